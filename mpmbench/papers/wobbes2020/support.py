"""What the chapters and claims on Wobbes et al. share: the paper's methods, and short cuts."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes

from mpmbench.papers.kit import Campaigns, variables
from mpmbench.report import style
from mpmbench.report.tables import Cell

ERROR, STRESS, TIME = "error_displacement_rms", "error_stress_rms", "solver_time"
RELATIVE, RELATIVE_STRESS = "error_displacement_relative", "error_stress_relative"

# The paper's names and what they are here.
METHODS: dict[str, dict[str, Any]] = {
    "MPM-P1": {"method": "mpm", "basis": "linear"},
    "OTM-P1": {"method": "otm", "basis": "linear"},
    "MPM-maxent": {"method": "mpm", "basis": "maxent"},
    "OTM-maxent": {"method": "otm", "basis": "maxent"},
    "BSMPM": {"method": "mpm", "basis": "bspline"},
    "unified": {"method": "unified", "basis": "bspline"},
}
MASS = {"MPM-P1": "lumped"}  # all others consistent
MOVING = ("OTM-P1", "OTM-maxent", "unified")


def method(name: str, **more: Any) -> dict[str, Any]:
    """What a run of one of the paper's methods must match, its mass included."""
    return METHODS[name] | {"mass": MASS.get(name, "consistent")} | more


def fields(
    campaigns: Campaigns, campaign: str, *wanted: str, **match: Any
) -> tuple[str, dict[str, np.ndarray]]:
    """As `variables`, of those with several snapshots the last."""
    file, found = variables(campaigns, campaign, *wanted, **match)
    return file, {
        name: value if name == "position_initial" else value[-1] for name, value in found.items()
    }


def derived(value: float | str, *files: str) -> Cell:
    """A cell computed from the fields of some files."""
    return Cell(value, tuple(dict.fromkeys(files)))


def scatter(axes: Axes, x: np.ndarray, y: np.ndarray, name: str, size: float = 2.0) -> None:
    """Particles in the colour of their method."""
    axes.plot(
        x,
        y,
        linestyle="none",
        marker=".",
        ms=size,
        mew=0,
        rasterized=True,
        color=style.colour(METHODS[name]["method"]),
    )
