"""The convex hull of nodes: outside, no non-negative linearly complete functions exist."""

import numpy as np

from mpmbench.core.compiled import compiled
from mpmbench.core.errors import BrokeDown

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


class Hull:
    """Half-spaces ``normals . x <= offsets`` around nodes [m], shape (N, dim), that have a volume.

    A box within holds most points.
    """

    def __init__(self, nodes: np.ndarray) -> None:
        from scipy.spatial import ConvexHull, QhullError  # slow to import

        lower, upper = nodes.min(axis=0), nodes.max(axis=0)
        if nodes.shape[1] == 1:
            equations = np.array([[-1.0, lower[0]], [1.0, -upper[0]]])
        else:
            try:
                equations = ConvexHull(nodes).equations
            except QhullError:
                raise BrokeDown("the nodes have collapsed onto a line or plane: no hull") from None
        self.normals = np.ascontiguousarray(equations[:, :-1])
        self.offsets = -equations[:, -1] + ROUNDING * float(np.max(upper - lower))
        middle = nodes.mean(axis=0)
        room = self.offsets - self.normals @ middle
        share = max(0.0, float(np.min(room / (np.abs(self.normals) @ (upper - lower)))))
        self.lower, self.upper = middle - share * (upper - lower), middle + share * (upper - lower)

    def first_outside(self, x: np.ndarray) -> int:
        """Number of the first point of `x`, shape (n, dim), outside or not a number; -1 if none."""
        return int(_first_outside(x, self.lower, self.upper, self.normals, self.offsets))
