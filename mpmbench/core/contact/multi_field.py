"""One velocity field per body on a grid (Bardenhagen, Brackbill and Sulsky 2000), with the correction for the gap.

Each body has a copy of the nodes. Where two bodies a and b see the same node, the normal from a to b
comes from the gradients of their masses,

    n = (g_a / |g_a| - g_b / |g_b|) / |...|,   g = sum_p m_p grad phi_i(x_p),

and impulses lambda on b and -lambda on a, with the conditions of Signorini and Coulomb,

    g_n + dt n . (v_b - v_a) >= 0,   lambda_n >= 0,   one of both is 0,   |lambda_t| <= mu lambda_n,

keep what is between them. Bodies see the same node before they touch. The gap g_n between their
surfaces, which is the distance along n between the points of a and b (particles, and points on the
surfaces) that are farthest towards each other among those that see the node, lets them come closer
until they do; without the correction it is 0. Where a node sees several pairs of bodies, their
impulses are found together, in no order.

A node at the rim of a body may have next to no mass: impulses on it say nothing, and those of forces
throw it about. Nodes too light for the step follow their neighbours (`spare_light_nodes` in
`mpmbench.core.stability`, which says how light), hand them their mass and forces, and are in no pair.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any, ClassVar

import numpy as np

from mpmbench.core.bases.handle import count, index, locate, scratch, value
from mpmbench.core.bodies import Part
from mpmbench.core.compiled import lean, vector
from mpmbench.core.contact import Contact, ContactRule
from mpmbench.core.errors import NotApplicable, NotConverged
from mpmbench.core.nodes import Nodes
from mpmbench.core.particles import SEEN
from mpmbench.core.registry import register
from mpmbench.core.setting import setting
from mpmbench.core.stability import spare_light_nodes
from mpmbench.core.state import State

TOLERANCE = 1e-13  # of velocities, over the largest one
MOST_ITERATIONS = 10_000


@register("contact", "multi_field")
@dataclass(frozen=True)
class MultiField(ContactRule):
    """A velocity field for each body on a grid; impulses at common nodes keep bodies apart and let them go."""

    friction: float = setting(0.0, "coefficient of Coulomb friction", unit="-", least=0.0)
    gap: str = setting(
        "corrected",
        "bodies meet when their surfaces do, or when they see the same node",
        options=("corrected", "ignored"),
    )
    at_surfaces: ClassVar[bool] = True

    def check(self, case: Any, parts: Sequence[Part]) -> None:
        """Refuse nodes that are no grid, and masses by which impulses cannot be shared out."""
        if case.choices.on_body:
            raise NotApplicable(
                "contact=multi_field needs a grid through which bodies move: nodes that are those "
                "of a body meet no copies of themselves; take contact=penalty"
            )
        if case.choices.mass != "lumped":
            raise NotApplicable(
                "contact=multi_field shares impulses out by lumped masses: it needs "
                "method.mass=lumped"
            )

    def build(self, s: State) -> "FieldsInContact":
        return FieldsInContact(s, self.friction, self.gap == "corrected")


class FieldsInContact(Contact):
    """The fields of a simulation, and what it costs to keep them apart."""

    def __init__(self, s: State, friction: float, corrected: bool) -> None:
        self.friction, self.corrected = friction, corrected
        self.nodes = len(s.nodes.m) // s.bodies.count  # of each field
        self.gradient = np.zeros_like(s.nodes.v)
        self.wanted = np.zeros(len(s.nodes.m), dtype=np.bool_)
        self.normal = np.zeros_like(s.nodes.v)
        self.reach = np.zeros(len(s.nodes.m))
        self.impulse = np.zeros((0, s.nodes.v.shape[1]))

    def push(self, s: State) -> None:
        spare_light_nodes(s)

    def hold(self, s: State, dt: float) -> float:
        n, p = s.nodes, s.particles
        common = self.common(s)
        if not common:
            return 0.0
        own = np.unique(np.concatenate([side for *_, a, b in common for side in (a, b)]))
        self.wanted[:], self.wanted[own] = False, True
        box = around(s.basis.nodes[own], s)
        mass_gradients(s.basis.handle, p.x, p.m, *box, self.wanted, self.gradient)
        self.gradient[own] /= lengths(self.gradient[own])
        sides = []
        for one, other, a, b in common:
            normal = self.gradient[a] - self.gradient[b]
            normal /= lengths(normal)
            allowed = np.zeros(len(a))
            if self.corrected:
                allowed = self.gaps(s, box, (one, other), (a, b), normal) / dt
            sides.append((a, b, normal, allowed))
        a, b, normal, allowed = (np.concatenate(part) for part in zip(*sides, strict=True))
        change = Pairs(a, b, normal, allowed, n.m).impulses(n.v, self.friction)
        return exchange(n, s.fixed, a, b, change, dt)

    def common(self, s: State) -> list[tuple[int, int, np.ndarray, np.ndarray]]:
        """Pairs of bodies, and the numbers of the nodes that both have a mass at, in either field."""
        may = (s.nodes.m > 2.0 * SEEN) & ~s.mass.light_nodes.light & ~s.fixed.all(axis=1)
        fields = may.reshape(s.bodies.count, self.nodes)
        found = []
        if np.count_nonzero(fields.sum(axis=0) > 1):
            for one, other in combinations(range(s.bodies.count), 2):
                node = np.flatnonzero(fields[one] & fields[other])
                if len(node):
                    found.append((one, other, node + one * self.nodes, node + other * self.nodes))
        return found

    def gaps(
        self,
        s: State,
        box: tuple[np.ndarray, np.ndarray],
        bodies: tuple[int, int],
        nodes: tuple[np.ndarray, np.ndarray],
        normal: np.ndarray,
    ) -> np.ndarray:
        """Distance along the normals between two bodies at their common nodes [m]; 0 where they overlap."""
        self.reach[:] = -np.inf
        self.wanted[:] = False
        for sign, own in zip((1.0, -1.0), nodes, strict=True):
            self.normal[own], self.wanted[own] = sign * normal, True
        p = s.particles
        far_points(
            s.basis.handle,
            p.x,
            s.bodies.particle,
            *bodies,
            *box,
            self.wanted,
            self.normal,
            self.reach,
        )
        return np.maximum(-self.reach[nodes[1]] - self.reach[nodes[0]], 0.0)


@dataclass
class Pairs:
    """Contacts between nodes a and b of two fields, C of them, with the normals from a to b.

    Attributes
    ----------
    a, b : ndarray of int
        Shape (C,); a node that sees three bodies is in several pairs.
    normal : ndarray
        Shape (C, dim).
    allowed : ndarray
        Gap over time step [m/s], shape (C,).
    m : ndarray
        Masses of all nodes [kg], shape (N,).
    """

    a: np.ndarray
    b: np.ndarray
    normal: np.ndarray
    allowed: np.ndarray
    m: np.ndarray

    def impulses(self, free: np.ndarray, friction: float) -> np.ndarray:
        """Impulses on b [N s], shape (C, dim), that meet the conditions; one step where no node is in two pairs."""
        a, b, m = self.a, self.b, self.m
        reduced = (m[a] * m[b] / (m[a] + m[b]))[:, None]
        shared = np.bincount(np.concatenate([a, b]), minlength=len(m))
        step = reduced / np.maximum(shared[a], shared[b])[:, None]
        impulse, moved = np.zeros_like(self.normal), np.zeros_like(free)
        enough = TOLERANCE * float(np.abs(free[np.concatenate([a, b])]).max())
        for _ in range(MOST_ITERATIONS):
            between = free[b] + moved[b] - free[a] - moved[a] + self.allowed[:, None] * self.normal
            new = admissible(impulse - step * between, self.normal, friction)
            change, impulse = new - impulse, new
            np.add.at(moved, b, change / m[b, None])
            np.subtract.at(moved, a, change / m[a, None])
            if np.all(np.abs(change) <= enough * step):
                return impulse
        raise NotConverged("the impulses between three bodies at a node are not found")


def exchange(
    n: Nodes, fixed: np.ndarray, a: np.ndarray, b: np.ndarray, impulse: np.ndarray, dt: float
) -> float:
    """Give impulses [N s], shape (C, dim), to the nodes b and their opposites to the nodes a, where these are free.

    Particles take accelerations, which change with the velocities. The work on the nodes [J] is
    that at the mean of the velocities before and after the step.
    """
    own = np.union1d(a, b)
    before = n.v[own]
    np.add.at(n.v, b, impulse / n.m[b, None])
    np.subtract.at(n.v, a, impulse / n.m[a, None])
    n.v[own] = np.where(fixed[own], before, n.v[own])
    n.a[own] += (n.v[own] - before) / dt
    between = 0.5 * (n.v[b] + n.v_last[b] - n.v[a] - n.v_last[a])
    return float(np.sum(impulse * between))


def admissible(impulse: np.ndarray, normal: np.ndarray, friction: float) -> np.ndarray:
    """Impulses brought back to ``lambda_n >= 0`` and ``|lambda_t| <= mu lambda_n``."""
    pressed = np.sum(impulse * normal, axis=1)
    along = impulse - pressed[:, None] * normal
    pressed = np.maximum(pressed, 0.0)
    size, bound = np.linalg.norm(along, axis=1), friction * pressed
    share = np.divide(bound, size, where=size > bound, out=np.ones_like(size))
    return np.asarray(pressed[:, None] * normal + share[:, None] * along)


def lengths(vectors: np.ndarray) -> np.ndarray:
    """Lengths of vectors, shape (n, 1), 1 for those without any."""
    size = np.linalg.norm(vectors, axis=1)[:, None]
    return np.where(size > 0.0, size, 1.0)


def around(nodes: np.ndarray, s: State) -> tuple[np.ndarray, np.ndarray]:
    """Corners of the box that holds the supports of some nodes [m]."""
    assert s.geometry is not None
    reach = s.geometry.nodal_spacing * (s.basis.handle.width ** (1.0 / nodes.shape[1]))
    return nodes.min(axis=0) - reach, nodes.max(axis=0) + reach


@lean
def within(x, p, low, high):
    """Whether point `p` of `x`, shape (n, dim), lies in a box."""
    inside = True
    for d in range(low.shape[0]):
        inside = inside and low[d] <= x[p, d] <= high[d]
    return inside


@lean
def mass_gradients(phi, x, m, low, high, wanted, gradient):
    """Write ``sum_p m_p grad phi_i(x_p)`` [kg/m] of the nodes that are wanted, whose supports a box holds."""
    work, grad_phi = scratch(phi), vector(phi.axes)
    for i in range(gradient.shape[0]):
        for d in range(len(phi.axes)):
            gradient[i, d] = 0.0
    for p in range(x.shape[0]):
        if m[p] > 0.0 and within(x, p, low, high):
            at = locate(phi, x, p, work)
            for k in range(count(phi, at)):
                i = index(phi, at, k)
                if wanted[i]:
                    value(phi, at, k, work, grad_phi)
                    for d in range(len(phi.axes)):
                        gradient[i, d] += m[p] * grad_phi[d]


@lean
def far_points(phi, x, body, one, other, low, high, wanted, normal, reach):
    """Largest ``n_i . x`` [m] over the points of two bodies that see the node i, of nodes that are wanted."""
    work, grad_phi = scratch(phi), vector(phi.axes)
    for p in range(x.shape[0]):
        if (body[p] == one or body[p] == other) and within(x, p, low, high):
            at = locate(phi, x, p, work)
            for k in range(count(phi, at)):
                i = index(phi, at, k)
                if wanted[i] and value(phi, at, k, work, grad_phi) > 0.0:
                    far = 0.0
                    for d in range(len(phi.axes)):
                        far += normal[i, d] * x[p, d]
                    reach[i] = max(reach[i], far)
