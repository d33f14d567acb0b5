"""Functions of a point's nearest nodes: search, and repair of clouds that do not suffice.

The cloud of a point holds the nodes closer than a search radius, but at least a minimum number. A
point whose functions cannot be found, or only from an ill-conditioned matrix or by extrapolation,
takes in the next nearest node, and the next (Iaconeta 2017, section 5.3).
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from mpmbench.core.bases import StoredBasis
from mpmbench.core.bases.grid.product import first_outside
from mpmbench.core.bases.handle import Stencils
from mpmbench.core.errors import BadSetting, BrokeDown

SLACK = 1e-12  # of the radius: so far outside the box of fixed nodes is round-off
SPARE = 4  # nodes that are looked up beyond the largest cloud, for repairs
# A radius that grows reaches beyond the last node, which would have no weight otherwise.
BEYOND_LAST = 1.1
LARGEST_CLOUD = 200  # a point that needs more nodes than this has no functions
# Rounds in which nodes are added for conditioning, which points on the hull never reach.
STRICT_ROUNDS = 8


class Clouds(NamedTuple):
    """The nodes near each of n points."""

    nodes: np.ndarray  # positions of all nodes [m], shape (N, dim)
    x: np.ndarray  # those of the points [m], shape (n, dim)
    near: np.ndarray  # numbers of the nearest nodes by their distance, shape (n, K)
    size: np.ndarray  # how many of them are in the cloud, shape (n,)
    radius: np.ndarray  # of the cloud [m], shape (n,)


# fill(clouds, points, strict, stored, failed) evaluates the functions of some points, and marks
# those that have none or, if strict, ill-conditioned ones.
Fill = Callable[[Clouds, np.ndarray, bool, Stencils, np.ndarray], None]


class CloudBasis(StoredBasis):
    """Functions of the nodes closer to a point than `radius` [m], but of at least `minimum_nodes`.

    Points outside the box around the nodes are lost, unless these are `moving`: then end points sit
    on the hull.

    Attributes
    ----------
    repaired : int
        Number of points whose cloud was enlarged last time because their functions failed.
    """

    def __init__(
        self,
        nodes: np.ndarray,
        particles: int,
        radius: float,
        minimum_nodes: int,
        fill: Fill,
        moving: bool,
    ) -> None:
        self.nodes = np.array(nodes, dtype=float)
        least = max(minimum_nodes, self.nodes.shape[1] + 1)
        if len(self.nodes) < least:
            raise BadSetting("nodes", len(self.nodes), f"at least {least} nodes")
        self.radius, self.minimum_nodes = radius, minimum_nodes
        self._fill_points = fill
        self._tree = cKDTree(self.nodes)
        self._width = min(len(self.nodes), max(minimum_nodes, 2 * self.nodes.shape[1]) + SPARE)
        slack = np.finfo(float).max if moving else SLACK * radius
        self._lower, self._upper = self.nodes.min(axis=0) - slack, self.nodes.max(axis=0) + slack
        self.handle = Stencils.empty(particles, 1, self.nodes.shape[1])
        self.repaired = 0

    def first_outside(self, x: np.ndarray) -> int:
        return int(first_outside(x, self._lower, self._upper))

    def move(self, displacement: np.ndarray) -> None:
        self.nodes += displacement
        if (lost := super().first_outside(self.nodes)) >= 0:
            raise BrokeDown(f"node {lost} has no finite position")
        self._tree = cKDTree(self.nodes)

    def _fill(self, x: np.ndarray, stored: Stencils) -> Stencils:
        if (lost := super().first_outside(x)) >= 0:
            raise BrokeDown(f"point {lost} has no finite position")
        x = np.ascontiguousarray(x)
        distance, near = self._nearest(x)
        count = np.maximum(np.sum(distance < self.radius, axis=1), self.minimum_nodes)
        radius = np.zeros(len(x))
        width = int(count.max(initial=1)) + SPARE
        if stored.width < width:
            stored = Stencils.empty(len(x), width, x.shape[1])
        points, rounds = np.arange(len(x)), 0
        while points.size:
            most = int(count[points].max())
            if rounds > 0 and most > min(LARGEST_CLOUD, len(self.nodes)):
                p = points[int(np.argmax(count[points]))]
                raise BrokeDown(
                    f"lost basis: no functions at point {p} ({np.array2string(x[p], precision=6)} "
                    f"m) from its {most - 1} nearest nodes"
                )
            if most > distance.shape[1]:
                self._width = min(len(self.nodes), most + SPARE)
                distance, near = self._nearest(x)
            if most > stored.width:
                stored = _widened(stored, most + SPARE - stored.width)
            # the search radius, or more around the nodes that are needed
            farthest = np.take_along_axis(distance[points], count[points, None] - 1, axis=1)[:, 0]
            radius[points] = np.where(farthest < self.radius, self.radius, BEYOND_LAST * farthest)
            failed = np.zeros(len(x), dtype=np.bool_)
            # with all nodes in a cloud there is nothing to take in
            strict = rounds < STRICT_ROUNDS and most < len(self.nodes)
            clouds = Clouds(self.nodes, x, near, count, radius)
            self._fill_points(clouds, points, strict, stored, failed)
            points = np.flatnonzero(failed)
            self.repaired = points.size if rounds == 0 else self.repaired
            count[points] += 1
            rounds += 1
        return stored

    def _nearest(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Distances and numbers of the nearest nodes: all within the radius, a few to spare."""
        while True:
            found = self._tree.query(x, k=np.arange(1, self._width + 1))
            distance, near = np.asarray(found[0]), np.asarray(found[1], dtype=np.int64)
            if self._width == len(self.nodes) or not (distance[:, -1] < self.radius).any():
                return distance, near
            self._width = min(len(self.nodes), int(1.5 * self._width) + 1)


def _widened(stored: Stencils, more: int) -> Stencils:
    """The same functions with room for more nodes per point."""
    room = [(0, 0), (0, more), (0, 0)]
    index, phi, grad_phi = (
        np.pad(part, room[: part.ndim]) for part in (stored.index, stored.phi, stored.grad_phi)
    )
    return stored._replace(index=index, phi=phi, grad_phi=grad_phi)
