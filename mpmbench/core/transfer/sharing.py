"""Particles that share a change of volume and a pressure, for F-bar: who they are, and how they share."""

from typing import NamedTuple

import numpy as np

from mpmbench.core.compiled import inlined, lean, matrix
from mpmbench.core.compiled.algebra import determinant


class Cells(NamedTuple):
    """Particles that share: those of cell c are ``member[first[c] : first[c + 1]]``."""

    first: np.ndarray
    member: np.ndarray


def cells_of(mark: np.ndarray, particles: np.ndarray) -> Cells:
    """Cells of the given particles, shape (n,), each with its mark, shape (n,): those with equal marks share."""
    counts = np.unique(mark, return_counts=True)[1]
    first = np.concatenate([[0], np.cumsum(counts)])
    return Cells(first, particles[np.argsort(mark, kind="stable")])


@lean
def share_change(axes, cells, V, dt, L, start, stop):
    """Change L in cells start to stop: ``det(I + dt L)`` is that of all particles of a cell together."""
    dim, increment = len(axes), matrix(axes, axes)
    for c in range(start, stop):
        before, after = 0.0, 0.0
        for m in range(cells.first[c], cells.first[c + 1]):
            p = cells.member[m]
            volume = V[p]
            before += volume
            after += volume * change(axes, dt, L[p], increment)
        for m in range(cells.first[c], cells.first[c + 1]):
            p = cells.member[m]
            J = change(axes, dt, L[p], increment)
            scale = 1.0  # where one is turned inside out, as a guard will see
            if after > 0.0 and J > 0.0:
                scale = (after / before / J) ** (1.0 / dim)
            for d in range(dim):
                for e in range(dim):
                    L[p, d, e] *= scale
                L[p, d, d] += (scale - 1.0) / dt if dt > 0.0 else 0.0


@inlined
def change(axes, dt, L, increment):
    """Write ``I + dt L``; its determinant."""
    for d in range(len(axes)):
        for e in range(len(axes)):
            increment[d, e] = dt * L[d, e] + (1.0 if d == e else 0.0)
    return determinant(axes, increment)


@lean
def share_pressure(axes, cells, V, sigma, start, stop):
    """Give the stresses of the particles in cells start to stop the mean pressure by volume."""
    dim = len(axes)
    for c in range(start, stop):
        volume, mean = 0.0, 0.0
        for m in range(cells.first[c], cells.first[c + 1]):
            p = cells.member[m]
            volume += V[p]
            for d in range(dim):
                mean += V[p] * sigma[p, d, d] / dim
        for m in range(cells.first[c], cells.first[c + 1]):
            p = cells.member[m]
            own = 0.0
            for d in range(dim):
                own += sigma[p, d, d] / dim
            for d in range(dim):
                sigma[p, d, d] += mean / volume - own
