"""Functions of a point's nearest nodes: search, and repair of clouds that do not suffice.

The cloud of a point holds the nodes closer than a search radius, but at least a minimum number. A
point whose functions cannot be found, or only from an ill-conditioned matrix or by extrapolation,
takes in the next nearest node, and the next (Iaconeta 2017, section 5.3).
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from mpmbench.core.bases import StoredBasis
from mpmbench.core.bases.clouds.search import fill_buckets, list_near, make_buckets
from mpmbench.core.bases.handle import Stencils
from mpmbench.core.compiled import threads
from mpmbench.core.errors import BadSetting, BrokeDown
from mpmbench.core.geometry import search_tree
from mpmbench.core.geometry.outside import first_outside_box

SLACK = 1e-12  # of the radius: so far outside the box of fixed nodes is round-off
SPARE = 4  # nodes that are looked up beyond the largest cloud, for repairs
# A radius that grows reaches beyond the last node, which would have no weight otherwise.
BEYOND_LAST = 1.1
LARGEST_CLOUD = 200  # a point that needs more nodes than this has no functions
# Rounds in which nodes are added for conditioning, which points on the hull never reach.
STRICT_ROUNDS = 8


class Clouds(NamedTuple):
    """Around n points; their nodes are those of the `Stencils` to be filled."""

    nodes: np.ndarray  # positions of all nodes [m], shape (N, dim)
    x: np.ndarray  # those of the points [m], shape (n, dim)
    radius: np.ndarray  # of each cloud [m], shape (n,)


# fill(clouds, points, strict, stored, failed) evaluates the functions of some points, whose nodes
# are in `stored`, and marks those that have none or, if strict, ill-conditioned ones.
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
        self._tree: Any = None  # for repairs only
        self._buckets = make_buckets(self.nodes, np.full(len(self.nodes), radius), True)
        self._width = min(len(self.nodes), max(minimum_nodes, 2 * self.nodes.shape[1]) + SPARE)
        slack = np.finfo(float).max if moving else SLACK * radius
        self._lower, self._upper = self.nodes.min(axis=0) - slack, self.nodes.max(axis=0) + slack
        self._anywhere = np.full(self.nodes.shape[1], np.finfo(float).max)
        # of the points that were asked for last
        self._points, self._failed, self._radius = np.arange(0), np.zeros(0, np.bool_), np.zeros(0)
        self.handle = Stencils.empty(particles, 1, self.nodes.shape[1])
        self.repaired = 0

    def first_outside(self, x: np.ndarray) -> int:
        return first_outside_box(x, self._lower, self._upper)

    def move(self, displacement: np.ndarray) -> None:
        self.nodes += displacement
        if (lost := super().first_outside(self.nodes)) >= 0:
            raise BrokeDown(f"node {lost} has no finite position")
        self._tree = None
        reach = np.full(len(self.nodes), self.radius)
        self._buckets = fill_buckets(self._buckets, self.nodes, reach)

    def _fill(self, x: np.ndarray, stored: Stencils) -> Stencils:
        if (lost := first_outside_box(x, -self._anywhere, self._anywhere)) >= 0:
            raise BrokeDown(f"point {lost} has no finite position")
        x = np.ascontiguousarray(x)
        stored, most, least = self._search(x, stored)
        if len(self._points) != len(x):
            self._points, self._failed = np.arange(len(x)), np.zeros(len(x), dtype=np.bool_)
            self._radius = np.zeros(len(x))
        failed, points = self._failed, self._points
        failed[:], self._radius[:] = False, self.radius
        clouds = Clouds(self.nodes, x, self._radius)

        def part(c: int, start: int, stop: int) -> None:
            strict = most < len(self.nodes)
            self._fill_points(clouds, points[start:stop], strict, stored, failed)

        threads.run(part, len(x), threads.FEW)
        self.repaired = 0
        if least < self.minimum_nodes or failed.any():
            few = stored.size < self.minimum_nodes
            others = np.flatnonzero(failed & ~few)
            self.repaired = len(others)
            for rounds, chosen in enumerate((np.flatnonzero(few), others)):
                if len(chosen):
                    stored = self._repair(clouds, chosen, rounds, stored)
        return stored

    def _search(self, x: np.ndarray, stored: Stencils) -> tuple[Stencils, int, int]:
        """List the nodes within the radius of each point, of which there are so many at most, and at least."""
        found = threads.run(
            lambda c, *part: list_near(self._buckets, self.nodes, x, self.radius, *part, stored),
            len(x),
            threads.FEW,
        )
        if (most := max(found)[0]) < stored.width:
            return stored, most, min(least for _, least in found)
        return self._search(x, Stencils.empty(len(x), most + SPARE, x.shape[1]))

    def _repair(
        self, clouds: Clouds, chosen: np.ndarray, rounds: int, stored: Stencils
    ) -> Stencils:
        """Functions of the points `chosen` from their nearest nodes, in as many rounds as it takes."""
        x = clouds.x[chosen]
        distance, near = self._nearest(x)
        count = np.maximum(stored.size[chosen], self.minimum_nodes) + rounds
        points = np.arange(len(x))  # of those chosen
        while points.size:
            most = int(count[points].max())
            if rounds > 0 and most > min(LARGEST_CLOUD, len(self.nodes)):
                p = points[int(np.argmax(count[points]))]
                raise BrokeDown(
                    f"lost basis: no functions at point {chosen[p]} "
                    f"({np.array2string(x[p], precision=6)} m) from its {most - 1} nearest nodes"
                )
            if most > distance.shape[1]:
                self._width = min(len(self.nodes), most + SPARE)
                distance, near = self._nearest(x)
            if most > stored.width:
                stored = _widened(stored, most + SPARE - stored.width)
            for p in points:
                stored.size[chosen[p]] = count[p]
                stored.index[chosen[p], : count[p]] = near[p, : count[p]]
            # the search radius, or more around the nodes that are needed
            farthest = distance[points, count[points] - 1]
            clouds.radius[chosen[points]] = np.where(
                farthest < self.radius, self.radius, BEYOND_LAST * farthest
            )
            failed = np.zeros(len(clouds.x), dtype=np.bool_)
            # with all nodes in a cloud there is nothing to take in
            strict = rounds < STRICT_ROUNDS and most < len(self.nodes)
            self._fill_points(clouds, chosen[points], strict, stored, failed)
            points = np.flatnonzero(failed[chosen])
            self.repaired += points.size if rounds == 0 else 0
            count[points] += 1
            rounds += 1
        return stored

    def _nearest(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Distances and numbers of the nearest nodes: all within the radius, a few to spare."""
        self._tree = self._tree or search_tree(self.nodes)
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
