"""What chapters share: rows of cells along an axis, their numbers, and curves."""

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from mpmbench.papers.kit import Campaigns, cell
from mpmbench.report import style
from mpmbench.report.evidence import MissingRuns
from mpmbench.report.tables import Cell

MOST_POINTS = 400  # of a drawn curve: no more can be seen
LINES = ("-", "--", "-.", ":")


def ticks(axes: Axes, values: Sequence[float]) -> None:
    """Ticks of the first axis at these values, each written in full; no minor ticks."""
    axes.set_xticks(values, [str(value) for value in values])
    axes.minorticks_off()


def error_lines(
    axes: Axes, cells: Sequence[int], rows: Mapping[str, Iterable[Cell]], label: str
) -> None:
    """Errors over resolutions in double logarithmic axes, one line for each method."""
    for rank, (name, found) in enumerate(rows.items()):
        line = LINES[rank % len(LINES)]
        axes.loglog(cells, numbers(found), marker="o", ms=3, lw=1.1, ls=line, label=name)
    ticks(axes, cells)
    axes.set(xlabel="cells", ylabel=label)


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


def of_file(file: str, *values: float) -> list[Cell]:
    """Cells of numbers that were computed from the fields of one run."""
    return [Cell(float(value), (file,)) for value in values]


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
