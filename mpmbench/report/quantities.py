"""Quantities of interest of a problem, such as a run-out: a table, and curves along the study's axis."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from mpmbench.report.figures import quantity_label
from mpmbench.report.names import safe_name
from mpmbench.report.panels import Panel, drawn_panels
from mpmbench.report.series import Series, Study
from mpmbench.report.tables import Cell, Table
from mpmbench.results.quantities import of_interest

MOST_PANELS = 8


def names_of(study: Study) -> list[str]:
    """The problem's own scalars of which some finished run has a number."""
    done = study.runs[study.runs.status == "ok"]
    known = [name for name in of_interest(study.campaign.units) if name in done]
    return [name for name in known if np.isfinite(done[name].astype(float)).any()]


def last_values(study: Study, name: str) -> dict[str, float]:
    """A quantity by curve, at the finest value of the axis that most curves share; medians over repeats."""
    found: dict[float, dict[str, float]] = {}
    for one in study.series:
        for value, number in _curve(one, name).items():
            found.setdefault(float(value), {})[one.label] = float(number)
    if not found:
        return {}
    most = max(map(len, found.values()))
    return found[study.axis.finest(value for value in found if len(found[value]) == most)]


def table(study: Study) -> Table:
    """A row for each finished run that has such a quantity, curve by curve."""
    names = names_of(study)
    rows = []
    for one in study.series:
        for file, run in one.ok.iterrows():
            cells = [Cell(float(run[name]), (str(file),)) for name in names]
            if any(cell.text for cell in cells):
                rows.append([one.name, Cell(float(run.axis_value), (str(file),)), *cells])
    said = [
        f"{name.replace('_', ' ')}: {text}"
        for name in names
        if (text := study.campaign.names.get(name, "")) not in ("", name.replace("_", " "))
    ]
    columns = ["curve", study.axis.unit, *(quantity_label(study, name) for name in names)]
    note = f"{'; '.join(said)}." if said else ""
    numeric = range(1, len(columns))
    stem = f"{safe_name(study.problem)}-quantities"
    return Table(stem, "Quantities of interest", columns, rows, note, numeric)


def panels(study: Study) -> Figure | None:
    """Each quantity along the study's axis; none where no curve has two values."""
    found = []
    for name in names_of(study):
        curves = {k: _curve(one, name) for k, one in enumerate(study.series)}
        if any(len(curve) > 1 for curve in curves.values()):
            points = {
                k: (curve.index.to_numpy(float), curve.to_numpy(float))
                for k, curve in curves.items()
                if len(curve)
            }
            found.append(Panel(quantity_label(study, name), points))
    return drawn_panels(study, found[:MOST_PANELS], study.axis.label, along_axis=True)


def _curve(one: Series, name: str) -> pd.Series:
    """A quantity of the finished runs of a curve by the value of the axis."""
    runs = one.ok if name in one.ok else one.ok.iloc[:0].assign(**{name: np.nan})
    runs = runs[np.isfinite(runs.axis_value) & np.isfinite(runs[name].astype(float))]
    return runs.groupby("axis_value", sort=True)[name].median()
