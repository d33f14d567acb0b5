"""The paper's claims, each with the rule that judges it from stored runs, in the paper's order."""

from mpmbench.papers.wobbes2020.claims import algorithms, costs, fixed_ends, plate, traction
from mpmbench.papers.wobbes2020.claims.judging import IN_WORDS, SET_UPS, claim

__all__ = ["IN_WORDS", "SET_UPS", "algorithms", "claim", "costs", "fixed_ends", "plate", "traction"]
