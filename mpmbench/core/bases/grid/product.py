"""Products of functions along the axes of a box: a grid basis is one function, `line`.

`product` makes a NamedTuple the handle of such a basis. Sums over the functions at a point are
taken axis by axis, and nothing is stored per particle.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from mpmbench.core.bases import Basis
from mpmbench.core.bases.handle import (
    Stencils,
    count,
    fill,
    index,
    interpolate,
    locate,
    locate_batch,
    place,
    room,
    scratch,
    spread,
    value,
)
from mpmbench.core.compiled import (
    answers_by_default,
    compiled,
    implemented,
    implements,
    inlined,
    matrix,
    table,
)
from mpmbench.core.compiled.rows import (
    BATCH,
    GROUPS,
    LANES,
    add_multiple,
    add_product,
    add_sums,
    fill_row,
    groups,
    lanes_for,
    put_rows,
    set_multiple,
    set_product,
    take,
)
from mpmbench.core.errors import BrokeDown
from mpmbench.core.geometry import Box
from mpmbench.core.geometry.outside import first_outside_box

FEW = (
    4  # points in a cell, below which vectors of points would be too empty: 1.5 times as fast for 2
)


def line(grid: Any, x: float, p: int, d: int, phi: np.ndarray, slope: np.ndarray) -> int:
    """Functions along axis `d` at the coordinate `x` [m] of point `p`.

    Writes the values to ``phi[d, a]`` and the slopes [1/m] to ``slope[d, a]`` for all ``a <
    len(grid.order)``, and returns the number of the first of these functions along the axis.
    """
    raise NotImplementedError


def product(handle: Any) -> Callable[[Callable[..., int]], Callable[..., int]]:
    """Decorate the `line` of a handle, which thereby answers all questions of a handle.

    Parameters
    ----------
    handle : type
        A NamedTuple that has, besides what its `line` reads, the fields of `product_fields`.
    """
    handle.width = property(lambda grid: len(grid.order) ** len(grid.axes))

    def decorate(function: Callable[..., int]) -> Callable[..., int]:
        implements(line, handle)(function)
        for question, answer in ANSWERS.items():
            if not implemented(question, handle):
                implements(question, handle)(answer)
        return function

    return decorate


def product_fields(box: Box, order: int, more: int) -> dict[str, Any]:
    """The fields that every product on a box has.

    Parameters
    ----------
    box : Box
    order : int
        Number of functions at a point along an axis.
    more : int
        There are n + more functions along n cells.

    Returns
    -------
    dict
        `axes`, the inverse cell sizes [1/m]; `order`, as many entries as functions along an axis;
        `lanes`, as many as a row of values or slopes has, which is rounded up to what a processor
        handles at once; `shape`, the number of functions along each axis, shape (dim,).
    """
    return {
        "axes": tuple(1.0 / h for h in box.spacing.tolist()),
        "order": (0.0,) * order,
        "lanes": lanes_for(order),
        "shape": np.array(box.cells) + more,
    }


def _scratch(grid):
    return matrix(grid.axes, grid.lanes), matrix(grid.axes, grid.lanes)


def _count(grid, at):
    functions = 1
    for _ in range(len(grid.axes)):
        functions *= len(grid.order)
    return functions


def _locate(grid, x, p, work):
    phi, slope = work
    first = 0
    for d in range(len(grid.axes)):
        first = first * grid.shape[d] + line(grid, x[p, d], p, d, phi, slope)
    return first


def _index(grid, at, k):
    i, stride = at, 1
    for d in range(len(grid.axes) - 1, -1, -1):  # the last axis is the fastest
        i += k % len(grid.order) * stride
        k //= len(grid.order)
        stride *= grid.shape[d]
    return i


def _value(grid, at, k, work, grad_phi):
    phi, slope = work
    total = 1.0
    for e in range(len(grid.axes)):
        grad_phi[e] = 1.0
    for d in range(len(grid.axes) - 1, -1, -1):
        a = k % len(grid.order)
        k //= len(grid.order)
        total *= phi[d, a]
        for e in range(len(grid.axes)):
            grad_phi[e] *= slope[d, a] if e == d else phi[d, a]
    return total


def _room(grid):
    """Functions and slopes of points in one cell, row ``d len(order) + a``, and what is kept for a batch."""
    phi, slope = table(grid.axes, grid.order, BATCH), table(grid.axes, grid.order, BATCH)
    return phi, slope, table((*grid.axes, *grid.axes), grid.order, BATCH)


def _locate_batch(grid, x, first, most, at, work):
    """Keep what `line` says about a batch: functions, and below them slopes."""
    dim, order, kept = len(grid.axes), len(grid.order), work[2]
    point, steep = matrix(grid.axes, grid.lanes), matrix(grid.axes, grid.lanes)
    for b in range(most):
        p, at[b] = first + b, 0
        for d in range(dim):
            at[b] = at[b] * grid.shape[d] + line(grid, x[p, d], p, d, point, steep)
            for a in range(order):
                row = d * order + a
                kept[row, b], kept[dim * order + row, b] = point[d, a], steep[d, a]
    return most


@answers_by_default
def weigh(grid, at, start, n, work):
    """Write functions and slopes of n points from `start` on, which are all in the cell `at`."""
    phi, slope, kept = work
    rows = len(grid.axes) * len(grid.order)
    for r in range(rows):
        take((0.0,), phi, r, kept, len(BATCH) * r + start, n)
        take((0.0,), slope, r, kept, len(BATCH) * (rows + r) + start, n)


def _spread(grid, at, start, n, work, values, lanes, columns, sums, marks):
    phi, slope, _ = work
    order = len(grid.order)
    weigh(grid, at, start, n, work)
    if n < FEW:
        for b in range(n):
            spread_point(grid, at, b, start + b, phi, slope, values, lanes, columns, sums)
    else:
        spread_points(grid, at, start, n, phi, slope, values, lanes, columns, sums)
    for k in range(lines(grid)):
        i = index(grid, at, k * order)
        for a in range(order):
            marks[i + a] = 1


@inlined
def spread_point(grid, at, b, point, phi, slope, values, lanes, columns, sums):
    """Add one point, in vectors of all that is added to a node."""
    dim, order = len(grid.axes), len(grid.order)
    rows, folded = matrix((0.0, *grid.axes), lanes), matrix((0.0, 0.0), lanes)
    for r in range(1 + dim):
        fill_row(lanes, rows, r, 0.0)
    for c in range(len(values)):
        rows[0, dim + c] = columns[dim * dim + c, point]
    for d in range(dim):
        for e in range(dim):
            rows[1 + e, d] = columns[d * dim + e, point]
    for k in range(lines(grid)):
        if dim == 1:
            set_multiple(lanes, folded, 0, 1.0, rows, 0)
            set_multiple(lanes, folded, 1, 1.0, rows, 1)
        elif dim == 2:
            set_multiple(lanes, folded, 0, phi[k, b], rows, 0)
            add_multiple(lanes, folded, 0, slope[k, b], rows, 1)
            set_multiple(lanes, folded, 1, phi[k, b], rows, 2)
        else:
            i, j = k // order, order + k % order
            set_multiple(lanes, folded, 0, phi[i, b] * phi[j, b], rows, 0)
            add_multiple(lanes, folded, 0, slope[i, b] * phi[j, b], rows, 1)
            add_multiple(lanes, folded, 0, phi[i, b] * slope[j, b], rows, 2)
            set_multiple(lanes, folded, 1, phi[i, b] * phi[j, b], rows, 3)
        i = index(grid, at, k * order)
        for a in range(order):
            row = (dim - 1) * order + a
            add_multiple(lanes, sums, i + a, phi[row, b], folded, 0)
            add_multiple(lanes, sums, i + a, slope[row, b], folded, 1)


@inlined
def spread_points(grid, at, start, n, phi, slope, values, lanes, columns, sums):
    """Add many points, in vectors of points."""
    dim, order = len(grid.axes), len(grid.order)
    last, used = dim - 1, dim + len(values)
    weight, folded = matrix(grid.axes, LANES), matrix((0.0, *grid.axes, *values), LANES)
    line_sums = table(grid.order, (*grid.axes, *values), LANES)
    own = table((0.0, *grid.axes), (0.0, *grid.axes), BATCH)  # columns of these points
    for r in range(dim * dim + len(values)):
        take((0.0,), own, r, columns, len(BATCH) * r + start, n)
    for k in range(lines(grid)):
        for r in range(order * used):
            fill_row(LANES, line_sums, r, 0.0)
        for g in range(groups(n)):
            line_weights(grid, k, g, phi, slope, weight)
            for d in range(dim):
                fill_row(LANES, folded, d, 0.0)
                for e in range(last):
                    c = GROUPS * (d * dim + e) + g
                    add_product(LANES, folded, d, weight, 1 + e, own, c)
            for c in range(len(values)):
                i = GROUPS * (dim * dim + c) + g
                set_product(LANES, folded, dim + c, weight, 0, own, i)
            for a in range(order):
                for c in range(used):
                    f = GROUPS * (last * order + a) + g
                    add_product(LANES, line_sums, a * used + c, phi, f, folded, c)
            for d in range(dim):
                c = GROUPS * (d * dim + last) + g
                set_product(LANES, folded, d, weight, 0, own, c)
                for a in range(order):
                    f = GROUPS * (last * order + a) + g
                    add_product(LANES, line_sums, a * used + d, slope, f, folded, d)
        i = index(grid, at, k * order)
        for a in range(order):
            add_sums((*grid.axes, *values), lanes, sums, i + a, line_sums, a * used)


def _interpolate(grid, at, start, n, work, nodes, fields):
    dim, order = len(grid.axes), len(grid.order)
    phi, slope, _ = work
    weight, along = matrix(grid.axes, LANES), matrix((0.0,), LANES)
    sums = table((0.0, 0.0, *grid.axes), grid.axes, LANES)
    weigh(grid, at, start, n, work)
    for g in range(groups(n)):
        for r in range((2 + dim) * dim):
            fill_row(LANES, sums, r, 0.0)
        for k in range(lines(grid)):
            line_weights(grid, k, g, phi, slope, weight)
            i = index(grid, at, k * order)
            for d in range(dim):
                along_line(grid, nodes.a, i, d, phi, g, along)
                add_product(LANES, sums, dim + d, weight, 0, along, 0)
                along_line(grid, nodes.v, i, d, phi, g, along)
                add_product(LANES, sums, d, weight, 0, along, 0)
                for e in range(dim - 1):
                    add_product(LANES, sums, (2 + d) * dim + e, weight, 1 + e, along, 0)
                along_line(grid, nodes.v, i, d, slope, g, along)
                add_product(LANES, sums, (3 + d) * dim - 1, weight, 0, along, 0)
        b = len(LANES) * g
        for r in range((2 + dim) * dim):
            put_rows((0.0,), sums, r, fields, len(BATCH) * r + start + b, n - b)


@inlined
def lines(grid):
    """Number of lines of functions along the last axis in a cell."""
    n = 1
    for _ in range(len(grid.axes) - 1):
        n *= len(grid.order)
    return n


@inlined
def line_weights(grid, k, g, phi, slope, weight):
    """Product of the functions along all axes but the last, constant on line k, and its derivatives."""
    order = len(grid.order)
    if len(grid.axes) == 1:
        fill_row(LANES, weight, 0, 1.0)
    elif len(grid.axes) == 2:
        set_multiple(LANES, weight, 0, 1.0, phi, GROUPS * k + g)
        set_multiple(LANES, weight, 1, 1.0, slope, GROUPS * k + g)
    else:
        i, j = GROUPS * (k // order) + g, GROUPS * (order + k % order) + g
        set_product(LANES, weight, 0, phi, i, phi, j)
        set_product(LANES, weight, 1, slope, i, phi, j)
        set_product(LANES, weight, 2, phi, i, slope, j)


@inlined
def along_line(grid, field, i, d, functions, g, along):
    """Sum of component d of a nodal field over the functions of a line, whose first node is i."""
    first = GROUPS * (len(grid.axes) - 1) * len(grid.order) + g
    set_multiple(LANES, along, 0, field[i, d], functions, first)
    for a in range(1, len(grid.order)):
        add_multiple(LANES, along, 0, field[i + a, d], functions, first + GROUPS * a)


def _place(grid, columns, i, k, j, n):
    order = len(grid.order)
    where, stride = 0, 1
    for _ in range(len(grid.axes)):
        where += (n % order - k % order + order - 1) * stride
        stride *= 2 * order - 1
        n //= order
        k //= order
    return where


ANSWERS: dict[Callable[..., Any], Callable[..., Any]] = {
    scratch: _scratch,
    locate: _locate,
    count: _count,
    index: _index,
    value: _value,
    room: _room,
    locate_batch: _locate_batch,
    spread: _spread,
    interpolate: _interpolate,
    place: _place,
}
import mpmbench.core.bases.grid.moments  # noqa: E402 - which adds its own answers
import mpmbench.core.bases.grid.pairs  # noqa: E402, F401


@compiled
def count_crossings(grid, x, cells, start, stop):
    """Number of points start to stop in another cell than `cells` says, which is brought up to date."""
    work = scratch(grid)
    crossed = 0
    for p in range(start, stop):
        cell = locate(grid, x, p, work)
        crossed += cell != cells[p]
        cells[p] = cell
    return crossed


class GridBasis(Basis):
    """Products of functions along the axes of a box.

    Parameters
    ----------
    box : Box
    handle : NamedTuple
        Of a class with a `product`.
    nodes : ndarray
        Positions of the degrees of freedom [m], shape (N, dim), the last axis fastest.
    """

    def __init__(self, box: Box, handle: Any, nodes: np.ndarray) -> None:
        self.handle, self.nodes = handle, nodes
        self.lower, self.upper = np.array(box.lower), np.array(box.upper)

    def evaluate(self, x: np.ndarray) -> Stencils:
        if (outside := self.first_outside(x)) >= 0:
            raise BrokeDown(f"point {outside} at {x[outside]} m is outside the grid")
        stored = Stencils.empty(len(x), self.handle.width, x.shape[1])
        fill(self.handle, x, stored.size, stored.index, stored.phi, stored.grad_phi)
        return stored

    def first_outside(self, x: np.ndarray) -> int:
        return first_outside_box(x, self.lower, self.upper)
