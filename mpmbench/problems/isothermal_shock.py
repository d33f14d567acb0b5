"""Isothermal plane shock in a viscous fluid, in 1D, along a strip and along a cylinder (Li 2009, section 4.1).

``rho_0 phi'' = sigma_11,X`` with ``sigma_11 = K (J - 1/J) / 2 + (4 eta / 3) J' / J`` has the
travelling wave ``J = (J_a + J_b) / 2 + (J_a - J_b) / 2 tanh((X - C t) / (2 L))`` (Eqs. 4.20-4.23,
with + log 2) from J_b behind it to J_a ahead, ``C^2 = K (1 + 1 / (J_a J_b)) / (2 rho_0)`` and ``L =
8 eta C J_a J_b / (3 K (J_a - J_b))``.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from mpmbench.core.choices import Choices
from mpmbench.core.errors import NotApplicable, require
from mpmbench.core.geometry import Box, Cloud, Geometry
from mpmbench.core.geometry.triangulate import (
    barycentres,
    disc,
    extruded,
    jittered,
    nodal_volumes,
    seed_segments,
    triangulation,
)
from mpmbench.core.materials import Material
from mpmbench.core.materials.newtonian_fluid import NewtonianFluid
from mpmbench.core.particles import Particles, seed_cells
from mpmbench.core.registry import register
from mpmbench.core.setting import setting
from mpmbench.core.simulation import Solution
from mpmbench.core.stability import smallest_stretch
from mpmbench.core.state import Loads, State
from mpmbench.problems import Fields, Problem

WIDTH = 4  # cells across the strip, and along the radius of the cylinder
COURANT, VISCOUS = (
    0.2,
    0.7,
)  # fractions of h / C and rho_0 h^2 / eta, with the smallest current spacing h
CONSISTENT = 1.0 / 3.0  # share of that step with a consistent mass: that of linear functions


@register("problem", "isothermal_shock")
@dataclass(frozen=True)
class IsothermalShock(Problem):
    """Isothermal plane shock in a compressible viscous fluid, Li 2009, Sect. 4.1.

    Initial and end conditions are exact; lateral faces slide on rollers.
    """

    dimension: int = setting(  # type: ignore[misc]
        1, "2: strip of 4 cells, 3: cylinder of radius 4 h", unit="-", options=(1, 2, 3)
    )
    length: float = setting(
        0.04342977555392065, "of the body, 25 shock widths L", unit="m", above=0.0
    )
    jacobian_ahead: float = setting(1.0, "J ahead of the shock", unit="-", above=0.0, most=10.0)
    jacobian_behind: float = setting(0.1, "J behind it, less than ahead", unit="-", above=0.0)
    irregularity: float = setting(
        0.0, "random displacement of nodes over their spacing", unit="-", least=0.0, most=0.4
    )
    particle_layout: str = setting(
        "auto",
        "midpoints of sub-cells (auto in 1D), barycentres of simplices (else), nodes",
        options=("auto", "midpoint", "barycentre", "nodes"),
    )
    random_seed: int = 0
    samples = 500

    def check_together(self) -> None:
        behind = self.jacobian_behind
        require(
            behind < self.jacobian_ahead,
            "jacobian_behind",
            behind,
            "a number less than jacobian_ahead",
        )
        if self.dimension == 3:
            require(
                self.particle_layout != "midpoint",
                "particle_layout",
                "midpoint",
                "barycentre or nodes in 3D",
            )

    @property
    def reference_length(self) -> float:  # type: ignore[override]
        return self.length

    def check(self, material: Material, choices: Choices, basis: str, resolution: int) -> None:
        if not isinstance(material, NewtonianFluid):
            raise NotApplicable("the shock is an exact solution for material=newtonian_fluid")
        if not (choices.moving or choices.frozen):
            raise NotApplicable(
                "the end that drives the shock moves: method.nodes=moving is needed"
            )
        if choices.implicit or not choices.moves_particles:
            raise NotApplicable(
                f"method.time={choices.time}: the tangent of a viscous fluid is not there, only explicit is"
            )

    def check_particles(self, particles_per_cell: int) -> None:
        if self._layout == "barycentre":
            allowed = (
                "1, as problem.particle_layout=barycentre puts one particle into each simplex,"
            )
            require(particles_per_cell == 1, "particles_per_cell", particles_per_cell, allowed)
        elif self._layout == "midpoint":
            super().check_particles(particles_per_cell)

    @property
    def _layout(self) -> str:
        """Where the particles go."""
        if self.particle_layout != "auto":
            return self.particle_layout
        return "midpoint" if self.dimension == 1 else "barycentre"

    # geometry

    def _cloud(self, resolution: int) -> Cloud:
        """Nodes in the reference configuration with a triangulation; x_1 is the direction of the shock."""
        h = self.length / resolution
        levels = np.linspace(0.0, self.length, resolution + 1)
        if self.dimension == 3:
            regular = extruded(disc(WIDTH * h), levels)
        else:
            box = self._box(resolution)
            regular = Cloud(box.points, triangulation(box.points, float(np.prod(box.upper))), h)
        if self.irregularity == 0.0:
            return regular
        nodes = jittered(
            regular.nodes, h, self.irregularity, self.fixed(regular.nodes), self.random_seed
        )
        if self.dimension == 3:
            return Cloud(nodes, regular.simplices, h)
        return Cloud(nodes, triangulation(nodes, float(np.prod(self._box(resolution).upper))), h)

    def _box(self, resolution: int) -> Box:
        h = self.length / resolution
        upper = (self.length, WIDTH * h)[: self.dimension]
        return Box((0.0,) * self.dimension, upper, (resolution, WIDTH)[: self.dimension])

    def nodes(self, resolution: int, choices: Choices) -> Geometry:
        if self.dimension < 3 and self.irregularity == 0.0:
            return self._box(resolution)
        return self._cloud(resolution)

    def seed(self, resolution: int, particles_per_cell: int) -> tuple[np.ndarray, np.ndarray]:
        if self._layout == "midpoint":
            if self.dimension == 1:  # cells between the nodes, where these are irregular too
                return seed_segments(self._cloud(resolution), particles_per_cell)
            return seed_cells(self._box(resolution), particles_per_cell)
        cloud = self._cloud(resolution)
        return (
            (cloud.nodes, nodal_volumes(cloud)) if self._layout == "nodes" else barycentres(cloud)
        )

    # initial and boundary conditions

    def fixed(self, x: np.ndarray) -> np.ndarray:
        """The ends follow the exact motion along x_1; the lateral surface slides along x_1."""
        fixed = np.zeros(x.shape, dtype=bool)
        tolerance = 1e-9 * self.length
        fixed[:, 0] = (x[:, 0] < tolerance) | (x[:, 0] > self.length - tolerance)
        if self.dimension == 2:
            fixed[:, 1] = (x[:, 1] < tolerance) | (x[:, 1] > x[:, 1].max() - tolerance)
        if self.dimension == 3:
            radius = np.hypot(x[:, 1], x[:, 2])
            fixed[:, 1:] = (radius > radius.max() - tolerance)[:, None]
        return fixed

    def velocity(self, X: np.ndarray, material: Material) -> np.ndarray:
        return self._along(self.wave(X[:, 0], 0.0, material)["velocity"])

    def initial_displacement(self, material: Material) -> Callable[[np.ndarray], np.ndarray] | None:
        return lambda X: self._along(self.wave(X[:, 0], 0.0, material)["displacement"])

    def prepare(self, particles: Particles, material: Material) -> None:
        wave = self.wave(particles.X[:, 0], 0.0, material)
        particles.x[:, 0] += wave["displacement"]
        particles.F[:, 0, 0] = wave["jacobian"]
        particles.L[:, 0, 0] = wave["rate"] / wave["jacobian"]
        particles.V[:] = wave["jacobian"] * particles.V0
        particles.sigma[:] = self._stress(wave, material)

    def start(self, state: State, dt: float) -> None:
        """The exact velocity at -dt/2, where that of the leapfrog scheme lives."""
        for v, X in ((state.nodes.v, state.initial_nodes), (state.particles.v, state.particles.X)):
            early, late = (
                self.wave(X[:, 0], t, state.material)["velocity"] for t in (-0.5 * dt, 0.0)
            )
            v[:, 0] += early - late

    def loads(self, material: Material) -> Loads:
        def motion(X: np.ndarray, t: float) -> np.ndarray:
            ends = self.wave(np.array([0.0, self.length]), t, material)["displacement"]
            return self._along(np.where(X[:, 0] < 0.5 * self.length, ends[0], ends[1]))

        return Loads(prescribed_motion=motion)

    def adaptive_step(self, state: State) -> Callable[[State], float] | None:
        """Eq. 4.26 with the smallest current spacing, and a third of it with a consistent mass.

        Half of it would do for 100 cells; with 200 a zigzag grows before the compression has
        shortened the steps.
        """
        fluid = state.material
        assert isinstance(fluid, NewtonianFluid)
        C, _ = self.speed_and_width(fluid)
        geometry = state.geometry
        assert geometry is not None
        h0 = float(geometry.spacing[0] if isinstance(geometry, Box) else geometry.spacing or 0.0)
        h0 *= 1.0 - 2.0 * self.irregularity
        share = 1.0 if state.choices.mass == "lumped" else CONSISTENT

        def step(s: State) -> float:
            h = h0 * smallest_stretch(s.particles.F)
            viscous = (
                VISCOUS * fluid.density * h * h / fluid.viscosity
                if fluid.viscosity > 0.0
                else np.inf
            )
            return share * min(COURANT * h / C, viscous)

        return step

    # exact solution

    def speed_and_width(self, fluid: NewtonianFluid) -> tuple[float, float]:
        """Shock speed C [m/s] and width L [m] (Eqs. 4.21b, c)."""
        ahead, behind = self.jacobian_ahead, self.jacobian_behind
        C = np.sqrt(0.5 * fluid.bulk_modulus / fluid.density * (1.0 + 1.0 / (ahead * behind)))
        return float(C), float(
            8.0
            * fluid.viscosity
            * C
            * ahead
            * behind
            / (3.0 * fluid.bulk_modulus * (ahead - behind))
        )

    def wave(self, X: np.ndarray, t: float, material: Material) -> Fields:
        """The wave at X, shape (n,): displacement [m], velocity [m/s], acceleration [m/s2], J and its rate [1/s]."""
        assert isinstance(material, NewtonianFluid)
        C, L = self.speed_and_width(material)
        mean, jump = (
            0.5 * (self.jacobian_ahead + self.jacobian_behind),
            self.jacobian_ahead - self.jacobian_behind,
        )
        s = (X - C * t) / (2.0 * L)
        J = mean + 0.5 * jump * np.tanh(s)
        slope = 0.5 * jump / np.cosh(np.clip(s, -300.0, 300.0)) ** 2 / (2.0 * L)  # dJ/dX
        log_2cosh = np.abs(s) + np.log1p(np.exp(-2.0 * np.abs(s)))
        shift = (mean - 1.0) * (X - C * t) + L * jump * log_2cosh
        return {
            "displacement": shift,
            "velocity": C * (1.0 - J),
            "acceleration": C * C * slope,
            "jacobian": J,
            "rate": -C * slope,
        }

    def exact(self, X: np.ndarray, t: float, material: Material) -> Fields:
        wave = self.wave(X[:, 0], t, material)
        return {
            "displacement": self._along(wave["displacement"]),
            "velocity": self._along(wave["velocity"]),
            "stress": self._stress(wave, material),
        }

    def _along(self, values: np.ndarray) -> np.ndarray:
        """A field along x_1, shape (n, dim)."""
        field = np.zeros((len(values), self.dimension))
        field[:, 0] = values
        return field

    def _stress(self, wave: Fields, material: Material) -> np.ndarray:
        assert isinstance(material, NewtonianFluid)
        viscous = 2.0 / 3.0 * material.viscosity * wave["rate"] / wave["jacobian"]
        sigma = (material.pressure(wave["jacobian"]) - viscous)[:, None, None] * np.eye(
            self.dimension
        )
        sigma[:, 0, 0] += 3.0 * viscous
        return sigma

    # quantities of interest

    def observe(self, state: State) -> dict[str, Any]:
        """Norms of Eq. 4.27 over the reference domain, per cross-section; the velocity lives half a step earlier."""
        p, solid = state.particles, state.particles.material
        X, share = p.X[solid, 0], p.V0[solid] * (self.length / p.V0.sum())
        velocity = self._along(
            self.wave(X, state.time - 0.5 * state.time_step, state.material)["velocity"]
        )
        density = state.material.density * p.V0[solid] / p.V[solid]
        exact_density = (
            state.material.density / self.wave(X, state.time, state.material)["jacobian"]
        )
        return {
            "error_velocity_l2": float(
                np.sqrt(share @ np.sum((p.v[solid] - velocity) ** 2, axis=1))
            ),
            "error_density_l1": float(share @ np.abs(density - exact_density)),
        }

    def quantities(self, solution: Solution, material: Material) -> dict[str, tuple[Any, str, str]]:
        found: dict[str, tuple[Any, str, str]] = {}
        for name, unit, text in (
            ("error_velocity_l2", "m1.5 s-1", "L2 norm of the error of the velocity"),
            ("error_density_l1", "kg m-2", "L1 norm of the error of the density"),
        ):
            series = np.array(solution.history[name])
            found[name] = (
                series,
                unit,
                f"{text} over the reference domain, per cross-section (Li 2009, Eq. 4.27)",
            )
            if solution.status == "ok":
                found[f"{name}_max"] = (float(series.max()), unit, f"{text}, maximum over time")
        return found
