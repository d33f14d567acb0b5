"""Neo-Hookean plate in axis-aligned motion, a manufactured solution (Wobbes 2020, section 8.3).

``u_i = A sin(2 pi X_i / l) s_i(t)`` with ``s_1 = sin(c pi t / l) = -s_2`` on the unit square in
plane strain; the body force makes it a solution of the momentum balance. Rollers on all sides:
clamping, as the paper says, gives 37 % error.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from mpmbench.core.choices import Choices
from mpmbench.core.compiled import compiled
from mpmbench.core.compiled.exponentials import logarithm
from mpmbench.core.errors import NotApplicable, require
from mpmbench.core.geometry import Box
from mpmbench.core.materials import Material
from mpmbench.core.materials.elastic.neo_hookean import NeoHookean
from mpmbench.core.particles import seed_cells
from mpmbench.core.registry import register
from mpmbench.core.setting import setting
from mpmbench.core.state import Loads
from mpmbench.problems import Fields, Problem

LARGEST = 0.15915  # amplitude over the length: 1 / (2 pi), beyond which F is not positive


@register("problem", "plate_axis_aligned")
@dataclass(frozen=True)
class PlateAxisAligned(Problem):
    """Plate undergoing axis-aligned displacement, a manufactured solution, Wobbes et al. 2020, Sect. 8.3."""

    displacement_amplitude: float = setting(
        0.005, "A, not 0, within 0.159 lengths; 0.05 for large strain", unit="m"
    )
    length: float = setting(1.0, "l, of each side of the plate", unit="m", above=0.0, below=1e3)
    body_force: bool = setting(
        True, "the manufactured body force acts; else free vibration, for timings only"
    )
    particle_layout: str = setting(
        "midpoint", "middles of equal sub-cells, or Gauss points", options=("midpoint", "gauss")
    )
    dimension: ClassVar[int] = 2
    initial_acceleration: ClassVar[str] = "zero"

    @property
    def reference_length(self) -> float:  # type: ignore[override]
        """A side of the plate."""
        return self.length

    def check_together(self) -> None:
        A = self.displacement_amplitude
        require(A != 0.0, "displacement_amplitude", A, "a number other than 0")
        most = LARGEST * self.length
        require(
            abs(A) < most, "displacement_amplitude", A, f"a number between {-most:g} and {most:g}"
        )

    def check(self, material: Material, choices: Choices, basis: str, resolution: int) -> None:
        if self.body_force and not isinstance(material, NeoHookean):
            raise NotApplicable(
                "the body force of plate_axis_aligned is made for material=neo_hookean"
            )

    # geometry

    def nodes(self, resolution: int, choices: Choices) -> Box:
        return Box((0.0, 0.0), (self.reference_length,) * 2, (resolution,) * 2)

    def seed(self, resolution: int, particles_per_cell: int) -> tuple[np.ndarray, np.ndarray]:
        box = Box((0.0, 0.0), (self.reference_length,) * 2, (resolution,) * 2)
        return seed_cells(box, particles_per_cell, self.particle_layout)

    # initial and boundary conditions

    def fixed(self, x: np.ndarray) -> np.ndarray:
        """Rollers: u_1 = 0 on x_1 = 0 and l, u_2 = 0 on x_2 = 0 and l."""
        tolerance = 1e-12 * self.reference_length
        return (x < tolerance) | (x > self.reference_length - tolerance)

    def velocity(self, X: np.ndarray, material: Material) -> np.ndarray:
        omega = self._frequency(material)
        amplitude = self.displacement_amplitude * omega * np.array([1.0, -1.0])
        return amplitude * np.sin(2.0 * np.pi * X / self.reference_length)

    def loads(self, material: Material) -> Loads:
        if not self.body_force:
            return Loads()
        lame, shear = material.lame_parameters()
        l, A, rho = self.reference_length, self.displacement_amplitude, material.density
        omega = self._frequency(material)

        k, young = 2.0 * np.pi / l, rho * (omega * l / np.pi) ** 2
        kept: dict[tuple[int, int], tuple[np.ndarray, ...]] = {}  # X stays where it is, as it is

        def body_force(X: np.ndarray, t: float, b: np.ndarray) -> None:
            place = X.ctypes.data, len(X)
            if place not in kept:
                kept[place] = np.sin(k * X), np.cos(k * X), np.zeros(len(X)), X
            sines, cosines, log_J, _ = kept[place]
            s = A * float(np.sin(omega * t))
            factor = np.pi**2 / (rho * l**2)
            manufactured_force(sines, cosines, log_J, b, s, k * s, factor, lame, shear, young)

        return Loads(body_force=body_force)

    # exact solution

    def exact(self, X: np.ndarray, t: float, material: Material) -> Fields:
        """Eqs. 104 and 105; ``sigma_ii = lambda ln J / J + mu (F_i^2 - 1) / J``."""
        if not isinstance(material, NeoHookean) or not self.body_force:
            return {}
        lame, shear = material.lame_parameters()
        k, omega, A = (
            2.0 * np.pi / self.reference_length,
            self._frequency(material),
            self.displacement_amplitude,
        )
        signs = np.array([1.0, -1.0])
        F = 1.0 + k * A * np.cos(k * X) * np.sin(omega * t) * signs
        J = np.prod(F, axis=1, keepdims=True)
        sigma = np.zeros((len(X), 2, 2))
        sigma[:, [0, 1], [0, 1]] = (lame * np.log(J) + shear * (F**2 - 1.0)) / J
        return {
            "displacement": A * np.sin(k * X) * np.sin(omega * t) * signs,
            "velocity": A * omega * np.sin(k * X) * np.cos(omega * t) * signs,
            "stress": sigma,
        }

    def _frequency(self, material: Material) -> float:
        """``pi c / l`` with ``c = sqrt(E / rho_0)``, Eq. 106."""
        lame, shear = material.lame_parameters()
        young = shear * (3.0 * lame + 2.0 * shear) / (lame + shear)
        return float(np.pi / self.reference_length * np.sqrt(young / material.density))


@compiled
def manufactured_force(sines, cosines, log_J, b, displacement, strain, factor, lame, shear, young):
    """``b_i = (pi^2 u_i/(rho_0 l^2)) {(4/F_i^2) [lambda (1 - ln J) + mu (1 + F_i^2)] - E}``.

    `displacement` and `strain` are the largest of this instant, `factor` is ``pi^2/(rho_0 l^2)``.
    Sines and cosines of the initial places have the shape of `b`; `log_J` is written.
    """
    for p in range(b.shape[0]):
        log_J[p] = (1.0 + strain * cosines[p, 0]) * (1.0 - strain * cosines[p, 1])
    for p in range(b.shape[0]):  # in a loop of its own, which the compiler can vectorise
        log_J[p] = logarithm(log_J[p])
    for p in range(b.shape[0]):
        F_1, F_2 = 1.0 + strain * cosines[p, 0], 1.0 - strain * cosines[p, 1]
        u_1, u_2 = displacement * sines[p, 0], -displacement * sines[p, 1]
        volumetric = lame * (1.0 - log_J[p]) + shear
        b[p, 0] = factor * u_1 * (4.0 * (volumetric / (F_1 * F_1) + shear) - young)
        b[p, 1] = factor * u_2 * (4.0 * (volumetric / (F_2 * F_2) + shear) - young)
