"""Tables of a study as CSV, Markdown and LaTeX, whose cells know their result files."""

import csv
import io
from collections.abc import Collection
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from mpmbench.analysis.estimate import OrderEstimate, asymptotic_text, numbers_text, slopes_text
from mpmbench.report.figures import quantity_label
from mpmbench.report.latex import latex
from mpmbench.report.names import safe_name
from mpmbench.report.series import Series, Study, setting_label, setting_text
from mpmbench.results.cells import csv_cell
from mpmbench.results.quantities import OF_BASES

OVERVIEW = (
    "error_displacement_rms",
    "error_stress_rms",
    "error_velocity_rms",
    "energy_drift",
    "energy_imbalance",
    "momentum_drift",
)
MEANINGS = {
    "energy_drift": "Energy drift: the largest |kinetic + strain + dissipated + contact energy - work from "
    "outside - initial energy|, over the larger of the initial energy and the largest kinetic one; it is "
    "large, and says little, of a body that is loaded slowly.",
    "energy_imbalance": "Energy imbalance: the same without what the method is known to dissipate.",
    "momentum_drift": "Momentum drift: the largest change of momentum, which loads and supports change too.",
}
COUNTS = ("steps", "n_particles", "n_nodes", "n_cell_crossings")
COSTS = ("solver_time", "solver_cpu_time", "compile_time", "wall_time", "peak_memory")


@dataclass(frozen=True)
class Cell:
    """A value of a table, its result files, and how many of its digits are shown."""

    value: Any = ""
    files: tuple[str, ...] = ()
    digits: int = 3

    @property
    def text(self) -> str:
        """The leading digits of numbers; all of them are in the CSV."""
        if isinstance(self.value, (float, np.floating)):
            if not np.isfinite(self.value):
                return ""
            return number_text(float(self.value), self.digits)
        return str(self.value)


def number_text(number: float, digits: int = 3) -> str:
    """The leading digits, zeros at their end kept unless the number has no more than it shows.

    ``1.70e-06`` of 1.7031e-6, ``2114`` of 2114.2, ``0.01`` of 0.01, ``80`` of 80.
    """
    if abs(number) < 1e7 and (number.is_integer() or abs(number) >= 10.0**digits):
        return str(round(number))
    short = f"{number:.{digits}g}"
    return (
        short
        if float(short) == float(f"{number:.12g}")
        else f"{number:#.{digits}g}".removesuffix(".")
    )


@dataclass(frozen=True)
class Table:
    """Rows of cells with a title and a note.

    Attributes
    ----------
    name : str
        Stem of its files.
    rows : list of list of Cell
        Other values become cells without files.
    numeric : collection of int
        Columns that are set flush right.
    """

    name: str
    title: str
    columns: list[str]
    rows: list[list[Any]]
    note: str = ""
    numeric: Collection[int] = ()

    def __post_init__(self) -> None:
        cells = [[one if isinstance(one, Cell) else Cell(one) for one in row] for row in self.rows]
        object.__setattr__(self, "rows", cells)

    def __bool__(self) -> bool:
        """Whether there is anything in it."""
        return bool(self.rows)

    def csv(self) -> str:
        """All digits, and the result files of each row in a last column."""
        out = io.StringIO()
        writer = csv.writer(out, lineterminator="\n")
        writer.writerow([*map(csv_cell, self.columns), "files"])
        for row in self.rows:
            files = dict.fromkeys(file for cell in row for file in cell.files)
            values = [*(_exact(cell.value) for cell in row), " ".join(files)]
            writer.writerow(map(csv_cell, values))
        return out.getvalue()

    def markdown(self) -> str:
        """The table as shown."""
        lines = [
            [_markdown(column) for column in self.columns],
            ["---:" if k in self.numeric else "---" for k in range(len(self.columns))],
        ]
        lines += [[_markdown(cell.text) for cell in row] for row in self.rows]
        text = "\n".join("| " + " | ".join(line) + " |" for line in lines)
        title, note = (part.replace("<", "&lt;") for part in (self.title, self.note))
        return f"{title}\n\n{text}\n" + (f"\n{note}\n" if note else "")

    def latex(self) -> str:
        """The table as shown, for the packages booktabs and siunitx."""
        rows = [[cell.text for cell in row] for row in self.rows]
        return latex(self.name, self.title, self.columns, rows, self.numeric, self.note)


def _exact(value: Any) -> str:
    if isinstance(value, (float, np.floating)):
        return "" if not np.isfinite(value) else repr(float(value))
    return str(value)


def _markdown(text: str) -> str:
    """Plain text for a cell in Markdown: one line, and neither an element of HTML nor a link in it."""
    return " ".join(text.replace("<", "&lt;").replace("|", "\\|").replace("](", "] (").split())


def orders(study: Study, estimates: dict[str, dict[str, OrderEstimate]]) -> Table:
    """Slopes, asymptotic order, floor and verdict of each curve; `estimates` by quantity and by label."""
    rows = []
    for quantity, by_label in estimates.items():
        for one in study.series:
            runs = one.finite(quantity)
            if one.label not in by_label or runs.axis_value.nunique() < 2:
                continue
            found = by_label[one.label]
            levels = " ".join(f"{value:g}" for value in runs.axis_value)
            rows.append(
                [
                    one.name,
                    quantity_label(study, quantity),
                    slopes_text(found),
                    numbers_text(found.local),
                    asymptotic_text(found),
                    found.floor if found.floor > 0 else "",
                    found.verdict,
                    Cell(levels, tuple(map(str, runs.index))),
                ]
            )
    columns = ["curve", "error", "order", "local slopes", "asymptotic order", "floor", "verdict"]
    columns.append(study.axis.unit)
    name = f"{safe_name(study.problem)}-orders"
    return Table(name, "Orders of convergence", columns, rows, numeric=(5,))


def errors(study: Study, quantity: str) -> Table:
    """One error of every curve at every value of the axis; a failed run shows its status."""
    values = study.values()
    rows = [
        [one.name, *(_value_at(one, value, quantity) for value in values)]
        for one in study.series
        if len(one.finite(quantity))
    ]
    columns = ["curve", *(f"{value:g} {study.axis.unit}" for value in values)]
    axis = safe_name(study.axis.key.replace(".", "_"))
    name = f"{safe_name(study.problem)}-{quantity.removesuffix('_rms')}-{axis}"
    numeric = range(1, len(columns))
    return Table(name, quantity_label(study, quantity), columns, rows, numeric=numeric)


def median(runs: pd.DataFrame, quantity: str) -> Cell:
    """Median of a quantity of some runs, with their files; empty without runs."""
    if not len(runs):
        return Cell()
    return Cell(float(runs[quantity].median()), tuple(map(str, runs.index)))


def _value_at(one: Series, value: float, quantity: str) -> Cell:
    runs = one.runs[one.runs.axis_value == value]
    ok = runs[runs.status == "ok"]
    if len(runs) and not (len(ok) and quantity in ok):
        return Cell(runs.status.iloc[0].replace("_", " "), tuple(map(str, runs.index)))
    return median(ok, quantity)


def ratio(above: Cell, below: Cell) -> Cell:
    """Quotient of two cells with the files of both; empty unless both are numbers."""
    known = isinstance(above.value, float) and isinstance(below.value, float) and below.value != 0.0
    return Cell(above.value / below.value, above.files + below.files) if known else Cell()


def failures(study: Study) -> Table:
    """Every run without a result, with its reason."""
    labels = _labels(study)
    rows = [
        [
            labels.get(file, ""),
            float(row.resolution),
            row.status.replace("_", " "),
            row.reason,
            float(row.get("time_reached", np.nan)),
            Cell(file, (str(file),)),
        ]
        for file, row in study.runs[study.runs.status != "ok"].iterrows()
    ]
    columns = ["curve", "cells", "status", "reason", "time reached [s]", "file"]
    title = "Runs that failed or do not apply"
    return Table(f"{safe_name(study.problem)}-failures", title, columns, rows, numeric=(1, 4))


def all_runs(study: Study) -> Table:
    """Every run with its numbers and its file: where each number of the report comes from."""
    labels = _labels(study)
    known = [name for name in (*OVERVIEW, *COUNTS, *sorted(OF_BASES), *COSTS) if name in study.runs]
    quantities = [name for name in known if np.isfinite(study.runs[name].astype(float)).any()]
    varying = study.varying()
    others = [file for file in study.runs.index if file not in labels]
    rows = []
    for file in (*labels, *others):
        row = study.runs.loc[file]
        rows.append(
            [
                labels.get(file, ""),
                *(float(row.resolution), float(row.time_step)),
                *(setting_text(study.campaign.settings.at[file, key]) for key in varying),
                *(Cell(float(row[name]), (str(file),)) for name in quantities),
                row.timing_context,
                row.status.replace("_", " "),
                Cell(file, (file,)),
            ]
        )
    names = [quantity_label(study, name) for name in quantities]
    settings = [setting_label(key) for key in varying]
    columns = ["curve", "cells", "time step [s]", *settings, *names, "timing", "status", "file"]
    numeric = range(1, 3 + len(varying) + len(quantities))
    note = " ".join(text for name, text in MEANINGS.items() if name in quantities)
    return Table(f"{safe_name(study.problem)}-runs", "All runs", columns, rows, note, numeric)


def _labels(study: Study) -> dict[Any, str]:
    """The curve of each run, curve by curve."""
    return {file: one.name for one in study.series for file in one.runs.index}
