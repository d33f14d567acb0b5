"""What every plug-in owes, as checks that say what they found: the tests ask them of our own, ``check`` of others'.

A check is a function of a case that returns a `Finding`. A declaration is tested in both
directions: what a plug-in does not claim must not hold either, or it claims too little.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Finding:
    """Whether a plug-in keeps one part of its contract, and what was measured."""

    passed: bool
    text: str

    @classmethod
    def below(cls, value: float, limit: float, what: str) -> "Finding":
        """An error that must stay below a limit; not-a-number does not."""
        return cls(bool(value < limit), f"{what} {value:.2g}, less than {limit:g} is needed")

    @classmethod
    def as_declared(cls, holds: bool, declared: bool, claim: str, measured: str) -> "Finding":
        """A property that must hold exactly when it is declared."""
        verb = "holds" if holds else "does not hold"
        said = "declared" if declared else "not declared"
        return cls(bool(holds) == bool(declared), f"{claim} {verb} and is {said} ({measured})")

    @classmethod
    def all(cls, findings: list["Finding"]) -> "Finding":
        """Several findings as one; its text is that of the first one that failed."""
        worst = next((finding for finding in findings if not finding.passed), findings[0])
        return cls(worst.passed, worst.text)


Check = Callable[[Any], Finding]


def largest(values: np.ndarray) -> float:
    """Largest magnitude; not-a-number stays one."""
    return float(np.abs(values).max())
