"""Fig. 9: the plate in axis-aligned motion, and its convergence, which the paper does not show."""

from typing import Any

import numpy as np

from mpmbench.papers.kit import Campaigns, Chapter, cell, study_of
from mpmbench.papers.parts import of_file, quantities
from mpmbench.papers.wobbes2020.support import (
    ERROR,
    METHODS,
    RELATIVE,
    RELATIVE_STRESS,
    STRESS,
    fields,
    method,
    stress_panels,
)
from mpmbench.report import figures, tables
from mpmbench.report.series import Series
from mpmbench.report.tables import Cell
from mpmbench.report.timing import clock_of, compared

ROW = 0.07  # height of the row of particles that Fig. 9 shows [m]
SHOWN: dict[str, dict[str, Any]] = {
    "MPM-P1": method("MPM-P1"),
    "OTM-P1": method("OTM-P1"),
    "MPM-maxent": method("MPM-maxent", basis__d_max=2.0),
    "OTM-maxent": method("OTM-maxent"),
    "BSMPM": method("BSMPM"),
    "unified": method("unified"),
}
WIDE = {
    "MPM-maxent, supports of 3, lumped": method("MPM-maxent", basis__d_max=3.0)
    | {"mass": "lumped"},
    "MPM-maxent, supports of 3, consistent": method("MPM-maxent", basis__d_max=3.0),
}
MASSES = {
    "MPM-P1, consistent": METHODS["MPM-P1"] | {"mass": "consistent"},
    "BSMPM, lumped": METHODS["BSMPM"] | {"mass": "lumped"},
    "OTM-P1, lumped": METHODS["OTM-P1"] | {"mass": "lumped"},
    "OTM-maxent, lumped": METHODS["OTM-maxent"] | {"mass": "lumped"},
}


def fig9_chapter(campaigns: Campaigns) -> Chapter:
    """Stress along a row of particles."""
    page = Chapter(
        "fig9",
        "Fig. 9: stress in the plate in axis-aligned motion",
        "The paper: with piecewise-linear functions the stress is piecewise constant, and in MPM "
        "it deviates by grid crossing. Max-ent functions (supports of 3 node spacings with MPM, "
        "of 2 with OTM) are considerably more accurate; the unified approach and BSMPM are "
        "smoother still and in close agreement with the analytical solution.",
    )
    stress = r"stress $\sigma_{11}$ [kPa]"
    figure = stress_panels(campaigns, "fig9", SHOWN, 3, 1.4, stress, scale=1e-3, chosen=_row)
    caption = (
        f"Particles that started nearest to x2 = {ROW} m, on 33 x 33 nodes; black: exact solution. "
        "Supports of max-ent functions are 2 node spacings; 3 with MPM, as in the paper, are in "
        "the table."
    )
    page.draw("stress", "Normal stress along the plate", caption, figure)
    rows = []
    for name, match in {**SHOWN, **WIDE, **MASSES}.items():
        errors = quantities(campaigns, "fig9", (ERROR, RELATIVE, STRESS, RELATIVE_STRESS), **match)
        rows.append([name, *errors, first_component(campaigns, match)])
    columns = ["method", "RMS displacement error [m]", "relative", "RMS stress error [Pa]"]
    columns += ["relative", "relative, first component alone"]
    page.tabulate("errors", "Errors on 33 x 33 nodes", columns, rows, numeric=range(1, 6))
    return page


def _row(found: dict[str, np.ndarray]) -> np.ndarray:
    """Particles that started in the row nearest to `ROW`, along the row."""
    height = found["position_initial"][:, 1]
    row = np.isclose(height, height[np.argmin(np.abs(height - ROW))])
    return np.flatnonzero(row)[np.argsort(found["position"][row, 0])]


def first_component(campaigns: Campaigns, match: dict[str, Any]) -> Cell:
    """Relative RMS error of sigma_11; the norm of the table takes all components."""
    whole = cell(campaigns, "fig9", RELATIVE_STRESS, **match)
    if not isinstance(whole.value, float):
        return Cell()
    file, found = fields(campaigns, "fig9", "stress", "stress_exact", **match)
    exact = found["stress_exact"][:, 0, 0]
    wrong = found["stress"][:, 0, 0] - exact
    return of_file(file, np.sqrt(np.mean(wrong**2) / np.mean(exact**2)))[0]


def plate_orders_chapter(campaigns: Campaigns) -> Chapter:
    """Convergence on the plate."""
    page = Chapter("plate_orders", "Fig. 9, continued: convergence on the plate")
    page.statement = "The paper shows one resolution."
    page.convergence(campaigns["plate_orders"], (ERROR, STRESS))
    page.notes.append(
        "The chapter on particles as quadrature points shows what the 4 x 4 midpoints in each cell "
        "cost."
    )
    study = study_of(campaigns["time_step_plate"])
    table = tables.errors(study, ERROR)
    if table:
        title = "RMS displacement error [m] on 65 x 65 nodes with the time step of 33 x 33 nodes, 1e-4 s"
        failed = [one for one in study.series if not len(one.finite(ERROR))]
        rows = [*table.rows, *([one.name, *_ends(one)] for one in failed)]
        page.add(table, name="large_step", title=title, rows=rows)
    return page


def _ends(one: Series) -> list[Cell]:
    """How the runs of a curve without results ended."""
    return [
        Cell(str(row.status).replace("_", " "), (str(file),)) for file, row in one.runs.iterrows()
    ]


def work_chapter(campaigns: Campaigns) -> Chapter:
    """Error against time for all benchmarks."""
    page = Chapter("work", "Beyond the paper: error against time")
    titles = {
        "fig6": "bar with fixed ends",
        "fig8": "bar with dynamic traction",
        "plate_orders": "plate in axis-aligned motion",
    }
    for name, title in titles.items():
        study = study_of(campaigns[name])
        clock = clock_of(compared(study)[0])
        drawn = figures.work_precision(study, ERROR, clock.quantity)
        if drawn is None:
            continue
        figure, exclusive = drawn
        caption = f"Solver time without compiling, local search. {clock.note}"
        if not exclusive:
            caption += " The machine was shared."
        page.draw(name, clock.title(f"Work and precision: {title}"), caption, figure)
    return page
