"""Arithmetic on whole rows of small arrays: 4, 8 or 16 numbers that a processor multiplies and adds at once.

A row is as long as the tuple `lanes`, whose entries do not matter, and row i of an array starts at
its number ``i len(lanes)``. Particles are worked on in batches, whose arrays have one row of
``len(BATCH)`` numbers, thus GROUPS rows of ``len(LANES)``, for each quantity.

The compiler finds vector instructions by itself in long loops only: the same kernels as loops over
a batch took 31 and 13 ns a particle, with these operations 12 and 7 (`g2p`, `p2g`, linear, 2D).
"""

from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.np.arrayobj import make_array

from mpmbench.core.compiled import generated, inlined

CONTRACT = ["contract"]  # as in all kernels: fused multiply-add, and nothing else
LANES = (0.0,) * 8  # numbers that a vector instruction takes at most
GROUPS = 2
BATCH = LANES * GROUPS
DOUBLE, INT32, INT64 = ir.DoubleType(), ir.IntType(32), ir.IntType(64)


def lanes_for(columns: int) -> tuple[float, ...]:
    """The shortest tuple for rows of at least so many numbers."""
    return (0.0,) * (1 << max(columns - 1, 1).bit_length())


@inlined
def groups(n):
    """So many rows of ``len(LANES)`` hold n numbers."""
    return (n + len(LANES) - 1) // len(LANES)


class _Rows:
    """Writes instructions for rows of one length in an array of the type `kind`."""

    def __init__(self, context, builder, kind, array, length):
        self.builder, self.length = builder, length
        self.data = make_array(kind)(context, builder, array).data

    def place(self, number):
        start = self.builder.mul(number, ir.Constant(INT64, self.length))
        pointer = self.builder.gep(self.data, [start])
        return self.builder.bitcast(pointer, ir.VectorType(DOUBLE, self.length).as_pointer())

    def load(self, number):
        return self.builder.load(self.place(number), align=8)

    def store(self, value, number):
        self.builder.store(value, self.place(number), align=8)


def _chosen(builder, a, b, numbers):
    """Numbers of two rows in a row."""
    mask = ir.Constant(ir.VectorType(INT32, len(numbers)), list(numbers))
    return builder.shuffle_vector(a, b, mask)


def _repeated(builder, number, length):
    nothing = ir.Constant(ir.VectorType(DOUBLE, length), ir.Undefined)
    first = builder.insert_element(nothing, number, ir.Constant(INT32, 0))
    return _chosen(builder, first, nothing, [0] * length)


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


def _row_operation(combine: Callable[..., Any]) -> Any:
    """An operation ``(lanes, target, i, factor, source, j)`` that writes ``target[i, :]``."""

    def operation(typingctx, lanes, target, i, factor, source, j):
        def generate(context, builder, signature, arguments):
            _, written, i_, number, read, j_ = arguments
            to = _Rows(context, builder, target, written, lanes.count)
            row = _Rows(context, builder, source, read, lanes.count).load(j_)
            factors = _repeated(builder, number, lanes.count)
            to.store(combine(builder, lambda: to.load(i_), factors, row), i_)
            return context.get_dummy_value()

        return types.void(lanes, target, types.intp, types.float64, source, types.intp), generate

    return generated(operation)


def _product_operation(combine: Callable[..., Any]) -> Any:
    """An operation ``(lanes, target, i, first, j, second, k)`` that writes ``target[i, :]``."""

    def operation(typingctx, lanes, target, i, first, j, second, k):
        def generate(context, builder, signature, arguments):
            _, written, i_, a, j_, b, k_ = arguments
            to = _Rows(context, builder, target, written, lanes.count)
            left = _Rows(context, builder, first, a, lanes.count).load(j_)
            right = _Rows(context, builder, second, b, lanes.count).load(k_)
            to.store(combine(builder, lambda: to.load(i_), left, right), i_)
            return context.get_dummy_value()

        n = types.intp
        return types.void(lanes, target, n, first, n, second, n), generate

    return generated(operation)


set_multiple = _row_operation(_scaled)  # target[i] = factor source[j]
add_multiple = _row_operation(_plus_scaled)  # target[i] += factor source[j]
multiply_and_add = _row_operation(_horner)  # target[i] = factor target[i] + source[j]
set_product = _product_operation(_scaled)  # target[i] = first[j] second[k]
add_product = _product_operation(_plus_scaled)  # target[i] += first[j] second[k]


@generated
def fill_row(typingctx, lanes, target, i, number):
    """``target[i, :] = number``."""

    def generate(context, builder, signature, arguments):
        _, written, i_, value = arguments
        to = _Rows(context, builder, target, written, lanes.count)
        to.store(_repeated(builder, value, lanes.count), i_)
        return context.get_dummy_value()

    return types.void(lanes, target, types.intp, types.float64), generate


@generated
def add_sums(typingctx, used, lanes, sums, i, rows, j):
    """``sums[i, c] += sum rows[j + c, :]`` for ``c < len(used)``; `rows` has rows like LANES."""

    def generate(context, builder, signature, arguments):
        _, _, written, i_, read, j_ = arguments
        to = _Rows(context, builder, sums, written, lanes.count)
        source = _Rows(context, builder, rows, read, 8)
        zero = ir.Constant(ir.VectorType(DOUBLE, 8), [0.0] * 8)
        level = [
            source.load(builder.add(j_, ir.Constant(INT64, c))) if c < used.count else zero
            for c in range(max(lanes.count, 8))
        ]
        for step in (
            1,
            2,
            4,
        ):  # in each pair, what is `step` apart is added, and the two become one
            low = [k // step % 2 * 8 + k // (2 * step) * 2 * step + k % step for k in range(8)]
            level = [
                _add(
                    builder,
                    _chosen(builder, a, b, low),
                    _chosen(builder, a, b, [k + step for k in low]),
                )
                for a, b in zip(level[::2], level[1::2], strict=True)
            ]
        total = _chosen(builder, level[0], level[-1], range(lanes.count))
        to.store(_add(builder, to.load(i_), total), i_)
        return context.get_dummy_value()

    n = types.intp
    return types.void(used, lanes, sums, n, rows, n), generate


def _columns(context, builder, kind, array, columns, first):
    """The pointer to the first of rows with so many columns, whatever the shape of the array."""
    data = make_array(kind)(context, builder, array).data
    return builder.gep(data, [builder.mul(first, ir.Constant(INT64, columns))])


@generated
def take_rows(typingctx, columns, target, i, source, first, count):
    """``target[i + GROUPS c, b] = source[first + b, c]`` for ``b < min(count, 8)``; others repeat the last b."""

    def generate(context, builder, signature, arguments):
        _, written, i_, read, first_, count_ = arguments
        to, n = _Rows(context, builder, target, written, 8), columns.count
        start = _columns(context, builder, source, read, n, first_)

        def store(c, row):
            to.store(row, builder.add(i_, ir.Constant(INT64, GROUPS * c)))

        whole = builder.icmp_signed(">=", count_, ir.Constant(INT64, 8))
        with builder.if_else(whole) as (then, otherwise):
            with then:
                block = ir.VectorType(DOUBLE, 8 * n).as_pointer()
                block = builder.load(builder.bitcast(start, block), align=8)
                for c in range(n):
                    store(c, _chosen(builder, block, block, range(c, 8 * n, n)))
            with otherwise:
                last = builder.sub(count_, ir.Constant(INT64, 1))
                rows = [ir.Constant(ir.VectorType(DOUBLE, 8), ir.Undefined)] * n
                for b in range(8):
                    here = ir.Constant(INT64, b)
                    here = builder.select(builder.icmp_signed("<", here, last), here, last)
                    point = builder.gep(start, [builder.mul(here, ir.Constant(INT64, n))])
                    for c in range(n):
                        value = builder.load(builder.gep(point, [ir.Constant(INT64, c)]))
                        rows[c] = builder.insert_element(rows[c], value, ir.Constant(INT32, b))
                for c in range(n):
                    store(c, rows[c])
        return context.get_dummy_value()

    k = types.intp
    return types.void(columns, target, k, source, k, k), generate


@generated
def put_rows(typingctx, columns, source, i, target, first, count):
    """``target[first + b, c] = source[i + GROUPS c, b]`` for ``b < min(count, 8)``."""

    def generate(context, builder, signature, arguments):
        _, read, i_, written, first_, count_ = arguments
        source_, n = _Rows(context, builder, source, read, 8), columns.count
        start = _columns(context, builder, target, written, n, first_)
        rows = [source_.load(builder.add(i_, ir.Constant(INT64, GROUPS * c))) for c in range(n)]
        whole = builder.icmp_signed(">=", count_, ir.Constant(INT64, 8))
        with builder.if_else(whole) as (then, otherwise):
            with then:
                block = rows[0]
                for c in range(1, n):
                    row = _chosen(builder, rows[c], rows[c], [b % 8 for b in range(8 * c)])
                    used = [*range(8 * c), *range(8 * c, 8 * c + 8)]
                    block = _chosen(builder, block, row, used)
                block = _chosen(
                    builder, block, block, [8 * c + b for b in range(8) for c in range(n)]
                )
                builder.store(block, builder.bitcast(start, block.type.as_pointer()), align=8)
            with otherwise:
                for b in range(8):
                    with builder.if_then(builder.icmp_signed(">", count_, ir.Constant(INT64, b))):
                        for c in range(n):
                            value = builder.extract_element(rows[c], ir.Constant(INT32, b))
                            place = builder.gep(start, [ir.Constant(INT64, b * n + c)])
                            builder.store(value, place)
        return context.get_dummy_value()

    k = types.intp
    return types.void(columns, source, k, target, k, k), generate


@inlined
def take(columns, target, row, source, first, n):
    """``target[row + c, b] = source[first + b, c]`` for ``b < n``; what is left repeats the last of them.

    `columns` has as many entries as one entry of `source`, a row or a matrix, has numbers.
    """
    for g in range(groups(n)):
        b = len(LANES) * g
        take_rows(columns, target, GROUPS * row + g, source, first + b, n - b)


@inlined
def put(columns, source, row, target, first, n):
    """``target[first + b, c] = source[row + c, b]`` for ``b < n``."""
    for g in range(groups(n)):
        b = len(LANES) * g
        put_rows(columns, source, GROUPS * row + g, target, first + b, n - b)
