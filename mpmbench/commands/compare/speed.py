"""Solver times of two campaigns: a ratio for each method and basis on each problem, and one for all."""

from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from mpmbench.commands.compare.aspect import Aspect
from mpmbench.commands.compare.ratio import (
    BUSY,
    LEVEL,
    QUIET,
    Ratio,
    Runs,
    group_level,
    judge,
    ratio_of,
)
from mpmbench.report.series import series_name
from mpmbench.results.netcdf import read_attributes
from mpmbench.results.records import Campaign
from mpmbench.results.timings import Timings, is_busy, mean_load, timings
from mpmbench.say import BELOW, in_lines, with_reason

MACHINE = ("host", "cpu", "threads")
Pair = tuple[Timings, Timings]  # of one run, before and after


def speed(before: Campaign, after: Campaign, good: pd.DataFrame) -> tuple[Aspect, str]:
    """What is said of each group of runs, and the verdict on the whole.

    Only runs on the same machine that had it to themselves count.
    """
    groups: dict[str, list[Pair]] = {}
    reasons: dict[str, Counter[str]] = {}
    for _, run in good.iterrows():
        group = f"{run.problem_b}, {series_name(run.method_b, run.basis_b)}"
        reason, pair = comparable(before, after, run)
        if reason:
            reasons.setdefault(group, Counter())[reason] += 1
        else:
            groups.setdefault(group, []).append(pair)
    aspect = Aspect(
        f"speed (wall-clock time in the solver; same: within {QUIET - 1:.0%}; intervals of {LEVEL:.0%} "
        f"for all groups together, {group_level(len(groups)):.1%} each)",
        tells_all=True,
    )
    pairs = [pair for group in groups.values() for pair in group]
    allowance = allowed(aspect, pairs)
    if not pairs:
        ratios, verdict = dict[str, Ratio](), "no comparable times"
    else:
        runs = {group: logarithms(those, "wall") for group, those in groups.items()}
        ratios, together, verdict = judge(runs, allowance)
    for group in sorted({*groups, *reasons}):
        if group in ratios:
            text = said(ratios[group], groups[group], allowance)
            aspect.judge(ratios[group].verdict(allowance), group, text)
        for reason, number in reasons.get(group, Counter()).items():
            left = "left out" if group in ratios else "no comparable times"
            aspect.judge(left, group, f"{number} runs {reason}")
    if pairs:
        text = f"{said(together, pairs, allowance)}{by_cpu(pairs)}"
        aspect.lines += with_reason(
            f"  all runs   {together.verdict(allowance)} ({LEVEL:.0%}):", text
        )
    return aspect, verdict


def comparable(before: Campaign, after: Campaign, run: pd.Series) -> tuple[str, Any]:
    """Why the times of a run cannot be compared, or else both."""
    origins = [before.provenance.loc[run.file_a], after.provenance.loc[run.file_b]]
    differing = [key for key in MACHINE if origins[0].get(key) != origins[1].get(key)]
    if differing:
        values = [f"{key}: {origins[0].get(key)}, {origins[1].get(key)}" for key in differing]
        return f"on different machines ({'; '.join(values)})", None
    files = [before.folder / run.file_a, after.folder / run.file_b]
    pair = tuple(timings(read_attributes(file)) for file in files)
    if not all(len(one.wall) and (one.wall > 0.0).all() for one in pair):
        return "not timed alone (timing=exclusive)", None
    return "", pair


def allowed(aspect: Aspect, pairs: Sequence[Pair]) -> float:
    """The factor allowed for what differs as a whole, with a line that says why."""
    loads = [mean_load([pair[side] for pair in pairs]) for side in (0, 1)]
    if any(is_busy(load) for load in loads):
        told = ["unknown" if np.isnan(load) else f"{load:.2f}" for load in loads]
        text = (
            f"under load (processors busy with other work: {told[0]} before, {told[1]} after): less "
            f"than a factor of {BUSY:g} is undecided; time both on a quiet machine"
        )
        aspect.lines += in_lines(text, BELOW, "  ")
        return BUSY
    if pairs and np.isnan(loads).any():
        aspect.lines.append("  load by other work unknown, taken as none")
    return QUIET


def logarithms(pairs: Sequence[Pair], clock: str) -> Runs:
    """Those of the times of each run by one clock."""
    return [(np.log(getattr(a, clock)), np.log(getattr(b, clock))) for a, b in pairs]


def said(ratio: Ratio, pairs: Sequence[Pair], allowance: float) -> str:
    """The ratio, what it rests on, and what would decide if it does not."""
    text = f"{ratio} over {len(pairs)} runs, {ratio.repeats[0]} and {ratio.repeats[1]} repeats"
    if ratio.verdict(allowance) != "undecided" or allowance == BUSY:
        return text
    needed = ratio.repeats_needed()
    number = f"about {needed}" if needed else "no affordable number of"
    return f"{text}; {number} repeats would decide"


def by_cpu(pairs: Sequence[Pair]) -> str:
    """The ratio of CPU times, for comparison, where they are known."""
    if not all((one.cpu > 0.0).all() for pair in pairs for one in pair):
        return ""
    return f"; CPU time {ratio_of(logarithms(pairs, 'cpu'))}"
