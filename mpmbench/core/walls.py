"""Rigid walls: planes that hold what meets them, with Coulomb friction, and let go.

In a step of size dt [s] a wall with the unit normal n gives the node i at the distance g_i the
impulse lambda_i [N s] with which (Signorini, Coulomb)

    g_i + dt n . v_i >= 0,   lambda_n >= 0,   one of both is 0,
    |lambda_t| <= mu lambda_n,   and where the node slides it is equal and against v_t.

Here ``v = v_free + M^-1 lambda`` is the velocity of the step, with the mass matrix of the method. On
a grid a node behind the wall counts as being on it: a body meets the wall when the nodes there see
its particles, up to one support before its surface arrives.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from mpmbench.core.compiled import lean
from mpmbench.core.errors import NotConverged
from mpmbench.core.matrix.light import is_free
from mpmbench.core.matrix.mass import LumpedMass
from mpmbench.core.nodes import add_multiple_of, copy, over
from mpmbench.core.particles import SEEN

if TYPE_CHECKING:
    from mpmbench.core.state import State

TOLERANCE = 1e-11  # of velocities, over the largest one before the contact
MOST_ITERATIONS = 10_000
MOST_TURNS = 50  # of a node between held and let go
POWER_ITERATIONS, MARGIN = 20, 1.2  # the eigenvalue that so few find may be too small


@dataclass(frozen=True)
class Wall:
    """A rigid plane.

    Parameters
    ----------
    point, normal : tuple of float
        A point of the plane [m], and its unit normal into the free side.
    friction : float
        Coefficient of Coulomb friction [-]; ``inf`` for a wall on which nothing slides.
    """

    point: tuple[float, ...]
    normal: tuple[float, ...]
    friction: float = 0.0


class Walls:
    """The walls of a simulation, and what they did in the last step.

    Attributes
    ----------
    normal, friction, offset : ndarray
        Unit normals, shape (W, dim), coefficients of friction [-] and ``n . point`` [m], shape (W,).
    nodal_impulse : ndarray
        What nodes were given [N s], shape (W, N, dim); the next step starts from there.
    last, eigenvalue : ndarray, float
        Contacts, shape (W, N) of bool, for which an eigenvalue was estimated last, and that.
    moved : ndarray
        Displacements of the nodes of frozen functions [m], shape (N, dim), which their basis does
        not know.
    """

    def __init__(self, walls: tuple[Wall, ...], nodes: int, dimension: int) -> None:
        self.normal = np.array([wall.normal for wall in walls]).reshape(-1, dimension)
        self.friction = np.array([wall.friction for wall in walls])
        points = np.array([wall.point for wall in walls]).reshape(-1, dimension)
        self.offset = np.sum(self.normal * points, axis=1)
        self.nodal_impulse = np.zeros((len(walls), nodes, dimension))
        self.moved = np.zeros((nodes, dimension))
        self.duration = 1.0  # of the step in which an implicit loop has found these impulses [s]
        self.last = np.zeros((len(walls), nodes), dtype=bool)
        self._touched, self._gap = np.zeros_like(self.last), np.zeros((len(walls), nodes))
        self._free = np.zeros((nodes, dimension))
        self.eigenvalue = 1.0

    @property
    def impulse(self) -> np.ndarray:
        """What each wall gave in the last step [N s], shape (W, dim)."""
        return np.asarray(self.nodal_impulse.sum(axis=1))

    def gap(self, nodes: np.ndarray) -> np.ndarray:
        """Distances of nodes at `nodes`, shape (N, dim), from the walls [m], shape (W, N).

        Fixed nodes may lie behind a wall, moving ones do by rounding: not less than 0.
        """
        distance = self.normal @ (nodes + self.moved).T - self.offset[:, None]
        return np.asarray(np.maximum(distance, 0.0))

    def along(self, v: np.ndarray) -> np.ndarray:
        """Velocities without their parts towards the walls, shape (N, dim)."""
        for normal in self.normal:
            v = v - np.minimum(v @ normal, 0.0)[:, None] * normal
        return v

    def hold(self, s: "State", dt: float) -> float:
        """Correct the velocities of the nodes, ``s.nodes.v``, and with them the accelerations.

        Returns
        -------
        float
            Work of the walls on the nodes [J], whose velocities were ``nodes.v_last``.

        Raises
        ------
        NotConverged
            When the impulses are not found.
        """
        n, impulse = s.nodes, self.nodal_impulse
        if not len(self.normal):
            return 0.0
        self.nodal_impulse = np.zeros(impulse.shape)
        self._touched[:] = False
        places = self.normal, self.offset, s.basis.nodes, self.moved
        marks = s.mass.light_nodes.light, s.fixed, impulse, self._gap, self._touched
        over(copy, n.seen, n.axes, n.v, self._free)
        while any(over(meet, n.seen, n.axes, *places, n.m, n.v, dt, *marks)):
            wall, node = np.nonzero(self._touched)
            contacts = Contacts(
                node, self.normal[wall], self.friction[wall], self._gap[wall, node] / dt, n.m[node]
            )
            if not isinstance(s.mass, LumpedMass) and not np.array_equal(self._touched, self.last):
                self.eigenvalue = MARGIN * contacts.largest_eigenvalue(s)
                self.last[:] = self._touched
            found = contacts.find(s, self._free, impulse[wall, node], self.eigenvalue)
            self.nodal_impulse[wall, node] = found
            impulse = self.nodal_impulse
            correction = contacts.answer(s, found)
            over(add_multiple_of, n.seen, n.axes, self._free, 1.0, correction, n.v)
        if not self._touched.any():
            return 0.0
        over(add_multiple_of, n.seen, n.axes, n.a, 1.0 / dt, correction, n.a)
        return 0.5 * float(np.sum(found * (n.v_last[node] + n.v[node])))


@lean
def meet(seen, axes, normal, offset, nodes, moved, m, v, dt, light, fixed, impulse, gap, touched):
    """Mark contacts, shape (W, N), of nodes that come through a wall in the step, or had an impulse of it.

    Writes the distances of nodes at `nodes` [m], shape (N, dim), from the walls, as `Walls.gap` says.
    Returns whether there are new ones.
    """
    some = False
    for n in range(seen.shape[0]):
        for i in range(seen[n, 0], seen[n, 1]):
            if not m[i] > 2.0 * SEEN or light[i] or not is_free(axes, fixed, i):
                continue
            for w in range(normal.shape[0]):
                distance, approach, had = -offset[w], 0.0, False
                for d in range(len(axes)):
                    distance += normal[w, d] * (nodes[i, d] + moved[i, d])
                    approach += normal[w, d] * v[i, d]
                    had = had or impulse[w, i, d] != 0.0
                gap[w, i] = max(distance, 0.0)
                if not touched[w, i] and (had or gap[w, i] + dt * approach < 0.0):
                    touched[w, i] = some = True
    return some


@dataclass
class Contacts:
    """Nodes that walls hold or may hold in a step, C of them.

    Attributes
    ----------
    node : ndarray of int
        Shape (C,); a node at two walls is there twice.
    normal : ndarray
        Shape (C, dim).
    friction, allowed, mass : ndarray
        Coefficients [-], velocities towards the wall with which a node just reaches it [m/s], and
        masses of the nodes [kg], shape (C,).
    """

    node: np.ndarray
    normal: np.ndarray
    friction: np.ndarray
    allowed: np.ndarray
    mass: np.ndarray

    def answer(self, s: "State", impulse: np.ndarray) -> np.ndarray:
        """Velocities ``M^-1 lambda`` of all nodes [m/s], shape (N, dim)."""
        given, velocity = np.zeros_like(s.nodes.v), np.zeros_like(s.nodes.v)
        np.add.at(given, self.node, impulse)
        s.mass.solve(given, velocity)
        return velocity

    def answer_here(self, s: "State", impulse: np.ndarray) -> np.ndarray:
        """The same at the contacts alone [m/s], shape (C, dim)."""
        if isinstance(s.mass, LumpedMass):  # contacts are no light nodes, which follow others
            place, total = self.places
            total[:] = 0.0
            np.add.at(total, place, impulse)
            return s.mass.divide_at(self.node, total[place])
        return self.answer(s, impulse)[self.node]

    @cached_property
    def places(self) -> tuple[np.ndarray, np.ndarray]:
        """Which of the nodes in contact each contact is at, shape (C,), and room for a vector of each."""
        nodes, place = np.unique(self.node, return_inverse=True)
        return place, np.zeros((len(nodes), self.normal.shape[1]))

    def largest_eigenvalue(self, s: "State") -> float:
        """Largest eigenvalue of ``m^(1/2) M^-1 m^(1/2)`` between the contacts, by the power method."""
        root = np.sqrt(self.mass)[:, None]
        z = np.random.default_rng(0).standard_normal(self.normal.shape)
        size = 1.0
        for _ in range(POWER_ITERATIONS):
            z = root * self.answer(s, root * z)[self.node]
            size = float(np.linalg.norm(z))
            z /= size
        return size

    def find(self, s: "State", free: np.ndarray, impulse: np.ndarray, largest: float) -> np.ndarray:
        """Impulses [N s], shape (C, dim), by projected steps with Nesterov's momentum from `impulse` on.

        Its fixed points satisfy the conditions above. With a lumped mass the first step finds them.
        With others and ``mu = inf`` there may be none (let go, the node comes back; held by all its
        components, it is pulled): what is let go again and again is held in this step.
        """
        step = (self.mass / largest)[:, None]
        target = free[self.node] + self.normal * self.allowed[:, None]
        enough = TOLERANCE * float(np.abs(target).max(initial=0.0))
        ahead = old = impulse
        t, turns = 1.0, np.zeros(len(step), dtype=np.int64)
        for _ in range(MOST_ITERATIONS):
            velocity = target + self.answer_here(s, ahead)
            new = self.admissible(ahead - step * velocity, turns > MOST_TURNS)
            turns += np.isinf(self.friction) & old.any(axis=1) & ~new.any(axis=1)
            if np.all(np.abs(new - ahead) <= enough * step):
                return new
            if np.vdot(ahead - new, new - old) > 0.0:  # the momentum leads astray
                t = 1.0
            further = 0.5 * (1.0 + np.sqrt(1.0 + 4.0 * t * t))
            ahead, old, t = new + (t - 1.0) / further * (new - old), new, further
        raise NotConverged("the impulses of the walls are not found")

    def admissible(self, impulse: np.ndarray, held: np.ndarray) -> np.ndarray:
        """The impulses brought back to ``lambda_n >= 0`` and ``|lambda_t| <= mu lambda_n``, but for those `held`."""
        across = np.maximum(np.sum(impulse * self.normal, axis=1), 0.0)
        along = impulse - np.sum(impulse * self.normal, axis=1)[:, None] * self.normal
        size = np.linalg.norm(along, axis=1)
        bound = np.multiply(self.friction, across, where=across > 0.0, out=np.zeros_like(across))
        share = np.divide(bound, size, where=size > bound, out=np.ones_like(size))
        allowed = across[:, None] * self.normal + share[:, None] * along
        return np.where(held[:, None], impulse, allowed)
