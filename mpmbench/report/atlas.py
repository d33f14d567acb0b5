"""The failure atlas: which method and basis works at which size and time step, and why not."""

import re
from dataclasses import dataclass, field

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle

from mpmbench.report.figures import wrapped
from mpmbench.report.names import safe_name
from mpmbench.report.series import Series, Study, series_name, variant_name
from mpmbench.report.tables import Cell, Table

# Light where nothing is wrong; the others are told apart by readers with any common colour vision
# deficiency, and by the mark in the cell.
COLOURS = {
    "ok": "#cfe8dc",
    "not_applicable": "#ececec",
    "diverged": "#D55E00",
    "broke_down": "#CC79A7",
    "not_converged": "#E69F00",
    "timeout": "#0072B2",
    "out_of_memory": "#56B4E9",
    "crashed": "#4d4d4d",
    "interrupted": "#999999",
}
CELL = 0.2  # side of a cell [in]
LABEL_WIDTH = 44  # characters
CHARACTER, LINE, LEGEND_ENTRY = 0.062, 0.15, 1.1  # of a label [in]
NUMBER = re.compile(r"(?<![A-Za-z_])[-+]?\d+(\.\d*)?(e[-+]?\d+)?")
MARKS = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"


@dataclass
class Cause:
    """A way in which runs ended without a result; numbers in the reason may differ."""

    mark: str
    status: str
    reason: str
    files: list[str] = field(default_factory=list)


def causes(study: Study) -> list[Cause]:
    """The distinct reasons of a study in the order of its curves."""
    found: dict[tuple[str, str], Cause] = {}
    for one in study.series:
        for file, run in one.runs[one.runs.status != "ok"].iterrows():
            kind = NUMBER.sub("#", run.reason)
            mark = MARKS[len(found)] if len(found) < len(MARKS) else str(len(found))
            found.setdefault((run.status, kind), Cause(mark, run.status, run.reason)).files.append(
                str(file)
            )
    return list(found.values())


def atlas(study: Study) -> Figure:
    """A row for each curve, a column for each size and time step, coloured by status.

    A cell without a colour has no run; a mark stands for the reason (`reasons`).
    """
    marks = {file: cause.mark for cause in causes(study) for file in cause.files}
    keys = columns_of(study)
    curves = [wrapped(row_of(one), LABEL_WIDTH) for one in study.series]
    rows = list(dict.fromkeys(curves))
    lines = sum(label.count("\n") + 1 for label in rows)
    width = max(3.4, 2.6 + CELL * len(keys))
    found = {status for one in study.series for status in one.runs.status}
    shown = [status for status in COLOURS if status in found]
    beside = min(len(shown), int(width / LEGEND_ENTRY))
    text_lines = -(-len(shown) // beside)
    labels, title = column_labels(study, keys)
    longest = max(len(line) for label in rows for line in label.splitlines())
    title = wrapped(title, max(12, int((width - 0.3) / CHARACTER) - longest))
    text_lines += title.count("\n") + 1
    upright = any(len(label) > 3 for label in labels)
    below = LINE * text_lines + (CHARACTER * max(map(len, labels)) if upright else LINE) + 0.25
    figure = Figure(
        figsize=(width, below + max(CELL * len(rows), LINE * lines)), layout="constrained"
    )
    axes = figure.add_subplot()
    for curve, one in zip(curves, study.series, strict=True):
        row = rows.index(curve)
        for file, run in one.runs.iterrows():
            column = keys.index(key_of(run))
            colour = COLOURS.get(run.status, "white")
            axes.add_patch(Rectangle((column - 0.45, row - 0.45), 0.9, 0.9, color=colour, lw=0))
            if mark := marks.get(str(file)):
                ink = "white" if run.status in ("crashed", "timeout", "diverged") else "black"
                axes.text(column, row, mark, ha="center", va="center", size=6, color=ink)
    axes.set_xlim(-0.5, len(keys) - 0.5)
    axes.set_ylim(len(rows) - 0.5, -0.5)
    axes.set_yticks(range(len(rows)), rows)
    axes.set_xticks(range(len(keys)), labels, rotation=90 if upright else 0)
    axes.set_xlabel(title)
    axes.grid(False)
    axes.tick_params(length=0, top=False, right=False)
    handles = [Patch(color=COLOURS[status], label=status.replace("_", " ")) for status in shown]
    figure.legend(handles=handles, loc="outside lower left", ncols=beside, handlelength=1.0)
    return figure


def row_of(one: Series) -> str:
    """Name of a curve without what the columns say."""
    variant = tuple(part for part in one.variant if part[0] not in ("time_step", "resolution"))
    name = ", ".join(filter(None, [series_name(one.method, one.basis), variant_name(variant)]))
    return f"{name} ({', '.join(one.choices)})" if one.choices else name


Key = tuple[float, float, float]


def key_of(run: object) -> Key:
    """Column of a run: its place along the study's axis, its resolution and its time step."""
    values = (getattr(run, name, np.nan) for name in ("axis_value", "resolution", "time_step"))
    return tuple(-1.0 if value is None or np.isnan(value) else float(value) for value in values)  # type: ignore[return-value]


def columns_of(study: Study) -> list[Key]:
    """All columns, coarse to fine."""
    keys = {key_of(run) for one in study.series for _, run in one.runs.iterrows()}
    backwards = study.axis.power == 1
    return sorted(keys, key=lambda key: (-key[0] if backwards else key[0], key[1], -key[2]))


def column_labels(study: Study, keys: list[Key]) -> tuple[list[str], str]:
    """Labels of the columns and what they say: the axis, and the time step where it varies."""
    several_steps = len({key[2] for key in keys}) > 1 and study.axis.key != "time_step"
    several_sizes = len({key[1] for key in keys}) > 1 and study.axis.key != "resolution"
    labels = []
    for place, resolution, step in keys:
        parts = [f"{place:g}" if place >= 0.0 else "auto"]
        parts += [f"{resolution:g} cells"] if several_sizes else []
        parts += [f"{step:.3g} s" if step > 0.0 else "auto"] if several_steps else []
        labels.append(", ".join(parts))
    return labels, study.axis.label + (", time step" if several_steps else "")


def reasons(study: Study) -> Table:
    """What the marks of the atlas stand for."""
    rows = [
        [
            cause.mark,
            cause.status.replace("_", " "),
            Cell(len(cause.files), tuple(cause.files)),
            Cell(cause.reason, (cause.files[0],)),
        ]
        for cause in causes(study)
    ]
    note = "Reasons that differ in numbers only share a mark; that of the first run is shown."
    columns = ["mark", "status", "runs", "reason"]
    return Table(
        f"{safe_name(study.problem)}-atlas", "Why runs have no result", columns, rows, note, (2,)
    )
