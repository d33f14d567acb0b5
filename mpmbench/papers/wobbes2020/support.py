"""What the chapters and claims on Wobbes et al. share: the paper's methods, and short cuts."""

from collections.abc import Callable
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mpmbench.papers.kit import Campaigns, variables
from mpmbench.papers.parts import exact_line
from mpmbench.report import style
from mpmbench.report.figures import name_axes, tiles

PROFILE = ("position", "position_initial", "stress", "stress_exact")
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
PAIRS = {"OTM-P1": "MPM-P1", "OTM-maxent": "MPM-maxent", "unified": "BSMPM"}  # moving and fixed
MOVING = tuple(PAIRS)


def method(name: str, **more: Any) -> dict[str, Any]:
    """What a run of one of the paper's methods must match, its mass included."""
    return METHODS[name] | {"mass": MASS.get(name, "consistent")} | more


def searched(name: str, search: str = "local") -> dict[str, str]:
    """Which runs of max-ent functions are meant: those that search near nodes, or all of them."""
    return {"basis__search": search} if METHODS[name]["basis"] == "maxent" else {}


def fields(
    campaigns: Campaigns, campaign: str, *wanted: str, **match: Any
) -> tuple[str, dict[str, np.ndarray]]:
    """As `variables`, of those with several snapshots the last."""
    file, found = variables(campaigns, campaign, *wanted, **match)
    return file, {
        name: value if name == "position_initial" else value[-1] for name, value in found.items()
    }


def scatter(axes: Axes, x: np.ndarray, y: np.ndarray, title: str, size: float = 2.0) -> None:
    """Particles in the colour of the method that the title of a panel begins with."""
    method = METHODS[title.partition(",")[0]]["method"]
    axes.plot(x, y, rasterized=True, **style.dots(method, size))


def stress_panels(
    campaigns: Campaigns,
    campaign: str,
    shown: dict[str, dict[str, Any]],
    columns: int,
    height: float = 1.5,
    stress: str = r"stress $\sigma$ [Pa]",
    scale: float = 1.0,
    size: float = 2.0,
    chosen: Callable[[dict[str, np.ndarray]], Any] = lambda found: slice(None),
    title: float = 8.0,
) -> Figure:
    """Stress of particles at the end, times `scale`; a panel for each run by its title.

    `chosen` picks particles, and the exact solution is black.
    """
    figure, axes = tiles(len(shown), columns, height)
    for axis, (name, match) in zip(axes, shown.items(), strict=True):
        _, found = fields(campaigns, campaign, *PROFILE, **match)
        some = chosen(found)
        x = found["position"][some, 0]
        exact_line(axis, x, scale * found["stress_exact"][some, 0, 0])
        scatter(axis, x, scale * found["stress"][some, 0, 0], name, size)
        axis.set_title(name, pad=3, size=title)
    name_axes(figure, "position $x_1$ [m]", stress)
    return figure
