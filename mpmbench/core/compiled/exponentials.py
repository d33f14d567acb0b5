"""Exponentials and logarithms for loops that the compiler is to turn into vector instructions."""

import math
from typing import Any

from llvmlite import ir
from numba import types

from mpmbench.core.compiled import generated, inlined

LANES = 8  # numbers that a vector instruction takes at most: arrays are padded to a multiple
LOG2E = 1.0 / math.log(2.0)
LN2_HIGH, LN2_LOW = 0.6931471803691238, 1.9082149292705877e-10  # the first with short digits
TO_INTEGER = 6755399441055744.0  # 1.5 * 2^52: adding it rounds, and leaves n in the low bits
TERMS = tuple(1.0 / math.factorial(k) for k in range(14))
ODD = tuple(2.0 / (2 * k + 1) for k in range(11))
SQRT_HALF = 0x3FE6A09E667F3BCD  # bits of the double sqrt(1/2)
TWO_52 = 0x4330000000000000  # bits of 2^52, whose low bits are a whole number
FRACTION = 0xFFFFFFFFFFFFF  # the bits behind the exponent


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


def _cast(source: Any, result: Any) -> Any:
    """The number with the same bits."""

    def cast(typingctx, number):
        def generate(context, builder, signature, arguments):
            return builder.bitcast(arguments[0], context.get_value_type(result))

        return result(source), generate

    return generated(cast)


bits_of, number_of = _cast(types.float64, types.int64), _cast(types.int64, types.float64)


@inlined
def logarithm(x):
    """``ln x`` to three units in the last place, NaN where x is not positive.

    x = 2^n m with m between sqrt(1/2) and sqrt(2), and ln m = 2 artanh((m - 1) / (m + 1)) by its
    series, without branches. Numbers below 1e-300 are not told from it.
    """
    bits = bits_of(x) - SQRT_HALF
    n = number_of((bits >> 52) + 1024 + TWO_52) - (2.0**52 + 1024.0)
    m = number_of((bits & FRACTION) + SQRT_HALF)
    s = (m - 1.0) / (m + 1.0)
    z = s * s
    q = z * z
    a = (ODD[1] + z * ODD[2]) + q * (ODD[3] + z * ODD[4])
    b = (ODD[5] + z * ODD[6]) + q * (ODD[7] + z * ODD[8])
    c = ODD[9] + z * ODD[10]
    series = z * (a + (q * q) * (b + (q * q) * c))
    result = n * LN2_HIGH + (n * LN2_LOW + s * (2.0 + series))
    return result if x > 0.0 else math.nan
