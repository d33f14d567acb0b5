"""Pairs of functions of all products along axes, summed over the particles of a cell: for the consistent mass."""

from mpmbench.core.bases.grid.product import ANSWERS, weigh
from mpmbench.core.bases.handle import add_pairs
from mpmbench.core.compiled import matrix
from mpmbench.core.compiled.rows import (
    BATCH,
    GROUPS,
    LANES,
    add_product,
    add_sums,
    fill_row,
    groups,
    set_multiple,
    set_product,
    take,
)


def _add_pairs(grid, at, start, p, n, work, functions, m, phi_p, pairs):
    order = len(grid.order)
    phi, values, heavy = work[0], matrix(functions, BATCH), matrix(functions, BATCH)
    mass, added = matrix((0.0,), BATCH), matrix(LANES, LANES)
    weigh(grid, at, start, n, work)
    take((0.0,), mass, 0, m, p, n)
    pair = 0
    for k in range(len(functions)):
        for g in range(groups(n)):
            row, left = GROUPS * k + g, k // order
            last = GROUPS * ((len(grid.axes) - 1) * order + k % order) + g  # the fastest axis
            set_multiple(LANES, values, row, 1.0, phi, last)
            for d in range(len(grid.axes) - 2, -1, -1):
                along = GROUPS * (d * order + left % order) + g
                set_product(LANES, values, row, values, row, phi, along)
                left //= order
            set_product(LANES, heavy, row, values, row, mass, g)
        for j in range(k + 1):
            i = pair % len(LANES)
            set_product(LANES, added, i, heavy, GROUPS * k, values, GROUPS * j)
            for g in range(1, groups(n)):
                add_product(LANES, added, i, heavy, GROUPS * k + g, values, GROUPS * j + g)
            pair += 1
            if pair % len(LANES) == 0:
                add_sums(LANES, LANES, pairs, pair // len(LANES) - 1, added, 0)
    if pair % len(LANES) > 0:
        for i in range(pair % len(LANES), len(LANES)):
            fill_row(LANES, added, i, 0.0)
        add_sums(LANES, LANES, pairs, pair // len(LANES), added, 0)


ANSWERS[add_pairs] = _add_pairs
