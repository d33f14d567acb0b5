"""What chapters share: figures with panels, rows of cells along an axis, and their numbers."""

import dataclasses
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mpmbench.papers.kit import Campaigns, cell
from mpmbench.report import style
from mpmbench.report.claims import MissingRuns
from mpmbench.report.tables import Cell

MOST_POINTS = 400  # of a drawn curve: no more can be seen


def panels(
    rows: int, columns: int, height: float, width: float = 2.0 * style.COLUMN, **shared: Any
) -> tuple[Figure, np.ndarray]:
    """A figure with a grid of axes, shape (rows, columns); lengths in inches."""
    figure = Figure(figsize=(width, height), layout="constrained")
    return figure, figure.subplots(rows, columns, squeeze=False, **shared)


def single(height: float = 2.6, width: float = style.COLUMN) -> tuple[Figure, Axes]:
    """A figure with one pair of axes; lengths in inches."""
    figure, axes = panels(1, 1, height, width)
    return figure, axes[0, 0]


def tiles(
    count: int, columns: int, height: float = 1.5, sharey: bool = True
) -> tuple[Figure, list[Axes]]:
    """As many panels as are wanted, row by row, of this height [in]; they share their axes."""
    rows = -(-count // columns)
    figure, grid = panels(rows, columns, 0.35 + height * rows, sharex=True, sharey=sharey)
    for empty in grid.ravel()[count:]:
        empty.remove()
    return figure, list(grid.ravel()[:count])


def name_axes(figure: Figure, x: str, y: str = "") -> None:
    """Name the axes that all panels share."""
    figure.supxlabel(x, size=8)
    if y:
        figure.supylabel(y, size=8)


def ticks(axes: Axes, values: Sequence[float]) -> None:
    """Ticks of the first axis at these values, each written in full; no minor ticks."""
    axes.set_xticks(values, [str(value) for value in values])
    axes.minorticks_off()


def along(
    campaigns: Campaigns,
    campaign: str,
    quantity: str,
    key: str,
    values: Iterable[Any],
    **match: Any,
) -> list[Cell]:
    """Cells of the runs that match, one for each value of a key (as in `kit.cell`)."""
    return [cell(campaigns, campaign, quantity, **match, **{key: value}) for value in values]


def quantities(
    campaigns: Campaigns, campaign: str, names: Iterable[str], **match: Any
) -> list[Cell]:
    """Cells of one run, one for each quantity."""
    return [cell(campaigns, campaign, name, **match) for name in names]


def numbers(cells: Iterable[Cell]) -> np.ndarray:
    """Values of the cells; nan for those that hold none."""
    return np.array([one.value if isinstance(one.value, float) else np.nan for one in cells])


def files_of(cells: Iterable[Cell]) -> list[str]:
    """Result files of the cells."""
    return [file for one in cells for file in one.files]


def finished(
    values: Iterable[float], cells: Iterable[Cell], lack: str
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Points of the curve of the cells over these values, those without a number left out.

    Raises
    ------
    MissingRuns
        When no cell holds a number; `lack` says so.
    """
    pairs = zip(values, cells, strict=True)
    known = [(value, one.value) for value, one in pairs if isinstance(one.value, float)]
    if not known:
        raise MissingRuns(lack)
    x, y = zip(*known, strict=True)
    return x, y


def ratio(above: Cell, below: Cell) -> Cell:
    """Quotient of two cells with the files of both; empty unless both are numbers."""
    known = isinstance(above.value, float) and isinstance(below.value, float) and below.value != 0.0
    return Cell(above.value / below.value, above.files + below.files) if known else Cell()


def with_digits(digits: int, found: Cell) -> Cell:
    """The same cell with more digits shown."""
    return dataclasses.replace(found, digits=digits)


def exact_line(axes: Axes, x: np.ndarray, y: np.ndarray) -> None:
    """The exact solution in black, with no more points than can be seen."""
    order = np.argsort(x)[:: max(1, len(x) // MOST_POINTS)]
    axes.plot(x[order], y[order], label="exact", **style.EXACT)


def thinned(*histories: np.ndarray) -> tuple[np.ndarray, ...]:
    """The same histories at no more than `MOST_POINTS` instants, the last one among them."""
    last = len(histories[0]) - 1
    kept = np.unique(np.linspace(0, last, min(MOST_POINTS, last + 1)).round().astype(int))
    return tuple(one[kept] for one in histories)
