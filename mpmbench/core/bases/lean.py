"""Vector exponentials for loops without reference counts; see `lean` in `mpmbench.core.compiled`."""

import math

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.np.arrayobj import make_array

from mpmbench.core.compiled import generated, lean, matrix, vector

__all__ = ["LANES", "exponentials", "exponentiate", "generated", "lean", "matrix", "vector"]

LANES = 8  # exponentials computed at once


def _real(value):  # type: ignore[no-untyped-def]
    return ir.Constant(ir.VectorType(ir.DoubleType(), LANES), [value] * LANES)


def _lanes(context, builder, array, indices):  # type: ignore[no-untyped-def]
    """Pointer to the LANES numbers of a C-ordered array that begin at the given indices."""
    place = builder.mul(indices[0], cgutils.unpack_tuple(builder, array.strides)[0])
    data = builder.bitcast(array.data, ir.IntType(8).as_pointer())
    if len(indices) == 2:
        place = builder.add(place, builder.mul(indices[1], context.get_constant(types.intp, 8)))
    return builder.bitcast(
        builder.gep(data, [place]), ir.VectorType(ir.DoubleType(), LANES).as_pointer()
    )


def _multiply_add(builder, a, b, c):  # type: ignore[no-untyped-def]
    return builder.fadd(builder.fmul(a, b, flags=("contract",)), c, flags=("contract",))


def _exponential(builder, x):  # type: ignore[no-untyped-def]
    """exp(x) of several numbers to the last bit or two; x beyond -708..708 is taken as the nearest end.

    exp(x) = 2^n exp(r) with n the integer nearest to x / ln 2 and a Taylor polynomial of degree 13
    in |r| <= 0.35.
    """
    integers = ir.VectorType(ir.IntType(64), LANES)
    for bound, order in ((-708.0, "<"), (708.0, ">")):
        x = builder.select(builder.fcmp_ordered(order, x, _real(bound)), _real(bound), x)
    to_integer = _real(
        6755399441055744.0
    )  # 1.5 * 2^52: adding it rounds, and leaves n in the low bits
    shifted = _multiply_add(builder, x, _real(1.0 / math.log(2.0)), to_integer)
    n = builder.fsub(shifted, to_integer)
    r = _multiply_add(
        builder, n, _real(-0.6931471803691238), x
    )  # ln 2 in two parts, the first with short digits
    r = _multiply_add(builder, n, _real(-1.9082149292705877e-10), r)
    terms = [_real(1.0 / math.factorial(degree)) for degree in range(14)]
    while (
        len(terms) > 1
    ):  # neighbours in pairs: a shorter chain of dependent operations than Horner's
        terms = [
            _multiply_add(builder, b, r, a) for a, b in zip(terms[::2], terms[1::2], strict=False)
        ] + (terms[-1:] if len(terms) % 2 else [])
        r = builder.fmul(r, r)
    exponent = builder.shl(builder.bitcast(shifted, integers), ir.Constant(integers, [52] * LANES))
    power = builder.add(exponent, ir.Constant(integers, [1023 << 52] * LANES))
    return builder.fmul(terms[0], builder.bitcast(power, x.type))


@generated
def exponentiate(typingctx, values, start):  # type: ignore[no-untyped-def]
    """Replace ``values[start : start + LANES]`` by their exponentials, in vector instructions."""

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        array = make_array(signature.args[0])(context, builder, arguments[0])
        place = _lanes(context, builder, array, [arguments[1]])
        builder.store(_exponential(builder, builder.load(place, align=8)), place, align=8)
        return context.get_dummy_value()

    return types.void(values, types.intp), generate


@generated
def exponentials(typingctx, axes, multiplier, dx, shift, values, start):  # type: ignore[no-untyped-def]
    """``values[k] = exp(-sum_d multiplier[d] dx[d, k] - shift)`` for ``start <= k < start + LANES``.

    `multiplier` has as many entries as the tuple `axes`; all arrays are C-ordered.
    """

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        _, factors, offsets, _, results, _ = (
            make_array(kind)(context, builder, value) if isinstance(kind, types.Array) else value
            for kind, value in zip(signature.args, arguments, strict=True)
        )
        shift, start = arguments[3], arguments[5]

        def splat(value):  # type: ignore[no-untyped-def]
            lanes = ir.VectorType(ir.DoubleType(), LANES)
            first = builder.insert_element(
                ir.Constant(lanes, ir.Undefined), value, ir.IntType(32)(0)
            )
            return builder.shuffle_vector(
                first, first, ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES)
            )

        x = builder.fsub(_real(0.0), splat(shift))
        for d in range(axes.count):
            axis = context.get_constant(types.intp, d)
            factor = builder.fneg(builder.load(builder.gep(factors.data, [axis])))
            row = builder.load(_lanes(context, builder, offsets, [axis, start]), align=8)
            x = _multiply_add(builder, splat(factor), row, x)
        builder.store(_exponential(builder, x), _lanes(context, builder, results, [start]), align=8)
        return context.get_dummy_value()

    return types.void(axes, multiplier, dx, types.float64, values, types.intp), generate
