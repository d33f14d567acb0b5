"""Everything against everything: what each method with each basis reaches on each problem, at what cost.

A *combination* is a method with a basis and with whatever else tells its runs apart but the size. On a
problem it has a result at a cost c if one of its runs ended well within c; its error there is the
smallest of these. All that is drawn and said follows from this rule.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle

from mpmbench.report import style
from mpmbench.report.atlas import COLOURS
from mpmbench.report.series import Study, series_name, studies, variant_name
from mpmbench.report.tables import Cell, Table, number_text
from mpmbench.report.timing import clock_of
from mpmbench.results.records import Campaign

USUAL = "error_displacement_rms"
OTHERS = ("_rms", "_relative", "_alternative")  # errors of other fields
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


@dataclass(frozen=True)
class Entry:
    """A combination on a problem.

    Attributes
    ----------
    ratio : float
        Its error over the best one at the same cost; nan without a result there.
    error, cost : float
        What it reached, and the time that took [s].
    status, reason : str
        How its runs ended: ``ok`` where one of them has a result.
    file : str
        The run that is shown.
    """

    ratio: float
    error: float
    cost: float
    status: str
    reason: str
    file: str


@dataclass(frozen=True)
class Field:
    """The runs of one problem.

    Attributes
    ----------
    problem : str
        Its name, and how it is set where several settings of it were run.
    quantity, unit : str
        The error by which they are compared.
    clock : str
        Scalar of a run that is its cost [s].
    runs : DataFrame
        With the columns ``combination``, ``error`` and ``cost``.
    """

    problem: str
    quantity: str
    unit: str
    clock: str
    runs: pd.DataFrame

    @cached_property
    def results(self) -> pd.DataFrame:
        """Runs with an error and a cost, the cheapest first."""
        runs = self.runs[(self.runs.status == "ok") & np.isfinite(self.runs.error)]
        return runs[np.isfinite(runs.cost)].sort_values("cost", kind="stable")

    @cached_property
    def cost(self) -> float:
        """The cost at which combinations are compared: each that has a result has one by then [s]."""
        return float(self.results.groupby("combination").cost.min().max())

    def entries(self) -> dict[str, Entry]:
        """All combinations at this cost."""
        within = self.results[self.results.cost <= self.cost]
        best = float(within.error.min()) if len(within) else np.nan
        return {
            str(name): self._entry(runs, within[within.combination == name], best)
            for name, runs in self.runs.groupby("combination", sort=True)
        }

    def _entry(self, runs: pd.DataFrame, within: pd.DataFrame, best: float) -> Entry:
        if len(within):
            file = within.error.idxmin()
            run = within.loc[file]
            ratio = run.error / best if best > 0.0 else np.nan
            return Entry(float(ratio), float(run.error), float(run.cost), "ok", "", str(file))
        failed = runs[runs.status != "ok"]
        run = (failed if len(failed) else runs).iloc[-1]
        reason = str(run.reason) or "it has no such error"
        return Entry(np.nan, np.nan, float(run.cost), str(run.status), reason, str(run.name))

    def front(self) -> list[tuple[str, float, float, str]]:
        """Combination, cost [s], error and file of each run that no cheaper one equals."""
        steps: list[tuple[str, float, float, str]] = []
        for file, run in self.results.iterrows():
            if not steps or run.error < steps[-1][2]:
                steps.append((str(run.combination), float(run.cost), float(run.error), str(file)))
        return steps

    def sentence(self) -> str:
        """Which combination is best up to which cost."""
        steps = self.front()
        if not steps:
            return f"No run on {self.problem} has a result."
        turns = [i for i, step in enumerate(steps) if i == 0 or step[0] != steps[i - 1][0]]
        parts: list[str] = []
        for this, following in zip(turns, [*turns[1:], None], strict=True):
            until = (
                f"up to {number_text(steps[following][1])} s"
                if following is not None
                else ("beyond" if parts else "at every cost")
            )
            parts.append(f"{steps[this][0]} {'is best ' if not parts else ''}{until}")
        last = steps[-1]
        return (
            f"{', '.join(parts)}; the smallest error is {f'{number_text(last[2])} {self.unit}'.strip()}, "
            f"in {number_text(last[1])} s."
        )


def fields_of(campaign: Campaign) -> list[Field]:
    """The problems of a campaign, by name; one that is set in several ways is several."""
    return [field for study in studies(campaign) for field in _fields(study)]


def _fields(study: Study) -> Iterator[Field]:
    clock = clock_of(study.runs).quantity
    parts: dict[tuple[tuple[str, object], ...], list[pd.DataFrame]] = {}
    for one in study.series:
        variant = tuple(part for part in one.variant if part[0] not in ("resolution", "time_step"))
        task = tuple(part for part in variant if part[0].startswith(("problem.", "end_time")))
        own = variant_name(tuple(part for part in variant if part not in task))
        name = ", ".join(filter(None, [series_name(one.method, one.basis), own]))
        parts.setdefault(task, []).append(one.runs.assign(combination=name))
    for task, tables in parts.items():
        runs = pd.concat(tables)
        quantity = quantity_of(runs)
        if quantity is None or clock not in runs:
            continue
        runs = runs.assign(error=runs[quantity], cost=runs[clock])
        unit = study.campaign.units.get(quantity, "")
        name = ", ".join(filter(None, [study.problem, variant_name(task)]))
        yield Field(name, quantity, "" if unit == "1" else unit, clock, runs)


def quantity_of(runs: pd.DataFrame) -> str | None:
    """The error of displacements, or where no run has it the first other error that most runs have."""
    count = {name: int(runs[name].notna().sum()) for name in runs if str(name).startswith("error_")}
    if count.get(USUAL):
        return USUAL
    own = {name: n for name, n in count.items() if n and not str(name).endswith(OTHERS)}
    return max(own, key=lambda name: own[name]) if own else None


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
    axes.set_xticks(range(len(problems)), [one.replace("_", "\n") for one in problems])
    axes.set_yticks(range(len(names)), names)
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
        axes.semilogx(factors, shares, line, color=colour, label=name)
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
        f"{one.problem}: {one.quantity.replace('_', ' ')} {one.unit} at {number_text(one.cost)} s"
        for one in fields
        if np.isfinite(one.cost)
    )
    return Table("matrix", "Every combination", columns, rows, f"Compared by {costs}.", (2, 3, 4))
