"""What a step takes to the nodes and from them besides velocities, in the same pass over the particles.

`p2g` and `g2p` ask these two questions about every run of particles in one cell, when the functions
there are at hand; for most transfers nothing is to be done.
"""

from typing import NamedTuple

import numpy as np

from mpmbench.core.bases.handle import Affine, spread_affine, take_affine
from mpmbench.core.compiled import implements


class Nothing(NamedTuple):
    """There is nothing besides."""

    besides: float = 0.0


NOTHING = Nothing()


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
