"""Affine parts of fields for all products of functions along axes, axis by axis.

``phi_i (x_i - x)_e`` is a product in which the function along the axis e is multiplied by its
distance along that axis: a moment in the place of a slope. The functions have to be complete to
first order, so that ``D = sum_i phi_i (x_i - x) (x) (x_i - x)`` has no entries off its diagonal.
"""

from mpmbench.core.bases.grid.product import (
    ANSWERS,
    FEW,
    along_line,
    line_weights,
    lines,
    spread_point,
    spread_points,
    weigh,
)
from mpmbench.core.bases.handle import FLAT, index, spread_affine, take_affine
from mpmbench.core.compiled import inlined, matrix, table
from mpmbench.core.compiled.rows import (
    BATCH,
    GROUPS,
    LANES,
    add_multiple,
    add_product,
    fill_row,
    groups,
    put_rows,
    set_product,
    take,
)


@inlined
def weigh_moments(grid, at, start, n, work, nodes, places, D):
    """Write functions and, in the place of slopes, moments of n points, and the diagonal of D to its rows."""
    axes, order = grid.axes, len(grid.order)
    phi, moment, _ = work
    weigh(grid, at, start, n, work)
    here, arm = matrix(axes, BATCH), matrix((0.0,), LANES)
    stride = 1
    for d in range(len(axes) - 1, -1, -1):
        take((0.0,), here, d, places, len(BATCH) * d + start, n)
        for g in range(groups(n)):
            place = GROUPS * d + g
            fill_row(LANES, D, place, 0.0)
            for a in range(order):
                row = GROUPS * (d * order + a) + g
                fill_row(LANES, arm, 0, nodes[at + a * stride, d])
                add_multiple(LANES, arm, 0, -1.0, here, place)
                set_product(LANES, moment, row, phi, row, arm, 0)
                add_product(LANES, D, place, moment, row, arm, 0)
        stride *= grid.shape[d]


def _take_affine(grid, at, start, n, work, nodes, places, v_i, fields):
    dim = len(grid.axes)
    phi, moment, _ = work
    D = matrix(grid.axes, BATCH)
    weigh_moments(grid, at, start, n, work, nodes, places, D)
    weight, along = matrix(grid.axes, LANES), matrix((0.0,), LANES)
    sums = table(grid.axes, grid.axes, LANES)
    for g in range(groups(n)):
        for r in range(dim * dim):
            fill_row(LANES, sums, r, 0.0)
        for k in range(lines(grid)):
            line_weights(grid, k, g, phi, moment, weight)
            i = index(grid, at, k * len(grid.order))
            for d in range(dim):
                if dim > 1:
                    along_line(grid, v_i, i, d, phi, g, along)
                for e in range(dim - 1):
                    add_product(LANES, sums, d * dim + e, weight, 1 + e, along, 0)
                along_line(grid, v_i, i, d, moment, g, along)
                add_product(LANES, sums, (d + 1) * dim - 1, weight, 0, along, 0)
        b = len(LANES) * g
        for r in range(dim * dim):
            put_rows((0.0,), sums, r, fields, len(BATCH) * r + start + b, n - b)


def _spread_affine(grid, at, start, n, work, nodes, places, moments, lanes, columns, sums, touched):
    dim, order = len(grid.axes), len(grid.order)
    phi, moment, _ = work
    D = matrix(grid.axes, BATCH)
    weigh_moments(grid, at, start, n, work, nodes, places, D)
    if moments:
        stride = 1
        for e in range(dim - 1, -1, -1):
            least = FLAT * (nodes[at + (order - 1) * stride, e] - nodes[at, e]) ** 2
            for b in range(len(LANES) * groups(n)):  # whole vectors, without a branch
                some = max(D[e, b], least)
                D[e, b] = (D[e, b] > least) / some
            for d in range(dim):
                for b in range(n):
                    columns[d * dim + e, start + b] *= D[e, b]
            stride *= grid.shape[e]
    if n < FEW:
        for b in range(n):
            spread_point(grid, at, b, start + b, phi, moment, (), lanes, columns, sums)
    else:
        spread_points(grid, at, start, n, phi, moment, (), lanes, columns, sums)
    for k in range(lines(grid)):
        i = index(grid, at, k * order)
        touched[0], touched[1] = min(touched[0], i), max(touched[1], i + order)


ANSWERS[take_affine] = _take_affine
ANSWERS[spread_affine] = _spread_affine
