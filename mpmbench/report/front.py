"""What each method with each basis reaches on a problem, at what cost, and who is best up to which cost.

A *combination* is a method with a basis and with whatever else tells its runs apart but the size. On a
problem it has a result at a cost c if one of its runs ended well within c; its error there is the
smallest of these. All that is drawn and said follows from this rule.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd

from mpmbench.report.series import Study, series_name, studies, variant_name
from mpmbench.report.tables import number_text
from mpmbench.report.timing import clock_of
from mpmbench.results.records import Campaign

MOST_TURNS = 4  # that a sentence names
USUAL = "error_displacement_rms"
OTHERS = ("_rms", "_relative", "_alternative")  # errors of other fields


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
        last = steps[-1]
        smallest = (
            f"smallest {self.error_name} is {f'{number_text(last[2])} {self.unit}'.strip()}, "
            f"in {number_text(last[1])} s."
        )
        if self.results.combination.nunique() == 1:
            return f"{last[0]}: the {smallest}"
        turns = [i for i, step in enumerate(steps) if i == 0 or step[0] != steps[i - 1][0]]
        parts: list[str] = []
        for this, following in zip(turns, [*turns[1:], None], strict=True):
            until = (
                f"up to {number_text(steps[following][1])} s"
                if following is not None
                else ("beyond" if parts else "at every cost")
            )
            parts.append(f"{steps[this][0]} {'is best ' if not parts else ''}{until}")
        if len(parts) > MOST_TURNS:
            until = f"up to {number_text(steps[turns[-1]][1])} s"
            parts[MOST_TURNS - 2 : -1] = [f"others {until}"]
        return f"{'; '.join(parts)}. The {smallest}"

    @property
    def error_name(self) -> str:
        """``displacement error``."""
        return f"{self.quantity.removeprefix('error_').removesuffix('_rms')} error".replace(
            "_", " "
        )


def fields_of(campaign: Campaign) -> list[Field]:
    """The problems of a campaign, by name; one that is set in several ways is several."""
    return [field for study in studies(campaign) for field in fields(study)]


def fields(study: Study) -> Iterator[Field]:
    """The problem of a study, once for each way in which it is set."""
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
        runs = runs.assign(error=runs[quantity].abs(), cost=runs[clock])
        unit = study.campaign.units.get(quantity, "")
        name = ", ".join(filter(None, [study.problem, variant_name(task)]))
        yield Field(name, quantity, "" if unit == "1" else unit, clock, runs)


def quantity_of(runs: pd.DataFrame) -> str | None:
    """The error of displacements, or where no run has it another one that most runs have."""
    count = {name: int(runs[name].notna().sum()) for name in runs if str(name).startswith("error_")}
    if count.get(USUAL):
        return USUAL
    some = {name: n for name, n in count.items() if n}
    own = {name: n for name, n in some.items() if not str(name).endswith(OTHERS)} or some
    return max(own, key=lambda name: own[name]) if own else None
