"""One run: from its settings to the solver's state, and from the solution to a dataset."""

from mpmbench.case.build import Case, build, check, estimate_memory, read, solve

__all__ = ["Case", "build", "check", "estimate_memory", "read", "solve"]
