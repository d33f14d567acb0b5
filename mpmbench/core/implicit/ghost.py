"""Ghost stiffness: a faint elastic skeleton, which holds nodes that few particles see.

``eps E int grad N_I . grad N_J`` over the cells with particles acts on the increment of
displacement; eps is the key ``method.ghost_stiffness``.
"""

from dataclasses import dataclass

import numpy as np

from mpmbench.core.bases import Basis
from mpmbench.core.bases.cells.simplices import FixedSimplices
from mpmbench.core.bases.grid.spline import TensorSpline
from mpmbench.core.bases.handle import Stencils, fill
from mpmbench.core.compiled import compiled
from mpmbench.core.errors import NotApplicable
from mpmbench.core.geometry import simplex_volumes, tensor_points


@dataclass(frozen=True)
class GhostCells:
    """Cells with points in them (C of them).

    Attributes
    ----------
    point : ndarray of int
        One point of each cell, whose nodes are those of the cell, shape (C,).
    laplace : ndarray
        ``int grad N_I . grad N_J`` over each cell [m^(dim - 2)], shape (C, K, K).
    """

    point: np.ndarray
    laplace: np.ndarray


class GhostSimplices:
    """The same on a fixed triangulation, where gradients are constant."""

    def __init__(self, basis: FixedSimplices) -> None:
        self._basis = basis
        self._volume = simplex_volumes(basis.nodes, basis.simplices)

    def cells(self, phi: Stencils) -> GhostCells:
        """The simplices that the points of `phi` are in."""
        simplex, point = np.unique(self._basis.simplex, return_index=True)
        gradient = phi.grad_phi[point]
        return GhostCells(
            point, np.einsum("c,ckd,cnd->ckn", self._volume[simplex], gradient, gradient)
        )


def ghost_of(basis: Basis) -> "GhostGrid | GhostSimplices":
    """The ghost cells of a background grid.

    Raises
    ------
    NotApplicable
        When there is none.
    """
    if isinstance(basis, TensorSpline):
        return GhostGrid(basis)
    if isinstance(basis, FixedSimplices):
        return GhostSimplices(basis)
    raise NotApplicable(
        "method.ghost_stiffness > 0 needs a background grid: basis=linear or bspline"
    )


class GhostGrid:
    """Laplace matrices of all cells of a fixed grid, made once."""

    def __init__(self, basis: TensorSpline) -> None:
        abscissae, weight = np.polynomial.legendre.leggauss(basis.degree + 1)
        dim = len(basis.cells)
        local = tensor_points([(abscissae + 1.0) / 2.0] * dim)
        weights = np.prod(tensor_points([weight / 2.0] * dim), axis=1)
        lower = tensor_points([basis.breaks(d)[:-1] for d in range(dim)])
        width = tensor_points([np.diff(basis.breaks(d)) for d in range(dim)])
        points = (lower[:, None, :] + local * width[:, None, :]).reshape(-1, dim)
        stored = Stencils.empty(len(points), (basis.degree + 1) ** dim, dim)
        fill(basis.handle, points, stored.size, stored.index, stored.phi, stored.grad_phi)
        gradient = stored.grad_phi.reshape(len(lower), len(weights), -1, dim)
        volume = np.prod(width, axis=1)
        self._table = np.einsum("c,g,cgkd,cgnd->ckn", volume, weights, gradient, gradient)
        self._cell = np.full(len(basis.nodes), -1, dtype=np.int64)
        self._cell[stored.index[:: len(weights), 0]] = np.arange(len(lower))

    def cells(self, phi: Stencils) -> GhostCells:
        """The cells that the points of `phi` are in."""
        first, point = np.unique(phi.index[:, 0], return_index=True)
        return GhostCells(point, self._table[self._cell[first]])


@compiled
def add_ghost(phi, point, laplace, stiffness, du, force, slot, blocks):
    """Add ``eps E L du`` to the forces, shape (N, dim), and ``eps E L`` to the blocks."""
    for c in range(point.shape[0]):
        p = point[c]
        for k in range(phi.size[p]):
            i = phi.index[p, k]
            for n in range(phi.size[p]):
                value = stiffness * laplace[c, k, n]
                for d in range(du.shape[1]):
                    force[i, d] += value * du[phi.index[p, n], d]
                if slot[p, k, n] >= 0:
                    for d in range(du.shape[1]):
                        blocks[slot[p, k, n], d, d] += value
