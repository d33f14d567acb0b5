"""Elastic bar whose free end is pulled by an initial velocity (Li 2009, section 4.2.2; Dyka and Ingel 1995).

``rho u'' = E u_xx`` on (0, l) with ``u(0) = 0`` and a free end at l; at t = 0 the right quarter
moves with v_0. The wave speed of the thesis, 5053 m/s, is ``sqrt(E / rho)``: uniaxial stress, here
a law with modulus E in 1D (nu = 0).
"""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from mpmbench.core.choices import Choices
from mpmbench.core.energies import strain_energy
from mpmbench.core.errors import Diverged, NotApplicable, require
from mpmbench.core.geometry import Box, Cloud, Geometry
from mpmbench.core.geometry.triangulate import irregular_line, nodal_volumes, seed_segments
from mpmbench.core.materials import Material
from mpmbench.core.materials.elastic.small_strain_elastic import SmallStrainElastic
from mpmbench.core.registry import register
from mpmbench.core.setting import setting
from mpmbench.core.simulation import Solution
from mpmbench.core.stability import wave_speed
from mpmbench.core.state import State
from mpmbench.core.transfer.sums import p2g_mass, p2g_momentum
from mpmbench.problems import Fields, Problem

LOADED = 0.75  # of the length: what lies beyond moves at t = 0
LOST = 10.0  # a tip displaced this many times more than the exact one belongs to no bar


@register("problem", "elastic_bar_tension")
@dataclass(frozen=True)
class ElasticBarTension(Problem):
    """Elastic bar whose right quarter starts with a velocity, Li 2009, Sect. 4.2.2."""

    end_velocity: float = setting(5.0, "of the right quarter at t = 0, not 0", unit="m/s")
    irregularity: float = setting(
        0.0, "random displacement of nodes over their spacing", unit="-", least=0.0, most=0.4
    )
    particle_layout: str = setting(
        "midpoint",
        "of equal parts of the segments between nodes, or the nodes",
        options=("midpoint", "nodes"),
    )
    length: float = setting(0.1333, "of the bar", unit="m", above=0.0, below=1e3)
    random_seed: int = 0
    dimension: ClassVar[int] = 1
    initial_acceleration: ClassVar[str] = "zero"
    samples: ClassVar[int] = 1000

    @property
    def reference_length(self) -> float:  # type: ignore[override]
        """The bar."""
        return self.length

    def check_together(self) -> None:
        v0 = self.end_velocity
        require(v0 != 0.0, "end_velocity", v0, "a number other than 0")

    def check(self, material: Material, choices: Choices, basis: str, resolution: int) -> None:
        if self.irregularity > 0.0 and not (choices.moving or choices.frozen):
            raise NotApplicable(
                "irregular nodes are for methods whose nodes move with the material"
            )

    # geometry

    def _cloud(self, resolution: int) -> Cloud:
        return irregular_line(
            self.reference_length, resolution, self.irregularity, self.random_seed
        )

    def nodes(self, resolution: int, choices: Choices) -> Geometry:
        """The bar; methods with fixed nodes have two empty cells beyond the free end."""
        if self.irregularity > 0.0:
            return self._cloud(resolution)
        empty = 0 if choices.moving or choices.frozen else 2
        upper = self.reference_length * (resolution + empty) / resolution
        return Box((0.0,), (upper,), (resolution + empty,))

    def seed(self, resolution: int, particles_per_cell: int) -> tuple[np.ndarray, np.ndarray]:
        cloud = self._cloud(resolution)
        if self.particle_layout == "nodes":
            return cloud.nodes, nodal_volumes(cloud)
        return seed_segments(cloud, particles_per_cell)

    def tracers(self) -> np.ndarray:
        return np.array([[self.reference_length]])

    # initial and boundary conditions

    def fixed(self, x: np.ndarray) -> np.ndarray:
        return x < 1e-12 * self.reference_length

    def velocity(self, X: np.ndarray, material: Material) -> np.ndarray:
        return np.where(X / self.reference_length > LOADED, self.end_velocity, 0.0)

    # exact solution

    def exact(self, X: np.ndarray, t: float, material: Material) -> Fields:
        """D'Alembert's solution; for the small-strain law, whose bar is linear."""
        return self._linear(X, t, material) if isinstance(material, SmallStrainElastic) else {}

    def alternative(self, X: np.ndarray, t: float, material: Material) -> Fields:
        """The linear solution, beside which other laws are reported."""
        return {} if isinstance(material, SmallStrainElastic) else self._linear(X, t, material)

    def _linear(self, X: np.ndarray, t: float, material: Material) -> Fields:
        """The initial velocity, odd about the fixed and even about the free end, runs to both sides."""
        c, v0 = wave_speed(material), self.end_velocity
        l, free = self.reference_length, 1.0 - LOADED

        def velocity(s: np.ndarray) -> np.ndarray:
            place = np.mod(s, 4.0 * l)
            return v0 * (
                (np.abs(place - l) < free * l) * 1.0 - (np.abs(place - 3.0 * l) < free * l)
            )

        def primitive(s: np.ndarray) -> np.ndarray:
            place = np.mod(s, 4.0 * l)
            return v0 * (
                np.clip(place - LOADED * l, 0.0, 2.0 * free * l)
                - np.clip(place - (2.0 + LOADED) * l, 0.0, 2.0 * free * l)
            )

        ahead, behind = X + c * t, X - c * t
        modulus = material.density * c * c
        return {
            "displacement": (primitive(ahead) - primitive(behind)) / (2.0 * c),
            "velocity": 0.5 * (velocity(ahead) + velocity(behind)),
            "stress": (modulus / (2.0 * c) * (velocity(ahead) - velocity(behind)))[:, :, None],
        }

    # quantities of interest

    def observe(self, state: State) -> dict[str, Any]:
        """The tip and the total energy; a tip far from where any bar could have it ends the run."""
        p = state.particles
        tip = len(p.x) - 1  # the tracer
        displacement = float(p.x[tip, 0] - p.X[tip, 0])
        amplitude = (
            abs(self.end_velocity)
            * (1.0 - LOADED)
            * self.reference_length
            / wave_speed(state.material)
        )
        if abs(displacement) > LOST * amplitude:
            raise Diverged(
                f"the free end is displaced by {displacement:.3g} m, {LOST:g} times what the exact bar allows"
            )
        energy = total_energy(state)
        return {
            "tip_displacement": displacement,
            "tip_velocity": float(p.v[tip, 0]),
            "total_energy": energy,
        }

    def quantities(self, solution: Solution, material: Material) -> dict[str, tuple[Any, str, str]]:
        history = {name: np.array(values) for name, values in solution.history.items()}
        t, u, v, energy = (
            history[k] for k in ("time", "tip_displacement", "tip_velocity", "total_energy")
        )
        tip, lag = np.array([[self.reference_length]]), 0.5 * solution.time_step
        exact = np.array([self._linear(tip, time, material)["displacement"][0, 0] for time in t])
        exact_v = np.array(
            [self._linear(tip, max(time - lag, 0.0), material)["velocity"][0, 0] for time in t]
        )
        series = {
            "tip_displacement": (u, "m", "displacement of the free end"),
            "tip_displacement_exact": (
                exact,
                "m",
                "exact displacement of the free end, small strains",
            ),
            "tip_velocity": (v, "m s-1", "velocity of the free end"),
            "tip_velocity_exact": (
                exact_v,
                "m s-1",
                "exact velocity of the free end, small strains",
            ),
            "total_energy": (
                energy,
                "J",
                "kinetic and strain energy, of the nodes where these move",
            ),
        }
        if solution.status != "ok":
            return series
        first = t <= 4.0 * self.reference_length / wave_speed(
            material
        )  # later periods add up dispersion
        error = float(np.sqrt(np.sum((u - exact) ** 2) / np.sum(exact**2)))
        drift = float(np.abs(energy / energy[0] - 1.0).max())
        return series | {
            "tip_displacement_max": (
                float(u[first].max()),
                "m",
                "largest displacement of the free end, first period",
            ),
            "tip_displacement_min": (
                float(u[first].min()),
                "m",
                "smallest displacement of the free end, first period",
            ),
            "tip_displacement_error": (
                error,
                "1",
                "L2 norm over time of the error of the tip's displacement, relative",
            ),
            "tip_velocity_max": (float(np.abs(v).max()), "m s-1", "largest speed of the free end"),
            "total_energy_drift": (drift, "1", "largest relative change of the total energy"),
            "total_energy_end": (
                float(energy[-1] / energy[0]),
                "1",
                "total energy at the end over that at the start",
            ),
        }


def total_energy(s: State) -> float:
    """Strain and kinetic energy [J] at the same instant; the kinetic one of the nodes, where these move.

    Nodal velocities live half a step earlier and are brought forward by half of ``dt a``. Before
    the first step they are the projection of the particles' velocities, unless the nodes keep their
    own.
    """
    p, n = s.particles, s.nodes
    strain = float(strain_energy(s.law, s.axes, p.F, p.state, p.V0))
    if not s.choices.moving or s.choices.implicit or s.choices.particles_are_nodes:
        return strain + 0.5 * float(np.sum(p.m[:, None] * p.v**2))
    v = n.v + 0.5 * s.time_step * n.a
    if s.time == 0.0:
        s.basis.locate(p.x)
        n.m[:], n.q[:] = 0.0, 0.0
        p2g_mass(s.basis.handle, p.x, p.m, n.m)
        p2g_momentum(s.basis.handle, p.x, p.m, p.v, n.q)
        s.mass.assemble(s.basis, p, n.m)
        if not s.transfer.velocity_on_nodes:
            v = np.zeros_like(n.v)
            s.mass.solve(n.q, v)
    return strain + 0.5 * float(np.sum(v * s.mass.multiply(v)))
