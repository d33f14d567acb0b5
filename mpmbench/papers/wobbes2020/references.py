"""Values that an independent prototype gave for the same set-ups, beside those of our runs."""

import itertools
from typing import Any

import numpy as np

from mpmbench.papers.kit import Campaigns, Chapter, cell
from mpmbench.papers.parts import along, numbers, with_digits
from mpmbench.papers.wobbes2020.plate import first_component
from mpmbench.papers.wobbes2020.support import ERROR, METHODS, RELATIVE, RELATIVE_STRESS, method
from mpmbench.report.tables import Cell

AT_END = {"particles_per_cell": 4, "method__traction": "end_point"}
AT_LAST = {"particles_per_cell": 4, "method__traction": "last_particle"}
LOCAL = {"basis__search": "local"}
GRIDS = (8, 16, 32, 64)

# problem, what, campaign, quantity, match, value of the prototype, relative agreement expected
Row = tuple[str, str, str, str, dict[str, Any], float, float]


def _grid(name: str, cells: int, **more: Any) -> dict[str, Any]:
    return method(name, resolution=cells, **more)


VALUES: tuple[Row, ...] = (
    ("8.1, 32 nodes", "MPM-P1, lumped", "fig6", ERROR, _grid("MPM-P1", 31), 7.33e-7, 0.02),
    ("8.1, 32 nodes", "OTM-P1", "fig6", ERROR, _grid("OTM-P1", 31), 1.59e-7, 0.02),
    ("8.1, 32 nodes", "BSMPM, consistent", "fig6", ERROR, _grid("BSMPM", 31), 2.55e-9, 0.02),
    ("8.1, 32 nodes", "BSMPM, lumped", "fig6", ERROR, _grid("BSMPM", 31) | {"mass": "lumped"}, 1.40e-6, 0.02),
    ("8.1, 32 nodes", "unified", "fig6", ERROR, _grid("unified", 31), 2.55e-9, 0.02),
    ("8.1, 32 nodes", "OTM-maxent", "fig6", ERROR, _grid("OTM-maxent", 31), 3.49e-10, 0.02),
    ("8.1, 1e-5 s", "temporal floor", "fig6", "predicted_temporal_floor", _grid("unified", 511), 2.764e-10, 0.02),
    ("8.1, 64 nodes", "cell crossings, MPM-P1", "fig6", "n_cell_crossings", _grid("MPM-P1", 63), 0.0, 0.1),
    ("8.1, 128 nodes", "cell crossings, MPM-P1", "fig6", "n_cell_crossings", _grid("MPM-P1", 127), 80.0, 0.1),
    ("8.1, 256 nodes", "cell crossings, MPM-P1", "fig6", "n_cell_crossings", _grid("MPM-P1", 255), 306.0, 0.1),
    ("8.1, 512 nodes", "cell crossings, MPM-P1", "fig6", "n_cell_crossings", _grid("MPM-P1", 511), 1185.0, 0.1),
    ("8.2, t = 0.4 s", "unified", "fig7", ERROR, method("unified", **AT_END), 5.435e-8, 0.02),
    ("8.2, t = 0.4 s", "OTM-maxent", "fig7", ERROR, method("OTM-maxent", **AT_END, **LOCAL), 4.946e-8, 0.02),
    ("8.2, t = 0.4 s", "OTM-P1", "fig7", ERROR, method("OTM-P1", **AT_END), 6.46e-7, 0.02),
    ("8.2, t = 0.4 s", "BSMPM, load at the end", "fig7", ERROR, method("BSMPM", **AT_END), 1.602e-7, 0.02),
    ("8.2, t = 0.4 s", "BSMPM, load on the last particle", "fig7", ERROR, method("BSMPM", **AT_LAST), 7.63e-7, 0.02),
    ("8.3, relative", "displacement, MPM-P1", "fig9", RELATIVE, method("MPM-P1"), 1.56e-2, 0.1),
    ("8.3, relative", "stress, MPM-P1", "fig9", RELATIVE_STRESS, method("MPM-P1"), 9.56e-2, 0.1),
    ("8.3, relative", "displacement, OTM-P1", "fig9", RELATIVE, method("OTM-P1"), 3.27e-3, 0.02),
    ("8.3, relative", "stress, OTM-P1", "fig9", RELATIVE_STRESS, method("OTM-P1"), 5.49e-2, 0.02),
    ("8.3, relative", "displacement, BSMPM", "fig9", RELATIVE, method("BSMPM"), 3.96e-4, 0.02),
    ("8.3, relative", "stress, BSMPM", "fig9", RELATIVE_STRESS, method("BSMPM"), 1.945e-3, 0.02),
    ("8.3, relative", "displacement, unified", "fig9", RELATIVE, method("unified"), 2.143e-4, 0.02),
    ("8.3, relative", "stress, unified", "fig9", RELATIVE_STRESS, method("unified"), 1.219e-3, 0.02),
    ("8.3, relative", "displacement, OTM-maxent", "fig9", RELATIVE, method("OTM-maxent"), 3.12e-5, 0.02),
    ("8.3, relative", "stress, OTM-maxent", "fig9", RELATIVE_STRESS, method("OTM-maxent"), 5.96e-4, 0.02),
    *(
        (f"8.1, amplitude {v:g} m/s", "floor of MPM-P1, consistent, 256 cells", "amplitude_floor", ERROR,
         {"method": "mpm", "resolution": 256, "problem__velocity_amplitude": v}, value, 0.05)
        for v, value in ((0.02, 1.2e-8), (0.01, 3.1e-9), (0.005, 7.9e-10))
    ),
)  # fmt: skip
ORDERS: tuple[tuple[str, str, dict[str, Any], tuple[float, ...]], ...] = (
    ("8.1, OTM-maxent", "orders", method("OTM-maxent"), (3.49, 3.50, 3.47)),
    ("8.3, OTM-P1", "plate_orders", method("OTM-P1"), (2.0, 2.0, 2.0)),
    ("8.3, unified", "plate_orders", method("unified"), (2.4, 2.1, 2.0)),
    ("8.3, BSMPM, lumped", "plate_orders", METHODS["BSMPM"] | {"mass": "lumped"}, (3.3, 2.1, 2.0)),
    ("8.3, BSMPM, consistent", "plate_orders", method("BSMPM"), (2.3, 1.1, 1.3)),
    ("8.3, OTM-maxent", "plate_orders", method("OTM-maxent"), (3.1, 2.4, 1.7)),
)


def references_chapter(campaigns: Campaigns) -> Chapter:
    """Two tables: values and local orders."""
    page = Chapter("references", "Agreement with an independent prototype")
    rows, apart = [], []
    for problem, what, campaign, quantity, match, expected, tolerance in VALUES:
        found = with_digits(4, cell(campaigns, campaign, quantity, **match))
        deviation, agrees = Cell("", found.files), False
        if isinstance(found.value, float):
            apart_by = found.value - expected
            deviation = Cell(f"{apart_by / expected if expected else 0.0:+.1%}", found.files)
            agrees = abs(apart_by) <= tolerance * expected
        head = [problem, what, Cell(expected, digits=4)]
        rows.append([*head, found, deviation, "yes" if agrees else "no"])
        if not agrees:
            apart.append(f"{what} in {problem}")
    columns = ["problem", "what", "prototype", "here", "deviation"]
    columns.append("within 2 % (10 % with crossings)")
    note = (
        "Errors are RMS displacement errors [m] unless they are called relative; prototype values "
        "have 3 or 4 digits."
    )
    page.tabulate("values", "Reference values", columns, rows, numeric=(2, 3, 4), note=note)
    page.notes.append(
        f"{len(VALUES) - len(apart)} of {len(VALUES)} values agree."
        + (f" Apart: {'; '.join(apart)}." if apart else "")
    )
    page.notes += _erratum(campaigns)
    _local_orders(page, campaigns)
    return page


def _erratum(campaigns: Campaigns) -> list[str]:
    """A prototype value that is another norm than it says."""
    match = method("OTM-maxent")
    whole = cell(campaigns, "fig9", RELATIVE_STRESS, **match)
    first = first_component(campaigns, match)
    if not (isinstance(whole.value, float) and isinstance(first.value, float)):
        return []
    if abs(first.value - 5.96e-4) < abs(whole.value - 5.96e-4):
        return [
            "The prototype's 5.96e-4 for the stress of OTM-maxent in 8.3 is the relative error of "
            f"the first component alone (here {first.value:.3g}); the norm over all components in "
            f"the plane is {whole.value:.3g}."
        ]
    return []


def _local_orders(page: Chapter, campaigns: Campaigns) -> None:
    rows = []
    for what, campaign, match, expected in ORDERS:
        errors = along(campaigns, campaign, ERROR, "resolution", GRIDS, **match)
        row: list[Any] = [what]
        for order, pair in zip(expected, itertools.pairwise(errors), strict=True):
            coarse, fine = numbers(pair)
            row += [order, Cell(float(np.log2(coarse / fine)), pair[0].files + pair[1].files)]
        rows.append(row)
    columns = ["what"]
    for n, finer in itertools.pairwise(GRIDS):
        columns += [f"{n} to {finer}: prototype", "here"]
    title = "Orders between neighbouring grids"
    page.tabulate("slopes", title, columns, rows, numeric=range(1, 7))
