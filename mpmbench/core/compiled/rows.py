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
from numba.core import cgutils
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


@inlined
def alike(at, b, n):
    """Number of points of a batch of n from b on that are at the same place."""
    e = b + 1
    while e < n and at[e] == at[b]:
        e += 1
    return e - b


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


def _masked(context, builder, kind, array, columns, first, count):
    """Type of 8 rows with so many columns, a pointer to them from the first on, and which are less than `count`."""
    block = ir.VectorType(DOUBLE, 8 * columns)
    data = make_array(kind)(context, builder, array).data
    start = builder.gep(data, [builder.mul(first, ir.Constant(INT64, columns))])
    numbers = ir.VectorType(INT64, 8 * columns)
    row = ir.Constant(numbers, [k // columns for k in range(8 * columns)])
    nothing = ir.Constant(numbers, ir.Undefined)
    counts = builder.insert_element(nothing, count, ir.Constant(INT32, 0))
    counts = _chosen(builder, counts, nothing, [0] * (8 * columns))
    mask = builder.icmp_signed("<", row, counts)
    return block, builder.bitcast(start, block.as_pointer()), mask


def _call(builder, name, result, arguments):
    kind = ir.FunctionType(result, [argument.type for argument in arguments])
    function = cgutils.get_or_insert_function(builder.module, kind, name)
    return builder.call(function, arguments)


@generated
def take_rows(typingctx, columns, target, i, source, first, count):
    """``target[i + GROUPS c, b] = source[first + b, c]`` for ``b < count``, 0 for the others up to 8."""

    def generate(context, builder, signature, arguments):
        _, written, i_, read, first_, count_ = arguments
        to, n = _Rows(context, builder, target, written, 8), columns.count
        block, start, mask = _masked(context, builder, source, read, n, first_, count_)
        zeros = ir.Constant(block, [0.0] * (8 * n))
        name = f"llvm.masked.load.v{8 * n}f64.p0"
        values = cgutils.alloca_once(builder, block)
        whole = builder.icmp_signed(">=", count_, ir.Constant(INT64, 8))
        with builder.if_else(whole) as (then, otherwise):  # masks of 72 numbers are slow
            with then:
                builder.store(builder.load(start, align=8), values)
            with otherwise:
                some = [start, ir.Constant(INT32, 8), mask, zeros]
                builder.store(_call(builder, name, block, some), values)
        values = builder.load(values)
        for c in range(n):
            row = _chosen(builder, values, values, range(c, 8 * n, n))
            to.store(row, builder.add(i_, ir.Constant(INT64, GROUPS * c)))
        return context.get_dummy_value()

    k = types.intp
    return types.void(columns, target, k, source, k, k), generate


@generated
def put_rows(typingctx, columns, source, i, target, first, count):
    """``target[first + b, c] = source[i + GROUPS c, b]`` for ``b < count``, at most 8."""

    def generate(context, builder, signature, arguments):
        _, read, i_, written, first_, count_ = arguments
        source_, n = _Rows(context, builder, source, read, 8), columns.count
        values = source_.load(i_)
        for c in range(1, n):
            row = source_.load(builder.add(i_, ir.Constant(INT64, GROUPS * c)))
            row = _chosen(builder, row, row, [b % 8 for b in range(8 * c)])
            values = _chosen(builder, values, row, [*range(8 * c), *range(8 * c, 8 * c + 8)])
        values = _chosen(builder, values, values, [8 * c + b for b in range(8) for c in range(n)])
        _, start, mask = _masked(context, builder, target, written, n, first_, count_)
        name = f"llvm.masked.store.v{8 * n}f64.p0"
        whole = builder.icmp_signed(">=", count_, ir.Constant(INT64, 8))
        with builder.if_else(whole) as (then, otherwise):
            with then:
                builder.store(values, start, align=8)
            with otherwise:
                some = [values, start, ir.Constant(INT32, 8), mask]
                _call(builder, name, ir.VoidType(), some)
        return context.get_dummy_value()

    k = types.intp
    return types.void(columns, source, k, target, k, k), generate


@inlined
def take(columns, target, row, source, first, n):
    """``target[row + c, b] = source[first + b, c]`` for ``b < n``, 0 for what is left.

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
