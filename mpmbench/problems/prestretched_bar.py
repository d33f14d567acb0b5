"""Bar held in a stretched state and disturbed by next to nothing: does it keep still (Li 2009, section 4.2).

``rho_0 u'' = P_X`` with ``P = E ln J`` on a bar of length l, stretched uniformly, with both ends
held and a random velocity of 1e-10 m/s. The tangent modulus E / J is positive, so that the bar
itself is stable at any stretch; whatever grows is the tensile instability of the discretisation. Its
waves have the frequency ``k sqrt(E / (rho_0 J))``, k in the unstretched bar. What a step makes of small
waves (`core.linearised`, `analysis.von_neumann`) predicts how fast they grow.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from mpmbench.analysis import von_neumann
from mpmbench.core.choices import Choices
from mpmbench.core.errors import NotApplicable
from mpmbench.core.geometry import Box, Geometry
from mpmbench.core.geometry.triangulate import irregular_line, nodal_volumes, seed_segments
from mpmbench.core.linearised import responses
from mpmbench.core.materials import Material
from mpmbench.core.materials.elastic.elastic_fluid import ElasticFluid
from mpmbench.core.particles import Particles
from mpmbench.core.registry import register
from mpmbench.core.setting import setting
from mpmbench.core.simulation import Solution
from mpmbench.core.state import State
from mpmbench.core.transfer.sums import p2g_internal_force
from mpmbench.problems import Fields, Problem

UNSTABLE = 100.0  # growth beyond this is an instability: what is bounded oscillates near 1
GROWN = 1e6  # the rate of growth is that between these multiples of the start
WAVES = np.pi * np.arange(41) / 40  # of the prediction, in radians per cell


@register("problem", "prestretched_bar")
@dataclass(frozen=True)
class PrestretchedBar(Problem):
    """Bar held stretched and disturbed by next to nothing: tensile instability, Li 2009, Sect. 4.2."""

    stretch: float = setting(1.5, "at the start", unit="-", least=0.2, most=5.0)
    velocity_noise: float = setting(
        1e-10, "amplitude of the random initial velocity", unit="m/s", above=0.0, below=1e-3
    )
    particle_layout: str = setting(
        "midpoint",
        "of equal parts of the segments between nodes, or the nodes",
        options=("midpoint", "nodes"),
    )
    length: float = setting(
        40.0, "of the bar before it is stretched", unit="m", above=0.0, below=1e3
    )
    random_seed: int = 0
    dimension: ClassVar[int] = 1
    initial_acceleration: ClassVar[str] = "zero"
    known_early: ClassVar[tuple[str, ...]] = (
        *("growth", "is_stable", "growth_rate", "growth_rate_predicted", "shortest_wave"),
    )

    @property
    def reference_length(self) -> float:  # type: ignore[override]
        """The bar before it is stretched."""
        return self.length

    def check(self, material: Material, choices: Choices, basis: str, resolution: int) -> None:
        if not isinstance(material, ElasticFluid):
            raise NotApplicable("the bar is made for material=elastic_fluid, P = E ln J in 1D")
        if choices.implicit or not choices.dynamic or choices.particles_are_nodes:
            raise NotApplicable(
                f"method.time={choices.time}: the initial stress is balanced for explicit methods only"
            )

    # geometry

    def nodes(self, resolution: int, choices: Choices) -> Geometry:
        """The unstretched bar; for fixed nodes, which do not follow, the stretched one."""
        stretch = 1.0 if choices.moving or choices.frozen else self.stretch
        return Box((0.0,), (stretch * self.reference_length,), (resolution,))

    def seed(self, resolution: int, particles_per_cell: int) -> tuple[np.ndarray, np.ndarray]:
        cloud = irregular_line(self.reference_length, resolution, 0.0, 0)
        if self.particle_layout == "nodes":
            return cloud.nodes, nodal_volumes(cloud)
        return seed_segments(cloud, particles_per_cell)

    # initial and boundary conditions

    def fixed(self, x: np.ndarray) -> np.ndarray:
        tolerance = 1e-12 * self.reference_length
        return (x < tolerance) | (x > x.max() - tolerance)

    def velocity(self, X: np.ndarray, material: Material) -> np.ndarray:
        noise = np.random.default_rng(self.random_seed).uniform(
            -self.velocity_noise, self.velocity_noise, X.shape
        )
        return np.where(self.fixed(X), 0.0, noise)

    def initial_displacement(self, material: Material) -> Callable[[np.ndarray], np.ndarray] | None:
        return lambda X: (self.stretch - 1.0) * X

    def prepare(self, particles: Particles, material: Material) -> None:
        assert isinstance(material, ElasticFluid)
        particles.x *= self.stretch
        particles.F *= self.stretch
        particles.V *= self.stretch
        particles.sigma[:] = material.bulk_modulus * np.log(self.stretch)

    def start(self, state: State, dt: float) -> None:
        """Balance the initial stress node by node: functions that fail the patch test would set the bar in motion."""
        p, force = state.particles, np.zeros_like(state.nodes.f)
        state.basis.locate(p.x)
        p2g_internal_force(state.basis.handle, p.x, p.V, p.sigma, force)
        state.dead_load = -force
        if "responses" not in state.records:
            assert state.geometry is not None
            state.record("responses", responses(state, dt))
            state.record("spacing", self.reference_length / (len(state.geometry.points) - 1))

    # exact solution

    def exact(self, X: np.ndarray, t: float, material: Material) -> Fields:
        """At rest, but for the noise."""
        assert isinstance(material, ElasticFluid)
        stress = np.full((len(X), 1, 1), material.bulk_modulus * np.log(self.stretch))
        return {
            "displacement": (self.stretch - 1.0) * X,
            "velocity": np.zeros_like(X),
            "stress": stress,
        }

    # quantities of interest

    def observe(self, state: State) -> dict[str, Any]:
        """Disturbance: root mean square velocity of the unknowns, which midpoints of cells may not see."""
        v = state.nodes.v if state.transfer.velocity_on_nodes else state.particles.v
        return {"disturbance": float(np.sqrt(np.mean(v**2)))}

    def quantities(self, solution: Solution, material: Material) -> dict[str, tuple[Any, str, str]]:
        disturbance = np.array(solution.history["disturbance"])
        growth = float(disturbance.max() / disturbance[0])
        out: dict[str, tuple[Any, ...]] = {
            "disturbance": (disturbance, "m s-1", "root mean square velocity"),
            "growth": (growth, "1", "largest disturbance over the initial one"),
            "is_stable": (
                int(solution.status == "ok" and growth < UNSTABLE),
                "1",
                f"growth stays below {UNSTABLE:g}",
            ),
        }
        time = np.array(solution.history["time"])
        text = f"rate at which the disturbance goes from {UNSTABLE:g} to {GROWN:g} of the start"
        out["growth_rate"] = (growth_rate(time, disturbance), "s-1", text)
        if "responses" in solution.records:
            out |= self._waves(solution, material)
        return out

    def _waves(self, solution: Solution, material: Material) -> dict[str, tuple[Any, ...]]:
        """Frequencies of waves and how fast they grow, by von Neumann's analysis of the first step."""
        assert isinstance(material, ElasticFluid)
        dt, h = solution.time_step, solution.records["spacing"][0]
        factors = von_neumann.factors(solution.records["responses"][0], WAVES)
        rates = von_neumann.growth_rates(factors, dt)
        speed = np.sqrt(material.bulk_modulus / (material.density * self.stretch))
        frequencies, exact = von_neumann.frequencies(factors, dt), WAVES / h * speed
        return {
            "wave_number": (WAVES, "rad", "waves of the analysis, by cell", ("wave",)),
            "wave_frequency": (
                frequencies,
                "rad s-1",
                "frequency of the fastest part of a wave",
                ("wave",),
            ),
            "wave_frequency_exact": (
                exact,
                "rad s-1",
                "frequency of a wave in the bar",
                ("wave",),
            ),
            "shortest_wave": (
                float(frequencies[-1] / exact[-1]),
                "1",
                "frequency of the wave of two cells over the exact one",
            ),
            "wave_growth_rate": (rates, "s-1", "rate at which a wave grows", ("wave",)),
            "growth_rate_predicted": (float(rates.max()), "s-1", "largest rate of growth of waves"),
        }


def growth_rate(time: np.ndarray, disturbance: np.ndarray) -> float:
    """Mean rate [1/s] between the first instants beyond both multiples of the start; nan where there are none."""
    late = [np.flatnonzero(disturbance > times * disturbance[0]) for times in (UNSTABLE, GROWN)]
    if len(late[1]) == 0 or late[0][0] == late[1][0]:
        return float("nan")
    one, two = late[0][0], late[1][0]
    return float(np.log(disturbance[two] / disturbance[one]) / (time[two] - time[one]))
