"""Exponentials for loops without reference counts; see `lean` in `mpmbench.core.compiled`."""

import math

import numpy as np

from mpmbench.core.compiled import inlined

LANES = 8  # numbers that a vector instruction takes at most: arrays are padded to a multiple
LOG2E = 1.0 / math.log(2.0)
LN2_HIGH, LN2_LOW = 0.6931471803691238, 1.9082149292705877e-10  # the first with short digits
TO_INTEGER = 6755399441055744.0  # 1.5 * 2^52: adding it rounds, and leaves n in the low bits
BIAS = np.int64(1023 << 52)  # exponent of the double 1.0
TERMS = tuple(1.0 / math.factorial(k) for k in range(14))


@inlined
def whole_lanes(count):
    """Least multiple of LANES that is not less than `count`."""
    return (count + LANES - 1) // LANES * LANES


@inlined
def exponentiate(values, count):
    """Replace ``values[:count]`` by their exponentials, to the last bit or two.

    exp(x) = 2^n exp(r) with n the integer nearest to x / ln 2 and a Taylor polynomial of degree 13
    in |r| <= 0.35, without branches, so that the compiler makes vector instructions of it. Values
    beyond -708..708 are taken as the nearest end; NaN stays NaN.
    """
    bits = values.view(np.int64)
    for k in range(count):
        x = min(max(values[k], -708.0), 708.0)
        shifted = x * LOG2E + TO_INTEGER
        n = shifted - TO_INTEGER
        r = x - n * LN2_HIGH
        r = r - n * LN2_LOW
        s = r * r
        q = s * s
        # terms in pairs: a shorter chain of dependent operations than Horner's
        a = (1.0 + r) + s * (TERMS[2] + r * TERMS[3])
        b = (TERMS[4] + r * TERMS[5]) + s * (TERMS[6] + r * TERMS[7])
        c = (TERMS[8] + r * TERMS[9]) + s * (TERMS[10] + r * TERMS[11])
        d = TERMS[12] + r * TERMS[13]
        p = (a + q * b) + (q * q) * (c + q * d)
        values[k] = shifted
        bits[k] = (bits[k] << 52) + BIAS  # 2^n
        values[k] = p * values[k]


@inlined
def exponentials(axes, multiplier, dx, shift, values, count):
    """``values[k] = exp(-sum_d multiplier[d] dx[d, k] - shift)`` for ``k < count``."""
    for k in range(count):
        values[k] = -shift
    for d in range(len(axes)):
        for k in range(count):
            values[k] -= multiplier[d] * dx[d, k]
    exponentiate(values, count)
