"""Shape functions that particles keep (total Lagrangian form): F pushes their gradients forward."""

import numpy as np

from mpmbench.core.bases import Basis, StoredBasis
from mpmbench.core.bases.handle import Stencils
from mpmbench.core.compiled import compiled, matrix
from mpmbench.core.compiled.algebra import inverse, transform_rows


@compiled
def push_forward(axes, reference, F, grad_phi):
    """``grad phi = F^-T Grad phi`` for every particle, shapes (P, K, dim) and (P, dim, dim)."""
    inverse_F = matrix(axes, axes)
    for p in range(F.shape[0]):
        inverse(axes, F[p], inverse_F)
        transform_rows(axes, reference, p, inverse_F, grad_phi)


class FrozenBasis(StoredBasis):
    """Any basis, evaluated at the initial positions X of the particles, wherever they go.

    Their deformation gradients F, shape (P, dim, dim), are read at every `locate`, and X stays.
    """

    constant_values = True

    def __init__(self, basis: Basis, X: np.ndarray, F: np.ndarray) -> None:
        self.nodes, self.X, self._basis = basis.nodes, X.copy(), basis
        self.handle = basis.evaluate_particles(X, np.arange(len(X)))
        # a body may be deformed from the start: Grad phi = F^T grad phi
        self._reference = np.einsum("pde,pkd->pke", F, self.handle.grad_phi)
        self._F = F

    def evaluate(self, x: np.ndarray) -> Stencils:
        return self._basis.evaluate(x)

    def locate(self, x: np.ndarray) -> None:
        push_forward(self.handle.axes, self._reference, self._F, self.handle.grad_phi)

    def move(self, displacement: np.ndarray) -> None:
        """Nothing to do: the functions live on the initial nodes."""
