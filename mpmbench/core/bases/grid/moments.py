"""Affine parts of fields for all products of functions along axes, axis by axis.

``phi_i (x_i - x)_e`` is a product in which the function along the axis e is multiplied by its
distance along that axis: a moment in the place of a slope. The functions have to be complete to
first order, so that ``D = sum_i phi_i (x_i - x) (x) (x_i - x)`` has no entries off its diagonal.
"""

from mpmbench.core.bases.grid.product import ANSWERS, along_line, line_weights, lines
from mpmbench.core.bases.handle import FLAT, index, spread_affine, take_affine
from mpmbench.core.compiled import inlined, matrix, table
from mpmbench.core.compiled.algebra import squared
from mpmbench.core.compiled.rows import (
    BATCH,
    GROUPS,
    LANES,
    add_multiple,
    add_product,
    add_sums,
    fill_row,
    groups,
    put_rows,
    set_product,
    take,
)


@inlined
def put_moments(grid, at, p, n, work, part):
    """Write moments in the place of slopes, for the particles of which the functions are at hand."""
    axes, order = grid.axes, len(grid.order)
    phi, moment, _ = work
    here, arm = matrix(axes, BATCH), matrix((0.0,), LANES)
    take(axes, here, 0, part.among, p, n)
    stride = 1
    for d in range(len(axes) - 1, -1, -1):
        for g in range(groups(n)):
            for a in range(order):
                row = GROUPS * (d * order + a) + g
                fill_row(LANES, arm, 0, part.nodes[at + a * stride, d])
                add_multiple(LANES, arm, 0, -1.0, here, GROUPS * d + g)
                set_product(LANES, moment, row, phi, row, arm, 0)
        stride *= grid.shape[d]


@inlined
def divide_moments(grid, at, p, n, work, part, columns):
    """Multiply columns ``d dim + e`` by the inverse of ``D_ee``, from functions and places along e."""
    axes, dim, order = grid.axes, len(grid.axes), len(grid.order)
    _, moment, _ = work
    here, arm, D = matrix(axes, BATCH), matrix((0.0,), LANES), matrix((0.0,), BATCH)
    take(axes, here, 0, part.among, p, n)
    stride = 1
    for e in range(dim - 1, -1, -1):
        width = part.nodes[at + (order - 1) * stride, e] - part.nodes[at, e]
        least = FLAT * width * width
        for g in range(groups(n)):
            fill_row(LANES, D, g, 0.0)
            for a in range(order):
                fill_row(LANES, arm, 0, part.nodes[at + a * stride, e])
                add_multiple(LANES, arm, 0, -1.0, here, GROUPS * e + g)
                add_product(LANES, D, g, moment, GROUPS * (e * order + a) + g, arm, 0)
        for b in range(len(LANES) * groups(n)):  # whole vectors, without a branch
            D[0, b] = (D[0, b] > least) / max(D[0, b], least)
        for d in range(dim):
            for g in range(groups(n)):
                c = GROUPS * (d * dim + e) + g
                set_product(LANES, columns, c, columns, c, D, g)
        stride *= grid.shape[e]


def _take_affine(grid, at, p, n, work, part, v_i):
    dim = len(grid.axes)
    phi, moment, _ = work
    put_moments(grid, at, p, n, work, part)
    weight, along = matrix(grid.axes, LANES), matrix((0.0,), LANES)
    sums = table(grid.axes, grid.axes, BATCH)
    for g in range(groups(n)):
        for r in range(dim * dim):
            fill_row(LANES, sums, GROUPS * r + g, 0.0)
        for k in range(lines(grid)):
            line_weights(grid, k, g, phi, moment, weight)
            i = index(grid, at, k * len(grid.order))
            for d in range(dim):
                if dim > 1:
                    along_line(grid, v_i, i, d, phi, g, along)
                for e in range(dim - 1):
                    add_product(LANES, sums, GROUPS * (d * dim + e) + g, weight, 1 + e, along, 0)
                along_line(grid, v_i, i, d, moment, g, along)
                r = GROUPS * ((d + 1) * dim - 1) + g
                add_product(LANES, sums, r, weight, 0, along, 0)
        b = len(LANES) * g
        put_rows(squared(grid.axes), sums, g, part.affine, p + b, n - b)


def _spread_affine(grid, at, p, n, work, part, m, column, sums):
    dim, order, last = len(grid.axes), len(grid.order), len(grid.axes) - 1
    phi, moment, _ = work
    put_moments(grid, at, p, n, work, part)
    columns, mass = table(grid.axes, grid.axes, BATCH), matrix((0.0,), BATCH)
    take(squared(grid.axes), columns, 0, part.affine, p, n)
    take((0.0,), mass, 0, m, p, n)
    for r in range(dim * dim):
        for g in range(groups(n)):
            set_product(LANES, columns, GROUPS * r + g, columns, GROUPS * r + g, mass, g)
    if part.moments:
        divide_moments(grid, at, p, n, work, part, columns)
    weight, folded = matrix(grid.axes, LANES), matrix((0.0, 0.0), LANES)
    added, total = table(grid.order, LANES, LANES), table(grid.order, (0.0,), LANES)
    for k in range(lines(grid)):
        for r in range(order * dim):
            fill_row(LANES, added, r, 0.0)
        for g in range(groups(n)):
            line_weights(grid, k, g, phi, moment, weight)
            for d in range(dim):
                fill_row(LANES, folded, 0, 0.0)
                for e in range(last):
                    c = GROUPS * (d * dim + e) + g
                    add_product(LANES, folded, 0, weight, 1 + e, columns, c)
                c = GROUPS * (d * dim + last) + g
                set_product(LANES, folded, 1, weight, 0, columns, c)
                for a in range(order):
                    row = GROUPS * (last * order + a) + g
                    add_product(LANES, added, a * dim + d, phi, row, folded, 0)
                    add_product(LANES, added, a * dim + d, moment, row, folded, 1)
        i = index(grid, at, k * order)
        for r in range((order * dim + len(LANES) - 1) // len(LANES)):
            fill_row(LANES, total, r, 0.0)
            add_sums(LANES, LANES, total, r, added, r * len(LANES))
        for r in range(order * dim):
            sums[i + r // dim, column + r % dim] += total[r // len(LANES), r % len(LANES)]


ANSWERS[take_affine] = _take_affine
ANSWERS[spread_affine] = _spread_affine
