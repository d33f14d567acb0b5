"""One run: from its settings to the solver's state, and from the solution to what its file holds."""

from mpmbench.case.build import build, refuse_to_continue, run, solve
from mpmbench.case.output import Outcome
from mpmbench.case.read import Case, estimate_memory, read

__all__ = [
    "Case",
    "Outcome",
    "build",
    "estimate_memory",
    "read",
    "refuse_to_continue",
    "run",
    "solve",
]
