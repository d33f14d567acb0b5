"""Figures of a study: errors against size and against time, each a matplotlib figure."""

import re
import textwrap
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import (
    FixedLocator,
    FuncFormatter,
    LogLocator,
    MaxNLocator,
    NullFormatter,
    NullLocator,
)

from mpmbench.analysis.estimate import OrderEstimate, slopes_text
from mpmbench.report import style
from mpmbench.report.coincide import depths
from mpmbench.report.curves import named
from mpmbench.report.names import drawn
from mpmbench.report.series import BASIS_NAMES, METHOD_NAMES, Series, Study, variant_name
from mpmbench.report.triangles import slope_triangles

SQUARE = 2.8  # height of a figure without its legend [in]
LEGEND_LINE = 0.145  # height of one line of a legend [in]
LEGEND_WIDTH = 54  # characters
MOST_FLOORS = 3  # errors of time integration that a legend lists one by one
FEW_LEVELS = 3.0  # ratio of the ends of an axis below which it gets a few round numbers
MOST_ROWS = 10  # of a legend that lists curves one by one
TIMES = {"solver_time": "solver time [s]", "solver_cpu_time": "CPU time of the solver [s]"}
Orders = dict[str, OrderEstimate]


def convergence(study: Study, quantity: str, orders: Orders) -> Figure | None:
    """Error against the study's axis with orders, slope triangles, floor and failed runs.

    Parameters
    ----------
    quantity : str
        Name of the error, for example ``error_displacement_rms``.
    orders : dict
        Estimates by label of the curve (`series.order_of`).

    Returns
    -------
    Figure or None
        None when no finished run has this error.
    """
    shown = [one for one in study.series if len(one.finite(quantity)) or len(_failed(one))]
    if not any(len(one.finite(quantity)) for one in shown):
        return None
    figure, axes = single(SQUARE)
    handles: list[Line2D] = []
    under = depths(study, quantity)
    for one in shown:
        curve = one.finite(quantity).groupby("axis_value", sort=False)[quantity].median()
        label = one.name
        if one.label in orders and len(orders[one.label].local):
            label += f": {slopes_text(orders[one.label])}"
        look = style.line(one.method, one.basis, one.rank)
        look |= style.beneath(look, under.get(one.label, 0))
        (line,) = axes.loglog(curve.index, curve, label=label, **look)
        handles.append(named(line, study.series.index(one)))
    if quantity == "error_displacement_rms" and study.axis.power is not None:
        handles += _temporal_floor(axes, study)
    if study.axis.power is not None:
        slope_triangles(axes, study, quantity, orders)
    failed = _mark_failed(axes, shown)
    if failed:
        low, high = axes.get_ylim()
        axes.set_ylim(low, high * (high / low) ** 0.09)
    handles += failed
    log_ticks(axes.yaxis)
    ticks_at_values(axes, study.values())
    axes.set(xlabel=drawn(study.axis.label), ylabel=drawn(quantity_label(study, quantity)))
    _legend_below(figure, handles, shown)
    return figure


def work_precision(
    study: Study, quantity: str, clock: str = "solver_time"
) -> tuple[Figure, bool] | None:
    """Error against the solver's time, and whether the times are exclusive.

    None where the runs differ in what they solve rather than in effort. Only runs that had the
    machine to themselves are drawn when there are any; otherwise all, marked in the figure. `clock` is
    the time that counts: ``solver_time`` or, on a busy machine, ``solver_cpu_time``.
    """
    if study.axis.power is None and study.axis.key != "particles_per_cell":
        return None
    exclusive = any(len(_timed(one, quantity, clock, True)) for one in study.series)
    shown = [one for one in study.series if len(_timed(one, quantity, clock, exclusive))]
    if not shown:
        return None
    figure, axes = single(SQUARE)
    handles = []
    for one in shown:
        runs = _timed(one, quantity, clock, exclusive)
        look = style.line(one.method, one.basis, one.rank)
        (line,) = axes.loglog(runs[clock], runs[quantity], label=one.name, **look)
        handles.append(named(line, study.series.index(one)))
    log_ticks(axes.xaxis, span=100.0)
    log_ticks(axes.yaxis)
    axes.set(xlabel=TIMES[clock], ylabel=drawn(quantity_label(study, quantity)))
    if not exclusive:
        corner: dict[str, Any] = {"ha": "right", "va": "top", "transform": axes.transAxes}
        axes.text(0.97, 0.97, "machine shared with other runs", size=7, **corner)
    _legend_below(figure, handles, shown)
    return figure, exclusive


def quantity_label(study: Study, quantity: str) -> str:
    """``RMS displacement error [m]`` for an axis or a table."""
    words = (
        quantity.removesuffix("_relative")
        .removeprefix("error_")
        .removesuffix("_rms")
        .replace("_", " ")
    )
    is_error = quantity.startswith("error_")
    if quantity.endswith("_relative"):
        return f"relative RMS {words} error"
    norm = "RMS " if quantity.endswith("_rms") else ""
    name = f"{norm}{words} error" if is_error else words.removeprefix("n ")
    largest = re.fullmatch(r"error_(.+)_l([12])_max", quantity)
    if largest:
        name = f"largest {largest[1].replace('_', ' ')} error in L{largest[2]}"
    return in_units(name, study.campaign.units.get(quantity, ""))


def in_units(words: str, unit: str) -> str:
    """Words and unit: ``momentum [kg m/s]`` of ``kg m s-1``; without one where it is a plain number."""
    shown = unit_text(unit)
    return f"{words} [{shown}]" if shown else words


def unit_text(unit: str) -> str:
    """``m/s`` of ``m s-1``, ``kg/m^2`` of ``kg m-2``; nothing of a plain number."""
    divided = re.sub(r" ([A-Za-z]+)-(?:1\b)?", r"/\1", unit)
    return "" if unit == "1" else re.sub(r"(?<=[A-Za-z])(?=\d)", "^", divided)


def wrapped(label: str, width: int) -> str:
    """A label in lines of at most that many characters, broken at its commas and blanks."""
    lines = textwrap.wrap(drawn(label), width, break_long_words=False)
    return "\n".join(lines) or drawn(label)


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
    count: int,
    columns: int,
    height: float = 1.5,
    sharey: bool = True,
    width: float = 2.0 * style.COLUMN,
    margin: float = 0.35,
) -> tuple[Figure, list[Axes]]:
    """As many panels as are wanted, row by row, of this height [in]; they share their axes."""
    rows = -(-count // columns)
    figure, grid = panels(rows, columns, margin + height * rows, width, sharex=True, sharey=sharey)
    for empty in grid.ravel()[count:]:
        empty.remove()
    return figure, list(grid.ravel()[:count])


def name_axes(figure: Figure, x: str, y: str = "") -> None:
    """Name the axes that all panels share."""
    figure.supxlabel(x, size=8)
    if y:
        figure.supylabel(y, size=8)


def _legend_below(figure: Figure, handles: list[Line2D], curves: list[Series]) -> None:
    """One entry for each curve; of many, one for each method, basis and variant."""
    if _rows(handles[: len(curves)]) > MOST_ROWS:
        handles = [*_parts(curves), *handles[len(curves) :]]
    lines = _rows(handles)
    for handle in handles:
        handle.set_label(wrapped(str(handle.get_label()), LEGEND_WIDTH))
    figure.set_figheight(SQUARE + 0.1 + LEGEND_LINE * lines)
    figure.legend(
        handles=handles, loc="outside lower left", ncols=1, labelspacing=0.25, handlelength=2.6
    )


def _rows(handles: list[Line2D]) -> int:
    return sum(wrapped(str(one.get_label()), LEGEND_WIDTH).count("\n") + 1 for one in handles)


def _parts(curves: list[Series]) -> list[Line2D]:
    """Entries for the colour of each method, the marker of each basis and the line of each variant."""
    grey: dict[str, Any] = {"color": "#444444", "markeredgecolor": "#444444"}
    entries = []
    for method in dict.fromkeys(one.method for one in curves):
        own = [one for one in curves if one.method == method]
        shared = [what for what in own[0].choices if all(what in one.choices for one in own)]
        name = METHOD_NAMES.get(method, method.replace("_", " "))
        label = f"{name} ({', '.join(shared)})" if shared else name
        look: dict[str, Any] = {"color": style.colour(method), "linewidth": 3.0}
        entries.append(Line2D([], [], label=label, **look))
    for basis in dict.fromkeys(one.basis for one in curves):
        look = {"marker": style.marker(basis), "linestyle": "none"} | grey
        entries.append(
            Line2D([], [], label=BASIS_NAMES.get(basis, basis.replace("_", " ")), **look)
        )
    for name, one in {variant_name(one.variant): one for one in curves if one.variant}.items():
        look = style.line(one.method, one.basis, one.rank) | grey | {"marker": "o"}
        if look["markerfacecolor"] == style.colour(one.method):
            look["markerfacecolor"] = "#444444"
        entries.append(Line2D([], [], label=name, **look))
    return entries


def _timed(one: Series, quantity: str, clock: str, exclusive: bool) -> pd.DataFrame:
    runs = one.finite(quantity, clock)
    return runs[runs.timing_context == "exclusive"] if exclusive else runs


def _failed(one: Series) -> pd.DataFrame:
    failed = ~one.runs.status.isin(["ok", "not_applicable"])
    return one.runs[failed & np.isfinite(one.runs.axis_value)]


def _mark_failed(axes: Axes, series: list[Series]) -> list[Line2D]:
    """Crosses along the upper edge where a run ended without a result; what stands for them."""
    look: dict[str, Any] = {"marker": "x", "linestyle": "none", "mew": 1.3}
    handles: list[Line2D] = []
    for one in series:
        values = _failed(one).axis_value
        if len(values):
            above = axes.get_xaxis_transform()
            colour = style.colour(one.method)
            crosses = {"color": colour, "transform": above, "ms": 5, "zorder": 5}
            axes.plot(values, [0.965] * len(values), **look | crosses)
            label = "failed (colour of the method)"
            handles = [Line2D([], [], color="#555555", label=label, **look)]
    return handles


def _temporal_floor(axes: Axes, study: Study) -> list[Line2D]:
    """The predicted error of the time step alone: a line per step, or along a swept step."""
    if "predicted_temporal_floor" not in study.runs:
        return []
    runs = study.runs[(study.runs.status == "ok") & (study.runs.predicted_temporal_floor > 0)]
    runs = runs[np.isfinite(runs.axis_value)] if "axis_value" in runs else runs
    look: dict[str, Any] = {"color": "#555555", "linestyle": (0, (5, 2)), "linewidth": 0.9}
    if study.axis.key == "time_step":
        pairs = runs.drop_duplicates("time_step").sort_values("time_step")
        if pairs.empty:
            return []
        label = "error of time integration alone"
        return axes.loglog(pairs.time_step, pairs.predicted_temporal_floor, label=label, **look)
    levels = runs.drop_duplicates("predicted_temporal_floor").sort_values("time_step")
    each = len(levels) <= MOST_FLOORS
    handles = []
    for step, floor in zip(levels.time_step, levels.predicted_temporal_floor, strict=True):
        label = (
            f"error of time integration alone, step {step:.3g} s: {floor:.3g} m"
            if each
            else "errors of time integration alone"
        )
        handles.append(axes.axhline(floor, label=label, **look))
    return handles if each else handles[:1]


def log_ticks(axis: Axis, span: float = 20.0) -> None:
    """Powers of ten; 1, 2 and 5 times them where it spans less than the factor given, a few numbers for less."""
    low, high = sorted(axis.get_view_interval())
    axis.set_minor_formatter(NullFormatter())
    if high < span * low:
        few = (
            high < FEW_LEVELS * low
        )  # there 1, 2 and 5 times a power of ten may be one number or none
        axis.set_major_locator(MaxNLocator(3) if few else LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))


def ticks_at_values(axes: Axes, values: list[float]) -> None:
    """Ticks of the swept axis at its values; when they are many, at every second and so on."""
    room = 8 if all(len(f"{value:g}") <= 4 for value in values) else 5
    kept = values[:: -(-len(values) // room) or 1]
    axes.xaxis.set_major_locator(FixedLocator(kept))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.xaxis.set_minor_formatter(NullFormatter())
