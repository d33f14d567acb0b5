"""The basis object behind `maxent` and `lme`: nodes, supports, search and stored functions."""

from collections.abc import Callable

import numpy as np

from mpmbench.core.bases import Promises
from mpmbench.core.bases.entropy_nodes import NodeCloud, make_work
from mpmbench.core.bases.entropy_points import count_steps, evaluate_range, widest
from mpmbench.core.bases.handle import Stencils
from mpmbench.core.bases.hull import Hull
from mpmbench.core.bases.max_entropy import DONE, FLAT, OUTSIDE, STALLED, TOO_NARROW
from mpmbench.core.bases.search import fill_buckets, make_buckets
from mpmbench.core.errors import BadSetting, BrokeDown, NotConverged

PROMISES = Promises(kronecker="hull", gradient_on_hull=False)


class EntropyBasis:
    """Maximum-entropy functions with a radial prior on a set of nodes (fulfils `Basis`).

    Parameters
    ----------
    nodes : ndarray
        Positions [m], shape (N, dim); copied.
    particles : int
        Number of particles that `locate` is called for.
    supports : callable
        Radii of the supports [m], shape (N,), of nodes at given positions; called again after each move.
    prior : int
        CUBIC_SPLINE, QUARTIC_SPLINE or GAUSSIAN of `entropy_nodes`.
    rim_exponent : float
        The Gaussian has fallen to exp(-rim_exponent) at the rim of its support.
    spacing : float
        Nodal spacing as a fraction of the radius of a support: what the tolerance of the residual refers to.
    tolerance : float
        Largest ``|sum_i phi_i (x_i - x)|`` in nodal spacings.
    local : bool
        Search in cells; otherwise every point looks at all nodes (same functions, same bits).
    line_search : bool
        Safeguard Newton's method.
    max_iterations : int

    Attributes
    ----------
    iterations : ndarray of int
        Newton steps of the last `locate`, shape (particles,).
    """

    promises = PROMISES

    def __init__(
        self,
        nodes: np.ndarray,
        particles: int,
        supports: Callable[[np.ndarray], np.ndarray],
        *,
        prior: int,
        rim_exponent: float,
        spacing: float,
        tolerance: float,
        local: bool = True,
        line_search: bool = True,
        max_iterations: int = 100,
    ) -> None:
        self.nodes = np.array(nodes, dtype=float)
        if len(self.nodes) < self.nodes.shape[1] + 1:
            raise BadSetting("nodes", len(self.nodes), f"at least {self.nodes.shape[1] + 1} nodes")
        self._supports = supports
        support = supports(self.nodes)
        self.cloud = NodeCloud(
            axes=(0.0,) * self.nodes.shape[1],
            nodes=self.nodes,
            square=support**2,
            inverse_square=support**-2,
            buckets=make_buckets(self.nodes, support, local),
            prior=prior,
            rim_exponent=rim_exponent,
            spacing=spacing,
            tolerance=tolerance,
            line_search=line_search,
            max_iterations=max_iterations,
        )
        self.handle = Stencils.empty(particles, 1, self.nodes.shape[1])
        self.iterations = np.zeros(particles, dtype=np.int64)
        self._hull: Hull | None = None

    def evaluate(self, x: np.ndarray) -> Stencils:
        """Values and gradients at any points `x` [m], shape (n, dim), in arrays of their own."""
        stored = Stencils.empty(len(x), 1, self.nodes.shape[1])
        return self._fill(x, stored, np.zeros(len(x), dtype=np.int64))

    def locate(self, x: np.ndarray) -> None:
        """Store the functions of the particles in `handle`, which is a wider one when they no longer fit."""
        self.handle = self._fill(x, self.handle, self.iterations)

    def newton_steps(self, x: np.ndarray) -> np.ndarray:
        """Number of Newton steps at each point until the residual meets the tolerance; -1 where they fail."""
        steps = np.zeros(len(x), dtype=np.int64)
        count_steps(self.cloud, make_work(self.cloud), x, steps)
        return steps

    def first_outside(self, x: np.ndarray) -> int:
        """Number of the first point outside the convex hull of the nodes, -1 when all are inside."""
        if self._hull is None:
            self._hull = Hull(self.nodes)
        return self._hull.first_outside(x)

    def move(self, displacement: np.ndarray) -> None:
        """Move the nodes; supports and neighbours are found again."""
        self.nodes += displacement
        if not np.isfinite(self.nodes).all():
            raise BrokeDown(f"node {int(np.argmin(np.isfinite(self.nodes).all(axis=1)))} has no finite position")
        support = self._supports(self.nodes)
        self.cloud.square[:] = support**2
        self.cloud.inverse_square[:] = support**-2
        self.cloud = self.cloud._replace(buckets=fill_buckets(self.cloud.buckets, self.nodes, support))
        self._hull = None

    def _fill(self, x: np.ndarray, stored: Stencils, iterations: np.ndarray) -> Stencils:
        arrays = stored.size, stored.index, stored.phi, stored.grad_phi
        work = make_work(self.cloud)
        status, p, found = evaluate_range(self.cloud, work, x, 0, len(x), *arrays, iterations)
        if status == TOO_NARROW:
            # a little room to spare, because nodes that move change their neighbours
            width = int(1.2 * max(found, widest(self.cloud, work, x))) + 1
            wider = Stencils.empty(len(x), width, self.nodes.shape[1])
            return self._fill(x, wider, iterations)
        if status == DONE:
            return stored
        where = f"point {p} at {np.array2string(x[p], precision=6)}"
        if status == OUTSIDE:
            raise BrokeDown(f"lost basis: {where} is outside the hull of the {found} nodes whose supports cover it")
        if status == FLAT:
            raise BrokeDown(f"lost basis: the {found} nodes whose supports cover {where} lie on a line or plane")
        assert status == STALLED
        raise NotConverged(f"max-ent multipliers: no solution after {iterations[p]} Newton steps for {where}")
