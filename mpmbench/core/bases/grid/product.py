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
    place,
    scratch,
    spread,
    value,
)
from mpmbench.core.compiled import compiled, implements, inlined, matrix
from mpmbench.core.compiled.rows import add_multiple, lanes_for, set_multiple
from mpmbench.core.errors import BrokeDown
from mpmbench.core.geometry import Box


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


def _spread(grid, at, work, lanes, columns, cell):
    dim, order = len(grid.axes), len(grid.order)
    plane, row = matrix(grid.axes, lanes), matrix(grid.axes, lanes)
    if dim == 1:
        spread_along(grid, lanes, 0, 0, work, columns, cell)
    else:
        for a in range(order):
            fold(grid, lanes, dim, 0, a, work, columns, plane)
            if dim == 2:
                spread_along(grid, lanes, 1, a * order, work, plane, cell)
            else:
                for b in range(order):
                    fold(grid, lanes, 2, 1, b, work, plane, row)
                    spread_along(grid, lanes, 2, (a * order + b) * order, work, row, cell)


@inlined
def fold(grid, lanes, rows, d, a, work, columns, folded):
    """Multiply by the a-th function along axis d; what belongs to its slope joins its value."""
    phi, slope = work
    set_multiple(lanes, folded, 0, phi[d, a], columns, 0)
    add_multiple(lanes, folded, 0, slope[d, a], columns, 1)
    for r in range(1, rows):
        set_multiple(lanes, folded, r, phi[d, a], columns, 1 + r)


@inlined
def spread_along(grid, lanes, d, k, work, columns, cell):
    """Add to the functions k, k + 1, ..., which differ along the last axis d."""
    phi, slope = work
    for a in range(len(grid.order)):
        add_multiple(lanes, cell, k + a, phi[d, a], columns, 0)
        add_multiple(lanes, cell, k + a, slope[d, a], columns, 1)


def _interpolate(grid, at, work, lanes, cell, sums):
    dim, order = len(grid.axes), len(grid.order)
    plane, row = matrix(grid.axes, lanes), matrix(grid.axes, lanes)
    clear(lanes, 1 + dim, sums)
    if dim == 1:
        interpolate_along(grid, lanes, 0, 0, work, cell, sums)
    else:
        for a in range(order):
            clear(lanes, dim, plane)
            if dim == 2:
                interpolate_along(grid, lanes, 1, a * order, work, cell, plane)
            else:
                for b in range(order):
                    clear(lanes, 2, row)
                    interpolate_along(grid, lanes, 2, (a * order + b) * order, work, cell, row)
                    unfold(grid, lanes, 2, 1, b, work, row, plane)
            unfold(grid, lanes, dim, 0, a, work, plane, sums)


@inlined
def unfold(grid, lanes, rows, d, a, work, folded, sums):
    """Add the a-th function along axis d times what the axes behind it gave: value, then slopes."""
    phi, slope = work
    add_multiple(lanes, sums, 0, phi[d, a], folded, 0)
    add_multiple(lanes, sums, 1, slope[d, a], folded, 0)
    for r in range(1, rows):
        add_multiple(lanes, sums, 1 + r, phi[d, a], folded, r)


@inlined
def interpolate_along(grid, lanes, d, k, work, cell, sums):
    """Sum over the functions k, k + 1, ..., which differ along the last axis d."""
    phi, slope = work
    for a in range(len(grid.order)):
        add_multiple(lanes, sums, 0, phi[d, a], cell, k + a)
        add_multiple(lanes, sums, 1, slope[d, a], cell, k + a)


@inlined
def clear(lanes, rows, sums):
    """Set the first rows to zero."""
    for r in range(rows):
        for c in range(len(lanes)):
            sums[r, c] = 0.0


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
    spread: _spread,
    interpolate: _interpolate,
    place: _place,
}


@compiled
def first_outside(x, lower, upper):
    """Number of the first point outside the box (or not a number), -1 if there is none."""
    for p in range(x.shape[0]):
        for d in range(x.shape[1]):
            if not (lower[d] <= x[p, d] <= upper[d]):
                return p
    return -1


@compiled
def count_crossings(grid, x, cells):
    """Number of points in another cell than `cells` says, shape (n,); brings `cells` up to date."""
    work = scratch(grid)
    crossed = 0
    for p in range(cells.shape[0]):
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
        return int(first_outside(x, self.lower, self.upper))
