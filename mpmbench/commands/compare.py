"""The command ``compare``: what has become better or worse from one campaign to another.

Failures, accuracy, order and speed are judged separately, over the runs with the same
configuration.
"""

from collections import Counter
from dataclasses import dataclass, field
from math import comb
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.stats import mannwhitneyu

from mpmbench.analysis.convergence import OrderEstimate, order_with_interval
from mpmbench.report.series import order_of, series_name, studies
from mpmbench.results.netcdf import read_attributes
from mpmbench.results.records import Campaign, read_campaign
from mpmbench.settings.schema import BadInput

WORSE = Counter(["new", "worse"])  # verdicts that give a code of their own
SLOWER, LESS_ACCURATE, NEW_FAILURES, NOT_COMPARABLE = 10, 11, 12, 20
ACCURACY = 0.01  # relative change of an error that counts
ORDER = 0.1  # change of an order that counts
SPEED = 0.05  # relative change of a solver time that counts, when the rank test finds it at
SIGNIFICANCE = 0.01  # for all groups together
ERRORS = ("error_displacement_rms", "error_velocity_rms", "error_stress_rms")


@dataclass(eq=False)
class Aspect:
    """One of the things compared: a verdict for each item, and lines about those that changed."""

    name: str
    verdicts: Counter[str] = field(default_factory=Counter)
    lines: list[str] = field(default_factory=list)

    def judge(self, verdict: str, item: str, text: str = "") -> None:
        """Count a verdict, and keep a line unless it is ``same``."""
        self.verdicts[verdict] += 1
        if verdict != "same":
            self.lines.append(f"  {verdict:<10} {item:<46} {text}".rstrip())

    def __str__(self) -> str:
        counts = ", ".join(
            f"{number} {verdict}" for verdict, number in sorted(self.verdicts.items())
        )
        return "\n".join([f"{self.name}: {counts or 'nothing to compare'}", *self.lines])


def main(arguments: list[str]) -> int:
    """``compare A B``: two folders of results, the older one first."""
    if len(arguments) != 2:
        example = "`compare results/a results/b`"
        raise BadInput(
            f"compare: two folders of results are needed, the older one first: {example}"
        )
    before, after = (read(Path(argument)) for argument in arguments)
    reason = not_comparable(before, after)
    if reason:
        print(f"not comparable: {reason}")
        return NOT_COMPARABLE
    pairs = paired(before, after)
    alone = [len(campaign.runs) - len(pairs) for campaign in (before, after)]
    print(f"{len(pairs)} runs in both, {alone[0]} only in A, {alone[1]} only in B")
    good = pairs[(pairs.status_a == "ok") & (pairs.status_b == "ok")]
    aspects = {
        failures(pairs): NEW_FAILURES,
        accuracy(good): LESS_ACCURATE,
        orders(before, after, good): LESS_ACCURATE,
        speed(before, after, good): SLOWER,
    }
    for aspect in aspects:
        print(aspect)
    worse = [code for aspect, code in aspects.items() if aspect.verdicts & WORSE]
    return max(worse, default=0)


def read(folder: Path) -> Campaign:
    """The results of a folder, by configuration instead of by name."""
    try:
        campaign = read_campaign(folder)
    except FileNotFoundError as error:
        raise BadInput(f"compare: {error}") from None
    for name, reason in campaign.unreadable.items():
        print(f"left out: {folder / name}: {reason}")
    return campaign


def not_comparable(before: Campaign, after: Campaign) -> str:
    """Why two campaigns cannot be compared; empty when they can."""
    if before.runs.empty or after.runs.empty:
        return "one of them has no readable result"
    a, b = (set(campaign.provenance.get("schema_version", ())) for campaign in (before, after))
    if a != b:
        return f"their files have different versions ({', '.join(map(str, sorted(a | b)))})"
    if not set(before.runs.config_hash) & set(after.runs.config_hash):
        return "no configuration is in both"
    return ""


def paired(before: Campaign, after: Campaign) -> pd.DataFrame:
    """Runs of the same configuration side by side: columns end in ``_a`` and ``_b``, the index is B's file."""
    columns = [
        runs.reset_index(names="file").set_index("config_hash")
        for runs in (before.runs, after.runs)
    ]
    return columns[0].add_suffix("_a").join(columns[1].add_suffix("_b"), how="inner")


def failures(pairs: pd.DataFrame) -> Aspect:
    """Runs that fail now and did not, and the other way round."""
    aspect = Aspect("failures")
    for _, run in pairs.iterrows():
        had, has = run.status_a, run.status_b
        verdict = "same"
        if has == "ok" != had:
            verdict = "healed"
        elif has != had and had in ("ok", "not_applicable"):
            verdict = "new"
        why = f": {run.reason_b}" if verdict == "new" else ""
        aspect.judge(verdict, run.file_b, f"{had} -> {has}{why}")
    return aspect


def accuracy(good: pd.DataFrame) -> Aspect:
    """Errors that changed by more than `ACCURACY`; of several of one run the one that changed most."""
    aspect = Aspect(f"accuracy (by more than {ACCURACY:.0%})")
    for _, run in good.iterrows():
        changes: dict[str, float] = {}
        for name in ERRORS:
            a, b = (float(run.get(f"{name}_{side}", np.nan)) for side in "ab")
            if np.isfinite(a) and np.isfinite(b) and max(a, b) > 0.0:
                changes[name] = np.inf if a == 0.0 else b / a - 1.0
        if not changes:
            continue
        name = max(changes, key=lambda name: changes[name])
        if changes[name] <= ACCURACY:
            name = min(changes, key=lambda name: changes[name])
        verdict = worse_or_better(abs(changes[name]) > ACCURACY, changes[name] > 0.0)
        text = f"{name}: {run[f'{name}_a']:.4g} -> {run[f'{name}_b']:.4g} ({changes[name]:+.1%})"
        aspect.judge(verdict, run.file_b, text)
    return aspect


def worse_or_better(changed: bool, worse: bool) -> str:
    """The verdict on something that has or has not changed."""
    return "same" if not changed else "worse" if worse else "better"


def orders(before: Campaign, after: Campaign, good: pd.DataFrame) -> Aspect:
    """Orders of convergence that changed by more than `ORDER` and left each other's intervals."""
    aspect = Aspect(f"order (by more than {ORDER:g})")
    old, new = curves(before.only(good.file_a)), curves(after.only(good.file_b))
    for key in sorted(set(old) & set(new)):
        a, b = old[key], new[key]
        if not np.isfinite([a.order, a.half_width, b.order, b.half_width]).all():
            continue  # two levels have a slope, but no interval
        apart = not (b.low <= a.order <= b.high or a.low <= b.order <= a.high)
        verdict = worse_or_better(abs(b.order - a.order) > ORDER and apart, b.order < a.order)
        text = f"{key[2]}: p = {order_with_interval(a)} -> {order_with_interval(b)}"
        aspect.judge(verdict, f"{key[0]}, {key[1]}", text)
    return aspect


def curves(campaign: Campaign) -> dict[tuple[str, str, str], OrderEstimate]:
    """Order of every error of every curve, by problem, curve and error."""
    found = {}
    for study in studies(campaign):
        for series in study.series:
            for quantity in ERRORS:
                order = order_of(study, series, quantity) if len(series.finite(quantity)) else None
                if order is not None:
                    found[study.problem, series.label, quantity] = order
    return found


def speed(before: Campaign, after: Campaign, good: pd.DataFrame) -> Aspect:
    """Solver times of each method and basis on each problem, by a rank test over all repeats.

    Times of different configurations are made comparable by dividing each by the geometric mean of
    its configuration (aligned ranks). Only runs on the same machine that had it to themselves
    count.
    """
    aspect = Aspect(f"speed (by more than {SPEED:.0%}, p < {SIGNIFICANCE:g})")
    groups: dict[tuple[str, str], list[tuple[np.ndarray, np.ndarray]]] = {}
    left_out: Counter[str] = Counter()
    for _, run in good.iterrows():
        origins = [before.provenance.loc[run.file_a], after.provenance.loc[run.file_b]]
        files = [before.folder / run.file_a, after.folder / run.file_b]
        times = [np.array((read_attributes(file) or {}).get("solver_times", [])) for file in files]
        if any(origins[0].get(key) != origins[1].get(key) for key in ("host", "cpu", "threads")):
            left_out["on different machines"] += 1
        elif not all(len(some) and (some > 0.0).all() for some in times):
            left_out["not timed alone (timing=exclusive)"] += 1
        else:
            key = (run.problem_b, series_name(run.method_b, run.basis_b))
            groups.setdefault(key, []).append((np.log(times[0]), np.log(times[1])))
    aspect.lines = [f"  left out   {number} runs {reason}" for reason, number in left_out.items()]
    for (problem, label), cells in sorted(groups.items()):
        verdict, text = rank_test(cells, SIGNIFICANCE / len(groups))
        aspect.judge(verdict, f"{problem}, {label}", text)
    return aspect


def rank_test(cells: list[tuple[np.ndarray, np.ndarray]], significance: float) -> tuple[str, str]:
    """Verdict and text for the logarithms of the times before and after in each configuration.

    Mann and Whitney's test on aligned observations (Hodges and Lehmann, Ann. Math. Statist. 33,
    1962, 482-497).
    """
    centres = [0.5 * (a.mean() + b.mean()) for a, b in cells]
    a, b = (
        np.concatenate([cell[side] - centre for cell, centre in zip(cells, centres, strict=True)])
        for side in (0, 1)
    )
    ratio = float(np.exp(np.median(b) - np.median(a)))
    text = f"solver time x {ratio:.2f} over {len(a)} and {len(b)} timings"
    least = 2.0 / comb(len(a) + len(b), len(a))  # two-sided p that the test can give
    if least > significance:
        return "undecided", f"{text}: too few to tell"
    p = float(mannwhitneyu(b, a).pvalue)
    changed = p < significance and abs(np.log(ratio)) > np.log1p(SPEED)
    return worse_or_better(changed, ratio > 1.0), f"{text}, p = {p:.2g}"
