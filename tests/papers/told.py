"""Runs that are told by a function: for rules that judge claims, without result files."""

from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np

from mpmbench.analysis.convergence import estimate_order
from mpmbench.analysis.estimate import OrderEstimate
from mpmbench.papers import find
from mpmbench.report.evidence import MissingRuns, Runs

Tell = Callable[[str, str, dict[str, Any]], float | str]
CELLS = (16, 32, 64, 128, 256)  # of an order over all resolutions


class ToldRuns(Runs):
    """What `tell` says of campaign, quantity and match: a number, or how the run ended."""

    def __init__(self, tell: Tell, choices: Mapping[str, Any] | None = None) -> None:
        super().__init__({}, choices=choices or {})
        self.tell = tell

    def number(self, campaign: str, quantity: str, **match: Any) -> float:
        value = self.tell(campaign, quantity, match)
        if isinstance(value, str):
            raise MissingRuns(value)
        return value

    known = number

    def status(self, campaign: str, **match: Any) -> str:
        value = self.tell(campaign, "status", match)
        return value if isinstance(value, str) else "ok"

    def order(
        self, campaign: str, quantity: str, cells: Iterable[int] = (), **match: Any
    ) -> OrderEstimate:
        n = np.array(tuple(cells) or CELLS, dtype=float)
        errors = [self.number(campaign, quantity, **match, resolution=int(k)) for k in n]
        return estimate_order(1.0 / n, np.array(errors), labels=[f"{k:g}" for k in n])


def answer(paper: str, name: str, tell: Tell, choices: Mapping[str, Any] | None = None) -> str:
    """The verdict on a claim by told runs."""
    return said(paper, name, tell, choices)[0]


def said(
    paper: str, name: str, tell: Tell, choices: Mapping[str, Any] | None = None
) -> tuple[str, str]:
    """The verdict on a claim by told runs, and its sentence."""
    (claim,) = [claim for claim in find(paper).claims if claim.name == name]
    return claim.answer(ToldRuns(tell, choices))
