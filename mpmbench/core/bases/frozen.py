"""Shape functions that particles keep (total Lagrangian form): F pushes their gradients forward."""

import numpy as np

from mpmbench.core.bases import Basis, StoredBasis
from mpmbench.core.bases.handle import Stencils
from mpmbench.core.compiled import kernel, matrix
from mpmbench.core.compiled.algebra import inverse


@kernel
def push_forward(axes, reference, F, grad_phi):
    """``grad phi = F^-T Grad phi`` for every particle.

    Gradients have the shape (P, K, dim), F has (P, dim, dim).
    """
    inverse_F = matrix(axes, axes)
    for p in range(F.shape[0]):
        inverse(axes, F[p], inverse_F)
        for k in range(reference.shape[1]):
            for d in range(len(axes)):
                total = 0.0
                for e in range(len(axes)):
                    total += inverse_F[e, d] * reference[p, k, e]
                grad_phi[p, k, d] = total


class FrozenBasis(StoredBasis):
    """Any basis, evaluated at the initial positions of the particles, wherever they go.

    Parameters
    ----------
    basis : Basis
        Where the functions come from; it stays in its initial configuration.
    X : ndarray
        Initial particle positions [m], shape (P, dim).
    F : ndarray
        Deformation gradients, shape (P, dim, dim), that belong to X now; read at every `locate`.
    """

    constant_values = True

    def __init__(self, basis: Basis, X: np.ndarray, F: np.ndarray) -> None:
        self.nodes, self._basis = basis.nodes, basis
        self.handle = basis.evaluate(X)
        # a body may be deformed from the start: Grad phi = F^T grad phi
        self._reference = np.einsum("pde,pkd->pke", F, self.handle.grad_phi)
        self._F = F

    def evaluate(self, x: np.ndarray) -> Stencils:
        return self._basis.evaluate(x)

    def locate(self, x: np.ndarray) -> None:
        """Push the gradients forward; values do not change."""
        push_forward(self.handle.axes, self._reference, self._F, self.handle.grad_phi)

    def move(self, displacement: np.ndarray) -> None:
        """Nothing to do: the functions live on the initial nodes."""
