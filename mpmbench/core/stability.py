"""The largest stable time step of the discrete system at hand, for any basis and mass matrix."""

from collections.abc import Callable

import numpy as np

from mpmbench.core.materials import Material
from mpmbench.core.state import State
from mpmbench.core.transfer.carry import velocity_gradients
from mpmbench.core.transfer.sums import p2g_internal_force, p2g_mass

LOOKS = 10  # steps between two searches for the shortest cell of moving nodes


def wave_speed(material: Material) -> float:
    """Speed of the fastest small waves, those of volume [m/s]."""
    lame, shear = material.lame_parameters()
    return float(np.sqrt((lame + 2.0 * shear) / material.density))


def step_of_impact(
    s: State, speed: float, on_body: float, on_grid: float
) -> Callable[[State], float]:
    """A part of the time in which the fastest wave of all bodies, beside a motion with `speed` [m/s], crosses a cell.

    The part is `on_body` where nodes are those of the bodies, whose shortest cell counts, and `on_grid`
    on a grid.
    """
    assert s.geometry is not None
    h, counted, shortest = s.geometry.nodal_spacing, 0, 1.0
    wave = max(map(wave_speed, s.bodies.materials))
    courant = on_body if s.choices.on_body else on_grid

    def step(s: State) -> float:
        nonlocal counted, shortest
        if counted % LOOKS == 0 and s.choices.on_body:
            shortest = smallest_stretch(s.particles.F[s.particles.material])
        counted += 1
        return courant * h * shortest / (wave + speed)

    return step


def spare_light_nodes(s: State) -> None:
    """Let nodes of a grid follow their neighbours when they are too light for their stiffness in this step.

    A particle that has just come into a cell gives a node beyond it the mass ``m_i = m_p phi_i`` and
    the stiffness ``K_i = c^2 m_p |grad phi_i|^2``, about ``c^2 m_p / h^2`` however small phi_i is. The
    step bears ``dt^2 K_i / m_i < 4``, that is a mass of more than ``(c dt / 2 h)^2`` particles. Particles
    hardly see a lighter node, but massless points before them do: on a surface they would be
    thrown about by it, and the forces of contact there, which it gets in full, would throw it.
    """
    if s.choices.on_body or s.geometry is None:
        return
    wave = max(map(wave_speed, s.bodies.materials))
    least = (0.5 * wave * s.time_step / s.geometry.nodal_spacing) ** 2
    s.mass.light_nodes.cutoff = max(s.choices.mass_cutoff, least)


def stability_limit(s: State, iterations: int = 60) -> float:
    """Critical time step ``2 / omega_max`` of the leapfrog scheme about the current state [s].

    The highest frequency of ``M^-1 K`` is found by power iteration with the elastic tangent of the
    undeformed material; no matrix K is formed: a nodal displacement is strained, stressed and
    summed with the transfers of the run itself.

    Parameters
    ----------
    s : State
        Not changed, but for its scratch arrays.
    iterations : int
        Power iterations; the estimate approaches the limit from above, so a factor below one
        (`cfl`) belongs to it.

    Returns
    -------
    float
        Time step [s]; infinite when nothing is free to move.
    """
    p, dim = s.particles, s.particles.dimension
    lame, shear = s.material.lame_parameters()
    s.basis.locate(p.x)
    phi = s.basis.handle
    m_i = np.zeros(len(s.fixed))
    p2g_mass(phi, p.x, p.m, m_i)
    s.mass.assemble(s.basis, p, m_i)
    u = np.random.default_rng(0).standard_normal(s.fixed.shape)
    u[s.fixed] = 0.0
    f, a = np.zeros_like(u), np.zeros_like(u)
    L = np.zeros_like(p.F)
    omega_squared = 0.0
    for _ in range(iterations):
        norm = np.linalg.norm(u)
        if norm == 0.0:
            return float("inf")
        u /= norm
        velocity_gradients(phi, p.x, u, L, 0, len(p.x))
        trace = np.trace(L, axis1=1, axis2=2)
        sigma = shear * (L + L.transpose(0, 2, 1)) + lame * trace[:, None, None] * np.eye(dim)
        f[:] = 0.0
        p2g_internal_force(phi, p.x, p.V, sigma, f)
        s.mass.solve(-f, a)
        omega_squared = float(np.linalg.norm(a))
        u[:] = a
    return 2.0 / np.sqrt(omega_squared) if omega_squared > 0.0 else float("inf")


def smallest_stretch(F: np.ndarray) -> float:
    """Lower bound of all principal stretches, ``1 / |F^-1|``; exact in 1D."""
    return float(1.0 / np.sqrt(np.sum(np.linalg.inv(F) ** 2, axis=(1, 2)).max()))
