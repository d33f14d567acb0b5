"""Gradients that weigh nodes by their distance, as MLS-MPM has them (Hu et al. 2018).

``grad phi_i(x) = phi_i D^-1 (x_i - x)`` with ``D = sum_i phi_i (x_i - x) (x) (x_i - x)``, h^2 / 4 for
quadratic splines away from edges, instead of the derivative of phi_i: the gradient of the field
that is affine around x and nearest to the nodal values, with the functions as weights. It gives
linear fields their gradient, and constant ones none, as derivatives do.
"""

import numpy as np

from mpmbench.core.bases import Basis, StoredBasis
from mpmbench.core.bases.handle import FLAT, Stencils, fill
from mpmbench.core.compiled import compiled, matrix, vector
from mpmbench.core.compiled.algebra import divide_by
from mpmbench.core.particles import Particles

SPARE = 4  # functions that a point may get beyond the most so far, before there is new memory


@compiled
def weigh_by_distance(axes, x, nodes, stored):
    """Write the gradients at points x, shape (n, dim), to `stored`, which has the values."""
    D, inverse, arm = matrix(axes, axes), matrix(axes, axes), vector(axes)
    for p in range(x.shape[0]):
        farthest = 0.0
        for d in range(len(axes)):
            for e in range(len(axes)):
                D[d, e], inverse[d, e] = 0.0, 1.0 if d == e else 0.0
        for k in range(stored.size[p]):
            for d in range(len(axes)):
                arm[d] = nodes[stored.index[p, k], d] - x[p, d]
                farthest = max(farthest, arm[d] * arm[d])
            for d in range(len(axes)):
                for e in range(d + 1):
                    D[d, e] += stored.phi[p, k] * arm[d] * arm[e]
        divide_by(axes, D, FLAT * farthest, inverse)
        for k in range(stored.size[p]):
            for d in range(len(axes)):
                total = 0.0
                for e in range(len(axes)):
                    total += inverse[d, e] * (nodes[stored.index[p, k], e] - x[p, e])
                stored.grad_phi[p, k, d] = stored.phi[p, k] * total


class AffineGradients(StoredBasis):
    """The values of another basis, `within`, with gradients by distance."""

    def __init__(self, within: Basis, particles: int) -> None:
        self.within, self.nodes = within, within.nodes
        self.handle = Stencils.empty(particles, within.handle.width, within.nodes.shape[1])

    def follow(self, particles: Particles) -> None:
        self.within.follow(particles)

    def evaluate(self, x: np.ndarray) -> Stencils:
        stored = self.within.evaluate(x)
        weigh_by_distance(stored.axes, x, self.nodes, stored)
        return stored

    def locate(self, x: np.ndarray) -> None:
        self.within.locate(x)
        phi = self.within.handle
        if phi.width > self.handle.width:
            self.handle = Stencils.empty(len(x), phi.width + SPARE, x.shape[1])
        stored = self.handle
        fill(phi, x, stored.size, stored.index, stored.phi, stored.grad_phi)
        weigh_by_distance(stored.axes, x, self.nodes, stored)

    def first_outside(self, x: np.ndarray) -> int:
        return self.within.first_outside(x)

    def carry(self, v: np.ndarray, dt: float) -> None:
        self.within.carry(v, dt)

    def move(self, displacement: np.ndarray) -> None:
        self.within.move(displacement)
        self.nodes = self.within.nodes

    def statistics(self) -> dict[str, tuple[float, str, str]]:
        return self.within.statistics()
