"""Vibration of an elastic bar with both ends fixed (Wobbes 2020, section 8.1).

``rho u'' = E u_xx`` on (0, l) with ``u(0) = u(l) = 0``, ``u = 0`` and ``u' = v_0 sin(pi X / l)`` at
t = 0. With nu = 0 and the small-strain law the bar is linear at any amplitude, and the solution
below is exact.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from mpmbench.core.choices import Choices
from mpmbench.core.errors import require
from mpmbench.core.geometry import Box
from mpmbench.core.materials import Material
from mpmbench.core.materials.elastic.small_strain_elastic import SmallStrainElastic
from mpmbench.core.particles import seed_cells
from mpmbench.core.registry import register
from mpmbench.core.setting import setting
from mpmbench.problems import Fields, Problem


@register("problem", "bar_fixed_ends")
@dataclass(frozen=True)
class BarFixedEnds(Problem):
    """Vibrating bar with both ends fixed, Wobbes et al. 2020, Sect. 8.1."""

    velocity_amplitude: float = setting(
        0.6, "of the initial velocity, not 0; 20 for large strain", unit="m/s"
    )
    particle_layout: str = setting(
        "midpoint", "middles of equal sub-cells, or Gauss points", options=("midpoint", "gauss")
    )
    length: float = setting(1.0, "of the bar", unit="m", above=0.0, below=1e3)
    dimension: ClassVar[int] = 1
    initial_acceleration: ClassVar[str] = "zero"

    @property
    def reference_length(self) -> float:  # type: ignore[override]
        """The bar."""
        return self.length

    def check_together(self) -> None:
        v0 = self.velocity_amplitude
        require(v0 != 0.0, "velocity_amplitude", v0, "a number other than 0")

    # geometry

    def nodes(self, resolution: int, choices: Choices) -> Box:
        return Box((0.0,), (self.reference_length,), (resolution,))

    def seed(self, resolution: int, particles_per_cell: int) -> tuple[np.ndarray, np.ndarray]:
        box = Box((0.0,), (self.reference_length,), (resolution,))
        return seed_cells(box, particles_per_cell, self.particle_layout)

    # initial and boundary conditions

    def fixed(self, x: np.ndarray) -> np.ndarray:
        tolerance = 1e-12 * self.reference_length
        return (x < tolerance) | (x > self.reference_length - tolerance)

    def velocity(self, X: np.ndarray, material: Material) -> np.ndarray:
        return self.velocity_amplitude * np.sin(np.pi * X / self.reference_length)

    # exact solution

    def exact(self, X: np.ndarray, t: float, material: Material) -> Fields:
        """Standing wave ``u = v_0 l/(pi c) sin(pi X/l) sin(pi c t/l)``; exact for the small-strain law only."""
        return self._linear(X, t, material) if isinstance(material, SmallStrainElastic) else {}

    def alternative(self, X: np.ndarray, t: float, material: Material) -> Fields:
        """The linear solution, beside which other laws are reported."""
        return {} if isinstance(material, SmallStrainElastic) else self._linear(X, t, material)

    def _linear(self, X: np.ndarray, t: float, material: Material) -> Fields:
        omega = self._frequency(material)
        k = np.pi / self.reference_length
        amplitude = self.velocity_amplitude / omega
        fields = {
            "displacement": amplitude * np.sin(k * X) * np.sin(omega * t),
            "velocity": self.velocity_amplitude * np.sin(k * X) * np.cos(omega * t),
        }
        modulus = self._modulus(material)
        fields["stress"] = (modulus * amplitude * k * np.cos(k * X) * np.sin(omega * t))[:, :, None]
        return fields

    def temporal_floor(
        self, dt: float, t: float, X: np.ndarray, material: Material
    ) -> float | None:
        """Error of the leapfrog scheme on this mode: ``sin(Omega dt/2) = omega dt/2``, amplitude as below."""
        if not isinstance(material, SmallStrainElastic):
            return None
        omega = self._frequency(material)
        half = 0.5 * omega * dt
        if half >= 1.0:
            return None
        amplitude = self.velocity_amplitude / (omega * np.sqrt(1.0 - half**2))
        discrete = amplitude * np.sin(2.0 / dt * np.arcsin(half) * t)
        exact = self.velocity_amplitude / omega * np.sin(omega * t)
        shape = np.sin(np.pi * X[:, 0] / self.reference_length)
        return float(abs(discrete - exact) * np.sqrt(np.mean(shape**2)))

    def _modulus(self, material: Material) -> float:
        lame, shear = material.lame_parameters()
        return lame + 2.0 * shear

    def _frequency(self, material: Material) -> float:
        return float(
            np.pi / self.reference_length * np.sqrt(self._modulus(material) / material.density)
        )
