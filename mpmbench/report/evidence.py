"""What a rule on a claim may ask of stored runs; all that it asks for becomes evidence."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd

from mpmbench.analysis.convergence import estimate_order
from mpmbench.analysis.estimate import OrderEstimate, slopes_text
from mpmbench.report.series import field_scale
from mpmbench.results.records import Campaign

Match = Mapping[str, Any]


class MissingRuns(Exception):
    """A rule needs a run that is not there, or that did not finish; the message says which."""


@dataclass(frozen=True)
class Evidence:
    """One number or word that a verdict rests on, and its result files."""

    name: str
    value: float | str
    files: tuple[str, ...]


@dataclass
class Runs:
    """What a rule may ask of the campaigns; it remembers what was asked.

    Attributes
    ----------
    campaigns : mapping
        Campaigns by name.
    evidence : list of Evidence
        All that the rule has asked for so far.
    choices : mapping
        What the set-up chooses otherwise than the stated one.
    asked : set of str
        Choices that the rule has asked for so far.
    """

    campaigns: Mapping[str, Campaign]
    evidence: list[Evidence] = field(default_factory=list)
    choices: Mapping[str, Any] = field(default_factory=dict)
    asked: set[str] = field(default_factory=set)

    def choice(self, key: str, stated: Any) -> Any:
        """What this set-up chooses, or what the paper's stated one has; the rule depends on it."""
        self.asked.add(key)
        return self.choices.get(key, stated)

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

    def known(self, campaign: str, quantity: str, **match: Any) -> float:
        """The number of the one run that matches, however it ended; raises `MissingRuns` without one."""
        runs = self._matching(campaign, match)
        values = runs[quantity].dropna() if quantity in runs else pd.Series(dtype=float)
        if len(values) != 1:
            raise MissingRuns(
                f"{campaign}: {len(values)} runs with {_words(match)} have {quantity}"
            )
        self._remember(f"{quantity} of {_words(match)}", float(values.iloc[0]), values.index)
        return float(values.iloc[0])

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
    if wanted is None:  # a table of numbers holds nan in its place
        return found is None or found != found
    if isinstance(wanted, (int, float)) and not isinstance(wanted, bool):
        return isinstance(found, (int, float)) and bool(
            np.isclose(found, wanted, rtol=1e-9, atol=0.0)
        )
    return bool(found == wanted)


def _words(match: Match) -> str:
    return ", ".join(f"{key.replace('__', '.')} {value}" for key, value in match.items())
