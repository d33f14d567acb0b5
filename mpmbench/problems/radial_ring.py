"""An expanding ring, a manufactured solution that is not aligned with the grid (Wallstedt and Guilkey 2008).

A ring a <= R <= b (0.4 and 0.6 m) in plane strain, neo-Hookean without Poisson effect, breathes as

    u_R = s q(R),   s = A sin(omega t),   q = c_1 R + c_2 R^2 + c_3 R^3,

with q(b) = 1 and q' = 0 at both rims, which are therefore free of traction. With l_r = 1 + s q' and
l_t = 1 + s q/R, the stretches along and across the radius, the force per unit mass along X/R is

    b_R = -omega^2 s q - (mu/rho) ((1 + 1/l_r^2) s q'' + (l_r - 1/l_r - l_t + 1/l_t)/R).
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from mpmbench.core.choices import Choices
from mpmbench.core.errors import NotApplicable, require
from mpmbench.core.geometry import Geometry
from mpmbench.core.geometry.rings import ring_cloud, ring_grid, seed_ring
from mpmbench.core.materials import Material
from mpmbench.core.materials.elastic.neo_hookean import NeoHookean
from mpmbench.core.particles import per_axis
from mpmbench.core.registry import register
from mpmbench.core.setting import setting
from mpmbench.core.state import Loads, State
from mpmbench.problems import Fields, Problem

ROOM = 1.25  # half the square grid over the outer radius, about; whole cells
COURANT, IMPLICIT = 0.15, 0.75


@register("problem", "radial_ring")
@dataclass(frozen=True)
class RadialRing(Problem):
    """Expanding ring, a manufactured solution, Wallstedt and Guilkey 2008; its rims carry no traction.

    The rim of a cartesian lattice is a stair-case; compare equal seedings only.
    """

    displacement_amplitude: float = setting(0.1, "A, of the outer rim", unit="m", above=0.0)
    inner_radius: float = setting(0.4, "a, of the ring", unit="m", above=0.0)
    outer_radius: float = setting(0.6, "b, of the ring, less than 3 a", unit="m", above=0.0)
    seeding: str = setting(
        "polar", "particles on circles or on a lattice", options=("polar", "cartesian")
    )
    dimension: ClassVar[int] = 2
    bends: ClassVar[bool] = True

    @property
    def reference_length(self) -> float:  # type: ignore[override]
        """Width of the ring."""
        return self.outer_radius - self.inner_radius

    def check_together(self) -> None:
        """The denominators of q vanish at b = 3 a, and no circle may shrink to a point."""
        a, b = self.inner_radius, self.outer_radius
        require(a < b < 3.0 * a, "outer_radius", b, f"a number between {a:g} and {3.0 * a:g}")
        largest = a / float(self._over_radius(a) * a)
        A = self.displacement_amplitude
        require(largest > A, "displacement_amplitude", A, f"a number below {largest:.4g}")

    def check(self, material: Material, choices: Choices, basis: str, resolution: int) -> None:
        if not isinstance(material, NeoHookean) or material.lame_parameters()[0] != 0.0:
            raise NotApplicable(
                "the body force of radial_ring is made for material=neo_hookean with "
                "material.poisson_ratio=0"
            )
        if not choices.dynamic:
            raise NotApplicable(
                "radial_ring is a dynamic problem: it needs method.time=explicit or newmark"
            )

    # geometry

    def nodes(self, resolution: int, choices: Choices) -> Geometry:
        if choices.moving:
            return ring_cloud(self.inner_radius, self.outer_radius, resolution)
        h = self.reference_length / resolution
        half = math.ceil(ROOM * self.outer_radius / h) * h
        return ring_grid(half, self.outer_radius, self.inner_radius, resolution)

    def seed(self, resolution: int, particles_per_cell: int) -> tuple[np.ndarray, np.ndarray]:
        n = per_axis(particles_per_cell, 2)
        return seed_ring(self.inner_radius, self.outer_radius, resolution, n, self.seeding)

    # profile of the motion

    @property
    def _coefficients(self) -> tuple[float, float, float]:
        """c_1 [1/m], c_2 [1/m^2] and c_3 [1/m^3]."""
        a, b = self.inner_radius, self.outer_radius
        D = b - 3.0 * a
        return -6.0 * a / (b * D), 3.0 * (b + a) / (b**2 * D), -2.0 / (b**2 * D)

    def _over_radius(self, R: Any) -> Any:
        """q/R [1/m] at radii R [m]."""
        c_1, c_2, c_3 = self._coefficients
        return c_1 + c_2 * R + c_3 * R**2

    def _slope(self, R: np.ndarray) -> np.ndarray:
        """Derivative of q at radii R [m] [1/m]."""
        c_1, c_2, c_3 = self._coefficients
        return c_1 + 2.0 * c_2 * R + 3.0 * c_3 * R**2

    def frequency(self, material: Material) -> float:
        """``pi C/(2 r_b)`` with ``C = sqrt(E/rho)`` and the mean radius r_b [rad/s]."""
        young = 2.0 * material.lame_parameters()[1]  # without Poisson effect
        C = math.sqrt(young / material.density)
        return math.pi * C / (self.inner_radius + self.outer_radius)

    # initial condition and load

    def velocity(self, X: np.ndarray, material: Material) -> np.ndarray:
        """``A omega q X/R``; nodes of a grid outside the ring rest."""
        R = np.hypot(*X.T)
        rate = self.displacement_amplitude * self.frequency(material) * self._over_radius(R)
        near = (0.5 * self.inner_radius < R) & (1.5 * self.outer_radius > R)
        return np.where(near, rate, 0.0)[:, None] * X

    def loads(self, material: Material) -> Loads:
        stiffness = material.lame_parameters()[1] / material.density
        omega = self.frequency(material)
        _, c_2, c_3 = self._coefficients

        def force(X: np.ndarray, t: float, b: np.ndarray) -> None:
            s = self.displacement_amplitude * math.sin(omega * t)
            R = np.hypot(X[:, 0], X[:, 1])
            along, across = 1.0 + s * self._slope(R), 1.0 + s * self._over_radius(R)
            bend = s * (2.0 * c_2 + 6.0 * c_3 * R) * (1.0 + 1.0 / along**2)
            hoop = (along - 1.0 / along - across + 1.0 / across) / R
            b_R = -(omega**2) * s * self._over_radius(R) * R - stiffness * (bend + hoop)
            np.multiply((b_R / R)[:, None], X, out=b)

        return Loads(body_force=force)

    def adaptive_step(self, state: State) -> Callable[[State], float] | None:
        """The same step always: a whole part of a quarter period, at most 0.15 h over the wave speed."""
        assert state.geometry is not None
        wave = math.sqrt(2.0 * state.material.lame_parameters()[1] / state.material.density)
        courant = IMPLICIT if state.choices.implicit else COURANT
        quarter = 0.5 * math.pi / self.frequency(state.material)
        step = quarter / math.ceil(quarter * wave / (courant * state.geometry.nodal_spacing))
        return lambda _: step

    # exact solution

    def exact(self, X: np.ndarray, t: float, material: Material) -> Fields:
        """Principal stresses ``mu (l^2 - 1)/J`` along and across the radius, ``J = l_r l_t``."""
        if not isinstance(material, NeoHookean) or material.lame_parameters()[0] != 0.0:
            return {}
        omega, shear = self.frequency(material), material.lame_parameters()[1]
        s = self.displacement_amplitude * math.sin(omega * t)
        rate = self.displacement_amplitude * omega * math.cos(omega * t)
        R = np.hypot(*X.T)
        along, across = 1.0 + s * self._slope(R), 1.0 + s * self._over_radius(R)
        e = X / R[:, None]
        projector = e[:, :, None] * e[:, None, :]
        radial, hoop = (shear * (l**2 - 1.0) / (along * across) for l in (along, across))
        return {
            "displacement": (s * self._over_radius(R))[:, None] * X,
            "velocity": (rate * self._over_radius(R))[:, None] * X,
            "stress": radial[:, None, None] * projector
            + hoop[:, None, None] * (np.eye(2) - projector),
        }
