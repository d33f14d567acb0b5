"""Arithmetic on whole rows of small arrays: 2, 4 or 8 numbers that a processor multiplies and adds at once.

The compiler finds this by itself in long loops only. A row is as long as the tuple `lanes`, whose
entries do not matter; every row of the arrays must hold that many numbers.
"""

from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.np.arrayobj import make_array

from mpmbench.core.compiled import generated

CONTRACT = ["contract"]  # as in all kernels: fused multiply-add, and nothing else


def lanes_for(columns: int) -> tuple[float, ...]:
    """The shortest tuple for rows of at least so many numbers."""
    return (0.0,) * (1 << max(columns - 1, 1).bit_length())


def _row_operation(combine: Callable[..., Any]) -> Any:
    """An operation ``(lanes, target, i, factor, source, j)`` that writes ``target[i, :]``."""

    def operation(typingctx, lanes, target, i, factor, source, j):
        row = ir.VectorType(ir.DoubleType(), lanes.count)

        def generate(context, builder, signature, arguments):
            def place(kind, array, number):
                start = [number, context.get_constant(types.intp, 0)]
                data = make_array(kind)(context, builder, array)
                pointer = cgutils.get_item_pointer(
                    context, builder, kind, data, start, wraparound=False
                )
                return builder.bitcast(pointer, row.as_pointer())

            _, written, i_, number, read, j_ = arguments
            to = place(target, written, i_)
            nothing = ir.Constant(row, ir.Undefined)
            first = builder.insert_element(nothing, number, ir.Constant(ir.IntType(32), 0))
            zeros = ir.Constant(ir.VectorType(ir.IntType(32), lanes.count), [0] * lanes.count)
            factors = builder.shuffle_vector(first, nothing, zeros)
            values = builder.load(place(source, read, j_), align=8)
            result = combine(builder, lambda: builder.load(to, align=8), factors, values)
            builder.store(result, to, align=8)
            return context.get_dummy_value()

        return types.void(lanes, target, types.intp, types.float64, source, types.intp), generate

    return generated(operation)


def _multiply(builder, a, b):
    return builder.fmul(a, b, flags=CONTRACT)


def _add(builder, a, b):
    return builder.fadd(a, b, flags=CONTRACT)


def _scaled(builder, old, factor, row):
    return _multiply(builder, factor, row)


def _plus_scaled(builder, old, factor, row):
    return _add(builder, old(), _multiply(builder, factor, row))


def _horner(builder, old, factor, row):
    return _add(builder, _multiply(builder, old(), factor), row)


set_multiple = _row_operation(_scaled)  # target[i] = factor source[j]
add_multiple = _row_operation(_plus_scaled)  # target[i] += factor source[j]
multiply_and_add = _row_operation(_horner)  # target[i] = factor target[i] + source[j]
