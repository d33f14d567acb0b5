"""From MPM to OTM and from BSMPM to the unified method, one choice at a time."""

import matplotlib

from mpmbench.papers.kit import Campaigns, Chapter, cell
from mpmbench.papers.parts import files_of, numbers, ratio, single
from mpmbench.papers.wobbes2020.support import ERROR, STRESS
from mpmbench.report import style
from mpmbench.report.series import BASIS_NAMES
from mpmbench.report.tables import Cell

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
    rows, alone, files = [], [], []
    start, end = style.colour("mpm"), style.colour("otm")
    blend = matplotlib.colors.LinearSegmentedColormap.from_list("from MPM to OTM", [start, end])
    for basis in BASES:
        errors = [cell(campaigns, "ablation", ERROR, basis=basis, **state) for _, state in path]
        stresses = [cell(campaigns, "ablation", STRESS, basis=basis, **state) for _, state in path]
        values = numbers(errors)
        name = BASIS_NAMES.get(basis, basis)
        axes.semilogy(range(len(path)), values, color="#999999", lw=0.9, zorder=1)
        for k, value in enumerate(values):
            axes.plot(
                k,
                value,
                style.marker(basis),
                color=blend(k / (len(path) - 1)),
                ms=6,
                label=None if k else name,
            )
        for k, (label, _) in enumerate(path):
            gain = ratio(errors[k], errors[k - 1]) if k else Cell()
            rows.append([Cell(name), Cell(label), errors[k], gain, stresses[k]])
        files += files_of(errors)
        alone += _one_undone(campaigns, basis, name)
    axes.set_xticks(range(len(path)), [label.replace(" ", "\n", 1) for label, _ in path])
    axes.set_ylabel("RMS displacement error [m]")
    axes.legend(loc="lower left")
    caption = "Bar with dynamic traction, 68 cells, t = 0.4 s: every point adds one choice to those before it."
    page.draw("waterfall", "From MPM to OTM and the unified method", caption, figure, files)
    columns = [
        "basis",
        "choice added",
        "RMS displacement error [m]",
        "times the one before",
        "RMS stress error [Pa]",
    ]
    page.tabulate("waterfall", "Errors along the way", columns, rows, numeric=(2, 3, 4))
    columns = ["basis", "choice undone", "RMS displacement error [m]", "times the end of the way"]
    title = "The end of the way (OTM; for B-splines the unified method) with one choice undone"
    page.tabulate("undone", title, columns, alone, numeric=(2, 3))
    return page


def _one_undone(campaigns: Campaigns, basis: str, name: str) -> list[list[Cell]]:
    """Error of the last state with each choice alone undone, and with frozen functions."""
    last = states()[-1][1]
    end = cell(campaigns, "ablation", ERROR, basis=basis, **last)
    variants = [(label, last | {key: START[key] for key in change}) for label, change in CHANGES]
    variants.append(("functions updated (frozen instead)", last | FROZEN))
    rows = [[Cell(name), Cell("none"), end, Cell()]]
    for label, match in variants:
        error = cell(campaigns, "ablation", ERROR, basis=basis, **match)
        rows.append([Cell(name), Cell(label), error, ratio(error, end)])
    return rows
