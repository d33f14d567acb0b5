"""Orders of convergence with an interval, from the errors of one method on a sequence of sizes.

The model is ``e(h) = C h^p (1 + a h) + floor``: a leading term, its first correction (the
pre-asymptotic drift) and what does not shrink with h (time step, quadrature, grid crossing). Root
mean squares of error fields that have nothing to do with each other add in squares instead: ``e^2 =
(C h^p (1 + a h))^2 + floor^2``; both are considered. Runs are deterministic, so the interval is not
a sampling error: it holds the orders p that explain the local slopes up to a few percent, whatever
drift and floor.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import ndtr

INTERVAL_MEANING = (
    "Runs are deterministic: the interval is no sampling error. It holds 95 % of the orders p for which "
    "C h^p (1 + a h) + floor, or the root of the sum of their squares, explains the errors, so it states the spread of "
    "the local slopes and what an asymptotic drift (a) and a floor may still hide; few levels or an early floor make "
    "it wide."
)

# The model's prior, written down so that it can be judged. |a h| at the coarsest level, and the
# deviation of an error from the model (relative; 2 % is typical of smooth problems) with its
# weight.
LARGEST_DRIFT = 0.6
DEVIATIONS = (0.005, 0.01, 0.02, 0.04, 0.08)
DEVIATION_WEIGHTS = (0.07, 0.23, 0.50, 0.15, 0.05)
FLOOR_WEIGHTS = (
    1 / 2,
    1 / 3,
    1 / 6,
)  # of no floor, one that adds to the error, one that adds in squares
ORDERS = np.arange(0.0, 6.001, 0.04)
DRIFTS = np.linspace(-LARGEST_DRIFT, LARGEST_DRIFT, 17)
ACCEPTED_MISFIT = (
    0.12  # RMS relative misfit beyond which no single order is stated for a range of levels
)
FLOOR_LEVELS = 4  # fewer levels cannot tell a floor from a drift
LEAST_SLOPE = 0.1  # errors that change less than this over all levels do not depend on h
WIDEST_INTERVAL = 2.0  # beyond this length no value is named within the interval
SMALLEST_WINDOW = 4  # a part of the levels counts only when it could have contradicted the model


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


@dataclass(frozen=True)
class _Posterior:
    """Weights and floors, both by kind of floor (none, one that adds, one that adds in squares), order and drift.

    Their shape is (3, P, A); `misfit` is the RMS relative misfit of the best model.
    """

    weight: np.ndarray
    floor: np.ndarray
    misfit: float


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


def local_orders(
    sizes: Sequence[float] | np.ndarray, errors: Sequence[float] | np.ndarray
) -> np.ndarray:
    """Slopes between neighbouring levels in log-log, from coarse to fine, shape (L - 1,)."""
    h, e = _checked(sizes, errors)
    return np.diff(np.log(e)) / np.diff(np.log(h))


def estimate_order(
    sizes: Sequence[float] | np.ndarray,
    errors: Sequence[float] | np.ndarray,
    labels: Sequence[object] | None = None,
    label_unit: str = "cells",
    error_unit: str = "m",
    predicted_floor: float | None = None,
) -> OrderEstimate:
    """Order of convergence with a 95 % interval, floor, pre-asymptotic levels and a verdict sentence.

    The model is linear in C and in the floor for given p and a, so their posterior is a sum over a
    grid of p and a with the rest integrated in closed form. When the model misses by more than
    `ACCEPTED_MISFIT`, the longest run of neighbouring levels that it explains is used, and the
    verdict says what was left out.

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
    count, local = len(h), np.diff(np.log(e)) / np.diff(np.log(h))
    if count < 2:
        return _without_interval(
            count, local, "no order: one level only" if count else "no order: no finished run"
        )
    if count == 2:
        where = f"between {names[0]} and {names[1]} {label_unit}"
        sentence = f"slope {local[0]:.2f} {where}; two levels give no interval"
        return replace(
            _without_interval(2, local, sentence), order=float(local[0]), used=np.ones(2, bool)
        )
    if abs(np.log(e[0] / e[-1])) < LEAST_SLOPE * np.log(h[0] / h[-1]) and e.max() < 1.5 * e.min():
        stay = f"the errors stay at {e.min():.3g}..{e.max():.3g} {error_unit}"
        unchanged = _without_interval(
            count, local, f"no order: over {_span(names)} {label_unit} {stay}"
        )
        return replace(unchanged, floor=float(e.min()), floor_share=e.min() / e)

    first, last, posterior = _longest_explained(h, e)
    if posterior.misfit > ACCEPTED_MISFIT:
        sentence = (
            f"no single order: local slopes run {_slopes(local)} over {_span(names)} {label_unit}"
        )
        return replace(_without_interval(count, local, sentence), misfit=posterior.misfit)
    used = (np.arange(count) >= first) & (np.arange(count) < last)
    order_weight = posterior.weight.sum(axis=(0, 2))
    low, high = _shortest_interval(ORDERS, order_weight)
    probability = float(posterior.weight[1:].sum())
    floor = 0.0
    if probability > 0.5 and last - first >= FLOOR_LEVELS:
        floor = float((posterior.weight * posterior.floor).sum() / probability)
    limit = floor or (
        predicted_floor if predicted_floor and predicted_floor > 0.5 * e[last - 1] else 0.0
    )
    share = np.where(used, np.minimum(limit / e, 1.0), 0.0)
    if floor > 0 and (used & (share < 0.5)).sum() < 2:  # one level above the floor has no slope
        where = (
            f"at {_span([names[k] for k in np.flatnonzero(used & (share >= 0.5))])} {label_unit}"
        )
        sentence = (
            f"no order: {where} the errors level off near {floor:.2g} {error_unit}; "
            f"local slopes {_slopes(local)}"
        )
        none = _without_interval(count, local, sentence)
        return replace(
            none,
            floor=floor,
            floor_probability=probability,
            floor_share=share,
            misfit=posterior.misfit,
        )
    early = _pre_asymptotic(h, posterior.weight.sum(axis=(0, 1)), first, used)
    if (
        early[used].all()
    ):  # the order is an extrapolation then: the slopes that were seen stay inside the interval
        low, high = min(low, float(local.min())), max(high, float(local.max()))
    order = _most_probable(ORDERS, order_weight)
    if (
        count == 3
    ):  # the mode would extrapolate one difference of slopes: the plain slope says what was seen
        clear = used & (share < 0.5)
        plain = fitted_order(h[clear], e[clear]) if clear.sum() > 1 else fitted_order(h, e)
        order = plain if low <= plain <= high else order
    order = min(max(order, low), high)
    found = OrderEstimate(
        order, low, high, floor, probability, share, used, early, local, posterior.misfit
    )
    return replace(found, verdict=_sentence(found, names, label_unit, error_unit, predicted_floor))


def _without_interval(levels: int, local: np.ndarray, verdict: str) -> OrderEstimate:
    """An estimate that states no order."""
    none = np.zeros(levels, bool)
    nan = float("nan")
    return OrderEstimate(nan, nan, nan, 0.0, nan, np.zeros(levels), none, none, local, nan, verdict)


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


def _posterior(h: np.ndarray, e: np.ndarray, smallest: float) -> _Posterior:
    """Posterior of order and drift, without a floor, with one that adds up and with one that adds in squares.

    Prior: log C flat; no floor or a floor f, even odds; f / smallest (or its square) flat on
    0..1.05; p flat with soft ends below 0.9 and above 4.5 (a slow order and an early floor look
    alike); a flat. No error on a finer level, used or not, lies below a floor: `smallest` is the
    least of them.
    """
    s = (h / h.max())[:, None, None]
    e = e[:, None, None]
    term = s ** ORDERS[:, None] * (1.0 + DRIFTS * s) / e
    soft_ends = np.minimum((ORDERS - 0.9) / 0.15, 0.0) + np.minimum((4.5 - ORDERS) / 0.3, 0.0)
    (without, added, share, misfit), (_, in_squares, square, other_misfit) = (
        _fits(term**power, (smallest / e) ** power, power) for power in (1, 2)
    )
    log_weight = np.stack([without, added, in_squares]) + soft_ends[:, None]
    log_weight += np.log(FLOOR_WEIGHTS)[:, None, None, None]
    weight = np.exp(log_weight - log_weight.max()).sum(axis=1)
    floors = smallest * np.stack([np.zeros_like(share), share, np.sqrt(square)])
    return _Posterior(weight / weight.sum(), floors, min(misfit, other_misfit))


def _fits(
    term: np.ndarray, constant: np.ndarray, power: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Log evidence without and with a floor, both (D, P, A) for all deviations, the floors and the least RMS misfit.

    Levels are the first axis of `term`, shape (L, P, A), and `constant`, shape (L, 1, 1). The
    relative deviations r_k = c term_k + f constant_k - 1 have the standard deviation ``power * s``:
    this is linear least squares in (c, f), which are integrated out. With ``power`` 2 all of them
    are squares of errors.
    """
    count = len(term)
    gg, gf, ff = (term**2).sum(0), (term * constant).sum(0), (constant**2).sum(0)
    g1, f1 = term.sum(0), constant.sum(0)
    only = g1 / gg
    misfit_only = np.maximum(count - only * g1, 0.0)
    determinant = np.maximum(gg * ff - gf**2, 1e-12 * gg * ff)
    leading = (ff * g1 - gf * f1) / determinant
    share = (gg * f1 - gf * g1) / determinant
    misfit = np.maximum(count - leading * g1 - share * f1, 0.0)

    most = 1.05**power
    positive = leading > 0
    own = np.array(DEVIATIONS)[:, None, None]
    deviation, width = power * own, np.sqrt(2.0 * np.pi) * own
    common = np.log(DEVIATION_WEIGHTS)[:, None, None] - count * np.log(own)
    without = common - 0.5 * misfit_only / deviation**2 + np.log(width) - np.log(np.sqrt(gg) * only)
    spread = deviation * np.sqrt(gg / determinant)
    inside = np.maximum(ndtr((most - share) / spread) - ndtr(-share / spread), 1e-300)
    volume = np.log(np.sqrt(determinant) * np.where(positive, leading, 1.0))
    with_floor = (
        common - 0.5 * misfit / deviation**2 + np.log(width**2 * power * inside / most) - volume
    )
    with_floor = np.where(positive, with_floor, -np.inf)
    admissible = np.where((share > 0) & (share < most) & positive, misfit, np.inf)
    least = np.sqrt(min(misfit_only.min(), admissible.min()) / count) / power
    return without, with_floor, np.clip(share, 0.0, most), float(least)


def _longest_explained(h: np.ndarray, e: np.ndarray) -> tuple[int, int, _Posterior]:
    """First and one past the last level of the longest range that the model explains, and its posterior."""
    count = len(h)
    whole = _posterior(h, e, e.min())
    if whole.misfit <= ACCEPTED_MISFIT:
        return 0, count, whole
    for length in range(count - 1, SMALLEST_WINDOW - 1, -1):
        tried = [
            (k, k + length, _posterior(h[k : k + length], e[k : k + length], e[k:].min()))
            for k in range(count - length + 1)
        ]
        best = min(tried, key=lambda window: window[2].misfit)
        if best[2].misfit <= ACCEPTED_MISFIT:
            return best
    return 0, count, whole


def _shortest_interval(
    values: np.ndarray, weight: np.ndarray, mass: float = 0.95
) -> tuple[float, float]:
    """Shortest interval with the given posterior mass; values are centres of equal bins."""
    half = 0.5 * (values[1] - values[0])
    edges = np.append(values - half, values[-1] + half)
    cumulative = np.append(0.0, np.cumsum(weight)) / weight.sum()
    below = np.linspace(0.0, 1.0 - mass, 51)
    low, high = np.interp(below, cumulative, edges), np.interp(below + mass, cumulative, edges)
    k = int(np.argmin(high - low))
    return float(low[k]), float(high[k])


def _most_probable(values: np.ndarray, weight: np.ndarray) -> float:
    """Mode of a density on equal bins, by a parabola through the logarithms around the largest."""
    k = int(np.argmax(weight))
    if k in (0, len(values) - 1) or min(weight[k - 1], weight[k + 1]) <= 0:
        return float(values[k])
    left, middle, right = np.log(weight[k - 1 : k + 2])
    curvature = left - 2.0 * middle + right
    shift = 0.5 * (left - right) / curvature if curvature < 0 else 0.0
    return float(values[k] + shift * (values[1] - values[0]))


def _pre_asymptotic(
    h: np.ndarray, drift_weight: np.ndarray, first: int, used: np.ndarray
) -> np.ndarray:
    """Levels before the used range, and used levels whose slope differs from p by more than 0.1 beyond doubt."""
    early = np.arange(len(h)) < first
    positive = drift_weight[DRIFTS > 0].sum()
    if max(positive, 1.0 - positive) < 0.95:
        return early
    s = (h / h[first])[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        change = np.where(used, (DRIFTS * s / (1.0 + DRIFTS * s) * drift_weight).sum(-1), 0.0)
    return early | (np.abs(change) > 0.1)


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


def _span(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{names[0]}..{names[-1]}"


def _slopes(local: np.ndarray) -> str:
    return ", ".join(f"{slope:.2f}" for slope in local)


def _sentence(
    found: OrderEstimate,
    names: list[str],
    label_unit: str,
    error_unit: str,
    predicted_floor: float | None,
) -> str:
    """The verdict: order and range, floor and cause, pre-asymptotic levels, levels that no single order explains."""
    used = np.flatnonzero(found.used)
    clear = [names[k] for k in used if found.floor_share[k] < 0.5] or [names[used[0]]]
    parts = [f"p = {order_with_interval(found)} over {_span(clear)} {label_unit}"]
    if found.floor > 0:
        cause = "the errors level off"
        if predicted_floor and 0.5 < found.floor / predicted_floor < 2.0:
            cause = f"the time step limits (predicted {predicted_floor:.2g} {error_unit})"
        parts.append(f"below {found.floor:.2g} {error_unit} {cause}")
    elif found.floor_share.any():
        limited = _span([names[k] for k in used if found.floor_share[k] >= 0.5])
        predicted = f"(predicted {predicted_floor:.2g} {error_unit})"
        parts.append(
            f"at {limited} {label_unit} most of the error is that of the time step {predicted}"
        )
    early = [names[k] for k in np.flatnonzero(found.pre_asymptotic)]
    if len(early) == len(names):
        parts.append(f"pre-asymptotic throughout: local slopes {_slopes(found.local)}")
    elif early:
        parts.append(f"pre-asymptotic at {_span(early)} {label_unit}")
    beyond = names[used[-1] + 1 :]
    if beyond:
        parts.append(f"at {_span(beyond)} {label_unit} the errors leave this line")
    if len(used) < 4:
        parts.append(f"{len(used)} levels cannot exclude a floor")
    return "; ".join(parts)
