"""Priors of the nodes around a point, and what else defines its maximum-entropy functions."""

import math
from typing import NamedTuple

from mpmbench.core.bases.radial import (
    CUBIC_SPLINE,
    GAUSSIAN,
    QUARTIC_SPLINE,
    cubic_spline,
    quartic_spline,
)
from mpmbench.core.compiled import inlined
from mpmbench.core.compiled.exponentials import exponential, whole_lanes

CUT_GAUSSIAN = 3  # does not vanish at the rim of its support


class Formulation(NamedTuple):
    """Which functions they are, and how exactly their multipliers are found."""

    axes: tuple[float, ...]  # one entry per dimension (values unused)
    prior: int  # CUBIC_SPLINE, QUARTIC_SPLINE, GAUSSIAN or CUT_GAUSSIAN
    rim_exponent: float  # a Gaussian has fallen to exp(-rim_exponent) at the rim of its support
    spacing: float  # nodal spacing h as a fraction of the radius of a support
    tolerance: float  # largest residual ``|sum_i phi_i dx_i| / h``
    line_search: bool = True  # shorten steps that do not lessen log Z, which Li (2009) does not
    most_steps: int = 100  # Newton's iteration has failed after these


@inlined
def weigh(form, found, growth, work):
    """Priors w_i and their slopes g_i at distance r = |dx_i| / d_i (Wobbes 2020, Eqs. 87-90).

    The support of a Gaussian is larger by `growth` than the one that ``rim_exponent`` refers to.
    """
    w, g, rr, inverse_square = work.w, work.g, work.rr, work.inverse_square
    a = form.rim_exponent * growth**2
    padded = whole_lanes(found)
    if form.prior == CUBIC_SPLINE:
        for k in range(padded):
            w[k], slope = cubic_spline(rr[k])
            g[k] = inverse_square[k] * slope
    elif form.prior == QUARTIC_SPLINE:
        for k in range(padded):
            w[k], slope = quartic_spline(rr[k])
            g[k] = inverse_square[k] * slope
    elif form.prior == GAUSSIAN:  # less its tangent at the rim in r^2: value and slope vanish there
        rim = math.exp(-a)
        for k in range(padded):
            bell = exponential(-a * rr[k])
            w[k] = bell - rim * (1.0 + a * (1.0 - rr[k]))
            g[k] = -2.0 * a * inverse_square[k] * (bell - rim)
    else:
        nearest = rr[0]
        for k in range(found):
            nearest = min(nearest, rr[k])
        for k in range(padded):
            w[k] = exponential(a * (nearest - rr[k]))  # only ratios count: the largest is 1
            g[k] = 0.0  # what the slope of a whole Gaussian adds, lambda takes away
    for k in range(found, padded):
        w[k] = g[k] = 0.0
