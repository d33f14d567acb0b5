"""Tables of a study as CSV, Markdown and LaTeX, whose cells know their result files."""

import csv
import io
import re
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mpmbench.analysis.convergence import OrderEstimate, order_with_interval
from mpmbench.report.figures import quantity_label
from mpmbench.report.series import Series, Study

OVERVIEW = (
    "error_displacement_rms",
    "error_stress_rms",
    "error_velocity_rms",
    "energy_drift",
    "momentum_drift",
)
COUNTS = ("steps", "n_particles", "n_nodes", "n_cell_crossings")
COSTS = ("solver_time", "compile_time", "wall_time", "peak_memory")
LATEX = {character: "\\" + character for character in "&%_#${}"} | {
    "\\": r"\textbackslash{}", "^": r"\^{}", "~": r"\textasciitilde{}", "<": "$<$", ">": "$>$",
    "±": r"$\pm$", "²": "$^2$", "³": "$^3$",
}  # fmt: skip


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
    numeric : tuple of int
        Columns that are set flush right.
    """

    name: str
    title: str
    columns: list[str]
    rows: list[list[Cell]]
    note: str = ""
    numeric: tuple[int, ...] = field(default=())

    def csv(self) -> str:
        """All digits, and the result files of each row in a last column."""
        out = io.StringIO()
        writer = csv.writer(out, lineterminator="\n")
        writer.writerow([*self.columns, "files"])
        for row in self.rows:
            files = dict.fromkeys(file for cell in row for file in cell.files)
            writer.writerow([*(_exact(cell.value) for cell in row), " ".join(files)])
        return out.getvalue()

    def markdown(self) -> str:
        """The table as shown."""
        lines = [
            self.columns,
            ["---:" if k in self.numeric else "---" for k in range(len(self.columns))],
        ]
        lines += [[cell.text.replace("|", "\\|") for cell in row] for row in self.rows]
        text = "\n".join("| " + " | ".join(line) + " |" for line in lines)
        return f"{self.title}\n\n{text}\n" + (f"\n{self.note}\n" if self.note else "")

    def latex(self) -> str:
        """The table as shown, for the package booktabs."""
        alignment = "".join("r" if k in self.numeric else "l" for k in range(len(self.columns)))
        rows = [" & ".join(_latex(cell.text) for cell in row) + r" \\" for row in self.rows]
        head = " & ".join(_latex(column) for column in self.columns) + r" \\"
        body = ["\\toprule", head, "\\midrule", *rows, "\\bottomrule"]
        return f"\\begin{{tabular}}{{{alignment}}}\n" + "\n".join(body) + "\n\\end{tabular}\n"


def _exact(value: Any) -> str:
    if isinstance(value, (float, np.floating)):
        return "" if not np.isfinite(value) else repr(float(value))
    return str(value)


def _latex(text: str) -> str:
    """Plain text for LaTeX; ``1.2e-05`` becomes a power of ten."""
    escaped = "".join(LATEX.get(character, character) for character in text)
    return re.sub(
        r"(?<![\w.])(\d+(?:\.\d+)?)e([+-]\d+)\b",
        lambda m: rf"${m[1]} \times 10^{{{int(m[2])}}}$",
        escaped,
    )


def orders(study: Study, estimates: dict[str, dict[str, OrderEstimate]]) -> Table | None:
    """Order, interval, floor and verdict of each curve; `estimates` by quantity and by label."""
    rows = []
    for quantity, by_label in estimates.items():
        for one in study.series:
            runs = one.finite(quantity)
            if one.label not in by_label or runs.axis_value.nunique() < 2:
                continue
            found = by_label[one.label]
            levels = [Cell(f"{value:g}", (str(file),)) for file, value in runs.axis_value.items()]
            rows.append(
                [
                    Cell(one.label),
                    Cell(quantity_label(study, quantity)),
                    Cell(order_with_interval(found) if np.isfinite(found.order) else "none"),
                    Cell(", ".join(f"{slope:.2f}" for slope in found.local)),
                    Cell(found.floor if found.floor > 0 else ""),
                    Cell(found.verdict),
                    Cell(
                        " ".join(cell.value for cell in levels),
                        tuple(cell.files[0] for cell in levels),
                    ),
                ]
            )
    if not rows:
        return None
    columns = ["curve", "error", "order p", "local slopes", "floor", "verdict", study.axis.unit]
    return Table(f"{study.problem}-orders", "Orders of convergence", columns, rows, numeric=(4,))


def errors(study: Study, quantity: str) -> Table | None:
    """One error of every curve at every value of the axis; a failed run shows its status."""
    values = study.values()
    rows = []
    for one in study.series:
        if len(one.finite(quantity)):
            rows.append([Cell(one.label), *(_value_at(one, value, quantity) for value in values)])
    if not rows:
        return None
    columns = ["curve", *(f"{value:g} {study.axis.unit}" for value in values)]
    name = f"{study.problem}-{quantity.removesuffix('_rms')}-{study.axis.key.replace('.', '_')}"
    return Table(
        name, quantity_label(study, quantity), columns, rows, numeric=tuple(range(1, len(columns)))
    )


def _value_at(one: Series, value: float, quantity: str) -> Cell:
    runs = one.runs[one.runs.axis_value == value]
    ok = runs[runs.status == "ok"]
    if len(ok) and quantity in ok:
        return Cell(float(ok[quantity].median()), tuple(map(str, ok.index)))
    return (
        Cell(runs.status.iloc[0].replace("_", " "), tuple(map(str, runs.index)))
        if len(runs)
        else Cell()
    )


def timings(study: Study) -> Table | None:
    """Solver times of runs that had the machine to themselves, and ratios to linear MPM."""
    values = study.values()
    rows = []
    missing_base = False
    for one in study.series:
        base = _baseline(study, one)
        row = [Cell(one.label)]
        for value in values:
            time = _time_at(one, value)
            reference = _time_at(base, value) if base is not None else Cell()
            known = isinstance(time.value, float) and isinstance(reference.value, float)
            missing_base |= isinstance(time.value, float) and not known
            ratio = (
                Cell(time.value / reference.value, time.files + reference.files)
                if known
                else Cell()
            )
            row += [time, ratio]
        if any(isinstance(cell.value, float) for cell in row):
            rows.append(row)
    if not rows:
        return None
    columns = ["curve"]
    for value in values:
        columns += [f"{value:g} {study.axis.unit} [s]", "ratio"]
    left_out = int(((study.runs.status == "ok") & (study.runs.timing_context != "exclusive")).sum())
    note = (
        "Solver time without compiling, median over repeats; ratio to MPM linear at the same size."
    )
    note += " A ratio is missing where MPM linear has no exclusive timing." if missing_base else ""
    note += f" {left_out} runs that shared the machine are left out." if left_out else ""
    numeric = tuple(range(1, len(columns)))
    return Table(f"{study.problem}-timings", "Solver time", columns, rows, note, numeric)


def _baseline(study: Study, one: Series) -> Series | None:
    """Linear MPM with the same variant, otherwise lumped, otherwise the first."""
    linear = [base for base in study.series if (base.method, base.basis) == ("mpm", "linear")]
    if not linear:
        return None
    same = [base for base in linear if base.variant == one.variant]
    lumped = [base for base in linear if set(base.runs["mass"]) == {"lumped"}]
    return (same or lumped or linear)[0]


def _time_at(one: Series, value: float) -> Cell:
    runs = one.finite("solver_time")
    runs = runs[(runs.axis_value == value) & (runs.timing_context == "exclusive")]
    return (
        Cell(float(runs.solver_time.median()), tuple(map(str, runs.index))) if len(runs) else Cell()
    )


def failures(study: Study) -> Table | None:
    """Every run without a result, with its reason."""
    labels = {file: one.label for one in study.series for file in one.runs.index}
    bad = study.runs[study.runs.status != "ok"]
    rows = [
        [
            Cell(labels.get(file, "")),
            Cell(float(row.resolution)),
            Cell(row.status.replace("_", " ")),
            Cell(row.reason),
            Cell(float(row.get("time_reached", np.nan))),
            Cell(file, (str(file),)),
        ]
        for file, row in bad.iterrows()
    ]
    columns = ["curve", "cells", "status", "reason", "time reached [s]", "file"]
    title = "Runs that failed or do not apply"
    return (
        Table(f"{study.problem}-failures", title, columns, rows, numeric=(1, 4)) if rows else None
    )


def all_runs(study: Study) -> Table:
    """Every run with its numbers and its file: where each number of the report comes from."""
    labels = {file: one.label for one in study.series for file in one.runs.index}
    quantities = [name for name in (*OVERVIEW, *COUNTS, *COSTS) if name in study.runs]
    rows = []
    order = {file: k for k, file in enumerate(labels)}
    for file in sorted(study.runs.index, key=lambda name: order.get(name, len(order))):
        row = study.runs.loc[file]
        head = [Cell(labels.get(file, "")), Cell(float(row.resolution)), Cell(float(row.time_step))]
        numbers = [Cell(float(row[name]), (str(file),)) for name in quantities]
        rows.append(
            [
                *head,
                *numbers,
                Cell(row.timing_context),
                Cell(row.status.replace("_", " ")),
                Cell(file, (file,)),
            ]
        )
    columns = [
        "curve",
        "cells",
        "time step [s]",
        *(quantity_label(study, name) for name in quantities),
    ]
    columns += ["timing", "status", "file"]
    numeric = tuple(range(1, 3 + len(quantities)))
    return Table(f"{study.problem}-runs", "All runs", columns, rows, numeric=numeric)
