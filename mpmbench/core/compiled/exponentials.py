"""Exponentials for loops that the compiler is to turn into vector instructions."""

import math

from llvmlite import ir
from numba import types

from mpmbench.core.compiled import generated, inlined

LANES = 8  # numbers that a vector instruction takes at most: arrays are padded to a multiple
LOG2E = 1.0 / math.log(2.0)
LN2_HIGH, LN2_LOW = 0.6931471803691238, 1.9082149292705877e-10  # the first with short digits
TO_INTEGER = 6755399441055744.0  # 1.5 * 2^52: adding it rounds, and leaves n in the low bits
TERMS = tuple(1.0 / math.factorial(k) for k in range(14))


@inlined
def whole_lanes(count):
    """Least multiple of LANES that is not less than `count`."""
    return (count + LANES - 1) // LANES * LANES


@generated
def power_of_two(typingctx, shifted):
    """``2^n`` from ``n + TO_INTEGER``, by bits: n becomes the exponent of a double."""

    def generate(context, builder, signature, arguments):
        word = ir.IntType(64)
        exponent = builder.shl(builder.bitcast(arguments[0], word), ir.Constant(word, 52))
        bias = ir.Constant(word, 1023 << 52)  # the bits of 1.0
        return builder.bitcast(builder.add(exponent, bias), ir.DoubleType())

    return types.float64(types.float64), generate


@inlined
def exponential(x):
    """``exp(x)`` to the last bit or two.

    exp(x) = 2^n exp(r) with n the integer nearest to x / ln 2 and a Taylor polynomial of degree 13
    in |r| <= 0.35, without branches. Values beyond -708..708 are taken as the nearest end; NaN
    stays NaN.
    """
    x = min(max(x, -708.0), 708.0)
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
    return ((a + q * b) + (q * q) * (c + q * d)) * power_of_two(shifted)


@inlined
def exponentials(axes, multiplier, dx, shift, values, count):
    """``values[k] = exp(-sum_d multiplier[d] dx[d, k] - shift)`` for ``k < count``."""
    for k in range(count):
        exponent = -shift
        for d in range(len(axes)):
            exponent -= multiplier[d] * dx[d, k]
        values[k] = exponential(exponent)
