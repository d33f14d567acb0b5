"""What the paper's equations do as printed, and how max-ent can come out at order 1 to 2."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from mpmbench.analysis.convergence import estimate_order
from mpmbench.analysis.estimate import OrderEstimate, asymptotic_text, numbers_text, slopes_text
from mpmbench.papers.kit import Campaigns, Chapter, number
from mpmbench.papers.parts import of_file, ticks
from mpmbench.papers.wobbes2020.support import ERROR, fields
from mpmbench.report import style
from mpmbench.report.figures import name_axes, tiles
from mpmbench.report.tables import Cell

CELLS = (8, 16, 32, 64)
STEP, LARGER = {"time_step": 1e-6}, {"time_step": 1e-5}
CONSISTENT = {"method": "otm", "basis": "maxent", "mass": "consistent"}
MAXENT = CONSISTENT | {"basis__tolerance": 1e-12} | STEP
UNIFIED = {"method": "unified", "basis": "bspline", "mass": "consistent"} | STEP
LUMPED = {"method": "otm", "basis": "maxent", "mass": "lumped"}
PRINTED = {"method": "otm", "basis": "maxent_printed"}
EQ99 = {"method": "unified_eq99"}

# name, what is changed, and what the run must match
LATE = "constrained entries set to zero after the solve"
VARIANTS: tuple[tuple[str, str, dict[str, Any]], ...] = (
    ("max-ent, OTM", "nothing: the reference", MAXENT),
    (
        "gradient checked",
        "Eqs. 84, 86 with both signs corrected: the same",
        PRINTED | {"basis__gradient": "corrected"},
    ),
    (
        "Eq. 84, sign of A",
        "Eqs. 84, 86 with the overall sign alone corrected",
        PRINTED | {"basis__gradient": "sign_corrected"},
    ),
    ("Eq. 84 as printed", "Eqs. 84, 86 as printed", PRINTED | {"basis__gradient": "printed"}),
    (
        "loose Newton",
        "Newton's tolerance 1e-6 instead of 1e-12",
        MAXENT | {"basis__tolerance": 1e-6},
    ),
    (
        "lumped, Algorithm 2",
        "lumped mass with Eq. 49, time step 1e-6 s",
        LUMPED | STEP | {"method__transfer": "position_difference"},
    ),
    ("lumped, Algorithm 2, larger step", "the same, time step 1e-5 s", LUMPED | LARGER),
    (
        "lumped with FLIP",
        "lumped mass, FLIP in place of Eq. 49",
        LUMPED | STEP | {"method__transfer": "flip"},
    ),
    ("late constraints", LATE, {"method": "otm_late", "basis": "maxent"}),
    ("unified", "nothing: the reference", UNIFIED),
    ("unified, lumped", "lumped mass", UNIFIED | {"mass": "lumped"}),
    ("unified, Eq. 99", "volumes multiply, Eq. 99, time step 1e-6 s", EQ99 | STEP),
    ("unified, Eq. 99, larger step", "the same, time step 1e-5 s", EQ99 | LARGER),
    ("unified, late constraints", LATE, {"method": "unified_late"}),
)
LETTERS = "abcdefghijklmnop"
CLOSE = 1.7
NORMS: dict[str, dict[str, Any]] = {"max-ent, Eq. 102": MAXENT, "unified, Eq. 102": UNIFIED}


def variant_errors(campaigns: Campaigns, match: dict[str, Any]) -> list[Cell]:
    """Displacement errors of one variant on all grids."""
    return [number(campaigns, "errata", ERROR, resolution=n, **match) for n in CELLS]


def norm_as_printed(campaigns: Campaigns, match: dict[str, Any]) -> list[Cell]:
    """The norm of Eq. 102 as printed, without a square: the root of the mean error's size."""
    cells = []
    for n in CELLS:
        wanted = ("displacement", "displacement_exact")
        file, found = fields(campaigns, "errata", *wanted, resolution=n, **match)
        mean = float(np.mean(found["displacement_exact"] - found["displacement"]))
        cells += of_file(file, np.sqrt(abs(mean)))
    return cells


def order_of(cells: list[Cell], unit: str = "m") -> OrderEstimate:
    """Order over `CELLS`."""
    return estimate_order(
        1.0 / np.array(CELLS), [float(c.value) for c in cells], labels=CELLS, error_unit=unit
    )


def between_one_and_two(found: OrderEstimate) -> bool:
    """Whether the fitted slope over all grids would be read as lying between 1 and 2."""
    slope = float(np.mean(found.local))
    return 0.9 <= slope <= 2.1


def errata_chapter(campaigns: Campaigns) -> Chapter:
    """Variants, their orders, and what they say about the paper's Fig. 6."""
    page = Chapter(
        "errata",
        "The equations as printed, and the order of max-ent",
        "The paper: with max-ent functions the order is between 1 and 2, with B-splines it is 3 "
        "(Fig. 6).",
    )
    everything = [(name, what, variant_errors(campaigns, match)) for name, what, match in VARIANTS]
    norm = "the error norm of Eq. 102, without the square"
    everything += [(name, norm, norm_as_printed(campaigns, match)) for name, match in NORMS.items()]
    rows, explains = [], []
    for letter, (name, what, errors) in zip(LETTERS, everything, strict=False):
        found = order_of(errors, "m^0.5" if name in NORMS else "m")
        slopes = numbers_text(found.local)
        orders = [f"{slopes_text(found)} over {found.levels}", slopes, asymptotic_text(found)]
        rows.append([letter, name, what, *errors, *orders, found.verdict])
        if not name.startswith("unified") and between_one_and_two(found):
            explains.append(f"{name} ({slopes})")
    caption = (
        "Letters are those of the table. Full lines: corrected equations; broken lines: one thing "
        "changed; dots: the norm of Eq. 102, in m^(1/2)."
    )
    page.draw("variants", "What each erratum does to the error", caption, _curves(everything))
    columns = ["", "variant", "what is changed", *(f"{n} cells" for n in CELLS)]
    columns += ["order", "local slopes", "asymptotic order", "verdict"]
    title = "Errors [m] and orders of the variants"
    page.tabulate("orders", title, columns, rows, numeric=(3, 4, 5, 6))
    page.notes += conclusions({name: errors for name, _, errors in everything}, explains)
    return page


def _curves(everything: list[tuple[str, str, list[Cell]]]) -> Figure:
    """Max-ent and B-spline variants side by side, each curve with its letter at its end."""
    figure, (left, right) = tiles(2, 2, height=3.2)
    ends: dict[bool, list[tuple[float, str]]] = {False: [], True: []}
    for letter, (name, what, errors) in zip(LETTERS, everything, strict=False):
        splines = name.startswith("unified")
        axes = right if splines else left
        look = style.line("unified", "bspline") if splines else style.line("otm", "maxent")
        if not what.startswith("nothing"):
            look |= {"linestyle": ":" if name in NORMS else "--", "markerfacecolor": "white"}
        values = [float(cell.value) for cell in errors]
        axes.loglog(CELLS, values, **look)
        ends[splines].append((values[-1], letter))
    beside: dict[str, Any] = {
        "textcoords": "offset points",
        "ha": "left",
        "va": "center",
        "size": 7,
    }
    titles = ("max-ent functions, OTM", "B-splines, unified method")
    for axes, title, found in zip((left, right), titles, ends.values(), strict=True):
        for value, letters in _together(found):
            axes.annotate(letters, (CELLS[-1], value), (5, 0), **beside)
        axes.set_title(title, pad=3)
        axes.set_xlim(CELLS[0] / 1.2, CELLS[-1] * 2.0)
        ticks(axes, CELLS)
    name_axes(figure, "cells along the reference length", "RMS displacement error [m]")
    return figure


def _together(ends: list[tuple[float, str]]) -> Iterator[tuple[float, str]]:
    """Letters of curves that end within a factor of `CLOSE` as one label, with its place."""
    groups: list[list[tuple[float, str]]] = []
    for value, letter in sorted(ends):
        if groups and value < CLOSE * groups[-1][-1][0]:
            groups[-1].append((value, letter))
        else:
            groups.append([(value, letter)])
    for group in groups:
        values, letters = zip(*group, strict=True)
        yield (
            float(np.exp(np.mean([np.log(value) for value in values]))),
            ", ".join(sorted(letters)),
        )


def conclusions(errors: dict[str, list[Cell]], explains: list[str]) -> list[str]:
    """What the variants say, as far as they say it."""
    slopes = {name: float(np.mean(order_of(cells).local)) for name, cells in errors.items()}
    notes = []
    if explains:
        notes.append(
            "Max-ent functions come out with a mean slope between 1 and 2 by: "
            f"{'; '.join(explains)}."
        )
    printed = [slopes["Eq. 84, sign of A"], slopes["Eq. 84 as printed"]]
    if max(printed) < 0.3:
        notes.append(
            "The gradient of Eqs. 84 and 86 as printed is no explanation: the mean slopes are "
            f"{printed[0]:.2f} and {printed[1]:.2f}, nothing converges. Its overall sign hardly "
            "matters, because it enters stress and force."
        )
    volumes, larger = (errors[f"unified, Eq. 99{more}"][-1].value for more in ("", ", larger step"))
    if volumes > 3.0 * larger:
        notes.append(
            "Volumes that multiply (Eq. 99) leave an error that grows with the number of steps: "
            f"{larger:.2g} m with steps of 1e-5 s and {volumes:.2g} m with 1e-6 s on the finest "
            "grid."
        )
    diffused = errors["lumped, Algorithm 2"][-1].value
    if diffused > 3.0 * errors["lumped, Algorithm 2, larger step"][-1].value:
        notes.append(
            "Lumped mass in Algorithm 2 is a PIC transfer in every step: it diffuses with h^2/(6 "
            f"dt), so that smaller steps are worse ({diffused:.2g} m with steps of 1e-6 s on the "
            "finest grid)."
        )
    return notes
