"""Splines of any degree on axis-aligned knots: the functions behind `linear` and `bspline`.

On each knot span the d + 1 functions that are not zero are polynomials in the local coordinate
``t = (x - b_s) / (b_{s+1} - b_s)``. Their coefficients are tabulated per span (again after the
knots have moved), so that a point costs no division.
"""

from typing import NamedTuple

import numpy as np

from mpmbench.core.bases.grid.knots import advect, tabulate
from mpmbench.core.bases.grid.product import GridBasis, product, product_fields, weigh
from mpmbench.core.bases.handle import locate_batch
from mpmbench.core.compiled import implements, inlined, matrix
from mpmbench.core.compiled.rows import (
    BATCH,
    GROUPS,
    LANES,
    add_product,
    fill_row,
    groups,
    multiply_and_add,
    set_multiple,
    take,
)
from mpmbench.core.errors import BrokeDown
from mpmbench.core.geometry import Box


class TensorGrid(NamedTuple):
    """What kernels see of a tensor-product spline; A is the largest number of spans along an axis.

    The first four fields are `product_fields`: the degree is one less than the length of `order`,
    and the inverse spacing in `axes` is that of the initial uniform knots, which finds a span.
    """

    axes: tuple[float, ...]
    order: tuple[float, ...]
    lanes: tuple[float, ...]
    shape: np.ndarray
    moving: tuple[float, ...]  # empty where knots stay: then no search for the span is compiled
    breaks: np.ndarray  # distinct knots [m], shape (dim, A + 1)
    inverse_width: np.ndarray  # 1 / span width [1/m], shape (dim, A)
    # [axis, span, k, a] multiplies t^k in the a-th function, shape (dim, A, degree + 1, lanes)
    coefficients: np.ndarray


@inlined
def span(grid, x, d):
    """Number of the span along axis d that `x` is in, and the local coordinate there."""
    last = grid.shape[d] - len(grid.order)
    place = (x - grid.breaks[d, 0]) * grid.axes[d]
    s = min(max(int(place), 0), last)
    t = place - s
    if len(grid.moving) > 0:
        while s > 0 and x < grid.breaks[d, s]:
            s -= 1
        while s < last and x >= grid.breaks[d, s + 1]:
            s += 1
        t = (x - grid.breaks[d, s]) * grid.inverse_width[d, s]
    return s, t


@inlined
def inverse_width(grid, d, s):
    """1 / width of a span [1/m]."""
    return grid.inverse_width[d, s] if len(grid.moving) > 0 else grid.axes[d]


@implements(locate_batch, TensorGrid)
def _locate_batch(grid, x, first, most, at, work):
    """Keep local coordinates."""
    points, kept = x[first : first + most], work[2]
    for b in range(most):
        here = 0
        for d in range(len(grid.axes)):
            s, kept[d, b] = span(grid, points[b, d], d)
            here = here * grid.shape[d] + s
        at[b] = here
    return most


@implements(weigh, TensorGrid)
def _weigh(grid, at, start, n, work):
    order, (phi, slope, kept) = len(grid.order), work
    value, steep = matrix(grid.order, LANES), matrix(grid.order, LANES)
    t = matrix((0.0,), BATCH)
    for d in range(len(grid.axes) - 1, -1, -1):
        s, at = at % grid.shape[d], at // grid.shape[d]
        take((0.0,), t, 0, kept, len(BATCH) * d + start, n)
        for g in range(groups(n)):
            for a in range(order):
                fill_row(LANES, value, order - 1, grid.coefficients[d, s, order - 1, a])
                fill_row(LANES, steep, order - 1, 0.0)
                for k in range(order - 2, -1, -1):  # Horner's scheme; the results are in row 0
                    set_multiple(LANES, steep, k, 1.0, value, k + 1)
                    add_product(LANES, steep, k, steep, k + 1, t, g)
                    fill_row(LANES, value, k, grid.coefficients[d, s, k, a])
                    add_product(LANES, value, k, value, k + 1, t, g)
                row = GROUPS * (d * order + a) + g
                set_multiple(LANES, phi, row, 1.0, value, 0)
                set_multiple(LANES, slope, row, inverse_width(grid, d, s), steep, 0)


@product(TensorGrid)
def polynomials_along(grid, x, p, d, phi, slope):
    """Values and slopes of the polynomials on the span that `x` is in."""
    order = len(grid.order)
    s, t = span(grid, x, d)
    polynomials = grid.coefficients[d, s]
    set_multiple(grid.lanes, phi, d, 1.0, polynomials, order - 1)
    set_multiple(grid.lanes, slope, d, 0.0, polynomials, order - 1)
    for k in range(order - 2, -1, -1):  # for all functions at once
        multiply_and_add(grid.lanes, slope, d, t, phi, d)
        multiply_and_add(grid.lanes, phi, d, t, polynomials, k)
    set_multiple(grid.lanes, slope, d, inverse_width(grid, d, s), slope, d)
    return s


class TensorSpline(GridBasis):
    """Tensor-product B-splines of one degree with open knots along each axis."""

    def __init__(self, box: Box, degree: int, moving: bool = False) -> None:
        fields = product_fields(box, degree + 1, degree)
        dimension, longest = box.dimension, max(box.cells)
        handle = TensorGrid(
            **fields,
            moving=(0.0,) if moving else (),
            breaks=np.zeros((dimension, longest + 1)),
            inverse_width=np.ones((dimension, longest)),
            coefficients=np.zeros((dimension, longest, degree + 1, len(fields["lanes"]))),
        )
        super().__init__(box, handle, np.zeros((int(np.prod(handle.shape)), dimension)))
        self.degree, self.cells = degree, box.cells
        for d, breaks in enumerate(box.breaks()):
            handle.breaks[d, : len(breaks)] = breaks
        self._tables = handle.coefficients, handle.inverse_width
        self._update()

    def breaks(self, axis: int) -> np.ndarray:
        """The distinct knots along one axis [m] (a view)."""
        return self.handle.breaks[axis, : self.cells[axis] + 1]

    def _update(self) -> None:
        """Tabulate the polynomials, and put the degrees of freedom at the Greville abscissae."""
        axis = tabulate(self.handle.breaks, self.handle.shape, *self._tables, self.nodes)
        if axis >= 0:
            crossed = int(np.argmin(np.diff(self.breaks(axis))))
            raise BrokeDown(f"knots {crossed} and the next along axis {axis} have crossed")
        for d in range(len(self.cells)):
            self.lower[d], self.upper[d] = self.breaks(d)[[0, -1]]

    def move(self, displacement: np.ndarray) -> None:
        """Advect the knots: ``xi_j += sum_i phi_i(xi_j) dx_i`` (`knots.advect`)."""
        advect(self.handle.breaks, self.handle.shape, self.handle.coefficients, displacement)
        self._update()
