"""Linear functions on the simplices of a triangulation whose nodes move one by one: linear finite elements.

Barycentric coordinates of a particle are its state, as are the parametric coordinates on quads
(`quads`).
"""

import numpy as np
from scipy.spatial import cKDTree

from mpmbench.core.bases.handle import Stencils
from mpmbench.core.bases.quads import push_gradients
from mpmbench.core.errors import BadSetting, BrokeDown
from mpmbench.core.geometry import Cloud

NEAREST = 16  # simplices by their barycentres that are tried before all others
INSIDE = 1e-9  # barycentric coordinates above minus this count as inside


class MovingSimplices:
    """Linear functions on simplices that deform with their nodes (fulfils `Basis`).

    Parameters
    ----------
    cloud : Cloud
        With simplices.
    particles : int
    """

    constant_values = True  # and with them the consistent mass matrix: it is assembled once

    def __init__(self, cloud: Cloud, particles: int) -> None:
        if cloud.simplices is None:
            raise BadSetting("nodes", len(cloud.nodes), "a set of nodes with a triangulation")
        self.nodes = np.array(cloud.nodes, dtype=float)
        dimension = cloud.dimension
        self.axes = (0.0,) * dimension
        self.simplices = np.array(cloud.simplices)
        left_handed = np.linalg.det(self._edges()) < 0.0
        self.simplices[left_handed, -2:] = self.simplices[left_handed, :-3:-1]
        self._derivative = np.vstack([-np.ones(dimension), np.eye(dimension)])
        self.handle = Stencils.empty(particles, dimension + 1, dimension)
        self._located = False

    def _edges(self) -> np.ndarray:
        """Edges from the first corner of each simplex, as columns, shape (S, dim, dim)."""
        corners = self.nodes[self.simplices]
        return (corners[:, 1:] - corners[:, :1]).transpose(0, 2, 1)

    def evaluate(self, x: np.ndarray) -> Stencils:
        stored = Stencils.empty(len(x), len(self.axes) + 1, len(self.axes))
        self._store(x, stored)
        return stored

    def _store(self, x: np.ndarray, stored: Stencils) -> None:
        simplex, weights = self._find(x)
        stored.size[:] = weights.shape[1]
        stored.index[:] = self.simplices[simplex]
        stored.phi[:] = weights
        self._push(stored)

    def _push(self, stored: Stencils) -> None:
        derivative = np.broadcast_to(self._derivative, stored.grad_phi.shape)
        bad = push_gradients(self.axes, self.nodes, stored.index, derivative, stored.grad_phi)
        if bad >= 0:
            raise BrokeDown(f"the simplex of particle {bad} is turned inside out")

    def _find(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Simplex and barycentric coordinates of points, shapes (n,) and (n, dim + 1)."""
        corners, inverse = self.nodes[self.simplices[:, 0]], np.linalg.inv(self._edges())
        _, nearest = cKDTree(self.nodes[self.simplices].mean(axis=1)).query(
            x, k=min(NEAREST, len(corners))
        )
        nearest = np.asarray(nearest).reshape(len(x), -1)
        best, weights = self._best(x, corners, inverse, nearest)
        for p in np.flatnonzero(weights.min(axis=1) < -INSIDE):
            best[p : p + 1], weights[p : p + 1] = self._best(
                x[p : p + 1], corners, inverse, np.arange(len(corners))[None, :]
            )
            if not weights[p].min() >= -INSIDE:
                raise BrokeDown(f"point {p} at {x[p]} m is outside all simplices")
        return best, weights

    def _best(
        self, x: np.ndarray, corners: np.ndarray, inverse: np.ndarray, candidates: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """The candidate, shape (n, k), that each point is deepest in, and its barycentric coordinates there."""
        local = np.einsum("nkab,nkb->nka", inverse[candidates], x[:, None, :] - corners[candidates])
        weights = np.concatenate([1.0 - local.sum(axis=2, keepdims=True), local], axis=2)
        deepest = np.argmax(weights.min(axis=2), axis=1)
        row = np.arange(len(x))
        return candidates[row, deepest], weights[row, deepest]

    def locate(self, x: np.ndarray) -> None:
        if self._located:
            self._push(self.handle)
        else:
            self._store(x, self.handle)
            self._located = True

    def first_outside(self, x: np.ndarray) -> int:
        """Particles move with their simplices and cannot leave them; a lost one is not a number."""
        lost = np.flatnonzero(~np.isfinite(x).all(axis=1))
        return int(lost[0]) if len(lost) else -1

    def move(self, displacement: np.ndarray) -> None:
        self.nodes += displacement


class FixedSimplices(MovingSimplices):
    """Linear functions on a triangulation that stays, through which particles move (fulfils `Basis`)."""

    constant_values = False

    def __init__(self, cloud: Cloud, particles: int) -> None:
        super().__init__(cloud, particles)
        self._tree = cKDTree(self.nodes[self.simplices].mean(axis=1))
        self._corners, self._inverse = (
            self.nodes[self.simplices[:, 0]],
            np.linalg.inv(self._edges()),
        )
        self._upper, self._lower = self.nodes.max(axis=0), self.nodes.min(axis=0)
        self.simplex = np.zeros(particles, dtype=np.int64)

    def locate(self, x: np.ndarray) -> None:
        """Find the simplices of the particles again: most are where they were."""
        self.simplex, weights = self._find(x, self.simplex)
        self._fill(self.handle, self.simplex, weights)

    def evaluate(self, x: np.ndarray) -> Stencils:
        stored = Stencils.empty(len(x), len(self.axes) + 1, len(self.axes))
        self._fill(stored, *self._find(x, np.zeros(len(x), dtype=np.int64)))
        return stored

    def _fill(self, stored: Stencils, simplex: np.ndarray, weights: np.ndarray) -> None:
        stored.size[:] = weights.shape[1]
        stored.index[:] = self.simplices[simplex]
        stored.phi[:] = weights
        inverse = self._inverse[simplex]
        stored.grad_phi[:, 1:] = inverse
        stored.grad_phi[:, 0] = -inverse.sum(axis=1)

    def _find(self, x: np.ndarray, guess: np.ndarray) -> tuple[np.ndarray, np.ndarray]:  # type: ignore[override]
        best, weights = self._best(x, self._corners, self._inverse, guess[:, None])
        moved = np.flatnonzero(~(weights.min(axis=1) >= 0.0))
        if len(moved):
            _, near = self._tree.query(x[moved], k=min(NEAREST, len(self._corners)))
            near = np.asarray(near).reshape(len(moved), -1)
            best[moved], weights[moved] = self._best(x[moved], self._corners, self._inverse, near)
        for p in np.flatnonzero(~(weights.min(axis=1) >= -INSIDE)):
            everywhere = np.arange(len(self._corners))[None, :]
            best[p : p + 1], weights[p : p + 1] = self._best(
                x[p : p + 1], self._corners, self._inverse, everywhere
            )
            if not weights[p].min() >= -INSIDE:
                raise BrokeDown(f"point {p} at {x[p]} m is outside all simplices")
        return best, weights

    def first_outside(self, x: np.ndarray) -> int:
        """Number of the first point outside the bounding box of the nodes, -1 if there is none."""
        outside = np.flatnonzero(~np.all((self._lower <= x) & (x <= self._upper), axis=1))
        return int(outside[0]) if len(outside) else -1

    def move(self, displacement: np.ndarray) -> None:
        """Nothing to do: the nodes stay."""
