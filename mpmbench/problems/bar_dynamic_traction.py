"""Neo-Hookean bar, fixed at one end and loaded by a point traction at the other (Wobbes 2020, section 8.2).

``rho_0 u'' = P(F)_X`` on (0, l) with ``u(0) = 0`` and ``P(F(l, t)) = tau(t) = A sin(pi t / l)``, at
rest at t = 0. The paper compares with the linear wave equation; the bar is nonlinear, and its
simple wave is known exactly until it reaches the fixed end. The errata prescribe A < 0: compression
first.
"""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from mpmbench.core.choices import Choices
from mpmbench.core.errors import NotApplicable, require
from mpmbench.core.geometry import Box
from mpmbench.core.materials import Material
from mpmbench.core.materials.elastic.neo_hookean import NeoHookean
from mpmbench.core.materials.elastic.small_strain_elastic import SmallStrainElastic
from mpmbench.core.particles import seed_cells
from mpmbench.core.registry import register
from mpmbench.core.setting import setting
from mpmbench.core.simulation import Solution
from mpmbench.core.state import Loads
from mpmbench.problems import Fields, Problem

INNER = 0.75  # part of the bar away from the loaded end
DOMAIN = 1.25  # length of the grid of methods with fixed nodes over that of the bar


@register("problem", "bar_dynamic_traction")
@dataclass(frozen=True)
class BarDynamicTraction(Problem):
    """Neo-Hookean bar with a dynamic traction at its free end, Wobbes et al. 2020, Sect. 8.2.

    With `domain_cells`, the bar need not be a whole number of cells of the fixed grid; moving nodes
    then use the nearest number of cells on the bar.
    """

    traction_amplitude: float = setting(
        -1.0, "A in tau(t) = A sin(pi t / l); negative: compression first", unit="Pa"
    )
    domain_cells: int | None = setting(
        None,
        "whole number of cells of the fixed grid on 1.25 lengths; null: resolution cells on one",
        unit="-",
        least=2,
    )
    particle_layout: str = setting(
        "midpoint",
        "uniform over the bar, Gauss points, or aligned with the grid's cells",
        options=("midpoint", "gauss", "aligned"),
    )
    length: float = setting(
        1.0,
        "l of the bar; l seconds are half a period of the traction",
        unit="m",
        above=0.0,
        below=1e3,
    )
    dimension: ClassVar[int] = 1
    initial_acceleration: ClassVar[str] = "zero"

    @property
    def reference_length(self) -> float:  # type: ignore[override]
        """The bar."""
        return self.length

    def check_together(self) -> None:
        cells = self.domain_cells
        whole = cells is None or cells == int(cells)
        require(whole, "domain_cells", cells, "null or a whole number of at least 2")
        if cells is not None:  # a number from a file may come as 80.0
            object.__setattr__(self, "domain_cells", int(cells))

    def check(self, material: Material, choices: Choices, basis: str, resolution: int) -> None:
        if (
            self.domain_cells is None
            and not choices.moving
            and not choices.frozen
            and resolution % 4
        ):
            raise NotApplicable(
                f"resolution = {resolution}: the grid of 1.25 lengths has a whole number of cells only for "
                "multiples of 4; set problem.domain_cells instead"
            )

    # geometry

    def _bar_cells(self, resolution: int) -> int:
        return resolution if self.domain_cells is None else round(self.domain_cells / DOMAIN)

    def nodes(self, resolution: int, choices: Choices) -> Box:
        if choices.moving or choices.frozen:
            return Box((0.0,), (self.reference_length,), (self._bar_cells(resolution),))
        return Box(
            (0.0,), (DOMAIN * self.length,), (self.domain_cells or round(DOMAIN * resolution),)
        )

    def seed(self, resolution: int, particles_per_cell: int) -> tuple[np.ndarray, np.ndarray]:
        cells = self._bar_cells(resolution)
        if self.particle_layout == "aligned" and self.domain_cells is not None:
            box = Box((0.0,), (cells * (DOMAIN * self.length) / self.domain_cells,), (cells,))
            return seed_cells(box, particles_per_cell)
        layout = "gauss" if self.particle_layout == "gauss" else "midpoint"
        return seed_cells(
            Box((0.0,), (self.reference_length,), (cells,)), particles_per_cell, layout
        )

    def tracers(self) -> np.ndarray:
        return np.array([[self.reference_length]])

    # initial and boundary conditions

    def fixed(self, x: np.ndarray) -> np.ndarray:
        return x < 1e-12 * self.reference_length

    def traction(self, t: float) -> float:
        """tau(t) [Pa]."""
        return self.traction_amplitude * float(np.sin(np.pi * t / self.reference_length))

    def loads(self, material: Material) -> Loads:
        return Loads(traction=lambda t: np.array([[self.traction(t)]]))

    # exact solutions and quantities of interest

    def quantities(self, solution: Solution, material: Material) -> dict[str, tuple[Any, str, str]]:
        """The stress error away from the loaded end, where free ends have errors of their own."""
        last = solution.snapshots[-1]
        X = solution.snapshots[0]["x"][:-1]
        exact = self.exact(X, last["time"], material)
        if solution.status != "ok" or "stress" not in exact:
            return {}
        inner = X[:, 0] < INNER * self.reference_length
        error = (last["sigma"][:-1] - exact["stress"])[inner]
        text = f"RMS error of the stress on the {INNER:g} of the bar at the fixed end"
        return {"error_stress_inner": (float(np.sqrt(np.mean(error**2))), "Pa", text)}

    def exact(self, X: np.ndarray, t: float, material: Material) -> Fields:
        """The simple wave of the neo-Hookean bar (nu = 0, t < l/c), or the linear one of the small-strain law."""
        if isinstance(material, SmallStrainElastic):
            return self.linear(X, t, material)
        if isinstance(material, NeoHookean) and material.poisson_ratio == 0.0:
            c = np.sqrt(material.young_modulus / material.density)
            if t < self.reference_length / c:
                return self.simple_wave(X, t, material)
        return {}

    def alternative(self, X: np.ndarray, t: float, material: Material) -> Fields:
        """The linear solution, which the paper calls analytical."""
        return {} if isinstance(material, SmallStrainElastic) else self.linear(X, t, material)

    def linear(self, X: np.ndarray, t: float, material: Material) -> Fields:
        """``sigma = F(t + x) + F(t - x)``, d'Alembert with reflection at the fixed end; valid to t = 4 l/c."""
        l, A = self.reference_length, -self.traction_amplitude
        lame, shear = material.lame_parameters()
        modulus = lame + 2.0 * shear
        c = np.sqrt(modulus / material.density)
        if c * t > 4.0 * l:
            return {}

        def wave(s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            inside = (s >= l) & (s < 3.0 * l)
            k = np.pi / l / c  # the traction has the period 2 l in seconds
            phase = k * (s - l) + np.pi
            return np.where(inside, A * np.sin(phase), 0.0), np.where(
                inside, -A / k * (1.0 + np.cos(phase)), 0.0
            )

        (sigma_in, phi_in), (sigma_out, phi_out) = wave(c * t + X), wave(c * t - X)
        return {
            "displacement": (phi_in - phi_out) / modulus,
            "velocity": (sigma_in - sigma_out) * c / modulus,
            "stress": (sigma_in + sigma_out)[:, :, None],
        }

    def simple_wave(self, X: np.ndarray, t: float, material: Material) -> Fields:
        """Characteristics ``X = l - c(F_b(s)) (t - s)`` carry the stretch F_b that the traction set at time s.

        ``z = tau/E``, ``F_b = z + sqrt(1 + z^2)``, ``c(F) = sqrt(E (1 + F^-2)/(2 rho))``, ``v =
        int_1^F c dF``, ``u = u_b(s) + (v - c (F - 1))(t - s)`` with ``u_b(s) = int_0^s v``.
        """
        l, E, rho = self.reference_length, material.lame_parameters()[1] * 2.0, material.density

        def stretch(s: np.ndarray) -> np.ndarray:
            z = self.traction_amplitude * np.sin(np.pi * s / l) / E
            return z + np.sqrt(1.0 + z * z)

        def speed(F: np.ndarray) -> np.ndarray:
            return np.sqrt(E * (1.0 + F**-2) / (2.0 * rho))

        def velocity(F: np.ndarray) -> np.ndarray:
            primitive = np.sqrt(1.0 + F * F) - np.arcsinh(1.0 / F)
            return np.sqrt(E / (2.0 * rho)) * (primitive - (np.sqrt(2.0) - np.arcsinh(1.0)))

        x = X[:, 0]
        low, high = np.zeros_like(x), np.full_like(x, t)
        for _ in range(60):  # bisection: the front has not steepened into a shock before t = l/c
            middle = 0.5 * (low + high)
            ahead = l - speed(stretch(middle)) * (t - middle) > x
            low, high = np.where(ahead, low, middle), np.where(ahead, middle, high)
        s = 0.5 * (low + high)
        reached = x > l - speed(np.array(1.0)) * t
        abscissae, weights = np.polynomial.legendre.leggauss(24)
        u_b = 0.5 * s * (velocity(stretch(0.5 * s[:, None] * (abscissae + 1.0))) @ weights)
        F = stretch(s)
        v, c = velocity(F), speed(F)
        fields = {
            "displacement": u_b + (v - c * (F - 1.0)) * (t - s),
            "velocity": v,
            "stress": self.traction_amplitude * np.sin(np.pi * s / l),
        }
        fields = {name: np.where(reached, values, 0.0)[:, None] for name, values in fields.items()}
        fields["stress"] = fields["stress"][:, :, None]
        return fields
