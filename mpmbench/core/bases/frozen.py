"""Shape functions that particles keep: evaluated once, gradients pushed forward by F (total Lagrangian form)."""

import numpy as np

from mpmbench.core.bases import Basis
from mpmbench.core.bases.handle import Stencils
from mpmbench.core.compiled import kernel, matrix
from mpmbench.core.compiled.algebra import inverse


@kernel
def push_forward(axes, reference, F, grad_phi):  # type: ignore[no-untyped-def]
    """``grad phi = F^-T Grad phi`` for every particle; shapes (P, K, dim), (P, dim, dim), (P, K, dim)."""
    inverse_F = matrix(axes, axes)
    for p in range(F.shape[0]):
        inverse(axes, F[p], inverse_F)
        for k in range(reference.shape[1]):
            for d in range(len(axes)):
                total = 0.0
                for e in range(len(axes)):
                    total += inverse_F[e, d] * reference[p, k, e]
                grad_phi[p, k, d] = total


class FrozenBasis:
    """Any basis, evaluated at the initial positions of the particles (fulfils `Basis`).

    Parameters
    ----------
    basis : Basis
        Where the functions come from; it stays in its initial configuration.
    X : ndarray
        Initial particle positions [m], shape (P, dim).
    F : ndarray
        Deformation gradients, shape (P, dim, dim), that belong to X now; read at every `locate`.
    """

    constant_values = True  # and with them the consistent mass matrix: it is assembled once

    def __init__(self, basis: Basis, X: np.ndarray, F: np.ndarray) -> None:
        self.nodes = basis.nodes
        self.evaluate = basis.evaluate
        self.handle = basis.evaluate(X)
        # a body may be deformed from the start: Grad phi = F^T grad phi
        self._reference = np.einsum("pde,pkd->pke", F, self.handle.grad_phi)
        self._F = F

    def locate(self, x: np.ndarray) -> None:
        """Push the gradients forward; values do not change."""
        handle: Stencils = self.handle
        push_forward(handle.axes, self._reference, self._F, handle.grad_phi)

    def first_outside(self, x: np.ndarray) -> int:
        """Particles keep their functions wherever they go; a lost one is not a number."""
        lost = np.flatnonzero(~np.isfinite(x).all(axis=1))
        return int(lost[0]) if len(lost) else -1

    def move(self, displacement: np.ndarray) -> None:
        """Nothing to do: the functions live on the initial nodes."""
