"""One run: from its settings to the solver's state, and from the solution to a dataset."""

from mpmbench.case.build import build, refuse_to_continue, solve
from mpmbench.case.read import Case, estimate_memory, read

__all__ = ["Case", "build", "estimate_memory", "read", "refuse_to_continue", "solve"]
