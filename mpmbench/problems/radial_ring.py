"""An expanding ring, a manufactured solution that is not aligned with the grid (Wallstedt and Guilkey 2008).

A ring 0.4 m <= R <= 0.6 m in plane strain, neo-Hookean without Poisson effect, breathes as

    u_R = s q(R),   s = A sin(omega t),   q = c_1 R + c_2 R^2 + c_3 R^3,

with q' = 0 at both rims, which are therefore free of traction. With l_r = 1 + s q' and
l_t = 1 + s q/R, the stretches along and across the radius, the force per unit mass along X/R is

    b_R = -omega^2 s q - (mu/rho) ((1 + 1/l_r^2) s q'' + (l_r - 1/l_r - l_t + 1/l_t)/R).
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from mpmbench.core.choices import Choices
from mpmbench.core.errors import NotApplicable
from mpmbench.core.geometry import Geometry
from mpmbench.core.geometry.rings import ring_cloud, ring_grid, seed_ring
from mpmbench.core.materials import Material
from mpmbench.core.materials.elastic.neo_hookean import NeoHookean
from mpmbench.core.particles import per_axis
from mpmbench.core.registry import register
from mpmbench.core.setting import setting
from mpmbench.core.state import Loads, State
from mpmbench.problems import Fields, Problem

INNER, OUTER = 0.4, 0.6  # [m]
HALF = 0.75  # [m] of the square grid, about; whole cells
COURANT, IMPLICIT = 0.15, 0.75
D = OUTER - 3.0 * INNER
C1, C2, C3 = (
    -6.0 * INNER / (OUTER * D),  # [1/m]
    3.0 * (OUTER + INNER) / (OUTER**2 * D),  # [1/m^2]
    -2.0 / (OUTER**2 * D),  # [1/m^3]
)


@register("problem", "radial_ring")
@dataclass(frozen=True)
class RadialRing(Problem):
    """Expanding ring, a manufactured solution, Wallstedt and Guilkey 2008; its rims carry no traction.

    The rim of a cartesian lattice is a stair-case; compare equal seedings only.
    """

    displacement_amplitude: float = setting(
        0.1, "A, of the outer rim", unit="m", above=0.0, below=0.4
    )
    seeding: str = setting(
        "polar", "particles on circles or on a lattice", options=("polar", "cartesian")
    )
    dimension: ClassVar[int] = 2
    reference_length: ClassVar[float] = OUTER - INNER
    bends: ClassVar[bool] = True

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
            return ring_cloud(INNER, OUTER, resolution)
        h = (OUTER - INNER) / resolution
        return ring_grid(math.ceil(HALF / h) * h, OUTER, INNER, resolution)

    def seed(self, resolution: int, particles_per_cell: int) -> tuple[np.ndarray, np.ndarray]:
        circles = resolution * per_axis(particles_per_cell, 2)
        return seed_ring(INNER, OUTER, circles, self.seeding)

    # initial condition and load

    def velocity(self, X: np.ndarray, material: Material) -> np.ndarray:
        """``A omega q X/R``; nodes of a grid outside the ring rest."""
        R = np.hypot(*X.T)
        rate = self.displacement_amplitude * frequency(material) * over_radius(R)
        return np.where((R > 0.5 * INNER) & (R < 1.5 * OUTER), rate, 0.0)[:, None] * X

    def loads(self, material: Material) -> Loads:
        stiffness = material.lame_parameters()[1] / material.density
        omega = frequency(material)

        def force(X: np.ndarray, t: float, b: np.ndarray) -> None:
            s = self.displacement_amplitude * math.sin(omega * t)
            R = np.hypot(X[:, 0], X[:, 1])
            along, across = 1.0 + s * slope(R), 1.0 + s * over_radius(R)
            bend = s * (2.0 * C2 + 6.0 * C3 * R) * (1.0 + 1.0 / along**2)
            hoop = (along - 1.0 / along - across + 1.0 / across) / R
            b_R = -(omega**2) * s * over_radius(R) * R - stiffness * (bend + hoop)
            np.multiply((b_R / R)[:, None], X, out=b)

        return Loads(body_force=force)

    def adaptive_step(self, state: State) -> Callable[[State], float] | None:
        """The same step always: a whole part of a quarter period, at most 0.15 h over the wave speed."""
        assert state.geometry is not None
        wave = math.sqrt(2.0 * state.material.lame_parameters()[1] / state.material.density)
        courant = IMPLICIT if state.choices.implicit else COURANT
        quarter = 0.5 * math.pi / frequency(state.material)
        step = quarter / math.ceil(quarter * wave / (courant * state.geometry.nodal_spacing))
        return lambda _: step

    # exact solution

    def exact(self, X: np.ndarray, t: float, material: Material) -> Fields:
        """Principal stresses ``mu (l^2 - 1)/J`` along and across the radius, ``J = l_r l_t``."""
        if not isinstance(material, NeoHookean) or material.lame_parameters()[0] != 0.0:
            return {}
        omega, shear = frequency(material), material.lame_parameters()[1]
        s = self.displacement_amplitude * math.sin(omega * t)
        rate = self.displacement_amplitude * omega * math.cos(omega * t)
        R = np.hypot(*X.T)
        along, across = 1.0 + s * slope(R), 1.0 + s * over_radius(R)
        e = X / R[:, None]
        projector = e[:, :, None] * e[:, None, :]
        radial, hoop = (shear * (l**2 - 1.0) / (along * across) for l in (along, across))
        return {
            "displacement": (s * over_radius(R))[:, None] * X,
            "velocity": (rate * over_radius(R))[:, None] * X,
            "stress": radial[:, None, None] * projector
            + hoop[:, None, None] * (np.eye(2) - projector),
        }


def frequency(material: Material) -> float:
    """``pi C/(2 r_b)`` with ``C = sqrt(E/rho)`` and the mean radius r_b [rad/s]."""
    young = 2.0 * material.lame_parameters()[1]  # without Poisson effect
    return math.pi * math.sqrt(young / material.density) / (INNER + OUTER)


def over_radius(R: np.ndarray) -> np.ndarray:
    """q/R [1/m] at radii R [m]."""
    return C1 + C2 * R + C3 * R**2


def slope(R: np.ndarray) -> np.ndarray:
    """Derivative of q at radii R [m] [1/m]."""
    return C1 + 2.0 * C2 * R + 3.0 * C3 * R**2
