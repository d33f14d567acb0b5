"""Claims of a paper with verdicts computed from stored runs; none is typed in by hand.

A rule asks for numbers, orders and statuses by what a run must match, and answers with a `Verdict`.
What it asked for becomes the evidence, each piece with its result files.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd

from mpmbench.analysis.convergence import estimate_order
from mpmbench.analysis.estimate import OrderEstimate, slopes_text
from mpmbench.report.series import field_scale
from mpmbench.report.tables import Cell, Table
from mpmbench.results.records import Campaign

HOLDS, FAILS, UNDECIDED = "holds", "does not hold", "undecided"
Match = Mapping[str, Any]


class MissingRuns(Exception):
    """A rule needs a run that is not there, or that did not finish; the message says which."""


@dataclass(frozen=True)
class Evidence:
    """One number or word that a verdict rests on, and its result files."""

    name: str
    value: float | str
    files: tuple[str, ...]


@dataclass(frozen=True)
class Verdict:
    """What the runs say about a claim.

    Attributes
    ----------
    answer : str
        ``holds``, ``does not hold``, ``holds when ...`` or ``undecided``.
    because : str
        One sentence with the numbers.
    evidence : tuple of Evidence
    """

    answer: str
    because: str
    evidence: tuple[Evidence, ...] = ()


@dataclass
class Runs:
    """What a rule may ask of the campaigns; it remembers what was asked.

    Attributes
    ----------
    campaigns : mapping
        Campaigns by name.
    evidence : list of Evidence
        All that the rule has asked for so far.
    """

    campaigns: Mapping[str, Campaign]
    evidence: list[Evidence] = field(default_factory=list)

    def number(self, campaign: str, quantity: str, **match: Any) -> float:
        """A scalar of the one run that matches (median over repeats that differ in nothing).

        Parameters
        ----------
        campaign, quantity : str
            For example ``"fig6"`` and ``"error_displacement_rms"``.
        **match
            Attributes (``method="otm"``, ``resolution=32``) and settings, dots written as two
            underscores (``method__mass="lumped"``).

        Raises
        ------
        MissingRuns
            When no run matches, or none of them finished with this number.
        ValueError
            When the runs that match differ in a setting: the rule has to say which one it means.
        """
        runs = self._matching(campaign, match)
        done = runs[runs.status == "ok"]
        values = done[quantity].dropna() if quantity in done else pd.Series(dtype=float)
        if values.empty:
            state = ", ".join(sorted(set(runs.status)))
            raise MissingRuns(
                f"{campaign}: the run with {_words(match)} has no {quantity} (status: {state})"
            )
        differing = self._differing(campaign, values.index)
        if differing:
            raise ValueError(
                f"{campaign}: runs with {_words(match)} differ in {', '.join(differing)}"
            )
        value = float(values.median())
        self._remember(f"{quantity} of {_words(match)}", value, values.index)
        return value

    def order(
        self, campaign: str, quantity: str, cells: Iterable[int] = (), **match: Any
    ) -> OrderEstimate:
        """The order of the finished runs that match, over all resolutions or over the given ones.

        Raises
        ------
        MissingRuns
            When fewer than two resolutions are there.
        """
        runs = self._matching(campaign, match)
        wanted = set(cells)
        done = runs[(runs.status == "ok") & (runs[quantity] > 0)] if quantity in runs else runs[:0]
        done = done[done.resolution.isin(wanted)] if wanted else done
        errors = done.groupby("resolution")[quantity].median()
        if len(errors) < 2 or wanted - set(errors.index):
            have = ", ".join(f"{n:g}" for n in errors.index) or "none"
            raise MissingRuns(
                f"{campaign}: the order of {_words(match)} needs more resolutions (finished: "
                f"{have})"
            )
        n = errors.index.to_numpy(float)
        unit = self.campaigns[campaign].units.get(quantity, "")
        found = estimate_order(
            1.0 / n,
            errors.to_numpy(float),
            labels=[f"{k:g}" for k in n],
            error_unit=unit,
            scale=field_scale(self.campaigns[campaign], done, quantity),
        )
        self._remember(
            f"order of {quantity}, {_words(match)}",
            f"{slopes_text(found)}, {found.levels}",
            done.index,
        )
        return found

    def status(self, campaign: str, **match: Any) -> str:
        """How the one run that matches ended."""
        runs = self._matching(campaign, match)
        if len(runs) != 1:
            raise ValueError(f"{campaign}: {len(runs)} runs match {_words(match)}, not one")
        self._remember(f"status of {_words(match)}", str(runs.status.iloc[0]), runs.index)
        return str(runs.status.iloc[0])

    def _matching(self, campaign: str, match: Match) -> pd.DataFrame:
        if campaign not in self.campaigns:
            raise MissingRuns(f"there is no campaign {campaign}")
        runs = self.campaigns[campaign].runs
        keep = pd.Series(True, index=runs.index)
        for key, value in match.items():
            column = column_of(self.campaigns[campaign], campaign, key)
            keep &= column.map(lambda found, value=value: _equal(found, value))
        if not keep.any():
            raise MissingRuns(f"{campaign}: no run with {_words(match)}")
        return runs[keep]

    def _differing(self, campaign: str, files: pd.Index) -> list[str]:
        settings = self.campaigns[campaign].settings.loc[files]
        return [str(key) for key in settings if settings[key].map(repr).nunique() > 1]

    def _remember(self, name: str, value: float | str, files: pd.Index) -> None:
        self.evidence.append(Evidence(name, value, tuple(map(str, files))))


Holds = bool | str
Rule = Callable[[Runs], tuple[Holds, str]]


@dataclass(frozen=True)
class Claim:
    """A statement of a paper and what judges it: a rule, or measure, threshold and sentence.

    Attributes
    ----------
    name : str
        Short and unique, for links.
    statement, source : str
        The paper's statement and where it stands (section, figure, table).
    rule : callable, optional
        Takes `Runs`, returns whether the statement holds, as `holds` does (or the whole answer),
        and a sentence with the numbers. It stands for the three that follow when the words depend
        on what is found.
    measure : callable, optional
        Takes `Runs`, returns numbers by name.
    holds : callable, optional
        Takes these numbers by name, returns whether the statement holds, or the condition under
        which it does (``"when the mass is lumped"``).
    sentence : str
        A format of the numbers: ``"with 200 cells the error is {error:.1e} m"``.
    """

    name: str
    statement: str
    source: str
    rule: Rule | None = None
    measure: Callable[[Runs], Mapping[str, Any]] | None = None
    holds: Callable[..., Holds] | None = None
    sentence: str = ""

    def __post_init__(self) -> None:
        """Refuse a claim that nothing judges, or two things."""
        parts = (self.measure is not None, self.holds is not None, bool(self.sentence))
        if any(parts) == (self.rule is not None) or any(parts) != all(parts):
            raise ValueError(
                f"claim {self.name}: a rule, or measure, holds and sentence are needed"
            )

    def answer(self, runs: Runs) -> tuple[str, str]:
        """The answer, and a sentence with the numbers."""
        if self.rule is not None:
            holds, because = self.rule(runs)
        else:
            assert self.measure is not None and self.holds is not None
            found = self.measure(runs)
            holds, because = self.holds(**found), self.sentence.format(**found)
        if isinstance(holds, str):
            return (f"{HOLDS} {holds}" if holds.startswith("when ") else holds), because
        return (HOLDS if holds else FAILS), because


class Claims(list[Claim]):
    """Claims in the order in which their functions are written; called, it decorates one of them.

    The name of the function is that of the claim. With `holds` and `sentence` it is the `measure`
    of a `Claim`, without them the `rule`::

        @claim("OTM converges with order 2", "Fig. 3", holds=..., sentence="p = {p:.2f}")
        def order(runs: Runs) -> dict[str, float]:
    """

    def __call__(self, statement: str, source: str, **parts: Any) -> Callable[[Any], Any]:
        def add(function: Any) -> Any:
            role = "measure" if parts else "rule"
            self.append(Claim(function.__name__, statement, source, **{role: function}, **parts))
            return function

        return add


def judge(claim: Claim, campaigns: Mapping[str, Campaign]) -> Verdict:
    """Apply the rule of a claim; missing or failed runs leave it undecided, with the reason."""
    runs = Runs(campaigns)
    try:
        answer, because = claim.answer(runs)
    except MissingRuns as missing:
        return Verdict(UNDECIDED, str(missing), tuple(runs.evidence))
    return Verdict(answer, because, tuple(runs.evidence))


def claims_table(name: str, claims: Iterable[Claim], campaigns: Mapping[str, Campaign]) -> Table:
    """Claims, verdicts and evidence; every row links to its runs."""
    rows = []
    for claim in claims:
        verdict = judge(claim, campaigns)
        files = tuple(dict.fromkeys(file for piece in verdict.evidence for file in piece.files))
        numbers = "; ".join(f"{piece.name}: {Cell(piece.value).text}" for piece in verdict.evidence)
        answer = Cell(verdict.answer, files)
        rows.append([claim.statement, claim.source, answer, verdict.because, numbers])
    return Table(name, "Claims", ["claim", "source", "verdict", "because", "evidence"], rows)


def column_of(campaign: Campaign, called: str, key: str) -> pd.Series:
    """What the runs of a campaign have for an attribute or a setting.

    Raises
    ------
    MissingRuns
        When none has it.
    """
    name = key.replace("__", ".")
    for table in (campaign.runs, campaign.settings):
        if name in table:
            return table[name]
    raise MissingRuns(f"{called}: no run has a setting {name}")


def _equal(found: Any, wanted: Any) -> bool:
    if isinstance(wanted, (int, float)) and not isinstance(wanted, bool):
        return isinstance(found, (int, float)) and bool(
            np.isclose(found, wanted, rtol=1e-9, atol=0.0)
        )
    return bool(found == wanted)


def _words(match: Match) -> str:
    return ", ".join(f"{key.replace('__', '.')} {value}" for key, value in match.items())
