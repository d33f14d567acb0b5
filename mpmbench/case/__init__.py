"""One run: from its settings to the solver's state, and from the solution to a dataset."""

from mpmbench.case.build import build, solve
from mpmbench.case.read import Case, estimate_memory, read

__all__ = ["Case", "build", "estimate_memory", "read", "solve"]
