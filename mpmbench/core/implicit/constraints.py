"""Dirichlet conditions at points: ``sum_I N_I(x_d) u_I`` is held where nodes do not interpolate.

The points are the initial places of the fixed nodes; they move with the material along free
components, and so do the nodes then, by the field and not by their own values (`step.at_nodes`).
"""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix

from mpmbench.core.bases import Basis
from mpmbench.core.bases.handle import Stencils
from mpmbench.core.compiled import compiled
from mpmbench.core.matrix.pattern import Pattern


@dataclass
class HeldPoints:
    """Points with prescribed components (C components in all).

    Attributes
    ----------
    X, x, u : ndarray
        Initial and current positions, and displacements so far [m], shape (n, dim).
    point, component : ndarray of int
        The point and the direction of each condition, shape (C,).
    phi : Stencils
        Functions at the points at the start of the step.
    multiplier : ndarray
        Forces that hold the points, per condition, with the sign of the displacement they oppose
        [N], shape (C,).
    """

    X: np.ndarray
    x: np.ndarray
    u: np.ndarray
    point: np.ndarray
    component: np.ndarray
    phi: Stencils
    multiplier: np.ndarray

    @classmethod
    def at_nodes(cls, basis: Basis, fixed: np.ndarray) -> "HeldPoints":
        """Hold the points where nodes with components in `fixed`, shape (N, dim), are now."""
        chosen = np.flatnonzero(fixed.any(axis=1))
        point, component = np.nonzero(fixed[chosen])
        x = basis.nodes[chosen].copy()
        return cls(
            x.copy(), x, np.zeros_like(x), point, component, basis.evaluate(x), np.zeros(len(point))
        )

    def matrix(self, pattern: Pattern, dim: int) -> csr_matrix:
        """``G``, shape (C, A dim): ``G u`` are the held displacements."""
        row, column, value = [], [], []
        for c, (d, component) in enumerate(zip(self.point, self.component, strict=True)):
            k = int(self.phi.size[d])
            row.append(np.full(k, c))
            column.append(pattern.row[self.phi.index[d, :k]] * dim + component)
            value.append(self.phi.phi[d, :k])
        shape = (len(self.point), len(pattern.active) * dim)
        return csr_matrix(
            (np.concatenate(value), (np.concatenate(row), np.concatenate(column))), shape=shape
        )


@compiled
def add_augmentation(phi, point, component, stiffness, slot, blocks):
    """Add ``stiffness G^T G`` to the blocks; `slot` has the shape (n, K, K).

    It changes nothing where the constraint ``G u = u_d`` is met, and makes the matrix definite.
    """
    for c in range(point.shape[0]):
        p, d = point[c], component[c]
        for k in range(phi.size[p]):
            for n in range(phi.size[p]):
                s = slot[p, k, n]
                if s >= 0:
                    blocks[s, d, d] += stiffness * phi.phi[p, k] * phi.phi[p, n]
