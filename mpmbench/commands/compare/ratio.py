"""How many times longer the runs of one campaign took than those of another, with an interval.

What is repeated is a round: every run of a campaign once, in a process of its own. Repeats of one
round share the process, its place in memory and the state of the machine, so that the median over
the runs of a round counts as one observation, and ranks of single repeats would promise too much.
Times of different runs are made comparable by what aligned ranks begin with: each is divided by the
centre of its run's times in both campaigns (Hodges and Lehmann, Ann. Math. Statist. 33, 1962,
482-497). Ranks of three rounds cannot reach a level of 5 %; Student's t can.

What differs between two campaigns as a whole, such as the clock of the processor, cannot be told
from a slower program. A ratio counts as changed only when its whole interval is beyond an
allowance for that.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from math import exp, inf, log, sqrt
from statistics import median

import numpy as np
from scipy.stats import t as student

QUIET, BUSY = 1.05, 2.5  # factor allowed for that on a machine without and with other work
LEVEL = 0.95
MOST_REPEATS = 1000

Runs = list[tuple[np.ndarray, np.ndarray]]  # logarithms of the times before and after of each run


@dataclass(frozen=True)
class Ratio:
    """A ratio of times with its interval, by their logarithms.

    Attributes
    ----------
    shift, half_width : float
        Centre and half the width of the interval; the width is infinite where nothing is known.
    level : float
        That of the interval.
    scatter : float
        Standard deviation of one round.
    repeats : tuple of int
        Number of rounds before and after.
    """

    shift: float
    half_width: float
    level: float
    scatter: float
    repeats: tuple[int, int]

    def verdict(self, allowance: float = QUIET) -> str:
        """``same``, ``better``, ``worse`` or ``undecided``; with more than `QUIET` only equal times are."""
        low, high = self.shift - self.half_width, self.shift + self.half_width
        if low > log(allowance):
            return "worse"
        if high < -log(allowance):
            return "better"
        sure = allowance == QUIET or self.half_width == 0.0
        return "same" if sure and max(-low, high) <= log(QUIET) else "undecided"

    def repeats_needed(self) -> int:
        """How many repeats would decide on a quiet machine, if their scatter stays; 0 when too many."""
        if not np.isfinite(self.half_width):
            return max(2, *(number + 1 for number in self.repeats))
        room = abs(abs(self.shift) - log(QUIET))
        for number in range(min(self.repeats) + 1, MOST_REPEATS):
            if quantile(self.level, 2 * number - 2) * self.scatter * sqrt(2 / number) < room:
                return number
        return 0

    def __str__(self) -> str:
        ratio = f"x {exp(self.shift):.3f}"
        if not np.isfinite(self.half_width):
            return f"{ratio} (no interval from so few times)"
        low, high = exp(self.shift - self.half_width), exp(self.shift + self.half_width)
        return f"{ratio} ({low:.3f} to {high:.3f})"


def ratio_of(runs: Runs, level: float = LEVEL) -> Ratio:
    """The ratio of times after and before, with its interval of that level."""
    before, after = rounds(runs)
    repeats = (len(before), len(after))
    if all(np.array_equal(a, b) for a, b in runs):  # not measured twice: the very same times
        return Ratio(0.0, 0.0, level, 0.0, repeats)
    shift = float(after.mean() - before.mean())
    freedom = sum(repeats) - 2
    if freedom <= 0:  # the scatter of runs within one round says nothing about rounds
        return Ratio(shift, inf, level, inf, repeats)
    squares = sum(float(((side - side.mean()) ** 2).sum()) for side in (before, after))
    scatter = sqrt(squares / freedom)
    width = quantile(level, freedom) * scatter * sqrt(sum(1 / number for number in repeats))
    return Ratio(shift, width, level, scatter, repeats)


def judge(
    groups: Mapping[str, Runs], allowance: float = QUIET
) -> tuple[dict[str, Ratio], Ratio, str]:
    """The ratio of each group, that of all runs, and the verdict.

    The intervals of all groups hold together with the probability `LEVEL`, and that of all runs by
    itself. One group that is worse makes the whole worse: the median over all runs does not see it.
    """
    level = group_level(len(groups))
    ratios = {name: ratio_of(runs, level) for name, runs in groups.items()}
    together = ratio_of([run for runs in groups.values() for run in runs])
    found = {ratio.verdict(allowance) for ratio in ratios.values()}
    return ratios, together, "worse" if "worse" in found else together.verdict(allowance)


def group_level(number: int) -> float:
    """The level of each of so many intervals that hold together with the probability `LEVEL`."""
    return 1.0 - (1.0 - LEVEL) / max(1, number)


def rounds(runs: Runs) -> tuple[np.ndarray, np.ndarray]:
    """Median over the aligned runs of each round, before and after; some runs have fewer rounds."""
    centres = [0.5 * (median(a) + median(b)) for a, b in runs]
    found = []
    for side in (0, 1):
        aligned = [run[side] - centre for run, centre in zip(runs, centres, strict=True)]
        number = max(map(len, aligned))
        found.append([median([one[k] for one in aligned if len(one) > k]) for k in range(number)])
    return np.array(found[0]), np.array(found[1])


@cache
def quantile(level: float, freedom: int) -> float:
    """That of Student's distribution, for a two-sided interval."""
    return float(student.ppf(0.5 + 0.5 * level, freedom))
