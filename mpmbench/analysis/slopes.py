"""What the errors of a sequence of sizes show by themselves: slopes, and whether they still fall.

Nothing is extrapolated here. The least-squares slope over all levels is a weighted mean of the
slopes between neighbouring levels, so that it always lies within them.
"""

from collections.abc import Sequence

import numpy as np

Numbers = Sequence[float] | np.ndarray
# Errors below this many times the scale of their field are rounding: positions and stresses of
# order one, added to in up to some ten thousand steps.
ROUND_OFF = 1e4 * float(np.finfo(float).eps)
LEAST_SLOPE = 0.1  # errors that change less than this over all levels do not depend on h
LEVELS_OFF = 0.5  # share of the slope before, below which the last slopes converge no longer

CONVERGES, STAYS, UNEVEN = "converges", "stays", "uneven"
OFF, RISES, ROUNDING, UNKNOWN = "levels off", "rises", "round-off", "none"


def fitted_order(sizes: Numbers, errors: Numbers) -> float:
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
    h, e = coarse_first(sizes, errors)
    if len(h) < 2:
        raise ValueError(f"an order needs at least 2 levels, given {len(h)}")
    return float(np.polyfit(np.log(h), np.log(e), 1)[0])


def local_orders(sizes: Numbers, errors: Numbers) -> np.ndarray:
    """Slopes between neighbouring levels in log-log, from coarse to fine, shape (L - 1,)."""
    h, e = coarse_first(sizes, errors)
    return np.diff(np.log(e)) / np.diff(np.log(h))


def course_of(h: np.ndarray, e: np.ndarray) -> tuple[str, int]:
    """How a curve ends, and how many of its last slopes show it.

    Returns
    -------
    course : str
        ``converges``; ``levels off`` when the last slope, or the last two together, are less than
        `LEVELS_OFF` of the slope before them; ``rises`` when these are negative; ``stays`` when
        the errors do not depend on h; ``uneven`` when they rise in between; ``none`` for fewer
        than two levels.
    last : int
        1 or 2.
    """
    if len(h) < 2:
        return UNKNOWN, 1
    local = local_orders(h, e)
    small = abs(np.log(e[0] / e[-1])) < LEAST_SLOPE * np.log(h[0] / h[-1])
    if small and e.max() < 1.5 * e.min():
        return STAYS, 1
    ends = [1] if len(local) < 3 else [1, 2]
    after = {last: fitted_order(h[-last - 1 :], e[-last - 1 :]) for last in ends}
    for last in ends:
        if after[last] < -LEAST_SLOPE:
            return RISES, last
    for last in ends if len(local) > 1 else ():
        if after[last] < LEVELS_OFF * fitted_order(h[:-last], e[:-last]):
            return OFF, last
    return (UNEVEN if (local[1:] < -LEAST_SLOPE).any() else CONVERGES), 1


def coarse_first(sizes: Numbers, errors: Numbers) -> tuple[np.ndarray, np.ndarray]:
    """Sizes and errors as arrays from coarse to fine; refuses what has no logarithm."""
    h, e = np.asarray(sizes, float), np.asarray(errors, float)
    if h.ndim != 1 or h.shape != e.shape:
        raise ValueError(
            f"sizes and errors need the same length, given shapes {h.shape} and {e.shape}"
        )
    if not (np.all(np.isfinite(h)) and np.all(np.isfinite(e)) and np.all(h > 0) and np.all(e > 0)):
        raise ValueError("sizes and errors need to be positive and finite")
    if len(np.unique(h)) != len(h):
        raise ValueError("each size may occur once")
    order = np.argsort(-h)
    return h[order], e[order]
