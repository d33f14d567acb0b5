"""The convex hull of nodes: outside, no non-negative linearly complete functions exist."""

import math

import numpy as np

from mpmbench.core.compiled import compiled
from mpmbench.core.errors import BrokeDown
from mpmbench.core.geometry.outside import extent

COLLAPSED = "the nodes have collapsed onto a line or plane: no hull"
ROUNDING = 1e-12  # of the size of the hull: points on it count as inside


@compiled
def _first_outside(x, lower, upper, normals, offsets):
    """Facets are asked about points outside the box ``lower..upper`` only, which the hull holds."""
    for p in range(x.shape[0]):
        boxed = True
        for d in range(x.shape[1]):
            boxed = boxed and lower[d] <= x[p, d] <= upper[d]
        if not boxed:
            for f in range(normals.shape[0]):
                distance = -offsets[f]
                for d in range(x.shape[1]):
                    distance += normals[f, d] * x[p, d]
                if not distance <= 0.0:
                    return p
    return -1


@compiled
def _edges(nodes):
    """Outward unit normals and offsets of the edges of the hull in the plane: Andrew's chains (1979).

    There are none where the nodes lie on a line.
    """
    order = np.argsort(nodes[:, 1], kind="mergesort")
    order = order[np.argsort(nodes[order, 0], kind="mergesort")]
    n = order.shape[0]
    chain, size = np.empty(2 * n, np.int64), 0
    for upwards in (True, False):
        first = size  # of the lower chain, then of the upper one, which begins at its end
        for k in range(n):
            c = order[k] if upwards else order[n - 1 - k]
            while size >= first + 2:
                a, b = chain[size - 2], chain[size - 1]
                u1, u2 = nodes[b, 0] - nodes[a, 0], nodes[b, 1] - nodes[a, 1]
                w1, w2 = nodes[c, 0] - nodes[b, 0], nodes[c, 1] - nodes[b, 1]
                if u1 * w2 - u2 * w1 > 0.0:
                    break
                size -= 1
            chain[size] = c
            size += 1
        size -= 1
    normals, offsets, area, found = np.empty((size, 2)), np.empty(size), 0.0, 0
    for k in range(size):
        a, b = nodes[chain[k]], nodes[chain[(k + 1) % size]]
        u1, u2 = b[0] - a[0], b[1] - a[1]
        length = math.sqrt(u1 * u1 + u2 * u2)
        area += 0.5 * (a[0] - nodes[0, 0]) * u2 - 0.5 * (a[1] - nodes[0, 1]) * u1
        if length > 0.0:
            normals[found, 0], normals[found, 1] = u2 / length, -u1 / length
            offsets[found] = (u2 * a[0] - u1 * a[1]) / length
            found += 1
    return normals[:found], offsets[:found], area


@compiled
def _inner_box(nodes, lower, upper, normals, offsets):
    """Corners of a box in the hull, in the proportions of that around it, with the nodes' mean in its middle."""
    middle, share = np.zeros_like(lower), np.inf
    for i in range(nodes.shape[0]):
        for d in range(nodes.shape[1]):
            middle[d] += nodes[i, d] / nodes.shape[0]
    for f in range(normals.shape[0]):
        room, half = offsets[f], 0.0
        for d in range(nodes.shape[1]):
            room -= normals[f, d] * middle[d]
            half += abs(normals[f, d]) * (upper[d] - lower[d])
        share = min(share, max(room / half, 0.0))
    return middle - share * (upper - lower), middle + share * (upper - lower)


class Hull:
    """Half-spaces ``normals . x <= offsets`` around nodes [m], shape (N, dim), that have a volume.

    A box within holds most points.
    """

    def __init__(self, nodes: np.ndarray) -> None:
        lower, upper = extent(nodes)
        size = float(np.max(upper - lower))
        if nodes.shape[1] == 1:
            self.normals, self.offsets = np.array([[-1.0], [1.0]]), np.array([-lower[0], upper[0]])
        elif nodes.shape[1] == 2:  # moved nodes ask for it in every step
            self.normals, self.offsets, area = _edges(nodes)
            if not area > ROUNDING * size * size:
                raise BrokeDown(COLLAPSED)
        else:
            from scipy.spatial import ConvexHull, QhullError  # slow to import

            try:
                equations = ConvexHull(nodes).equations
            except QhullError:
                raise BrokeDown(COLLAPSED) from None
            self.normals = np.ascontiguousarray(equations[:, :-1])
            self.offsets = -equations[:, -1]
        self.offsets = self.offsets + ROUNDING * size
        self.lower, self.upper = _inner_box(nodes, lower, upper, self.normals, self.offsets)

    def first_outside(self, x: np.ndarray) -> int:
        """Number of the first point of `x`, shape (n, dim), outside or not a number; -1 if none."""
        return int(_first_outside(x, self.lower, self.upper, self.normals, self.offsets))
