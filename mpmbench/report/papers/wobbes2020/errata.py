"""What the paper's equations do when they are taken as printed, and how max-ent can come out at order 1 to 2."""

from typing import Any

import numpy as np

from mpmbench.analysis.convergence import OrderEstimate, estimate_order, order_with_interval
from mpmbench.report import style
from mpmbench.report.claims import Runs
from mpmbench.report.papers.parts import Campaigns, Chapter
from mpmbench.report.papers.wobbes2020.support import ERROR, fields, single
from mpmbench.report.tables import Cell, Table

CELLS = (8, 16, 32, 64)
STEP = {"time_step": 1e-6}
MAXENT = {"method": "otm", "basis": "maxent", "mass": "consistent", "basis__tolerance": 1e-12} | STEP
UNIFIED = {"method": "unified", "basis": "bspline", "mass": "consistent"} | STEP
LUMPED = {"method": "otm", "basis": "maxent", "mass": "lumped"}
PRINTED = {"method": "otm", "basis": "maxent_printed"}

# name, what is changed, and what the run must match
VARIANTS: tuple[tuple[str, str, dict[str, Any]], ...] = (
    ("max-ent, OTM", "nothing: the reference", MAXENT),
    ("gradient checked", "Eqs. 84, 86 with both signs corrected: the same", PRINTED | {"basis__gradient": "corrected"}),
    (
        "Eq. 84, sign of A",
        "Eqs. 84, 86 with the overall sign alone corrected",
        PRINTED | {"basis__gradient": "sign_corrected"},
    ),
    ("Eq. 84 as printed", "Eqs. 84, 86 as printed", PRINTED | {"basis__gradient": "printed"}),
    ("loose Newton", "Newton's tolerance 1e-6 instead of 1e-12", MAXENT | {"basis__tolerance": 1e-6}),
    (
        "lumped, Algorithm 2",
        "lumped mass with Eq. 49, time step 1e-6 s",
        LUMPED | STEP | {"method__transfer": "position_difference"},
    ),
    ("lumped, Algorithm 2, larger step", "the same, time step 1e-5 s", LUMPED | {"time_step": 1e-5}),
    ("lumped with FLIP", "lumped mass, FLIP in place of Eq. 49", LUMPED | STEP | {"method__transfer": "flip"}),
    ("late constraints", "constrained entries set to zero after the solve", {"method": "otm_late", "basis": "maxent"}),
    ("unified", "nothing: the reference", UNIFIED),
    ("unified, lumped", "lumped mass", UNIFIED | {"mass": "lumped"}),
    ("unified, Eq. 99", "volumes multiply, Eq. 99, time step 1e-6 s", {"method": "unified_eq99", **STEP}),
    ("unified, Eq. 99, larger step", "the same, time step 1e-5 s", {"method": "unified_eq99", "time_step": 1e-5}),
    ("unified, late constraints", "constrained entries set to zero after the solve", {"method": "unified_late"}),
)
NORMS: dict[str, dict[str, Any]] = {"max-ent, Eq. 102": MAXENT, "unified, Eq. 102": UNIFIED}


def variant_errors(campaigns: Campaigns, match: dict[str, Any]) -> list[Cell]:
    """Displacement errors of one variant on all grids."""
    cells = []
    for n in CELLS:
        runs = Runs(campaigns)
        value = runs.number("errata", ERROR, resolution=n, **match)
        cells.append(Cell(value, runs.evidence[-1].files))
    return cells


def norm_as_printed(campaigns: Campaigns, match: dict[str, Any]) -> list[Cell]:
    """The norm of Eq. 102 as printed, without a square: the root of the magnitude of the mean error."""
    cells = []
    for n in CELLS:
        wanted = ("displacement", "displacement_exact")
        file, found = fields(campaigns, "errata", *wanted, resolution=n, **match)
        mean = float(np.mean(found["displacement_exact"] - found["displacement"]))
        cells.append(Cell(float(np.sqrt(abs(mean))), (file,)))
    return cells


def order_of(cells: list[Cell], unit: str = "m") -> OrderEstimate:
    """Order over `CELLS`."""
    return estimate_order(1.0 / np.array(CELLS), [float(c.value) for c in cells], labels=CELLS, error_unit=unit)


def between_one_and_two(found: OrderEstimate) -> bool:
    """Whether the fitted slope over all grids would be read as lying between 1 and 2."""
    slope = float(np.mean(found.local))
    return 0.9 <= slope <= 2.1


def errata_chapter(campaigns: Campaigns) -> Chapter:
    """Variants, their orders, and what they say about the paper's Fig. 6."""
    page = Chapter(
        "errata",
        "The equations as printed, and the order of max-ent",
        "Fig. 6 of the paper shows max-ent functions with an order between 1 and 2. With the exact gradient and "
        "consistent mass they are cubic B-splines away from the ends, and the order is about 3.5.",
    )
    figure, axes = single(height=3.6, width=1.5 * style.COLUMN)
    rows, explains = [], []
    shapes = "ov^s<>PXDph*d8"
    everything = [(name, what, variant_errors(campaigns, match)) for name, what, match in VARIANTS]
    printed = [
        (name, "the error norm of Eq. 102, without the square", norm_as_printed(campaigns, match))
        for name, match in NORMS.items()
    ]
    for k, (name, what, errors) in enumerate([*everything, *printed]):
        family = "unified" if name.startswith("unified") else "otm"
        is_norm = k >= len(everything)
        found = order_of(errors, "m^0.5" if is_norm else "m")
        slopes = ", ".join(f"{slope:.2f}" for slope in found.local)
        values = [float(c.value) for c in errors]
        look = {"marker": shapes[k % len(shapes)], "color": style.colour(family), "ms": 4, "lw": 0.9}
        reference = what.startswith("nothing")
        axes.loglog(
            CELLS,
            values,
            label=name,
            ls="-" if reference else ":" if is_norm else "--",
            mfc="white" if not reference else None,
            **look,
        )
        rows.append(
            [Cell(name), Cell(what), *errors, Cell(slopes), Cell(order_with_interval(found)), Cell(found.verdict)]
        )
        if not name.startswith("unified") and between_one_and_two(found):
            explains.append(f"{name} ({slopes})")
    axes.set_xticks(CELLS, [str(n) for n in CELLS])
    axes.minorticks_off()
    axes.set_xlabel("cells along the reference length")
    axes.set_ylabel("RMS displacement error [m]; Eq. 102 [m$^{1/2}$]")
    figure.legend(loc="outside right upper", fontsize=6)
    caption = "Full lines: corrected equations; broken lines: one thing changed; dots: another norm."
    page.draw("variants", "What each erratum does to the error", caption, figure, campaigns["errata"].runs.index)
    columns = ["variant", "what is changed", *(f"{n} cells" for n in CELLS), "local slopes", "order", "verdict"]
    page.add(Table("orders", "Errors [m] and orders of the variants", columns, rows, numeric=(2, 3, 4, 5)))
    page.notes += conclusions({name: errors for name, _, errors in everything}, explains)
    return page


def conclusions(errors: dict[str, list[Cell]], explains: list[str]) -> list[str]:
    """What the variants say, as far as they say it."""
    slopes = {name: float(np.mean(order_of(cells).local)) for name, cells in errors.items()}
    notes = []
    if explains:
        notes.append(f"Max-ent functions come out with a mean slope between 1 and 2 by: {'; '.join(explains)}.")
    printed = [slopes["Eq. 84, sign of A"], slopes["Eq. 84 as printed"]]
    if max(printed) < 0.3:
        notes.append(
            f"The gradient of Eqs. 84 and 86 as printed is no explanation: the mean slopes are {printed[0]:.2f} and "
            f"{printed[1]:.2f}, nothing converges. Its overall sign hardly matters, because it enters stress and force."
        )
    volumes, larger = (errors[f"unified, Eq. 99{more}"][-1].value for more in ("", ", larger step"))
    if volumes > 3.0 * larger:
        notes.append(
            f"Volumes that multiply (Eq. 99) leave an error that grows with the number of steps: {larger:.2g} m with "
            f"steps of 1e-5 s and {volumes:.2g} m with 1e-6 s on the finest grid."
        )
    diffused = errors["lumped, Algorithm 2"][-1].value
    if diffused > 3.0 * errors["lumped, Algorithm 2, larger step"][-1].value:
        notes.append(
            "Lumped mass in Algorithm 2 is a PIC transfer in every step: it diffuses with h^2/(6 dt), so that smaller "
            f"steps are worse ({diffused:.2g} m with steps of 1e-6 s on the finest grid)."
        )
    return notes
