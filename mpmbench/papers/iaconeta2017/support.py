"""What the chapters and claims on Iaconeta et al. 2017 share: the paper's methods by name, and a few short cuts."""

import dataclasses
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.tri import Triangulation

from mpmbench.papers.kit import Campaigns, subset
from mpmbench.report import style
from mpmbench.report.claims import MissingRuns
from mpmbench.report.tables import Cell

METHODS: dict[str, dict[str, str]] = {
    "UL-FEM": {"method": "fem", "basis": "linear"},
    "MPM": {"method": "implicit_mpm", "basis": "linear"},
    "GMM-MLS": {"method": "gmm", "basis": "mls"},
    "GMM-LME": {"method": "gmm", "basis": "lme"},
}
COLUMNS = ("MPM", "GMM-MLS", "GMM-LME")  # methods of the soil column
MESHES = (
    (40, "soil"),
    (80, "soil"),
    (160, "soil_fine"),
)  # its resolutions, and the experiments that they are in
LINES = {"UL-FEM": "-", "MPM": "--", "GMM-MLS": "-", "GMM-LME": ":"}
COLOURS = {"UL-FEM": "#E69F00", "MPM": "#0072B2", "GMM-MLS": "#CC79A7", "GMM-LME": "#009E73"}
MOST_POINTS = 400  # of a drawn history


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


def panels(
    rows: int, columns: int, height: float, width: float = 2.0 * style.COLUMN
) -> tuple[Figure, np.ndarray]:
    """A figure with a grid of axes, shape (rows, columns); lengths in inches."""
    figure = Figure(figsize=(width, height), layout="constrained")
    return figure, figure.subplots(rows, columns, squeeze=False)


def single(height: float = 2.8, width: float = style.COLUMN) -> tuple[Figure, Axes]:
    """A figure with one pair of axes; lengths in inches."""
    figure, axes = panels(1, 1, height, width)
    return figure, axes[0, 0]


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
    """Filled contours of values at particles, shapes (P, 2), (P, 2) and (P,): joined up as at the `start`."""
    triangles = Triangulation(start[:, 0], start[:, 1]).triangles
    mesh = Triangulation(position[:, 0], position[:, 1], triangles)
    filled = axes.tricontourf(mesh, values, levels=levels, cmap=colours, extend="both")
    filled.set_rasterized(True)
    axes.set_aspect("equal")
    axes.grid(False)
    return filled


def thinned(*histories: np.ndarray) -> tuple[np.ndarray, ...]:
    """The same histories with at most `MOST_POINTS` instants, the last one among them: enough for a curve."""
    last = len(histories[0]) - 1
    kept = np.unique(np.linspace(0, last, min(MOST_POINTS, last + 1)).round().astype(int))
    return tuple(one[kept] for one in histories)


def with_digits(digits: int, found: Cell) -> Cell:
    """The same cell with more digits shown."""
    return dataclasses.replace(found, digits=digits)


def ratio(one: Cell, other: Cell) -> Cell:
    """Quotient of two numbers with the files of both; empty when one is missing."""
    if not (isinstance(one.value, float) and isinstance(other.value, float)) or other.value == 0.0:
        return Cell()
    return Cell(one.value / other.value, one.files + other.files)
