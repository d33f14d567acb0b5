"""The explicit time loop of MPM (Algorithm 1), OTM (Algorithm 2) and the unified method (Algorithm 3), Wobbes 2020.

The three algorithms are one, with choices: where the nodes go, which mass, and how velocity is
transferred. Equation numbers are of the paper, with the corrections of its errata: the internal
force enters with a minus sign, the traction is there, ``V = det(F) V_0``, and constrained
components leave the system before it is solved.
"""

import numpy as np

from mpmbench.core import transfer
from mpmbench.core.choices import Choices
from mpmbench.core.compiled import threads
from mpmbench.core.compiled.rows import lanes_for
from mpmbench.core.errors import NotApplicable
from mpmbench.core.loads import constrain, external_force, reaction_work
from mpmbench.core.materials import cauchy_stress
from mpmbench.core.registry import register
from mpmbench.core.state import State


@register("method", "explicit")
def step(s: State, dt: float) -> None:
    """Advance the state by one step of size `dt` [s]."""
    p, n, choices = s.particles, s.nodes, s.choices
    s.land()
    s.basis.locate(p.x)  # step 3
    if choices.stress_update == "usf":
        project_velocity(s)
        update_particles(s, dt, strain=True)
    s.sums(s.basis.handle, p.x, p.m, p.v, p.V, p.sigma, n.m, n.q, n.f_internal)  # Eqs. 17, 20, 21
    external_force(s, s.basis.handle, s.time, n.f_external)
    np.add(n.f_internal, n.f_external, out=n.f)
    s.mass.assemble(s.basis, p, n.m)  # Eqs. 19, 48, 90

    if choices.transfer == "nodal":
        n.v_old[:] = n.v  # Li 2009, Eq. 3.92: nodes keep their velocities
    else:
        n.v_old[s.fixed] = n.v[s.fixed]
        s.mass.solve(n.q, n.v_old)  # Eq. 23
    constrain(s, dt)
    np.divide(
        np.subtract(n.v, n.v_old, out=n.a), dt, out=n.a
    )  # on fixed components; the solve overwrites the rest
    s.mass.solve(n.f, n.a)  # Eqs. 22, 93
    np.add(n.v_old, np.multiply(n.a, dt, out=n.v), out=n.v)  # Eqs. 24, 51, 94
    s.external_work += dt * float(np.vdot(n.f_external, n.v)) + reaction_work(s, dt)

    if choices.stress_update == "usl":
        update_particles(
            s, dt, velocity=True, strain=True, position=True
        )  # Eqs. 26-30, 52-55, 96-99, step 10
    else:
        update_particles(s, dt, velocity=True)  # Eq. 27
        if choices.stress_update == "musl":
            n.v_old[:] = n.v
            project_velocity(s)
            update_particles(s, dt, strain=True)
            n.v[:] = n.v_old
        update_particles(s, dt, position=True)  # Eq. 26
    if choices.moving and not choices.frozen:
        s.basis.move(np.multiply(n.v, dt, out=n.q))  # Eqs. 51, 95
    s.time += dt


def update_particles(
    s: State, dt: float, velocity: bool = False, strain: bool = False, position: bool = False
) -> None:
    """Carry nodal velocities and accelerations to the particles (`transfer.g2p`)."""
    p, n, flip = s.particles, s.nodes, s.choices.flip_weight
    phi, lanes = s.basis.handle, lanes_for(2 * p.dimension)
    arrays = p.x, p.v, p.F, p.L, p.V, p.V0, p.state, p.sigma, n.v, n.a
    s.cells = transfer.at_least(s.cells, phi.width)

    def part(c: int, start: int, stop: int) -> None:
        switches = velocity, strain, position
        transfer.g2p(phi, lanes, s.law, *arrays, flip, dt, *switches, s.cells[c], start, stop)

    threads.run(part, len(p.x))


def project_velocity(s: State) -> None:
    """Nodal velocities from the particles': ``v = M^-1 sum_p m_p phi_i v_p``, for USF and MUSL."""
    p, n = s.particles, s.nodes
    n.m[:], n.q[:] = 0.0, 0.0
    transfer.p2g_mass(s.basis.handle, p.x, p.m, n.m)
    transfer.p2g_momentum(s.basis.handle, p.x, p.m, p.v, n.q)
    s.mass.assemble(s.basis, p, n.m)
    s.mass.solve(n.q, n.v)  # fixed components keep the velocity of the last step


def check(choices: Choices) -> None:
    """Refuse combinations that make no sense.

    Raises
    ------
    NotApplicable
        With the reason.
    """
    if choices.transfer == "nodal" and not (choices.moving or choices.frozen):
        raise NotApplicable(
            "method.transfer=nodal needs nodes that move with the material (method.nodes=moving)"
        )
    if choices.stress_update != "usl" and (choices.moving or choices.frozen):
        raise NotApplicable(
            f"method.stress_update={choices.stress_update} needs method.nodes=fixed and updated functions: where nodes "
            "move with the material, F must follow their motion"
        )


step.check = check  # type: ignore[attr-defined]
step.needs = cauchy_stress  # type: ignore[attr-defined]
