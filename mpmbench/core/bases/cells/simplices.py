"""Linear functions on the simplices of a triangulation, which move with their nodes or stay.

Barycentric coordinates of a particle are its state, as are the parametric coordinates on quads
(`quads`).
"""

import numpy as np

from mpmbench.core.bases.cells.quads import MovingCells
from mpmbench.core.bases.handle import Stencils
from mpmbench.core.errors import BadSetting, BrokeDown
from mpmbench.core.geometry import Cloud, search_tree
from mpmbench.core.geometry.outside import first_outside_box

NEAREST = 16  # simplices by their barycentres that are tried before all others
INSIDE = 1e-9  # barycentric coordinates above minus this count as inside


class MovingSimplices(MovingCells):
    """Linear functions on simplices that deform with their nodes."""

    cell_name = "simplex"

    def __init__(self, cloud: Cloud, particles: int) -> None:
        if cloud.simplices is None:
            raise BadSetting("nodes", len(cloud.nodes), "a set of nodes with a triangulation")
        super().__init__(cloud.nodes, particles, cloud.dimension + 1)
        self.simplices = np.array(cloud.simplices)
        left_handed = np.linalg.det(self._edges()) < 0.0
        self.simplices[left_handed, -2:] = self.simplices[left_handed, :-3:-1]

    def _edges(self) -> np.ndarray:
        """Edges of the simplices as `SimplexSearch` takes them."""
        corners = self.nodes[self.simplices]
        return (corners[:, 1:] - corners[:, :1]).transpose(0, 2, 1)

    def _attach(self, x: np.ndarray, stored: Stencils) -> np.ndarray:
        self._store(stored, *SimplexSearch(self.nodes, self.simplices, self._edges()).find(x))
        dimension = len(self.axes)
        derivative = np.vstack([-np.ones(dimension), np.eye(dimension)])
        return np.broadcast_to(derivative, stored.grad_phi.shape)

    def _store(self, stored: Stencils, simplex: np.ndarray, weights: np.ndarray) -> None:
        """Store nodes and values of points, given their simplices and barycentric coordinates."""
        stored.size[:] = stored.width
        stored.index[:] = self.simplices[simplex]
        stored.phi[:] = weights


class SimplexSearch:
    """Finds the simplices that points are in, first among those whose barycentres are near.

    Their edges are columns, from the first corner [m], shape (S, dim, dim).
    """

    def __init__(self, nodes: np.ndarray, simplices: np.ndarray, edges: np.ndarray) -> None:
        self._tree = search_tree(nodes[simplices].mean(axis=1))
        self._corners, self.inverse = nodes[simplices[:, 0]], np.linalg.inv(edges)

    def find(self, x: np.ndarray, guess: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Simplex and barycentric coordinates of points, shapes (n,) and (n, dim + 1).

        A `guess` of the simplices, shape (n,), stays where it is right.
        """
        if guess is None:
            best, weights = self._best(x, self._near(x))
        else:
            best, weights = self._best(x, guess[:, None])
            if len(moved := np.flatnonzero(~(weights.min(axis=1) >= 0.0))):
                best[moved], weights[moved] = self._best(x[moved], self._near(x[moved]))
        for p in np.flatnonzero(~(weights.min(axis=1) >= -INSIDE)):
            everywhere, here = np.arange(len(self._corners))[None, :], slice(p, p + 1)
            best[here], weights[here] = self._best(x[here], everywhere)
            if not weights[p].min() >= -INSIDE:
                raise BrokeDown(f"point {p} at {x[p]} m is outside all simplices")
        return best, weights

    def _near(self, x: np.ndarray) -> np.ndarray:
        """Simplices whose barycentres are nearest, shape (n, NEAREST)."""
        _, nearest = self._tree.query(x, k=min(NEAREST, len(self._corners)))
        return np.asarray(nearest).reshape(len(x), -1)

    def _best(self, x: np.ndarray, candidates: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The candidate, shape (n, k), that each point is deepest in, and its place there."""
        from_corner = x[:, None, :] - self._corners[candidates]
        local = np.einsum("nkab,nkb->nka", self.inverse[candidates], from_corner)
        weights = np.concatenate([1.0 - local.sum(axis=2, keepdims=True), local], axis=2)
        deepest = np.argmax(weights.min(axis=2), axis=1)
        row = np.arange(len(x))
        return candidates[row, deepest], weights[row, deepest]


class FixedSimplices(MovingSimplices):
    """Linear functions on a triangulation that stays, through which particles move."""

    constant_values = False

    def __init__(self, cloud: Cloud, particles: int) -> None:
        super().__init__(cloud, particles)
        self._search = SimplexSearch(self.nodes, self.simplices, self._edges())
        self._upper, self._lower = self.nodes.max(axis=0), self.nodes.min(axis=0)
        self.simplex = np.zeros(particles, dtype=np.int64)

    def locate(self, x: np.ndarray) -> None:
        """Find the simplices of the particles again: most are where they were."""
        self.simplex, weights = self._search.find(x, self.simplex)
        self._store(self.handle, self.simplex, weights)

    def _fill(self, x: np.ndarray, stored: Stencils) -> Stencils:
        self._store(stored, *self._search.find(x, np.zeros(len(x), dtype=np.int64)))
        return stored

    def _store(self, stored: Stencils, simplex: np.ndarray, weights: np.ndarray) -> None:
        super()._store(stored, simplex, weights)
        inverse = self._search.inverse[simplex]
        stored.grad_phi[:, 1:] = inverse
        stored.grad_phi[:, 0] = -inverse.sum(axis=1)

    def first_outside(self, x: np.ndarray) -> int:
        """As any basis; outside is beyond the bounding box of the nodes."""
        return first_outside_box(x, self._lower, self._upper)

    def move(self, displacement: np.ndarray) -> None:
        """Nothing to do: the nodes stay."""
