"""Failures, accuracy and orders: a verdict for each run or curve, and lines about those that changed."""

from collections import Counter
from dataclasses import dataclass, field

import numpy as np
import pandas as pd

from mpmbench.analysis.estimate import OrderEstimate, slopes_text
from mpmbench.report.series import order_of, studies
from mpmbench.results.records import Campaign
from mpmbench.say import BELOW, in_lines, visible, with_reason

ACCURACY = 0.01  # relative change of an error that counts
ORDER = 0.1  # change of an order that counts
ERRORS = ("error_displacement_rms", "error_velocity_rms", "error_stress_rms")


@dataclass(eq=False)
class Aspect:
    """One of the things compared: a verdict for each item, and lines about those that changed."""

    name: str
    verdicts: Counter[str] = field(default_factory=Counter)
    lines: list[str] = field(default_factory=list)
    tells_all: bool = False  # also those that are the same

    def judge(self, verdict: str, item: str, text: str = "") -> None:
        """Count a verdict, and keep a line if something is to be said."""
        self.verdicts[verdict] += 1
        if verdict != "same" or self.tells_all:
            self.lines += with_reason(f"  {verdict:<10} {visible(item):<46}", text)

    def told(self) -> list[str]:
        """Lines of at most 80 columns: how many verdicts there are, and what was judged."""
        counts = ", ".join(
            f"{number} {verdict}" for verdict, number in sorted(self.verdicts.items())
        )
        return [*in_lines(f"{self.name}: {counts or 'nothing to compare'}", BELOW), *self.lines]


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
        if not np.isfinite([a.slope, a.half_width, b.slope, b.half_width]).all():
            continue  # two levels have a slope, but no interval
        apart = not (b.low <= a.slope <= b.high or a.low <= b.slope <= a.high)
        verdict = worse_or_better(abs(b.slope - a.slope) > ORDER and apart, b.slope < a.slope)
        text = f"{key[2]}: slope {slopes_text(a)} -> {slopes_text(b)}"
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
