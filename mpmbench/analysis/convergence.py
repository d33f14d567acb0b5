"""Orders of convergence with an interval, from the errors of one method on a sequence of sizes.

Runs are deterministic, so the interval is not a sampling error: it holds the orders p that explain
the local slopes up to a few percent, whatever drift and floor; see `posterior` for the model.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mpmbench.analysis.posterior import (
    ACCEPTED_MISFIT,
    ORDERS,
    Posterior,
    longest_explained,
    most_probable,
    pre_asymptotic,
    shortest_interval,
)

INTERVAL_MEANING = (
    "Runs are deterministic: the interval is no sampling error. It holds 95 % of the orders p for which "
    "C h^p (1 + a h) + floor, or the root of the sum of their squares, explains the errors, so it states the spread of "
    "the local slopes and what an asymptotic drift (a) and a floor may still hide; few levels or an early floor make "
    "it wide."
)
FLOOR_LEVELS = 4  # fewer levels cannot tell a floor from a drift
LEAST_SLOPE = 0.1  # errors that change less than this over all levels do not depend on h
WIDEST_INTERVAL = 2.0  # beyond this length no value is named within the interval
Numbers = Sequence[float] | np.ndarray


@dataclass(frozen=True)
class OrderEstimate:
    """An order of convergence and how far it can be trusted.

    Attributes
    ----------
    order, low, high : float
        Most probable p (with three levels: the least-squares slope) and ends of its 95 % interval;
        NaN when no order can be stated. Two levels give their slope as `order` and no interval.
    floor : float
        Error that does not shrink with h, in the units of the errors; 0 when none was recognised.
    floor_probability : float
        Posterior probability that there is a floor (even odds beforehand).
    floor_share : ndarray
        Share of the floor in the error of each level, shape (L,); of the predicted floor where none
        was recognised and the predicted one is most of the finest error.
    used : ndarray of bool
        Levels that the order was fitted to, shape (L,).
    pre_asymptotic : ndarray of bool
        Coarse levels where the drift changes the slope by more than 0.1, or which no drift
        explains, shape (L,).
    local : ndarray
        Slopes between neighbouring levels, coarse to fine, shape (L - 1,).
    misfit : float
        RMS relative misfit of the best model on the used levels.
    verdict : str
        All of this as one sentence.
    """

    order: float
    low: float
    high: float
    floor: float
    floor_probability: float
    floor_share: np.ndarray
    used: np.ndarray
    pre_asymptotic: np.ndarray
    local: np.ndarray
    misfit: float
    verdict: str = ""

    @property
    def half_width(self) -> float:
        """Half the length of the interval."""
        return 0.5 * (self.high - self.low)


def fitted_order(
    sizes: Sequence[float] | np.ndarray, errors: Sequence[float] | np.ndarray
) -> float:
    """Least-squares slope of log(error) over log(size).

    Parameters
    ----------
    sizes, errors : array_like
        Mesh size [m] (or time step [s]) and error of each level, positive, shape (L,) with L >= 2.

    Raises
    ------
    ValueError
        For fewer than two different sizes, or entries that are not positive and finite.
    """
    h, e = _checked(sizes, errors)
    if len(h) < 2:
        raise ValueError(f"an order needs at least 2 levels, given {len(h)}")
    return float(np.polyfit(np.log(h), np.log(e), 1)[0])


def local_orders(sizes: Numbers, errors: Numbers) -> np.ndarray:
    """Slopes between neighbouring levels in log-log, from coarse to fine, shape (L - 1,)."""
    h, e = _checked(sizes, errors)
    return np.diff(np.log(e)) / np.diff(np.log(h))


def estimate_order(
    sizes: Numbers,
    errors: Numbers,
    labels: Sequence[object] | None = None,
    label_unit: str = "cells",
    error_unit: str = "m",
    predicted_floor: float | None = None,
) -> OrderEstimate:
    """Order of convergence with a 95 % interval, floor, pre-asymptotic levels and a verdict sentence.

    When the model misses by more than `ACCEPTED_MISFIT`, the longest run of neighbouring levels
    that it explains is used, and the verdict says what was left out.

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
        Known error of the time step; named as the cause when the floor found is within a factor 2
        of it, or when too few levels show a floor that it predicts.

    Raises
    ------
    ValueError
        For entries that are not positive and finite, or sizes that repeat.
    """
    given = np.asarray(sizes, float)
    h, e = _checked(sizes, errors)
    names = [str(label) for label in (labels if labels is not None else given)]
    names = [names[k] for k in np.argsort(-given)]
    levels = _Levels(h, e, local_orders(h, e), names, label_unit, error_unit)
    if len(h) < 2:
        return levels.without_order(
            "no order: one level only" if len(h) else "no order: no finished run"
        )
    if len(h) == 2:
        slope = float(levels.local[0])
        where = f"between {names[0]} and {names[1]} {label_unit}"
        sentence = f"slope {slope:.2f} {where}; two levels give no interval"
        return levels.without_order(sentence, order=slope, used=np.ones(2, bool))
    if abs(np.log(e[0] / e[-1])) < LEAST_SLOPE * np.log(h[0] / h[-1]) and e.max() < 1.5 * e.min():
        stay = f"the errors stay at {e.min():.3g}..{e.max():.3g} {error_unit}"
        sentence = f"no order: over {levels.span()} {stay}"
        return levels.without_order(sentence, floor=float(e.min()), floor_share=e.min() / e)
    first, last, posterior = longest_explained(h, e)
    if posterior.misfit > ACCEPTED_MISFIT:
        sentence = f"no single order: local slopes run {levels.slopes} over {levels.span()}"
        return levels.without_order(sentence, misfit=posterior.misfit)
    used = (np.arange(len(h)) >= first) & (np.arange(len(h)) < last)
    return _of_used(levels, used, posterior, predicted_floor)


@dataclass(frozen=True)
class _Levels:
    """Sizes and errors from coarse to fine, the slopes between them, and what a verdict calls them."""

    h: np.ndarray
    e: np.ndarray
    local: np.ndarray
    names: list[str]
    label_unit: str
    error_unit: str

    @property
    def slopes(self) -> str:
        return ", ".join(f"{slope:.2f}" for slope in self.local)

    def span(self, chosen: np.ndarray | slice = np.s_[:]) -> str:
        """``8..64 cells`` of all levels, or of those that a mask or a slice chooses."""
        names = np.array(self.names)[chosen]
        return f"{names[0] if len(names) == 1 else f'{names[0]}..{names[-1]}'} {self.label_unit}"

    def without_order(self, verdict: str, **known: Any) -> OrderEstimate:
        """An estimate that states no order, but what is known."""
        none, nan = np.zeros(len(self.h), bool), float("nan")
        blank = OrderEstimate(
            nan, nan, nan, 0.0, nan, np.zeros(len(self.h)), none, none, self.local, nan, verdict
        )
        return replace(blank, **known)


def _of_used(
    levels: _Levels, used: np.ndarray, posterior: Posterior, predicted_floor: float | None
) -> OrderEstimate:
    """The estimate from the levels that the model explains."""
    h, e = levels.h, levels.e
    order_weight = posterior.weight.sum(axis=(0, 2))
    low, high = shortest_interval(ORDERS, order_weight)
    probability = float(posterior.weight[1:].sum())
    floor = predicted = 0.0
    if probability > 0.5 and used.sum() >= FLOOR_LEVELS:
        floor = float((posterior.weight * posterior.floor).sum() / probability)
    if predicted_floor and predicted_floor > 0.5 * e[used][-1]:
        predicted = predicted_floor
    share = np.where(used, np.minimum((floor or predicted) / e, 1.0), 0.0)
    clear = used & (share < 0.5)
    if floor > 0 and clear.sum() < 2:  # one level above the floor has no slope
        return levels.without_order(
            f"no order: at {levels.span(used & (share >= 0.5))} the errors level off near "
            f"{floor:.2g} {levels.error_unit}; local slopes {levels.slopes}",
            floor=floor,
            floor_probability=probability,
            floor_share=share,
            misfit=posterior.misfit,
        )
    early = pre_asymptotic(h, posterior.weight.sum(axis=(0, 1)), used)
    if early[used].all():  # the order is an extrapolation: the interval keeps the slopes seen
        low, high = min(low, float(levels.local.min())), max(high, float(levels.local.max()))
    order = most_probable(ORDERS, order_weight)
    if len(h) == 3:  # the mode would extrapolate one difference of slopes, the plain slope does not
        plain = fitted_order(h[clear], e[clear]) if clear.sum() > 1 else fitted_order(h, e)
        order = plain if low <= plain <= high else order
    order = min(max(order, low), high)
    found = OrderEstimate(
        order, low, high, floor, probability, share, used, early, levels.local, posterior.misfit
    )
    return replace(found, verdict=_sentence(found, levels, predicted_floor))


def _sentence(found: OrderEstimate, levels: _Levels, predicted_floor: float | None) -> str:
    """The verdict: order and range, floor and cause, pre-asymptotic levels, levels that no single order explains."""
    used, unit = np.flatnonzero(found.used), levels.error_unit
    limited = found.used & (found.floor_share >= 0.5)
    clear = used[~limited[used]] if not limited[used].all() else used[:1]
    parts = [f"p = {order_with_interval(found)} over {levels.span(clear)}"]
    if found.floor > 0:
        cause = "the errors level off"
        if predicted_floor and 0.5 < found.floor / predicted_floor < 2.0:
            cause = f"the time step limits (predicted {predicted_floor:.2g} {unit})"
        parts.append(f"below {found.floor:.2g} {unit} {cause}")
    elif found.floor_share.any():
        parts.append(
            f"at {levels.span(limited)} most of the error is that of the time step "
            f"(predicted {predicted_floor:.2g} {unit})"
        )
    if found.pre_asymptotic.all():
        parts.append(f"pre-asymptotic throughout: local slopes {levels.slopes}")
    elif found.pre_asymptotic.any():
        parts.append(f"pre-asymptotic at {levels.span(found.pre_asymptotic)}")
    if used[-1] + 1 < len(levels.h):
        beyond = np.s_[used[-1] + 1 :]
        parts.append(f"at {levels.span(beyond)} the errors leave this line")
    if len(used) < 4:
        parts.append(f"{len(used)} levels cannot exclude a floor")
    return "; ".join(parts)


def order_with_interval(found: OrderEstimate) -> str:
    """``2.98 ± 0.04``, or ``2.00 (1.74 to 2.59)`` when the interval is lopsided, or the bare slope of two levels."""
    if not np.isfinite(found.order):
        return "none"
    if not np.isfinite(found.half_width):
        return f"{found.order:.2f}"
    if found.high - found.low > WIDEST_INTERVAL:
        return f"{found.low:.2f} to {found.high:.2f}"
    below, above = found.order - found.low, found.high - found.order
    if max(below, above) <= 1.3 * min(below, above) + 0.01:
        return f"{found.order:.2f} ± {max(below, above, 0.01):.2f}"
    return f"{found.order:.2f} ({found.low:.2f} to {found.high:.2f})"


def _checked(
    sizes: Sequence[float] | np.ndarray, errors: Sequence[float] | np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Sizes and errors as arrays from coarse to fine."""
    h, e = np.asarray(sizes, float), np.asarray(errors, float)
    if h.ndim != 1 or h.shape != e.shape:
        raise ValueError(
            f"sizes and errors need the same length, given shapes {h.shape} and {e.shape}"
        )
    if not (np.all(np.isfinite(h)) and np.all(np.isfinite(e)) and np.all(h > 0) and np.all(e > 0)):
        raise ValueError("sizes and errors need to be positive and finite")
    if len(np.unique(h)) != len(h):
        raise ValueError("each size may occur once")
    coarse_first = np.argsort(-h)
    return h[coarse_first], e[coarse_first]
