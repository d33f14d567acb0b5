"""A column that is compacted by its own weight, with a closed form at any strain (Coombs et al. 2018, 2020).

Uniaxial strain between smooth walls, in plane strain: equilibrium asks for the nominal stress

    P(X) = -rho_0 g (l - X),

whatever the material, and the Cauchy stress along the column is P, since the cross-section stays. The
stretch follows from the law: ``(lambda + 2 mu) ln(l)/l = P`` (Hencky), ``mu (l - 1/l) + lambda ln(l)/l
= P`` (neo-Hookean). With E = 10 kPa, nu = 0 and 50 m the base carries -40 kPa, and the Hencky column is
compacted to 24.0596 m, the neo-Hookean one to 16.1696 m. Time is the load factor; with explicit methods
it is time, in which the weight rises, and a drag (``method.drag``) brings the column to rest.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from mpmbench.core.choices import Choices
from mpmbench.core.errors import NotApplicable
from mpmbench.core.geometry import Box
from mpmbench.core.materials import Material
from mpmbench.core.materials.elastic.hencky_elastic import HenckyElastic
from mpmbench.core.materials.elastic.neo_hookean import NeoHookean
from mpmbench.core.particles import seed_cells
from mpmbench.core.registry import register
from mpmbench.core.setting import setting
from mpmbench.core.simulation import Solution
from mpmbench.core.state import Loads, State
from mpmbench.problems import Fields, Problem

COURANT = 0.4  # of the waves at the base, by the tangent of Hencky's law there
NEWTON = 60  # iterations for the stretch, which end at rounding
POINTS = 40  # of Gauss quadrature for the place of a point


@register("problem", "compaction_column")
@dataclass(frozen=True)
class CompactionColumn(Problem):
    """Column compacted by its own weight in equal load steps, Coombs et al. 2020: closed form at large strain."""

    gravity: float = setting(10.0, "weight per unit mass", unit="m/s2", above=0.0, below=1.0e4)
    load_steps: int = setting(
        40, "equal steps in which the weight is applied", unit="-", least=1, most=10000
    )
    height: float = setting(50.0, "of the column", unit="m", above=0.0, below=1e4)
    width: float = setting(6.25, "width, a whole number of cells", unit="m", above=0.0, most=1000.0)
    rise_time: float = setting(
        1.0, "in which the weight rises with explicit methods", unit="s", above=0.0, most=1e6
    )
    particle_layout: str = setting(
        "gauss",
        "Gauss points of the cells, or middles of equal sub-cells",
        options=("gauss", "midpoint"),
    )
    dimension: ClassVar[int] = 2
    initial_acceleration: ClassVar[str] = "zero"

    @property
    def reference_length(self) -> float:  # type: ignore[override]
        """The height of the column."""
        return self.height

    def check(self, material: Material, choices: Choices, basis: str, resolution: int) -> None:
        if choices.dynamic and not (not choices.implicit and choices.drag > 0.0):
            raise NotApplicable(
                "compaction_column is a static problem: it needs method.time=static, or an explicit method "
                "with a drag and time, such as method.drag=0.7 problem.rise_time=60 end_time=200"
            )
        across = self.width * resolution / self.reference_length
        if abs(across - max(1, round(across))) > 1e-9:
            raise NotApplicable(
                f"resolution = {resolution}: problem.width = {self.width:g} m is {across:g} cells; "
                "a whole number is needed"
            )

    def suited_to(self, choices: Choices) -> "CompactionColumn":
        """In time the weight rises; else time is the load factor."""
        return self if choices.dynamic else replace(self, rise_time=1.0)

    def load(self, t: float) -> float:
        """Part of the weight."""
        return min(t / self.rise_time, 1.0)

    # geometry

    def nodes(self, resolution: int, choices: Choices) -> Box:
        across = max(1, round(self.width * resolution / self.reference_length))
        return Box((0.0, 0.0), (self.width, self.reference_length), (across, resolution))

    def seed(self, resolution: int, particles_per_cell: int) -> tuple[np.ndarray, np.ndarray]:
        box = self.nodes(resolution, Choices())
        return seed_cells(box, particles_per_cell, self.particle_layout)

    def tracers(self) -> np.ndarray:
        """The top, at the left wall."""
        return np.array([[0.0, self.reference_length]])

    # boundary conditions

    def fixed(self, x: np.ndarray) -> np.ndarray:
        """Smooth walls at both sides, whose distance the nodes know, and at the base."""
        slack = 1e-9 * self.reference_length
        right = x[:, 0].max() - slack
        return np.stack([(x[:, 0] < slack) | (x[:, 0] > right), x[:, 1] < slack], axis=1)

    def loads(self, material: Material) -> Loads:
        def weight(X: np.ndarray, t: float, b: np.ndarray) -> None:
            b[:, 0], b[:, 1] = 0.0, -self.gravity * self.load(t)

        return Loads(body_force=weight)

    def adaptive_step(self, state: State) -> Callable[[State], float]:
        """One load step in units of time, the load factor; explicit ones bear the waves at the base."""
        if not state.choices.dynamic:
            return lambda _: 1.0 / self.load_steps
        assert state.geometry is not None
        base = self.pressure(np.zeros(1), self.rise_time, state.material)
        least = float(stretch(base, state.material)[0])
        lame, shear = state.material.lame_parameters()
        modulus = (lame + 2.0 * shear) * (1.0 - np.log(least)) / least**2
        step = COURANT * state.geometry.nodal_spacing / np.sqrt(modulus / state.material.density)
        return lambda _: float(step)

    # exact solution

    def pressure(self, X: np.ndarray, t: float, material: Material) -> np.ndarray:
        """Vertical stress at heights X [Pa]."""
        return -material.density * self.gravity * self.load(t) * (self.reference_length - X)

    def exact(self, X: np.ndarray, t: float, material: Material) -> Fields:
        """Heights are integrals of the stretch from the base."""
        if not isinstance(material, NeoHookean | HenckyElastic):
            return {}
        height, load = X[:, 1], self.pressure(X[:, 1], t, material)
        abscissae, weights = np.polynomial.legendre.leggauss(POINTS)
        below = 0.5 * height[:, None] * (1.0 + abscissae)
        place = 0.5 * height * (stretch(self.pressure(below, t, material), material) @ weights)
        sigma = np.zeros((len(X), 2, 2))
        l, lame = stretch(load, material), material.lame_parameters()[0]
        sigma[:, 1, 1], sigma[:, 0, 0] = load, lame * np.log(l) / l
        displacement = np.stack([np.zeros_like(height), place - height], axis=1)
        return {"displacement": displacement, "stress": sigma}

    # quantities of interest

    def quantities(self, solution: Solution, material: Material) -> dict[str, tuple[Any, str, str]]:
        if solution.status != "ok":
            return {}
        last, t = solution.snapshots[-1], solution.snapshots[-1]["time"]
        X = solution.snapshots[0]["x"][:-1]
        sigma, V0 = last["sigma"][:-1, 1, 1], last["V"][:-1] / np.linalg.det(last["F"][:-1])
        height = float(last["x"][-1, 1])
        weight = material.density * self.gravity * self.reference_length
        error = float(V0 @ np.abs(sigma - self.pressure(X[:, 1], t, material)) / V0.sum())
        low = np.unique(X[:, 1])[:4]  # heights of the two lowest cells, or of more
        near = X[:, 1] <= low[-1]
        base = float(np.polyfit(X[near, 1], sigma[near], 1)[1])
        out: dict[str, tuple[Any, str, str]] = {
            "height": (height, "m", "height of the top"),
            "base_stress": (base, "Pa", "vertical stress, extrapolated to the base"),
            "kinetic_share": (
                float(solution.history["kinetic_energy"][-1])
                / abs(float(solution.history["external_work"][-1])),
                "1",
                "kinetic energy at the end over the work of the weight; 0 in statics",
            ),
            "error_stress_weighted": (
                error / weight,
                "1",
                "mean error of the vertical stress over the weight of the column",
            ),
        }
        exact = self.exact(np.array([[0.0, self.reference_length]]), t, material)
        if exact:
            top = self.reference_length + float(exact["displacement"][0, 1])
            text = "error of the height of the top over the exact height"
            out["error_height_relative"] = (abs(height / top - 1.0), "1", text)
        return out


def stretch(load: np.ndarray, material: Material) -> np.ndarray:
    """Stretch of uniaxial strain under a nominal stress of at most 0 [Pa], by Newton's method in its logarithm.

    The stress over the stretch, ``e^u P``, is a function of u alone in both laws.
    """
    lame, shear = material.lame_parameters()
    hencky = isinstance(material, HenckyElastic)
    u = np.zeros_like(load)
    for _ in range(NEWTON):
        e = np.exp(u)
        if hencky:
            value, slope = (lame + 2.0 * shear) * u, lame + 2.0 * shear
        else:
            value, slope = lame * u + shear * (e * e - 1.0), lame + 2.0 * shear * e * e
        step = (value - load * e) / (slope - load * e)
        u -= step
        if np.abs(step).max(initial=0.0) < 1e-15:
            break
    return np.asarray(np.exp(u))
