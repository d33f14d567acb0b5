"""Several quantities side by side, a panel for each with the curves of all methods, and one legend."""

from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from mpmbench.report import style
from mpmbench.report.curves import named
from mpmbench.report.figures import LEGEND_LINE, ticks_at_values, tiles, wrapped
from mpmbench.report.names import drawn
from mpmbench.report.series import Series, Study

PANEL = 1.6  # height [in]
LEGEND = 0.3  # room that a legend needs besides its lines [in]
CHARACTERS = 62  # of a legend that is as wide as one column


@dataclass(frozen=True)
class Panel:
    """A quantity: its title, and x and y of each curve that has it, by the curve's number."""

    title: str
    curves: dict[int, tuple[np.ndarray, np.ndarray]]


def drawn_panels(study: Study, panels: list[Panel], xlabel: str, along_axis: bool) -> Figure | None:
    """Draw panels that share the axis below them; None without any.

    With `along_axis` the values are those of the study's axis, all marked; else instants, of which a
    few are, since marks tell bases apart.
    """
    if not panels:
        return None
    columns = min(2, len(panels))
    rows = -(-len(panels) // columns)
    width = style.COLUMN * columns
    figure, places = tiles(len(panels), columns, PANEL, sharey=False, width=width, margin=0.3)
    shown = sorted({number for panel in panels for number in panel.curves})
    for k, (panel, axes) in enumerate(zip(panels, places, strict=True)):
        for number, (x, y) in panel.curves.items():
            look = style.line(*_look_of(study.series[number]))
            look |= {} if along_axis else {"markevery": (0.04 * number % 0.2, 0.2)}
            (line,) = axes.plot(x, y, label=study.series[number].name, **look)
            named(line, number, k)
        if along_axis and study.axis.power is not None:
            axes.set_xscale("log")
        if along_axis:
            ticks_at_values(axes, study.values())
        axes.set_title(drawn(panel.title), pad=3, size=7)
        axes.locator_params(axis="y", nbins=5)
        if k + columns >= len(panels):  # nothing below it
            axes.set_xlabel(drawn(xlabel))
            axes.xaxis.set_tick_params(labelbottom=True)
    handles = [_handle(study.series[number]) for number in shown]
    lines = sum(str(one.get_label()).count("\n") + 1 for one in handles)
    figure.set_figheight(0.45 + PANEL * rows + LEGEND + LEGEND_LINE * lines)
    figure.legend(handles=handles, loc="outside lower left", ncols=1, labelspacing=0.25)
    return figure


def _look_of(one: Series) -> tuple[str, str, int]:
    return one.method, one.basis, one.rank


def _handle(one: Series) -> Line2D:
    return Line2D([], [], label=wrapped(one.name, CHARACTERS), **style.line(*_look_of(one)))
