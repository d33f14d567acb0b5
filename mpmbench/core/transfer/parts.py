"""What a step does besides in its passes over the particles: more to the nodes and from them, and a look at the new.

`p2g` and `g2p` ask the first two questions about every run of particles in one cell, when the functions
there are at hand; for most transfers nothing is to be done. The third one is about a batch that has just
been updated, which another pass would have to bring from memory once more.
"""

from typing import NamedTuple

import numpy as np

from mpmbench.core.bases.handle import Affine, locate, scratch, spread_affine, take_affine
from mpmbench.core.compiled import implements
from mpmbench.core.particles import FINITE


class Nothing(NamedTuple):
    """There is nothing besides."""

    besides: float = 0.0


NOTHING = Nothing()


class InBox(NamedTuple):
    """Particles on a grid, which is this box [m], shapes (dim,); they are looked at while they are updated."""

    lower: np.ndarray
    upper: np.ndarray


def also_spread(
    part: Nothing | Affine,
    phi: object,
    at: int,
    p: int,
    n: int,
    work: object,
    m: np.ndarray,
    column: int,
    sums: np.ndarray,
) -> None:
    """Add what n particles from `p` on, `at` one place, carry besides, to the columns of momentum from `column` on."""
    raise NotImplementedError


def also_take(
    part: Nothing | Affine,
    phi: object,
    at: int,
    b: int,
    p: int,
    n: int,
    work: object,
    v_i: np.ndarray,
    fields: np.ndarray,
) -> None:
    """Take what n particles from `p` on, the b-th of the batch whose `fields` were interpolated, carry besides."""
    raise NotImplementedError


def watch(
    box: Nothing | InBox,
    phi: object,
    p: object,
    first: int,
    n: int,
    solid: bool,
    at: object,
    update: object,
) -> tuple[int, int]:
    """Of n particles from `first` on, which were `at` their cells: how many left these, and how many a guard must see.

    These are outside the box, or have a volume that is not positive and finite, if they are `solid`.
    """
    raise NotImplementedError


@implements(watch, Nothing)
def _watch_nothing(box, phi, p, first, n, solid, at, update):
    return 0, 0


@implements(watch, InBox)
def _watch_in_box(box, phi, p, first, n, solid, at, update):
    work, crossed, bad = scratch(phi), 0, 0
    for b in range(n):
        if update.position:
            inside = True
            for d in range(len(phi.axes)):
                inside = inside and box.lower[d] <= p.x[first + b, d] <= box.upper[d]
            if not inside:
                bad += 1
            elif solid and locate(phi, p.x, first + b, work) != at[b]:
                crossed += 1
        if update.strain and solid and not 0.0 < p.V[first + b] < FINITE:
            bad += 1
    return crossed, bad


@implements(also_spread, Nothing)
def _spread_nothing(part, phi, at, p, n, work, m, column, sums):
    pass


@implements(also_take, Nothing)
def _take_nothing(part, phi, at, b, p, n, work, v_i, fields):
    pass


@implements(also_spread, Affine)
def _spread_affine(part, phi, at, p, n, work, m, column, sums):
    spread_affine(phi, at, p, n, work, part, m, column, sums)


@implements(also_take, Affine)
def _take_affine(part, phi, at, b, p, n, work, v_i, fields):
    dim = len(phi.axes)
    if part.moments:
        take_affine(phi, at, p, n, work, part, v_i)
        return
    for j in range(n):
        for d in range(dim):
            for e in range(dim):
                part.affine[p + j, d, e] = fields[(2 + d) * dim + e, b + j]
