"""The generalised vortex: a ring that is turned in its middle and sheared around it (Brannon, Kamojjala et al. 2015).

A manufactured solution of large rotation with large shear. With R and Theta of the initial place

    x = Q(alpha) X,   alpha = g(t) h(R),   g = A sin(pi t/T),   h = (1 - 16 (R/r - 1)^2)^2,

on 0.75 r <= R <= 1.25 r, r = 1 m, in plane strain. h and h' vanish at both rims, which rest and carry
no traction; the circle R = r turns by A. For neo-Hookean material (J = 1, sigma = mu (b - I)) the
force per unit mass is, along the directions e_r, e_t at the angle Theta + alpha,

    b_r = R ((mu/rho) (g h')^2 - (g_t h)^2),   b_t = R g_tt h - (mu/rho) g (3 h' + R h'').

No boundary condition holds the ring. Its angular momentum is driven, L(t) = rho g_t 2 pi int R^3 h dR.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from mpmbench.core.choices import Choices
from mpmbench.core.compiled import compiled
from mpmbench.core.errors import NotApplicable
from mpmbench.core.geometry import Geometry
from mpmbench.core.geometry.rings import ring_cloud, ring_grid, seed_ring
from mpmbench.core.materials import Material
from mpmbench.core.materials.elastic.neo_hookean import NeoHookean
from mpmbench.core.particles import per_axis
from mpmbench.core.registry import register
from mpmbench.core.setting import setting
from mpmbench.core.simulation import Solution
from mpmbench.core.stability import wave_speed
from mpmbench.core.state import Loads, State
from mpmbench.problems import Fields, Problem

INNER, OUTER = 0.75, 1.25  # rims over the radius r
HALF = 1.5  # half the square grid over r
COURANT, IMPLICIT = 0.2, 1.0  # over the largest stretch, which waves run along
SPIN = 1.720395977  # 2 pi int R^3 h dR over r^4: angular momentum over rho g_t
KINETIC, STRAIN = 0.649171815, 32.5528839  # pi int R^3 h^2 dR over r^4, pi int R^3 h'^2 dR over r^2
SHEAR = 7.066  # R h' at R = 1.150 r: the largest shear for A = 1


@register("problem", "generalized_vortex")
@dataclass(frozen=True)
class GeneralizedVortex(Problem):
    """Generalised vortex, large rotation and shear of a ring, a manufactured solution, Kamojjala et al. 2015.

    Amplitudes 0.2, 0.5 and 1 (that of the papers) are mild, usual and hard: shears of 1.4, 3.5 and 7.
    The rim of a cartesian lattice is a stair-case; compare equal seedings only.
    """

    amplitude: float = setting(
        0.5, "A, by which the middle of the ring is turned", unit="rad", above=0.0, most=10.0
    )
    period: float = setting(1.0, "T, after which the ring is back", unit="s", above=0.0)
    radius: float = setting(
        1.0, "r, of the middle of the ring, which is half as wide", unit="m", above=0.0
    )
    seeding: str = setting(
        "polar", "particles on circles or on a lattice", options=("polar", "cartesian")
    )
    dimension: ClassVar[int] = 2
    bends: ClassVar[bool] = True

    @property
    def reference_length(self) -> float:  # type: ignore[override]
        """Width of the ring."""
        return (OUTER - INNER) * self.radius

    def check(self, material: Material, choices: Choices, basis: str, resolution: int) -> None:
        if not isinstance(material, NeoHookean):
            raise NotApplicable(
                "the body force of generalized_vortex is made for material=neo_hookean"
            )
        if not choices.dynamic:
            raise NotApplicable(
                "generalized_vortex is a dynamic problem: it needs method.time=explicit or newmark"
            )

    # geometry

    def nodes(self, resolution: int, choices: Choices) -> Geometry:
        if choices.moving:
            return ring_cloud(INNER * self.radius, OUTER * self.radius, resolution)
        half, outer, inner = (ratio * self.radius for ratio in (HALF, OUTER, INNER))
        return ring_grid(half, outer, inner, resolution)

    def seed(self, resolution: int, particles_per_cell: int) -> tuple[np.ndarray, np.ndarray]:
        n = per_axis(particles_per_cell, 2)
        return seed_ring(INNER * self.radius, OUTER * self.radius, resolution, n, self.seeding)

    # initial condition and load

    def turn(self, t: float) -> tuple[float, float, float]:
        """Angle g [rad], its rates g_t [rad/s] and g_tt [rad/s^2] at t."""
        omega = math.pi / self.period
        sine, cosine = math.sin(omega * t), math.cos(omega * t)
        A = self.amplitude
        return A * sine, A * omega * cosine, -A * omega**2 * sine

    def velocity(self, X: np.ndarray, material: Material) -> np.ndarray:
        """``g_t(0) h k x X``; nodes of a grid outside the ring rest."""
        y = np.hypot(*X.T) / self.radius - 1.0
        h = np.where(np.abs(y) < 0.25, profile(y)[0], 0.0)
        return self.turn(0.0)[1] * h[:, None] * np.stack([-X[:, 1], X[:, 0]], axis=1)

    def loads(self, material: Material) -> Loads:
        _, shear = material.lame_parameters()
        stiffness = shear / material.density

        def force(X: np.ndarray, t: float, b: np.ndarray) -> None:
            vortex_force(X, b, stiffness, self.radius, *self.turn(t))

        return Loads(body_force=force)

    def adaptive_step(self, state: State) -> Callable[[State], float] | None:
        """A whole part of T/2, at most 0.2 h (implicit: h) over the wave speed times the largest stretch."""
        assert state.geometry is not None
        wave = wave_speed(state.material)
        slide = 0.5 * SHEAR * self.amplitude
        stretch = slide + math.hypot(1.0, slide)
        courant = IMPLICIT if state.choices.implicit else COURANT
        bound = courant * state.geometry.nodal_spacing / (wave * stretch)
        half = 0.5 * self.period
        step = half / math.ceil(half / bound)
        return lambda _: step

    # exact solution

    def exact(self, X: np.ndarray, t: float, material: Material) -> Fields:
        """``F = Q (I + (k x X) (x) grad alpha)``, ``sigma = mu (F F^T - I)``."""
        if not isinstance(material, NeoHookean):
            return {}
        _, shear = material.lame_parameters()
        g, rate, _ = self.turn(t)
        R = np.hypot(*X.T)
        h, slope = profile(R / self.radius - 1.0)
        alpha = g * h
        c, s = np.cos(alpha), np.sin(alpha)
        Q = np.stack([np.stack([c, -s], axis=1), np.stack([s, c], axis=1)], axis=1)
        across = np.stack([-X[:, 1], X[:, 0]], axis=1)
        F = Q @ (
            np.eye(2)
            + across[:, :, None] * (X * (g * slope / (R * self.radius))[:, None])[:, None, :]
        )
        return {
            "displacement": np.einsum("pij,pj->pi", Q, X) - X,
            "velocity": (rate * h)[:, None] * np.einsum("pij,pj->pi", Q, across),
            "stress": shear * (F @ F.transpose(0, 2, 1) - np.eye(2)),
        }

    # quantities of interest

    @property
    def _spin(self) -> float:
        """Angular momentum over rho g_t [m^4]."""
        return SPIN * self.radius**4

    def observe(self, state: State) -> dict[str, Any]:
        """Angular momentum that the ring should have when its velocities live [kg m2/s]."""
        t = state.time - state.choices.velocity_lag * (state.time_step if state.time > 0.0 else 0.0)
        return {"angular_momentum_exact": state.material.density * self._spin * self.turn(t)[1]}

    def quantities(self, solution: Solution, material: Material) -> dict[str, tuple[Any, str, str]]:
        series = {name: np.array(values) for name, values in solution.history.items()}
        _, shear = material.lame_parameters()
        g, rate, _ = np.array([self.turn(t) for t in series["time"]]).T
        spin, exact = series["angular_momentum"][:, 2], series["angular_momentum_exact"]
        kinetic = material.density * rate**2 * KINETIC * self.radius**4
        strain = shear * g**2 * STRAIN * self.radius**2
        scale = material.density * self._spin * self.amplitude * math.pi / self.period
        return {
            "angular_momentum_exact": (exact, "kg m2 s-1", "exact angular momentum of the ring"),
            "error_angular_momentum": (
                float(np.abs(spin - exact).max() / scale),
                "1",
                "largest error of the angular momentum over its largest value",
            ),
            "kinetic_energy_exact": (kinetic, "J", "exact kinetic energy"),
            "strain_energy_exact": (strain, "J", "exact strain energy"),
        }


def profile(y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Shape h and its derivative by y = R/r - 1."""
    return (1.0 - 16.0 * y**2) ** 2, -64.0 * y * (1.0 - 16.0 * y**2)


@compiled
def vortex_force(
    X: np.ndarray,
    b: np.ndarray,
    stiffness: float,
    radius: float,
    g: float,
    rate: float,
    acceleration: float,
) -> None:
    """Write the force per unit mass at initial places X; `stiffness` is mu/rho [m^2/s^2]."""
    for p in range(X.shape[0]):
        R = np.sqrt(X[p, 0] * X[p, 0] + X[p, 1] * X[p, 1])
        y = R / radius - 1.0
        h = (1.0 - 16.0 * y * y) ** 2
        slope = -64.0 * y * (1.0 - 16.0 * y * y) / radius
        bend = (3072.0 * y * y - 64.0) / radius**2
        c, s = np.cos(g * h), np.sin(g * h)
        e_x, e_y = (c * X[p, 0] - s * X[p, 1]) / R, (s * X[p, 0] + c * X[p, 1]) / R
        b_r = R * (stiffness * (g * slope) ** 2 - (rate * h) ** 2)
        b_t = R * acceleration * h - stiffness * g * (3.0 * slope + R * bend)
        b[p, 0] = b_r * e_x - b_t * e_y
        b[p, 1] = b_r * e_y + b_t * e_x
