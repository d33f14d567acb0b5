"""Tensor-product splines of any degree on axis-aligned knots: the handle behind `linear` and `bspline`.

On each knot span the d + 1 functions that are not zero are polynomials in the local coordinate
``t = (x - b_s) / (b_{s+1} - b_s)``. Their coefficients are tabulated per span (again after the
knots have moved), so that a point costs no division and nothing is stored per particle. Sums over
the functions at a point are taken axis by axis.
"""

from typing import NamedTuple

import numpy as np

from mpmbench.core.bases import Basis
from mpmbench.core.bases.grid.knots import advect, tabulate
from mpmbench.core.bases.handle import (
    Stencils,
    count,
    index,
    interpolate,
    locate,
    scratch,
    spread,
    value,
)
from mpmbench.core.compiled import implements, inlined, kernel, matrix, vector
from mpmbench.core.compiled.rows import add_multiple, lanes_for, multiply_and_add, set_multiple
from mpmbench.core.errors import BrokeDown
from mpmbench.core.geometry import Box


class TensorGrid(NamedTuple):
    """What kernels see of a tensor-product spline; A is the largest number of spans along an axis.

    Attributes
    ----------
    axes : tuple of float
        One entry per dimension; the inverse spacing [1/m] of the initial uniform knots, which finds
        a span.
    order : tuple of float
        degree + 1 entries (values unused; the length is known to the compiler).
    lanes : tuple of float
        As long as the rows of `coefficients`: degree + 1, rounded up to what a processor handles at
        once.
    moving : tuple of float
        One entry where knots move, none where they stay uniform: the compiler then leaves out the
        search for the span.
    shape : ndarray of int
        Number of functions along each axis, shape (dim,).
    breaks : ndarray
        Distinct knots [m], shape (dim, A + 1).
    inverse_width : ndarray
        1 / span width [1/m], shape (dim, A).
    coefficients : ndarray
        ``coefficients[axis, span, k, a]`` multiplies t^k in the a-th function, shape (dim, A,
        degree + 1, lanes).
    """

    axes: tuple[float, ...]
    order: tuple[float, ...]
    lanes: tuple[float, ...]
    moving: tuple[float, ...]
    shape: np.ndarray
    breaks: np.ndarray
    inverse_width: np.ndarray
    coefficients: np.ndarray

    @property
    def width(self) -> int:
        """Number of functions at any point."""
        return len(self.order) ** len(self.axes)


@implements(scratch, TensorGrid)
def _scratch(grid):  # type: ignore[no-untyped-def]
    return matrix(grid.axes, grid.lanes), matrix(grid.axes, grid.lanes)


@implements(count, TensorGrid)
def _count(grid, at):  # type: ignore[no-untyped-def]
    functions = 1
    for _ in range(len(grid.axes)):
        functions *= len(grid.order)
    return functions


@implements(locate, TensorGrid)
def _locate(grid, x, p, work):  # type: ignore[no-untyped-def]
    phi, derivative = work
    order = len(grid.order)
    first = 0
    for d in range(len(grid.axes)):
        last = grid.shape[d] - order
        place = (x[p, d] - grid.breaks[d, 0]) * grid.axes[d]
        s = min(max(int(place), 0), last)
        t, scale = place - s, grid.axes[d]
        if len(grid.moving) > 0:
            while s > 0 and x[p, d] < grid.breaks[d, s]:
                s -= 1
            while s < last and x[p, d] >= grid.breaks[d, s + 1]:
                s += 1
            scale = grid.inverse_width[d, s]
            t = (x[p, d] - grid.breaks[d, s]) * scale
        polynomials = grid.coefficients[d, s]
        set_multiple(grid.lanes, phi, d, 1.0, polynomials, order - 1)
        set_multiple(grid.lanes, derivative, d, 0.0, polynomials, order - 1)
        for k in range(
            order - 2, -1, -1
        ):  # Horner's scheme for all functions and their derivatives
            multiply_and_add(grid.lanes, derivative, d, t, phi, d)
            multiply_and_add(grid.lanes, phi, d, t, polynomials, k)
        set_multiple(grid.lanes, derivative, d, scale, derivative, d)
        first = first * grid.shape[d] + s
    return first


@implements(index, TensorGrid)
def _index(grid, at, k):  # type: ignore[no-untyped-def]
    i, stride = at, 1
    for d in range(len(grid.axes) - 1, -1, -1):  # the last axis is the fastest
        i += k % len(grid.order) * stride
        k //= len(grid.order)
        stride *= grid.shape[d]
    return i


@implements(value, TensorGrid)
def _value(grid, at, k, work, grad_phi):  # type: ignore[no-untyped-def]
    phi, derivative = work
    product = 1.0
    for e in range(len(grid.axes)):
        grad_phi[e] = 1.0
    for d in range(len(grid.axes) - 1, -1, -1):
        a = k % len(grid.order)
        k //= len(grid.order)
        product *= phi[d, a]
        for e in range(len(grid.axes)):
            grad_phi[e] *= derivative[d, a] if e == d else phi[d, a]
    return product


@implements(spread, TensorGrid)
def _spread(grid, at, work, lanes, columns, cell):  # type: ignore[no-untyped-def]
    phi, derivative = work
    dim, order = len(grid.axes), len(grid.order)
    first, second = matrix(grid.axes, lanes), matrix(grid.axes, lanes)
    k = 0
    for a in range(order):
        if dim == 1:
            add_multiple(lanes, cell, a, phi[0, a], columns, 0)
            add_multiple(lanes, cell, a, derivative[0, a], columns, 1)
            continue
        fold(grid, lanes, dim, 0, a, work, columns, first)
        for b in range(order):
            if dim == 2:
                add_multiple(lanes, cell, k, phi[1, b], first, 0)
                add_multiple(lanes, cell, k, derivative[1, b], first, 1)
                k += 1
                continue
            fold(grid, lanes, dim - 1, 1, b, work, first, second)
            for c in range(order):
                add_multiple(lanes, cell, k, phi[2, c], second, 0)
                add_multiple(lanes, cell, k, derivative[2, c], second, 1)
                k += 1


@inlined
def fold(grid, lanes, rows, d, a, work, columns, folded):  # type: ignore[no-untyped-def]
    """Multiply by the a-th function along axis d: what belongs to its derivative joins what belongs to its value."""
    phi, derivative = work
    set_multiple(lanes, folded, 0, phi[d, a], columns, 0)
    add_multiple(lanes, folded, 0, derivative[d, a], columns, 1)
    for r in range(1, rows):
        set_multiple(lanes, folded, r, phi[d, a], columns, 1 + r)


@implements(interpolate, TensorGrid)
def _interpolate(grid, at, work, lanes, cell, sums):  # type: ignore[no-untyped-def]
    phi, derivative = work
    dim, order = len(grid.axes), len(grid.order)
    first, second = matrix(grid.axes, lanes), matrix(grid.axes, lanes)
    clear(lanes, 1 + dim, sums)
    k = 0
    for a in range(order):
        if dim == 1:
            add_multiple(lanes, sums, 0, phi[0, a], cell, a)
            add_multiple(lanes, sums, 1, derivative[0, a], cell, a)
            continue
        clear(lanes, dim, first)
        for b in range(order):
            if dim == 2:
                add_multiple(lanes, first, 0, phi[1, b], cell, k)
                add_multiple(lanes, first, 1, derivative[1, b], cell, k)
                k += 1
                continue
            clear(lanes, 2, second)
            for c in range(order):
                add_multiple(lanes, second, 0, phi[2, c], cell, k)
                add_multiple(lanes, second, 1, derivative[2, c], cell, k)
                k += 1
            unfold(grid, lanes, dim - 1, 1, b, work, second, first)
        unfold(grid, lanes, dim, 0, a, work, first, sums)


@inlined
def unfold(grid, lanes, rows, d, a, work, folded, sums):  # type: ignore[no-untyped-def]
    """Add the a-th function along axis d times what the axes behind it gave: the value, then the derivatives."""
    phi, derivative = work
    add_multiple(lanes, sums, 0, phi[d, a], folded, 0)
    add_multiple(lanes, sums, 1, derivative[d, a], folded, 0)
    for r in range(1, rows):
        add_multiple(lanes, sums, 1 + r, phi[d, a], folded, r)


@inlined
def clear(lanes, rows, sums):  # type: ignore[no-untyped-def]
    """Set the first rows to zero."""
    for r in range(rows):
        for c in range(len(lanes)):
            sums[r, c] = 0.0


@kernel
def fill(grid, x, size, indices, phi, grad_phi):  # type: ignore[no-untyped-def]
    """Store the functions of any handle at points x, shape (n, dim)."""
    work, gradient = scratch(grid), vector(grid.axes)
    for p in range(x.shape[0]):
        at = locate(grid, x, p, work)
        size[p] = count(grid, at)
        for k in range(size[p]):
            indices[p, k] = index(grid, at, k)
            phi[p, k] = value(grid, at, k, work, gradient)
            for d in range(len(grid.axes)):
                grad_phi[p, k, d] = gradient[d]


@kernel
def first_outside(x, lower, upper):  # type: ignore[no-untyped-def]
    """Number of the first point outside the box (or not a number), -1 if there is none."""
    for p in range(x.shape[0]):
        for d in range(x.shape[1]):
            if not (lower[d] <= x[p, d] <= upper[d]):
                return p
    return -1


@kernel
def count_crossings(grid, x, cells):  # type: ignore[no-untyped-def]
    """Number of points in another cell than `cells` says, shape (n,), which is brought up to date."""
    work = scratch(grid)
    crossed = 0
    for p in range(cells.shape[0]):
        cell = locate(grid, x, p, work)
        crossed += cell != cells[p]
        cells[p] = cell
    return crossed


class TensorSpline(Basis):
    """Tensor-product B-splines of one degree with open knots along each axis."""

    def __init__(self, box: Box, degree: int, moving: bool = False) -> None:
        dimension, longest, lanes = box.dimension, max(box.cells), lanes_for(degree + 1)
        self.degree = degree
        self.cells = box.cells
        self.handle = TensorGrid(
            axes=tuple(1.0 / h for h in box.spacing.tolist()),
            order=(0.0,) * (degree + 1),
            lanes=lanes,
            moving=(0.0,) if moving else (),
            shape=np.array([n + degree for n in box.cells]),
            breaks=np.zeros((dimension, longest + 1)),
            inverse_width=np.ones((dimension, longest)),
            coefficients=np.zeros((dimension, longest, degree + 1, len(lanes))),
        )
        for d, breaks in enumerate(box.breaks()):
            self.handle.breaks[d, : len(breaks)] = breaks
        self._tables = self.handle.coefficients, self.handle.inverse_width
        self.nodes = np.zeros((int(np.prod(self.handle.shape)), dimension))
        self.lower, self.upper = np.zeros(dimension), np.zeros(dimension)
        self._update()

    def breaks(self, axis: int) -> np.ndarray:
        """The distinct knots along one axis [m] (a view)."""
        return self.handle.breaks[axis, : self.cells[axis] + 1]

    def _update(self) -> None:
        """Tabulate the polynomials and re-read the degrees of freedom as Greville abscissae."""
        axis = tabulate(self.handle.breaks, self.handle.shape, *self._tables, self.nodes)
        if axis >= 0:
            crossed = int(np.argmin(np.diff(self.breaks(axis))))
            raise BrokeDown(f"knots {crossed} and the next along axis {axis} have crossed")
        for d in range(len(self.cells)):
            self.lower[d], self.upper[d] = self.breaks(d)[[0, -1]]

    def evaluate(self, x: np.ndarray) -> Stencils:
        outside = first_outside(x, self.lower, self.upper)
        if outside >= 0:
            raise BrokeDown(f"point {outside} at {x[outside]} m is outside the grid")
        stored = Stencils.empty(len(x), (self.degree + 1) ** len(self.cells), len(self.cells))
        fill(self.handle, x, stored.size, stored.index, stored.phi, stored.grad_phi)
        return stored

    def first_outside(self, x: np.ndarray) -> int:
        return int(first_outside(x, self.lower, self.upper))

    def move(self, displacement: np.ndarray) -> None:
        """Advect the knots: ``xi_j += sum_i phi_i(xi_j) dx_i`` (`mpmbench.core.bases.grid.knots.advect`)."""
        advect(self.handle.breaks, self.handle.shape, self.handle.coefficients, displacement)
        self._update()
