"""The basis object behind `maxent` and `lme`: nodes, supports, search and stored functions."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from mpmbench.core.bases import Basis, BasisSettings, Promises
from mpmbench.core.bases.clouds.search import fill_buckets, make_buckets, still_listed
from mpmbench.core.bases.entropy.consistent import ConsistentGradients
from mpmbench.core.bases.entropy.locality import (
    Metric,
    NodeCloud,
    Work,
    allocate,
    clip,
    convect,
    grade,
    longest_list,
)
from mpmbench.core.bases.entropy.points import count_steps, evaluate_range
from mpmbench.core.bases.entropy.priors import Formulation
from mpmbench.core.bases.entropy.solve import DONE, FLAT, OUTSIDE, STALLED, TOO_NARROW
from mpmbench.core.bases.handle import Stencils
from mpmbench.core.compiled import threads
from mpmbench.core.errors import BadSetting, BrokeDown, NotConverged
from mpmbench.core.geometry import search_tree
from mpmbench.core.geometry.hull import Hull
from mpmbench.core.particles import Particles
from mpmbench.core.setting import setting

# Of a search radius whose nodes do not surround their point.
LARGEST_ENLARGEMENT = 2.0
ENLARGEMENT = 1.15  # at each attempt
NO_SUPPORT = 1e-100  # radius of a node that nobody sees [m]
SPARE = (
    0.05  # of a support: cells list nodes so far beyond it, until these have moved by half of it
)


@dataclass(frozen=True, kw_only=True)
class EntropySettings(BasisSettings):
    """What can be said about all functions of maximum entropy."""

    tolerance: float = setting(
        1e-12,
        "largest residual of linear completeness, in nodal spacings",
        unit="-",
        least=1e-13,
        most=1e-4,
    )
    search: str = setting(
        "local",
        "for neighbours in cells, or at all nodes for every point (same functions)",
        options=("local", "all"),
    )
    promises: ClassVar[Promises] = Promises(kronecker="hull", gradient_on_hull=False)


def hold_by_nearest(nodes: np.ndarray, x: np.ndarray, point: int, stored: Stencils) -> None:
    """Store the nearest node alone for a massless point without functions, which must not end a run."""
    nearest = int(np.argmin(np.sum((nodes - x[point]) ** 2, axis=1)))
    stored.size[point], stored.index[point, 0] = 1, nearest
    stored.phi[point, 0], stored.grad_phi[point, 0] = 1.0, 0.0


class EntropyBasis(Basis):
    """Maximum-entropy functions with a radial prior on a set of nodes.

    Parameters
    ----------
    supports : callable
        Radii of the supports [m], shape (N,), of nodes at given positions; called again after each
        move.
    local : bool
        Search in cells; otherwise every point looks at all nodes (same functions, same bits).
    locality : {"fixed", "volume", "convected"}
        Plain distances, or those before a particle's change of volume, or before its deformation.
    scale : ndarray or None
        Spacing along each axis around each node over the smallest, shape (N, dim), where nodes are
        graded: where locality follows the deformation, it counts as one that was there before.

    Attributes
    ----------
    iterations : ndarray of int
        Newton steps of the last `locate`, shape (particles,).
    multipliers : ndarray
        What they found, shape (particles, dim), from which the next `locate` starts; zeros without
        a line search, which is for the way from there.
    points, steps, most_steps, enlarged : int
        Sums of the whole run for `statistics`.
    """

    def __init__(
        self,
        nodes: np.ndarray,
        particles: int,
        supports: Callable[[np.ndarray], np.ndarray],
        form: Formulation,
        *,
        local: bool = True,
        locality: str = "fixed",
        stretch_limit: float = np.inf,
        scale: np.ndarray | None = None,
        consistent: ConsistentGradients | None = None,
    ) -> None:
        self.nodes = np.array(nodes, dtype=float)
        if len(self.nodes) < self.nodes.shape[1] + 1:
            raise BadSetting("nodes", len(self.nodes), f"at least {self.nodes.shape[1] + 1} nodes")
        self._supports = supports
        support = supports(self.nodes)
        dimension = self.nodes.shape[1]
        self.locality, self.stretch_limit, self.consistent = locality, stretch_limit, consistent
        uneven = locality != "fixed" and scale is not None and not np.all(scale == 1.0)
        self._scale = scale if uneven else None
        if uneven:  # radii are those of even nodes, which the metric of a point enlarges
            support = np.full(len(self.nodes), float(support.min()))
        self._listed, self._reach = self.nodes.copy(), self._listed_reach(support)
        self.cloud = NodeCloud(
            form=form,
            nodes=self.nodes,
            square=support**2,
            inverse_square=1.0 / support**2,
            buckets=make_buckets(self.nodes, self._reach, local),
            metric=Metric.identity(particles if locality != "fixed" else 0, dimension),
        )
        self._longest = longest_list(self.cloud)
        self.handle = Stencils.empty(particles, 1, dimension)
        self.iterations = np.zeros(particles, dtype=np.int64)
        self.multipliers = np.zeros((particles, dimension))
        self._room: dict[int, Work] = {}  # of each chunk
        self.points = self.steps = self.most_steps = self.enlarged = 0  # of the whole run
        self._hull: Hull | None = None
        self._particles: Particles | None = None

    def follow(self, particles: Particles) -> None:
        """As any basis; massless points that find no functions at the hull go with their nearest node."""
        self._particles = particles
        solid = particles.material  # tracers are not strained: theirs is the nearest one's
        self._nearest = np.asarray(
            search_tree(particles.X[solid]).query(particles.X[solid.stop :])[1]
        )
        if self._scale is not None:
            self._point_scale = self._scale[search_tree(self.nodes).query(particles.X)[1]]

    def admit(self, admitted: Callable[[np.ndarray], np.ndarray]) -> None:
        """See only the nodes that ``admitted(nodes)`` marks, shape (N,) of bool; it is asked after each move."""
        supports = self._supports

        def of_admitted(nodes: np.ndarray) -> np.ndarray:
            return np.where(admitted(nodes), supports(nodes), NO_SUPPORT)

        self._supports = of_admitted
        self.move(np.zeros_like(self.nodes))

    def evaluate(self, x: np.ndarray) -> Stencils:
        """As any basis; where locality follows the deformation, that of the nearest particle."""
        stored = Stencils.empty(len(x), 1, self.nodes.shape[1])
        iterations = np.zeros(len(x), dtype=np.int64)
        return self._fill(self._cloud_at(x), x, stored, iterations, np.zeros(x.shape))

    def locate(self, x: np.ndarray) -> None:
        if self.locality != "fixed" and self._particles is not None:
            self._measure(self._particles.F, self.cloud.metric, slice(None))
            for values in self.cloud.metric:
                values[self._particles.material.stop :] = values[self._nearest]
        if not self.cloud.form.line_search:
            self.multipliers[:] = 0.0
        self.handle = self._fill(self.cloud, x, self.handle, self.iterations, self.multipliers)
        if self.consistent is not None and self._particles is not None:
            self.consistent.correct(self.nodes, x, self._particles.V, self.handle)
        self.points += len(x)
        self.steps += int(self.iterations.sum())
        self.most_steps = max(self.most_steps, int(self.iterations.max(initial=0)))
        self.enlarged += int(np.count_nonzero(self.cloud.metric.growth > 1.0))

    def newton_steps(self, x: np.ndarray) -> np.ndarray:
        """Newton steps at each point until the residual meets the tolerance; -1 where they fail."""
        steps = np.zeros(len(x), dtype=np.int64)
        cloud = self._cloud_at(x)
        count_steps(cloud, allocate(x.shape[1], longest_list(cloud)), x, steps)
        return steps

    def statistics(self) -> dict[str, tuple[float, str, str]]:
        if self.points == 0:
            return {}
        mean, width = self.steps / self.points, float(self.handle.size.mean())
        return {
            "newton_steps_mean": (mean, "1", "Newton steps per point for the multipliers, mean"),
            "newton_steps_max": (self.most_steps, "1", "most Newton steps at one point"),
            "enlarged_points": (
                self.enlarged,
                "1",
                "times that a point's search radius had to grow",
            ),
            "neighbours_mean": (width, "1", "functions per particle in the last step, mean"),
        }

    def first_outside(self, x: np.ndarray) -> int:
        if self._hull is None:
            self._hull = Hull(self.nodes)
        return self._hull.first_outside(x)

    def move(self, displacement: np.ndarray) -> None:
        """Move the nodes; supports and neighbours are found again."""
        self.nodes += displacement
        if (lost := super().first_outside(self.nodes)) >= 0:
            raise BrokeDown(f"node {lost} has no finite position")
        support = self._supports(self.nodes)
        if self._scale is not None:
            support = np.full(len(self.nodes), float(support.min()))
        np.multiply(support, support, out=self.cloud.square)
        np.divide(1.0, self.cloud.square, out=self.cloud.inverse_square)
        if not still_listed(self.nodes, self._listed, support, self._reach):
            self._listed[:], self._reach = self.nodes, self._listed_reach(support)
            buckets = fill_buckets(self.cloud.buckets, self.nodes, self._reach)
            self.cloud = self.cloud._replace(buckets=buckets)
            self._longest = longest_list(self.cloud)
        self._hull = None

    def _listed_reach(self, support: np.ndarray) -> np.ndarray:
        """Radii within which cells list nodes [m], shape (N,): none where points measure by their deformation."""
        return (1.0 + SPARE) * support * (self.locality == "fixed")

    def _measure(self, F: np.ndarray, metric: Metric, particles: Any) -> None:
        """Fill the metric of points with deformation gradients F, where nodes are spaced as around these particles."""
        if not np.isfinite(F).all():
            point = int(np.argmin(np.isfinite(F).all(axis=(1, 2))))
            raise BrokeDown(f"the deformation of point {point} is not finite")
        most = convect(self.cloud.form.axes, F, self.locality == "volume", metric)
        if most > self.stretch_limit:
            clip(F, self.stretch_limit, metric)
        if self._scale is not None:
            grade(self.cloud.form.axes, self._point_scale[particles], metric)

    def _cloud_at(self, x: np.ndarray) -> NodeCloud:
        """The nodes with a metric for points anywhere."""
        if self.locality == "fixed":
            return self.cloud
        metric = Metric.identity(len(x), self.nodes.shape[1])
        if self._particles is not None:
            solid = self._particles.material
            _, nearest = search_tree(self._particles.x[solid]).query(x)
            self._measure(self._particles.F[solid][nearest], metric, nearest)
        return self.cloud._replace(metric=metric)

    def _fill(
        self,
        cloud: NodeCloud,
        x: np.ndarray,
        stored: Stencils,
        iterations: np.ndarray,
        starts: np.ndarray,
    ) -> Stencils:
        ends = [(DONE, -1, 0)] * len(threads.chunks(len(x), threads.FEW))

        growth = cloud.metric.growth
        most = longest_list(cloud) if len(growth) else self._longest
        tracers = len(x)
        if iterations is self.iterations and self._particles is not None:
            tracers = self._particles.material.stop

        def part(c: int, start: int, stop: int) -> None:
            if c not in self._room or len(self._room[c].near) <= most:
                self._room[c] = allocate(x.shape[1], most)
            work, at = self._room[c], start
            while True:
                ends[c] = evaluate_range(cloud, work, x, at, stop, stored, iterations, starts)
                status, at, _ = ends[c]
                if status in (OUTSIDE, FLAT) and at < len(growth):
                    growth[at] *= ENLARGEMENT
                    if growth[at] <= LARGEST_ENLARGEMENT:
                        continue
                if status in (DONE, TOO_NARROW) or at < tracers:
                    return
                hold_by_nearest(self.nodes, x, at, stored)
                at += 1

        threads.run(part, len(x), threads.FEW)
        failed = [end for end in ends if end[0] != DONE]
        if any(end[0] == TOO_NARROW for end in failed):
            # a little room to spare, because nodes that move change their neighbours
            most = max(end[2] for end in failed)
            wider = Stencils.empty(len(x), int(1.2 * most) + 1, self.nodes.shape[1])
            return self._fill(cloud, x, wider, iterations, starts)
        if not failed:
            return stored
        status, p, found = failed[0]
        where = f"point {p} at {np.array2string(x[p], precision=6)}"
        if status == STALLED:
            raise NotConverged(
                f"max-ent multipliers: no solution after {iterations[p]} Newton steps for {where}"
            )
        reason = f"the {found} nodes whose supports cover {where} lie on a line or plane"
        if status == OUTSIDE:
            reason = f"{where} is outside the hull of the {found} nodes whose supports cover it"
        raise BrokeDown(f"lost basis: {reason}")
