"""Which orders of convergence explain some errors: the posterior of order, drift and floor.

The model is ``e(h) = C h^p (1 + a h) + floor``: a leading term, its first correction (the
pre-asymptotic drift) and what does not shrink with h (time step, quadrature, grid crossing). Root
mean squares of error fields that have nothing to do with each other add in squares instead: ``e^2 =
(C h^p (1 + a h))^2 + floor^2``; both are considered. It is linear in C and in the floor for given p
and a, so the posterior is a sum over a grid of p and a with the rest integrated in closed form.
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

# The model's prior, written down so that it can be judged. |a h| at the coarsest level, and the
# deviation of an error from the model (relative; 2 % is typical of smooth problems) with its
# weight.
LARGEST_DRIFT = 0.6
DEVIATIONS = (0.005, 0.01, 0.02, 0.04, 0.08)
DEVIATION_WEIGHTS = (0.07, 0.23, 0.50, 0.15, 0.05)
# Of no floor, one that adds to the error, one that adds in squares.
FLOOR_WEIGHTS = (1 / 2, 1 / 3, 1 / 6)
ORDERS = np.arange(0.0, 6.001, 0.04)
DRIFTS = np.linspace(-LARGEST_DRIFT, LARGEST_DRIFT, 17)
# RMS relative misfit beyond which no single order is stated for a range of levels.
ACCEPTED_MISFIT = 0.12
SMALLEST_WINDOW = 4  # a part of the levels counts only when it could have contradicted the model


@dataclass(frozen=True)
class Posterior:
    """Weights and floors, both by kind of floor (none, one that adds, one that adds in squares), order and drift.

    Their shape is (3, P, A); `misfit` is the RMS relative misfit of the best model.
    """

    weight: np.ndarray
    floor: np.ndarray
    misfit: float


def longest_explained(h: np.ndarray, e: np.ndarray) -> tuple[int, int, Posterior]:
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


def _posterior(h: np.ndarray, e: np.ndarray, smallest: float) -> Posterior:
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
    return Posterior(weight / weight.sum(), floors, min(misfit, other_misfit))


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


def shortest_interval(
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


def most_probable(values: np.ndarray, weight: np.ndarray) -> float:
    """Mode of a density on equal bins, by a parabola through the logarithms around the largest."""
    k = int(np.argmax(weight))
    if k in (0, len(values) - 1) or min(weight[k - 1], weight[k + 1]) <= 0:
        return float(values[k])
    left, middle, right = np.log(weight[k - 1 : k + 2])
    curvature = left - 2.0 * middle + right
    shift = 0.5 * (left - right) / curvature if curvature < 0 else 0.0
    return float(values[k] + shift * (values[1] - values[0]))


def pre_asymptotic(h: np.ndarray, drift_weight: np.ndarray, used: np.ndarray) -> np.ndarray:
    """Levels before the used range, and used levels whose slope differs from p by more than 0.1 beyond doubt."""
    first = int(np.argmax(used))
    early = np.arange(len(h)) < first
    positive = drift_weight[DRIFTS > 0].sum()
    if max(positive, 1.0 - positive) < 0.95:
        return early
    s = (h / h[first])[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        change = np.where(used, (DRIFTS * s / (1.0 + DRIFTS * s) * drift_weight).sum(-1), 0.0)
    return early | (np.abs(change) > 0.1)
