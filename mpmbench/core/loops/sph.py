"""Smoothed particle hydrodynamics with an Eulerian kernel, for contrast: it has the tensile instability (Swegle 1995).

Particles are their own nodes; there is no artificial viscosity. The derivatives of Li 2009, Eq.
2.5, are ``L_i = sum_j V_j v_j (x) grad W_ij`` and ``rho_i a_i = sum_j V_j sigma_j grad W_ij``.
Monaghan's symmetric ones put ``v_j - v_i`` in place of v_j, and ``rho_i rho_j (sigma_i / rho_i^2 +
sigma_j / rho_j^2)`` in place of sigma_j.
"""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from mpmbench.core.bases.clouds.sph_kernel import KernelBasis, SmoothedKernel, pair_gradients
from mpmbench.core.compiled import lean, matrix
from mpmbench.core.errors import BrokeDown, Diverged, NotApplicable
from mpmbench.core.geometry import search_tree
from mpmbench.core.loads import body_force, constrain
from mpmbench.core.loops import LoopPromises, TimeLoop
from mpmbench.core.materials import cauchy_stress
from mpmbench.core.registry import register
from mpmbench.core.setting import setting
from mpmbench.core.state import State


@register("method", "sph")
@dataclass(frozen=True)
class SmoothedParticles(TimeLoop):
    """The leapfrog of smoothed particle hydrodynamics."""

    time: str = "sph"
    mass: str = setting("lumped", "only lumped", options=("lumped", "consistent"))
    transfer: str = setting("flip", "only flip: particles keep their velocities")
    derivatives: str = setting(
        "plain",
        "of Eq. 2.5 of Li 2009, or exact for constants and conserving momentum",
        options=("plain", "symmetric"),
    )
    velocity_lag: ClassVar[float] = 0.5
    stress: ClassVar[Any] = staticmethod(cauchy_stress)
    particles_are_nodes: ClassVar[bool] = True
    meets_walls: ClassVar[bool] = True

    @property
    def promises(self) -> LoopPromises:
        """Plain derivatives of a constant do not vanish near a surface, and no force has its counterpart."""
        if self.derivatives == "plain":
            return LoopPromises(frozenset({"mass"}), translation=False)
        return LoopPromises()

    def check(self, case: Any) -> None:
        """Refuse other functions, and choices that SPH does not have."""
        for key, value, wanted in (
            ("nodes", self.nodes, "moving"),
            ("shape_functions", self.shape_functions, "updated"),
            ("mass", self.mass, "lumped"),
            ("transfer", self.transfer, "flip"),
        ):
            if value != wanted:
                raise NotApplicable(
                    f"method.{key}={value} is no choice for sph, whose particles are the nodes: "
                    f"only {wanted}"
                )
        if not isinstance(case.basis, SmoothedKernel):
            raise NotApplicable(f"method=sph needs basis=sph_kernel, not basis={case.basis_name}")

    def start(self, s: State, dt: float) -> None:
        """Bring velocities to ``v(0) - a(0) dt/2``."""
        p = s.particles
        a = self.accelerations(s)[0]
        constrain(s, dt)
        p.v[p.material] -= np.where(s.fixed, p.v[p.material] - s.nodes.v, 0.5 * dt * a)

    def accelerations(self, s: State) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Accelerations [m/s^2], shape (N, dim), the pairs i, j, and the kernel's gradients at them."""
        p, radius = s.particles, support_radius(s)
        solid = p.material
        x = p.x[solid]
        if not np.isfinite(x).all():
            raise Diverged("a position is not finite")
        if s.workspace is None:  # tracers go with the nearest particle
            s.workspace = search_tree(p.X[solid]).query(p.X[solid.stop :])[1]
        i, j = search_tree(x).query_pairs(radius, output_type="ndarray").T
        gradient = pair_gradients(radius, x, i, j)

        symmetric = self.derivatives == "symmetric"
        m, V = p.m[solid, None], p.V[solid, None]
        if symmetric:
            specific = p.sigma[solid] * (V / m)[:, :, None] ** 2
            pull = np.einsum("nab,nb->na", specific[i] + specific[j], gradient)
            a = scatter(m[j] * pull, i, len(x)) - scatter(m[i] * pull, j, len(x))
        else:
            push = [
                np.einsum("nab,nb->na", V[k, :, None] * p.sigma[solid][k], gradient) for k in (i, j)
            ]
            a = V / m * (scatter(push[1], i, len(x)) - scatter(push[0], j, len(x)))
        if s.loads.body_force is not None:
            a += body_force(s, s.time)[solid]
        return a, i, j, gradient

    def step(self, s: State, dt: float) -> None:
        """Advance the state by one step of size `dt` [s]."""
        p = s.particles
        solid, symmetric = p.material, self.derivatives == "symmetric"
        a, i, j, gradient = self.accelerations(s)
        v, V, n = p.v[solid], p.V[solid, None], s.nodes
        constrain(s, dt)
        n.a[:] = np.where(s.fixed, (n.v - v) / dt, a)
        n.v[:] = np.where(s.fixed, n.v, v + dt * a)
        meet_walls(s, dt)
        p.a[solid], v[:] = n.a, n.v

        by_i, by_j = (v[j] - v[i], v[i] - v[j]) if symmetric else (v[j], v[i])
        L = scatter(np.einsum("na,nb->nab", V[j] * by_i, gradient), i, len(v))
        L -= scatter(np.einsum("na,nb->nab", V[i] * by_j, gradient), j, len(v))
        p.F[solid] += dt * L @ p.F[solid]
        if len(p.L):
            p.L[solid] = L
        p.V[solid] = p.V0[solid] * np.linalg.det(p.F[solid])
        p.v[solid.stop :] = v[s.workspace]
        p.x += dt * p.v
        if s.loads.body_force is not None:
            s.external_work += dt * float(np.sum(p.m[:, None] * p.b * p.v))
        s.basis.move(dt * v)
        if p.V[solid].min() > 0.0:  # the guard ends the run otherwise
            update_stress(s.law, s.axes, p.F[solid], L, dt, p.state, p.sigma)
        s.time += dt


def meet_walls(s: State, dt: float) -> None:
    """Hold the particles, which are the nodes, at rigid walls: their centres do not pass them."""
    p, n = s.particles, s.nodes
    if not s.loads.walls:
        return
    n.m[:], n.v_last[:] = p.m[p.material], p.v[p.material]
    s.mass.assemble(s.basis, p, n.m)
    s.contact_energy -= s.walls.hold(s, dt)


@lean
def update_stress(law, axes, F, L, dt, state, sigma):
    """Cauchy stresses of all particles from their deformation and velocity gradients."""
    F_p, L_p, sigma_p = matrix(axes, axes), matrix(axes, axes), matrix(axes, axes)
    for p in range(F.shape[0]):
        for d in range(len(axes)):
            for e in range(len(axes)):
                F_p[d, e], L_p[d, e], sigma_p[d, e] = F[p, d, e], L[p, d, e], sigma[p, d, e]
        cauchy_stress(law, axes, F_p, L_p, dt, state[p], sigma_p)
        for d in range(len(axes)):
            for e in range(len(axes)):
                sigma[p, d, e] = sigma_p[d, e]


def support_radius(s: State) -> float:
    """Radius of the kernel's support, twice the smoothing length [m].

    Raises
    ------
    BrokeDown
        When the particles are not the nodes.
    """
    if not isinstance(s.basis, KernelBasis):
        raise BrokeDown("method=sph needs basis=sph_kernel")
    particles, nodes = len(s.particles.x) - s.particles.tracers, len(s.fixed)
    if nodes != particles:
        raise BrokeDown(
            f"method=sph needs particles at the nodes: there are {particles} particles and {nodes} nodes"
        )
    return s.basis.radius


def scatter(values: np.ndarray, index: np.ndarray, count: int) -> np.ndarray:
    """Sums of `values` by `index`, in the order of the pairs, shape (count, ...)."""
    total = np.zeros((count, *values.shape[1:]))
    np.add.at(total, index, values)
    return total
