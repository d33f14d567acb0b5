"""Everything against everything: what each method with each basis reaches on each problem, at what cost.

`mpmbench.report.front` says what a combination is and which error it has at which cost.
"""

from collections.abc import Iterator

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle

from mpmbench.report import style
from mpmbench.report.atlas import COLOURS
from mpmbench.report.figures import in_units
from mpmbench.report.front import Entry, Field
from mpmbench.report.names import drawn
from mpmbench.report.tables import Cell, Table, number_text
from mpmbench.results.records import Campaign

FEWEST = 3  # problems, and methods, from which there is something to compare across
CAPTION = (
    "Smallest error of each combination within the cost at which all have a result, over the smallest "
    "of all; other cells are coloured by how the runs ended, and the table says why."
)
PROFILE = (
    "Share of the problems on which a combination is within a factor of the best at equal cost."
)
DARK = 30.0  # times the best error: cells whose text is white
WORST = 100.0  # times the best error: the end of the colours


def wanted(campaign: Campaign) -> bool:
    """Whether there are several methods on several problems."""
    runs = campaign.runs
    return len(runs) > 0 and min(runs.problem.nunique(), runs.method.nunique()) >= FEWEST


def combinations(entries: dict[str, dict[str, Entry]]) -> list[str]:
    """All combinations that apply somewhere, those with the most results first."""
    names = sorted({name for found in entries.values() for name in found})
    rank = {name: list(_ratios(name, entries)) for name in names}
    some = [
        name
        for name in names
        if any(
            found[name].status != "not_applicable" for found in entries.values() if name in found
        )
    ]
    return sorted(some, key=lambda name: (-len(rank[name]), np.sum(np.log(rank[name])), name))


def _ratios(name: str, entries: dict[str, dict[str, Entry]]) -> Iterator[float]:
    for found in entries.values():
        if name in found and np.isfinite(found[name].ratio):
            yield found[name].ratio


def heat_map(entries: dict[str, dict[str, Entry]]) -> Figure:
    """Error over the best at equal cost, a row per combination and a column per problem; else how runs ended."""
    names, problems = combinations(entries), list(entries)
    values = np.full((len(names), len(problems)), np.nan)
    height = 0.9 + 0.16 * len(names)
    figure = Figure(figsize=(2.4 + 0.75 * len(problems), height), layout="constrained")
    axes, ended = figure.add_subplot(), set()
    for j, problem in enumerate(problems):
        for i, name in enumerate(names):
            entry = entries[problem].get(name)
            if entry is None:
                continue
            values[i, j] = np.log10(min(entry.ratio, WORST))
            if np.isfinite(entry.ratio):
                text = f"{entry.ratio:.2g}" if entry.ratio < WORST else f"{entry.ratio:.0e}"
                ink = "white" if entry.ratio > DARK else "black"
                axes.text(j, i, text, ha="center", va="center", size=6, color=ink)
            else:
                colour = COLOURS.get(entry.status, "white")
                axes.add_patch(Rectangle((j - 0.5, i - 0.5), 1.0, 1.0, color=colour, lw=0))
                ended.add(entry.status)
    image = axes.imshow(values, cmap="YlOrBr", vmin=0.0, vmax=np.log10(WORST), aspect="auto")
    bar = figure.colorbar(image, ax=axes, shrink=0.6, extend="max")
    bar.set_ticks([0.0, 1.0, 2.0], labels=["1", "10", "100"])
    bar.set_label("error over the best at equal cost")
    axes.set_xticks(range(len(problems)), [drawn(one).replace("_", "\n") for one in problems])
    axes.set_yticks(range(len(names)), [*map(drawn, names)])
    axes.grid(False)
    axes.tick_params(length=0, top=False, right=False, labelsize=6)
    patches = [Patch(color=COLOURS[s], label=s.replace("_", " ")) for s in COLOURS if s in ended]
    if patches:
        figure.legend(handles=patches, loc="outside lower left", ncols=3, handlelength=1.0)
    return figure


def profile(entries: dict[str, dict[str, Entry]], most: int = 10) -> Figure:
    """Share of the problems on which a combination is within a factor of the best, for the first ones."""
    figure = Figure(figsize=(style.COLUMN, 3.4), layout="constrained")
    axes = figure.add_subplot()
    factors = np.geomspace(1.0, WORST, 200)
    for rank, name in enumerate(combinations(entries)[:most]):
        ratios = np.array([*_ratios(name, entries)])
        shares = [np.sum(ratios <= factor * (1.0 + 1e-12)) / len(entries) for factor in factors]
        colour = style.PLUGIN_COLOURS[rank % len(style.PLUGIN_COLOURS)]
        line = style.LINE_STYLES[rank // len(style.PLUGIN_COLOURS) % len(style.LINE_STYLES)]
        axes.semilogx(factors, shares, line, color=colour, label=drawn(name))
    axes.set(xlabel="factor of the best error at equal cost", ylabel="share of the problems")
    axes.set_ylim(0.0, 1.03)
    figure.legend(loc="outside lower left", ncols=2)
    return figure


def table(fields: list[Field], entries: dict[str, dict[str, Entry]]) -> Table:
    """Every cell of method, basis and problem: a number or a reason."""
    rows = []
    for field in fields:
        for name, entry in entries[field.problem].items():
            said = entry.reason if not np.isfinite(entry.error) else ""
            ended = entry.status.replace("_", " ")
            file = (entry.file,)
            numbers = [Cell(value, file) for value in (entry.error, entry.ratio, entry.cost)]
            rows.append([field.problem, name, *numbers, Cell(ended, file), said])
    columns = ["problem", "combination", "error", "over the best", "cost [s]", "status", "reason"]
    costs = "; ".join(
        f"{one.problem}: {in_units(one.error_name, one.unit)} at {number_text(one.cost)} s"
        for one in fields
        if np.isfinite(one.cost)
    )
    return Table("matrix", "Every combination", columns, rows, f"Compared by {costs}.", (2, 3, 4))
