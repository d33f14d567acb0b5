"""Newmark's method (Iaconeta 2017, Eqs. 38-49).

UL-FEM and GMM keep velocities on moving nodes; implicit MPM projects them from the particles to a
grid that is reset after each step.
"""

from dataclasses import dataclass

import numpy as np

from mpmbench.core.errors import require
from mpmbench.core.implicit import assembly
from mpmbench.core.implicit.contact import OPEN, WallContact
from mpmbench.core.implicit.newton import Equations, Inertia, equilibrate
from mpmbench.core.implicit.step import apply_loads, convect, given_by_mapping, prepare, reaction
from mpmbench.core.implicit.workspace import Workspace
from mpmbench.core.loads import body_force, work_of_loads
from mpmbench.core.loops.implicit import ImplicitLoop
from mpmbench.core.registry import register
from mpmbench.core.setting import setting
from mpmbench.core.state import State
from mpmbench.core.transfer.sums import p2g_mass, p2g_momentum

AT_REST = 1e-9  # of the largest velocity or acceleration: no node has landed with less


@register("method", "newmark")
@dataclass(frozen=True)
class Newmark(ImplicitLoop):
    """Newmark's method; as it is set, it is the trapezoidal rule."""

    time: str = "newmark"
    newmark_velocity: float = setting(
        0.5,
        "lambda of the paper (often gamma); more than 0.5 damps",
        unit="-",
        least=0.5,
        most=1.0,
    )
    newmark_displacement: float = setting(
        0.25,
        "zeta of the paper (often beta), at least newmark_velocity / 2",
        unit="-",
        least=0.25,
        most=1.0,
    )

    def check_together(self) -> None:
        """The method is stable."""
        super().check_together()
        require(
            0.5 * self.newmark_velocity <= self.newmark_displacement,
            "newmark_displacement",
            self.newmark_displacement,
            "at least newmark_velocity / 2 (stability)",
        )

    def start(self, s: State, dt: float) -> None:
        """Accelerations from ``M a = f`` at t = 0, unless the particles come with theirs."""
        p, n = s.particles, s.nodes
        w = prepare(s)
        n.m[:] = 0.0
        p2g_mass(w.phi, p.x, p.m, n.m)
        if p.a.any():
            n.a[:] = projected(s, w, p.a)
            return
        apply_loads(s, w, s.time)
        equations = Equations(s, w, n.f_external, dt, inertia=None)
        at_rest = np.zeros_like(n.a)
        force = equations.residual(at_rest)
        assert force is not None  # nothing has moved yet
        if self.on_body:
            mass = mass_blocks(s, w, self.mass)
            equations.hold_still()
            equations.blocks[:] = mass[:, None, None] * np.eye(p.dimension)
            n.a[:] = equations.correction(at_rest, force)
        else:  # as particles are projected in every step
            s.mass.assemble(s.basis, p, n.m)
            n.a[:] = 0.0
            s.mass.solve(force, n.a)
        assembly.interpolate(w.phi, n.a, p.a)

    def one_step(self, s: State, dt: float) -> None:
        """Advance the state by one step of size `dt` [s]."""
        p, n = s.particles, s.nodes
        velocity, displacement = self.newmark_velocity, self.newmark_displacement
        s.land()
        w = prepare(s)
        n.m[:] = 0.0
        p2g_mass(w.phi, p.x, p.m, n.m)
        mass = mass_blocks(s, w, self.mass)
        if not self.moving:
            n.v_old[:], n.a[:] = projected(s, w, p.v), projected(s, w, p.a)  # Eqs. 40, 41
        else:
            if s.time == 0.0 and not s.balanced:
                n.a[:] = projected(s, w, p.a)
            n.v_old[:] = n.v
        a_old = n.a.copy()
        start = -n.v_old / (displacement * dt) - (0.5 / displacement - 1.0) * a_old  # Eq. 44
        inertia = Inertia(1.0 / (displacement * dt * dt), start, mass)

        before = body_force(s, s.time).copy()
        if not self.moving:
            apply_loads(s, w, s.time)
            f_old = n.f_external.copy()
            if s.loads.walls:
                f_old += s.walls.nodal_impulse.sum(axis=0) / s.walls.duration
        apply_loads(s, w, s.time + dt)
        equations = Equations(s, w, n.f_external, dt, inertia)
        du, residual = equilibrate(s, equations)

        n.a[:] = inertia.coefficient * du + start
        n.v[:] = n.v_old + dt * ((1.0 - velocity) * a_old + velocity * n.a)  # Eq. 43
        leave_out(w, n.v, n.a)
        given = -kinetic_energy(s, w, n.v_old)
        if equations.contact is not None:
            moving = kinetic_energy(s, w, n.v)
            equations.contact.finish(s, du, residual, dt)
            if self.moving:
                come_to_rest(equations, equations.contact, mass, n.v, n.a)
            s.contact_energy += moving - kinetic_energy(s, w, n.v)
        s.give(given + kinetic_energy(s, w, n.v))
        if self.moving:
            assembly.interpolate(w.phi, n.v, p.v)
            assembly.interpolate(w.phi, n.a, p.a)
        else:
            s.give(-given_by_mapping(s, w, (a_old, f_old), du))
            a_p = p.a.copy()
            assembly.interpolate(w.phi, n.a, p.a)  # Eq. 47
            p.v += dt * ((1.0 - velocity) * a_p + velocity * p.a)  # Eq. 48
        moved = convect(s, w, du)  # Eqs. 46, 49
        s.record("reaction", reaction(s, w, residual))
        s.external_work += work_of_loads(s, before, moved, dt)
        s.time += dt


def come_to_rest(
    equations: Equations, contact: WallContact, mass: np.ndarray, *fields: np.ndarray
) -> None:
    """Stop what walls hold, in velocities and accelerations, shape (N, dim): an impulse at these nodes.

    The others get ``M change = 0``: with a consistent mass they answer the impulse, as they
    answered the rebound that the trapezoidal rule has given it instead. Not so on walls where
    nothing slides: impulses along them make nodes let go that have to roll.
    """
    active, held = equations.pattern.active, contact.fixed & ~contact.held_before
    rough = (contact.state[np.isinf(contact.friction)] != OPEN).any(axis=0)
    equations.blocks[:] = mass[:, None, None] * np.eye(held.shape[1])
    for field in fields:
        jump = np.where(held & ~rough[:, None], -field[active], 0.0)
        if np.abs(jump).max(initial=0.0) > AT_REST * np.abs(field).max():
            equations.prescribed = jump
            field += equations.correction(np.zeros_like(field), np.zeros_like(field))
        field[active] = np.where(held, 0.0, field[active])


def mass_blocks(s: State, w: Workspace, mass: str) -> np.ndarray:
    """Mass by blocks of the pattern [kg], shape (blocks,): consistent, or `s.nodes.m` on the diagonal."""
    assert w.pattern is not None
    blocks = np.zeros(len(w.pattern.column))
    if mass == "consistent":
        assembly.add_mass(w.phi, s.particles.m, w.pattern.slot, blocks)
    else:
        blocks[w.pattern.diagonal] = s.nodes.m[w.pattern.active]
    return blocks


def kinetic_energy(s: State, w: Workspace, v: np.ndarray) -> float:
    """``v . M v / 2`` of nodal velocities, shape (N, dim), with the mass of the method [J]."""
    if s.choices.mass == "lumped":
        return 0.5 * float(s.nodes.m @ np.sum(v * v, axis=1))
    carried = np.zeros_like(s.particles.v)
    assembly.interpolate(w.phi, v, carried)
    return 0.5 * float(s.particles.m @ np.sum(carried * carried, axis=1))


def projected(s: State, w: Workspace, u: np.ndarray) -> np.ndarray:
    """Nodal values of the particles' `u` with the lumped mass, shape (N, dim); fixed ones are zero."""
    assert w.pattern is not None
    active = w.pattern.active
    sums = np.zeros_like(s.nodes.v)
    p2g_momentum(w.phi, s.particles.x, s.particles.m, u, sums)
    out = np.zeros_like(sums)
    mass = s.nodes.m[active]
    out[active] = sums[active] / np.where(mass > 0.0, mass, np.inf)[:, None]
    if w.held is None:
        out[s.fixed] = 0.0
    return out


def leave_out(w: Workspace, *fields: np.ndarray) -> None:
    """Set nodal fields, shape (N, dim), to zero where no particle is."""
    assert w.pattern is not None
    unseen = w.pattern.row < 0
    for field in fields:
        field[unseen] = 0.0
