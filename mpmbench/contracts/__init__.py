"""What every plug-in owes, as checks that say what they found: the tests ask them of our own, ``check`` of others'.

A check is a function of a case that yields findings. A declaration is tested in both directions:
what a plug-in does not claim must not hold either, or it claims too little.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import wraps
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Finding:
    """Whether a plug-in keeps one part of its contract, and what was measured."""

    passed: bool
    text: str

    @classmethod
    def below(cls, errors: float | np.ndarray, limit: float, what: str) -> "Finding":
        """Errors whose magnitudes must stay below a limit; not-a-number does not."""
        value = largest(errors)
        return cls(value < limit, f"{what} {value:.2g}, less than {limit:g} is needed")

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


class Contract(dict[str, Check]):
    """Checks by name, in the order in which they are written."""

    def __init__(self) -> None:
        self._applies: dict[str, Callable[[Any], bool]] = {}

    def asks(
        self, applies: Callable[[Any], bool] = lambda case: True
    ) -> Callable[[Callable[[Any], Iterator[Finding]]], Check]:
        """Make a function that yields findings the check of its name, for the cases it applies to."""

        def decorate(find: Callable[[Any], Iterator[Finding]]) -> Check:
            @wraps(find)
            def check(case: Any) -> Finding:
                return Finding.all(list(find(case)))

            name = find.__name__.replace("_", " ")
            self[name], self._applies[name] = check, applies
            return check

        return decorate

    def of(self, case: Any) -> dict[str, Check]:
        """The checks that apply to a case."""
        return {name: check for name, check in self.items() if self._applies[name](case)}


def largest(values: float | np.ndarray) -> float:
    """Largest magnitude; not-a-number stays one."""
    return float(np.abs(values).max())
