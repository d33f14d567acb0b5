"""Orders of convergence: what the levels show, and apart from it what they let one extrapolate.

*The* order of a curve is its slope. Runs are deterministic, so the interval of the asymptotic order
is not a sampling error: it holds the orders p that explain the slopes up to a few percent, whatever
drift and floor; see `posterior` for the model.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mpmbench.analysis.estimate import (
    OrderEstimate,
    asymptotic_text,
    numbers_text,
    slopes_text,
)
from mpmbench.analysis.posterior import (
    ACCEPTED_MISFIT,
    ORDERS,
    Posterior,
    longest_explained,
    most_probable,
    pre_asymptotic,
    shortest_interval,
)
from mpmbench.analysis.slopes import (
    ROUND_OFF,
    ROUNDING,
    STAYS,
    UNKNOWN,
    Numbers,
    coarse_first,
    course_of,
    fitted_order,
    local_orders,
)

INTERVAL_MEANING = (
    "The slope is the least-squares slope over all levels, with the range of the slopes between "
    "neighbouring levels. A curve levels off where its last slope, or its last two together, are "
    "less than half of the slope before them. Round-off is an error below "
    f"{ROUND_OFF:.1e} of the field (of the stiffness where the stress is zero). The asymptotic "
    "order is extrapolated. Runs are deterministic: its interval is no sampling error. It holds "
    "95 % of the orders p for which C h^p (1 + a h) + floor, or the root of the sum of their "
    "squares, explains the errors, so it states what an asymptotic drift (a) and a floor may "
    "still hide; few levels or an early floor make it wide."
)
FLOOR_LEVELS = 4  # fewer levels cannot tell a floor from a drift
CLEAR_LEVELS = 3  # two slopes above a floor are needed to say what they would be without it
NEAR = 0.05  # a slope this close to another is the same
REFUTED = 0.98  # an error below this share of the predicted floor shows that it is none


def estimate_order(
    sizes: Numbers,
    errors: Numbers,
    labels: Sequence[object] | None = None,
    label_unit: str = "cells",
    error_unit: str = "m",
    predicted_floor: float | None = None,
    scale: float | None = None,
) -> OrderEstimate:
    """Slopes and course of a curve, its asymptotic order with an interval, and a verdict.

    When the model of the asymptotic order misses by more than `ACCEPTED_MISFIT`, the longest run of
    neighbouring levels that it explains is used, and the verdict says what was left out.

    Parameters
    ----------
    sizes, errors : array_like
        Mesh size [m] (or time step [s]) and error of each level, positive, any order, shape (L,).
    labels : sequence, optional
        How to name the levels in the verdict, for example the numbers of cells; same order as
        `sizes`.
    label_unit, error_unit : str
        Units in the verdict.
    predicted_floor : float, optional
        Known error of the time integration alone; named as the cause when the floor found is within
        a factor 2 of it, or when too few levels show a floor that it predicts. An error below it
        shows that it is no floor.
    scale : float, optional
        Size of the field, in the units of the errors: what is below `ROUND_OFF` of it is left out.

    Raises
    ------
    ValueError
        For entries that are not positive and finite, or sizes that repeat.
    """
    given = np.asarray(sizes, float)
    h, e = coarse_first(sizes, errors)
    names = [str(label) for label in (labels if labels is not None else given)]
    names = [names[k] for k in np.argsort(-given)]
    rounding = e < ROUND_OFF * (scale or 0.0)
    levels = _Levels(h, e, rounding, names, label_unit, error_unit)
    if len(h) and (~rounding).sum() < min(2, len(h)):
        sentence = f"no order: at {levels.span(rounding)} the errors are round-off"
        return levels.shown(ROUNDING, sentence)
    if not rounding.any():
        return levels.estimate(predicted_floor)
    known = levels.above_rounding().estimate(predicted_floor)
    padded: dict[str, Any] = {
        name: _at(getattr(known, name), ~rounding)
        for name in ("floor_share", "used", "pre_asymptotic")
    }
    verdict = f"{known.verdict}; at {levels.span(rounding)} the errors are round-off"
    return replace(known, **padded, verdict=verdict)


def _at(values: np.ndarray, levels: np.ndarray) -> np.ndarray:
    """Values of some levels among all, zero elsewhere."""
    full = np.zeros(len(levels), values.dtype)
    full[levels] = values
    return full


@dataclass(frozen=True)
class _Levels:
    """Sizes and errors from coarse to fine, which are rounding, and what a verdict calls them."""

    h: np.ndarray
    e: np.ndarray
    rounding: np.ndarray
    names: list[str]
    label_unit: str
    error_unit: str

    def above_rounding(self) -> "_Levels":
        """The levels that show more than rounding."""
        kept = np.flatnonzero(~self.rounding)
        names = [self.names[k] for k in kept]
        parts = (self.h[kept], self.e[kept], self.rounding[kept], names)
        return _Levels(*parts, self.label_unit, self.error_unit)

    @property
    def slopes(self) -> str:
        return numbers_text(local_orders(self.h, self.e))

    def span(self, chosen: np.ndarray | slice = np.s_[:]) -> str:
        """``8..64 cells`` of all levels, or of those that a mask or a slice chooses."""
        names = np.array(self.names)[chosen]
        return f"{names[0] if len(names) == 1 else f'{names[0]}..{names[-1]}'} {self.label_unit}"

    def shown(self, course: str, verdict: str, last: int = 1, **known: Any) -> OrderEstimate:
        """What the levels show, no asymptotic order, and what else is known."""
        none, some = np.zeros(len(self.h), bool), len(self.h) > 1 and course != ROUNDING
        slope = fitted_order(self.h, self.e) if some else float("nan")
        local = local_orders(self.h, self.e) if some else np.zeros(0)
        levels = self.span() if self.names else ""
        shown = OrderEstimate(slope, local, course, levels, last, verdict=verdict)
        blank: dict[str, Any] = {
            "floor_share": np.zeros(len(self.h)),
            "used": none,
            "pre_asymptotic": none,
        }
        return replace(shown, **(blank | known))

    def estimate(self, predicted_floor: float | None) -> OrderEstimate:
        """All that these levels say."""
        h, e = self.h, self.e
        course, last = course_of(h, e)
        if course == UNKNOWN:
            return self.shown(
                course, "no order: one level only" if len(h) else "no order: no finished run"
            )
        found = self.shown(course, "", last)
        head = f"{slopes_text(found)} over {self.span()}"
        head = head if "slope" in head else f"slope {head}"
        if len(h) == 2:
            verdict = f"{head}; two levels fix no asymptotic order"
            return replace(found, used=np.ones(2, bool), verdict=verdict)
        if course == STAYS:
            verdict = (
                f"no order: over {self.span()} the errors stay at {e.min():.3g}..{e.max():.3g} "
                f"{self.error_unit}"
            )
            return replace(found, verdict=verdict, floor=float(e.min()), floor_share=e.min() / e)
        first, end, posterior = longest_explained(h, e)
        if posterior.misfit > ACCEPTED_MISFIT:
            verdict = f"{head}; no single order explains the slopes {self.slopes}"
            return replace(found, verdict=verdict, misfit=posterior.misfit)
        used = (np.arange(len(h)) >= first) & (np.arange(len(h)) < end)
        found = _extrapolated(found, self, used, posterior, predicted_floor)
        return replace(found, verdict=_sentence(head, found, self, predicted_floor))


def _extrapolated(
    found: OrderEstimate,
    levels: _Levels,
    used: np.ndarray,
    posterior: Posterior,
    predicted_floor: float | None,
) -> OrderEstimate:
    """The asymptotic order from the levels that the model explains."""
    h, e = levels.h, levels.e
    order_weight = posterior.weight.sum(axis=(0, 2))
    low, high = shortest_interval(ORDERS, order_weight)
    probability = float(posterior.weight[1:].sum())
    floor = predicted = 0.0
    if probability > 0.5 and used.sum() >= FLOOR_LEVELS:
        floor = float((posterior.weight * posterior.floor).sum() / probability)
    if predicted_floor and 0.5 * e[used][-1] < predicted_floor < e.min() / REFUTED:
        predicted = predicted_floor
    share = np.where(used, np.minimum((floor or predicted) / e, 1.0), 0.0)
    clear = used & (share < 0.5)
    known: dict[str, Any] = {"floor": floor, "floor_probability": probability, "floor_share": share}
    known |= {"misfit": posterior.misfit}
    if floor > 0 and clear.sum() < 2:  # one level above the floor has no slope
        return replace(found, **known)
    early = pre_asymptotic(h, posterior.weight.sum(axis=(0, 1)), used)
    if early[used].all() or len(h) == 3:  # an extrapolation: the interval keeps the slopes seen
        low, high = min(low, float(found.local.min())), max(high, float(found.local.max()))
    order, reason = most_probable(ORDERS, order_weight), ""
    if len(h) == 3:  # the mode would extrapolate one difference of slopes, the plain slope does not
        order = fitted_order(h[clear], e[clear]) if clear.sum() > 1 else found.slope
    else:
        order, reason = _within_reason(order, levels, used, clear, floor, early)
    order = float(np.clip(order, low, high))
    known |= {"used": used, "pre_asymptotic": early}
    return replace(found, asymptotic=order, low=low, high=high, reason=reason, **known)


def _within_reason(
    order: float,
    levels: _Levels,
    used: np.ndarray,
    clear: np.ndarray,
    floor: float,
    early: np.ndarray,
) -> tuple[float, str]:
    """The order if the slopes show it, or would without a floor or as they drift; why, or why not."""
    local = local_orders(levels.h[used], levels.e[used])
    size = f"{floor:.2g} {levels.error_unit}"
    if _holds(local, order):
        return order, f"without a floor of {size}" if floor > 0 else ""
    if floor > 0:
        h, e = levels.h[clear], levels.e[clear]
        free = [local_orders(h, rest) for rest in (e - floor, np.sqrt(e**2 - floor**2))]
        shown = order - local.max() <= local.max() - local[-1]  # by the slopes that it made fall
        if clear.sum() >= CLEAR_LEVELS and shown and _holds(np.concatenate(free), order):
            return order, f"without a floor of {size}"
        return float("nan"), f"if {size} is a floor"
    if early.any() and abs(order - local[-1]) <= abs(local[-1] - local[-2]):
        return order, "if the slopes drift on"
    return float("nan"), "if the slopes drift on"


def _holds(slopes: np.ndarray, order: float) -> bool:
    return bool(slopes.min() - NEAR <= order <= slopes.max() + NEAR)


def _sentence(
    head: str, found: OrderEstimate, levels: _Levels, predicted_floor: float | None
) -> str:
    """The verdict: slopes, asymptotic order, floor and its cause, levels that differ."""
    unit, used = levels.error_unit, np.flatnonzero(found.used)
    limited = found.floor_share >= 0.5
    parts = [head]
    if asymptotic_text(found) != "none":
        clear = used[~limited[used]] if not limited[used].all() else used[:1]
        parts.append(f"asymptotic order {asymptotic_text(found)}, from {levels.span(clear)}")
    refuted = predicted_floor is not None and levels.e.min() < REFUTED * predicted_floor
    if found.floor > 0:
        near = predicted_floor and 0.5 < found.floor / predicted_floor < 2.0
        cause = "the errors level off"
        if near and not refuted:
            cause = f"the time step limits (predicted {predicted_floor:.2g} {unit})"
        parts.append(f"near {found.floor:.2g} {unit} {cause}")
    elif limited.any():
        parts.append(
            f"at {levels.span(limited)} most of the error is that of the time step "
            f"(predicted {predicted_floor:.2g} {unit})"
        )
    if refuted:
        parts.append(
            f"errors fall below {predicted_floor:.2g} {unit}, the error of time integration "
            "alone: that of space may cancel it"
        )
    if found.pre_asymptotic.all():
        parts.append("pre-asymptotic throughout")
    elif found.pre_asymptotic.any():
        parts.append(f"pre-asymptotic at {levels.span(found.pre_asymptotic)}")
    if len(used) and used[-1] + 1 < len(levels.h):
        parts.append(f"at {levels.span(np.s_[used[-1] + 1 :])} the errors leave this line")
    if len(levels.h) < FLOOR_LEVELS:
        parts.append(f"{len(levels.h)} levels cannot tell a floor from a drift")
    return "; ".join(parts)
