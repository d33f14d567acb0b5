"""What acts on a body from outside: body force, point loads and prescribed motion."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from mpmbench.core.bases.handle import Stencils
from mpmbench.core.nodes import hold_fixed
from mpmbench.core.particles import Particles
from mpmbench.core.transfer.sums import p2g_momentum
from mpmbench.core.walls import Wall

if TYPE_CHECKING:
    from mpmbench.core.state import State


@dataclass(frozen=True)
class Loads:
    """What acts on the body from outside.

    Attributes
    ----------
    body_force : callable or None
        ``body_force(X, t, b)`` writes the force per unit mass [N/kg] at initial positions X, shape
        (n, dim), to `b`; explicit methods call it for one part of the particles after the other,
        from several threads.
    traction : callable or None
        ``traction(t)`` gives the point loads [N], shape (n, dim); they act on the first n tracers.
    prescribed_motion : callable or None
        ``prescribed_motion(X_i, t)`` gives the displacement [m], shape (N, dim), of the fixed
        components of nodes that started at X_i; without it they rest.
    landing : callable or None
        ``landing(x_i)`` marks the components of moving nodes, shape (N, dim) of bool, that are held
        from now on.
    walls : tuple of Wall
        Rigid walls, which let go what they hold.
    """

    body_force: Callable[[np.ndarray, float, np.ndarray], None] | None = None
    traction: Callable[[float], np.ndarray] | None = None
    prescribed_motion: Callable[[np.ndarray, float], np.ndarray] | None = None
    landing: Callable[[np.ndarray], np.ndarray] | None = None
    walls: tuple[Wall, ...] = ()

    def displacement(self, X: np.ndarray, time: float) -> np.ndarray:
        """Prescribed displacements [m] of nodes or points that started at X, shape (N, dim)."""
        if self.prescribed_motion is None:
            return np.zeros_like(X)
        return self.prescribed_motion(X, time)

    def increment(self, X: np.ndarray, time: float, dt: float) -> np.ndarray:
        """Prescribed displacements [m] from `time` to ``time + dt``, shape (N, dim)."""
        return self.displacement(X, time + dt) - self.displacement(X, time)


def loaded_points(p: Particles, loads: int, treatment: str) -> np.ndarray:
    """Rows of the points that carry the loads: tracers, or the particle nearest to each of them."""
    tracers = np.arange(len(p.x) - p.tracers, len(p.x))[:loads]
    if treatment == "end_point":
        return tracers
    distance = np.linalg.norm(p.X[tracers, None, :] - p.X[None, p.material, :], axis=2)
    return np.argmin(distance, axis=1)


def body_force(s: "State", time: float, start: int = 0, stop: int | None = None) -> np.ndarray:
    """Body force per unit mass at `time` [N/kg], shape (P, dim), of particles start to stop or of all.

    It is left in ``particles.b``.
    """
    p = s.particles
    if s.loads.body_force is not None:
        s.loads.body_force(p.X[start:stop], time, p.b[start:stop])
    return p.b


def external_force(s: "State", phi: Any, time: float, force: np.ndarray) -> np.ndarray:
    """Write ``sum_p m_p b_p phi_i + sum phi_i(x) t`` at `time` [s] to `force` [N], shape (N, dim).

    `phi` is a handle that is valid for the particles; the dead load of the nodes comes on top.
    """
    p = s.particles
    force[:] = 0.0
    if s.loads.body_force is not None:
        p2g_momentum(phi, p.x, p.m, body_force(s, time), force)
    add_loads(s, phi, time, force)
    return force


def add_loads(s: "State", phi: Any, time: float, force: np.ndarray) -> None:
    """Add the dead load of the nodes and ``sum phi_i(x) t`` at `time` [s] to `force` [N], shape (N, dim)."""
    p = s.particles
    if np.ndim(s.dead_load):
        force += s.dead_load
    if s.loads.traction is not None:
        loaded = s.traction_particle
        stored, rows = phi, loaded
        if not isinstance(phi, Stencils):
            stored, rows = s.basis.evaluate_particles(p.x, loaded), np.arange(len(loaded))
        for row, load in zip(rows, s.loads.traction(time), strict=True):
            k = stored.size[row]
            force[stored.index[row, :k]] += stored.phi[row, :k, None] * load


def constrain(s: "State", dt: float) -> None:
    """Write the mean velocity of the step, so that positions are exact, and acceleration to the fixed components."""
    n, at_rest = s.nodes, s.loads.prescribed_motion is None
    if not at_rest:
        change = s.loads.increment(s.initial_nodes, s.time, dt)
        n.v[s.fixed] = change[s.fixed] / dt
    if len(s.held):
        hold_fixed(s.held, n.axes, n.m, s.fixed, at_rest, dt, n.v_old, n.v, n.a)


def reaction_work(s: "State", dt: float) -> float:
    """Work of the constraint forces ``M a - f`` on the prescribed motion during the step [J]."""
    if s.loads.prescribed_motion is None:
        return 0.0
    n = s.nodes
    reaction = s.mass.light_nodes.gather(s.mass.multiply(n.a) - n.f)
    return dt * float(np.sum((reaction * n.v)[s.fixed]))


def rise_of_traction(s: "State", dt: float, before: np.ndarray) -> float:
    """What point loads do in a step beyond the work of their values at its start, by the trapezoidal rule [J].

    `before` are the places of the loaded points at the start of the step [m], shape (n, dim).
    """
    if s.loads.traction is None:
        return 0.0
    rise = s.loads.traction(s.time + dt) - s.loads.traction(s.time)
    return 0.5 * float(np.sum(rise * (s.particles.x[s.traction_particle] - before)))


def work_of_loads(s: "State", before: np.ndarray, moved: np.ndarray, dt: float) -> float:
    """Work of body force and point loads in a step by the trapezoidal rule [J].

    Parameters
    ----------
    before : ndarray
        Body force at the start of the step [N/kg], shape (P, dim).
    moved : ndarray
        Displacements of the points in the step [m], shape (P, dim).
    """
    p = s.particles
    work = 0.5 * float(np.sum(p.m[:, None] * (before + p.b) * moved))
    if s.loads.traction is not None:
        load = s.loads.traction(s.time) + s.loads.traction(s.time + dt)
        work += 0.5 * float(np.sum(load * moved[s.traction_particle]))
    return work
