"""What the chapters and claims on Iaconeta et al. share: the paper's methods, and short cuts."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.tri import Triangulation

from mpmbench.papers.kit import Campaigns, subset
from mpmbench.report import style
from mpmbench.report.evidence import MissingRuns

METHODS: dict[str, dict[str, str]] = {
    "UL-FEM": {"method": "fem", "basis": "linear"},
    "MPM": {"method": "implicit_mpm", "basis": "linear"},
    "GMM-MLS": {"method": "gmm", "basis": "mls"},
    "GMM-LME": {"method": "gmm", "basis": "lme"},
}
COLUMNS = ("MPM", "GMM-MLS", "GMM-LME")  # methods of the soil column
# its resolutions, and the experiments that they are in
MESHES = ((40, "soil"), (80, "soil"), (160, "soil_fine"))
LINES = {"UL-FEM": "-", "MPM": "--", "GMM-MLS": "-", "GMM-LME": ":"}
COLOURS = {"UL-FEM": "#E69F00", "MPM": "#0072B2", "GMM-MLS": "#CC79A7", "GMM-LME": "#009E73"}


def look(name: str) -> dict[str, Any]:
    """Keywords of `Axes.plot` for one of the paper's methods."""
    basis = METHODS[name]["basis"]
    return {
        "color": COLOURS[name],
        "linestyle": LINES[name],
        "marker": style.marker(basis),
        "label": name,
    }


def history(
    campaigns: Campaigns, campaign: str, *wanted: str, **match: Any
) -> tuple[str, dict[str, np.ndarray]]:
    """File and variables of the one run that matches, however it ended.

    Raises
    ------
    MissingRuns
        When there is no such run, or it was ended before it could store them.
    ValueError
        When several match.
    """
    found = subset(campaigns[campaign], **match)
    if len(found.runs) != 1:
        raise ValueError(f"{campaign}: {len(found.runs)} runs match {match}, not one")
    file = str(found.runs.index[0])
    variables = found.variables(file, wanted)
    absent = [name for name in wanted if name not in variables]
    if absent:
        state = found.runs.loc[file, "status"]
        raise MissingRuns(
            f"{campaign}: the run with {match} holds no {', '.join(absent)} (status: {state})"
        )
    return file, variables


def particles(
    axes: Axes, position: np.ndarray, values: np.ndarray, limits: tuple[float, float], size: float
) -> Any:
    """Particles as coloured dots, drawn as an image inside the figure; no grid, equal scales."""
    dots = axes.scatter(
        position[:, 0],
        position[:, 1],
        c=values,
        s=size,
        vmin=limits[0],
        vmax=limits[1],
        cmap="viridis",
        linewidths=0,
        antialiased=False,  # fewer colours make a far smaller file
        rasterized=True,
    )
    axes.set_aspect("equal")
    axes.grid(False)
    return dots


def contours(
    axes: Axes,
    start: np.ndarray,
    position: np.ndarray,
    values: np.ndarray,
    levels: np.ndarray,
    colours: str,
) -> Any:
    """Filled contours of values at particles, (P, 2), (P, 2) and (P,), joined as at the `start`."""
    triangles = Triangulation(start[:, 0], start[:, 1]).triangles
    mesh = Triangulation(position[:, 0], position[:, 1], triangles)
    filled = axes.tricontourf(mesh, values, levels=levels, cmap=colours, extend="both")
    filled.set_rasterized(True)
    axes.set_aspect("equal")
    axes.grid(False)
    return filled
