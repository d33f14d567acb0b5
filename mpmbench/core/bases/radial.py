"""Weights by distance that max-ent priors and the kernel of SPH have in common.

Each takes the square of the distance t, in units in which the support ends at t = 1, and returns
its value and its slope over the distance, ``w'(t) / t``, which is finite at t = 0.
"""

import math

from mpmbench.core.compiled import inlined

CUBIC_SPLINE, QUARTIC_SPLINE, GAUSSIAN = 0, 1, 2
WEIGHTS = {"cubic_spline": CUBIC_SPLINE, "quartic_spline": QUARTIC_SPLINE, "gaussian": GAUSSIAN}


@inlined
def cubic_spline(square):
    """The cubic spline with w(0) = 2/3 (Wobbes 2020, Eq. 89); for t <= 1."""
    t = math.sqrt(square)
    rest = 1.0 - t
    inner = t <= 0.5
    value = 2.0 / 3.0 - 4.0 * square * rest if inner else 4.0 / 3.0 * rest * rest * rest
    slope = 12.0 * t - 8.0 if inner else -4.0 * rest * rest / max(t, 0.5)
    return value, slope


@inlined
def quartic_spline(square):
    """The quartic spline with w(0) = 1 (Wobbes 2020, Eq. 90); for t <= 1."""
    t = math.sqrt(square)
    return 1.0 - square * (6.0 - 8.0 * t + 3.0 * square), -12.0 * (1.0 - t) * (1.0 - t)
