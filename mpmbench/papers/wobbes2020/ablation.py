"""From MPM to OTM and from BSMPM to the unified method, one choice at a time."""

from typing import Any

import matplotlib

from mpmbench.papers.kit import Campaigns, Chapter, cell
from mpmbench.papers.parts import numbers
from mpmbench.papers.wobbes2020.support import ERROR, STRESS
from mpmbench.report import style
from mpmbench.report.figures import single
from mpmbench.report.series import BASIS_NAMES
from mpmbench.report.tables import ratio

START = {
    "method__traction": "last_particle",
    "mass": "lumped",
    "method__nodes": "fixed",
    "method__shape_functions": "updated",
    "method__transfer": "flip",
}
# One change after the other; the last state is OTM, or the unified method but for its transfer.
CHANGES = (
    ("load at the end of the bar", {"method__traction": "end_point"}),
    ("consistent mass", {"mass": "consistent"}),
    ("nodes move", {"method__nodes": "moving"}),
    ("position differences", {"method__transfer": "position_difference"}),
)
FROZEN = {"method__nodes": "fixed", "method__shape_functions": "frozen"}
BASES = ("linear", "maxent", "bspline")


def states() -> list[tuple[str, dict[str, str]]]:
    """The states of the waterfall by the change that leads to them."""
    found = [("MPM", dict(START))]
    for name, change in CHANGES:
        found.append((name, found[-1][1] | change))
    return found


def ablation_chapter(campaigns: Campaigns) -> Chapter:
    """Waterfall of errors, and the effect of each choice alone."""
    page = Chapter("ablation", "Beyond the paper: from MPM to OTM, one choice at a time")
    page.statement = (
        "The paper: under certain conditions the only difference between the algorithms emerges "
        "from the update of the basis functions, but this difference is fundamental."
    )
    path = states()
    figure, axes = single(height=2.9, width=1.5 * style.COLUMN)
    rows, alone = [], []
    start, end = style.colour("mpm"), style.colour("otm")
    blend = matplotlib.colors.LinearSegmentedColormap.from_list("from MPM to OTM", [start, end])
    for basis in BASES:
        errors = [cell(campaigns, "ablation", ERROR, basis=basis, **state) for _, state in path]
        stresses = [cell(campaigns, "ablation", STRESS, basis=basis, **state) for _, state in path]
        values = numbers(errors)
        name = BASIS_NAMES.get(basis, basis)
        axes.semilogy(range(len(path)), values, color="#999999", lw=0.9, zorder=1)
        for k, (label, _) in enumerate(path):
            look: Any = {"color": blend(k / (len(path) - 1)), "label": None if k else name}
            axes.plot(k, values[k], style.marker(basis), ms=6, **look)
            gain = ratio(errors[k], errors[k - 1]) if k else ""
            rows.append([name, label, errors[k], gain, stresses[k]])
        alone += _one_undone(campaigns, basis, name)
    axes.set_xticks(range(len(path)), [label.replace(" ", "\n", 1) for label, _ in path])
    axes.set_ylabel("RMS displacement error [m]")
    axes.legend(loc="lower left")
    caption = "Bar with dynamic traction, 68 cells, t = 0.4 s: every point adds one choice to those before it."
    page.draw("waterfall", "From MPM to OTM and the unified method", caption, figure)
    error = "RMS displacement error [m]"
    columns = ["basis", "choice added", error, "times the one before", "RMS stress error [Pa]"]
    page.tabulate("waterfall", "Errors along the way", columns, rows, numeric=(2, 3, 4))
    columns = ["basis", "choice undone", error, "times the end of the way"]
    title = "The end of the way (OTM; for B-splines the unified method) with one choice undone"
    page.tabulate("undone", title, columns, alone, numeric=(2, 3))
    return page


def _one_undone(campaigns: Campaigns, basis: str, name: str) -> list[list[Any]]:
    """Error of the last state with each choice alone undone, and with frozen functions."""
    last = states()[-1][1]
    end = cell(campaigns, "ablation", ERROR, basis=basis, **last)
    variants = [(label, last | {key: START[key] for key in change}) for label, change in CHANGES]
    variants.append(("functions updated (frozen instead)", last | FROZEN))
    rows: list[list[Any]] = [[name, "none", end, ""]]
    for label, match in variants:
        error = cell(campaigns, "ablation", ERROR, basis=basis, **match)
        rows.append([name, label, error, ratio(error, end)])
    return rows
