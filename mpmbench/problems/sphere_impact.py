"""A steel sphere that penetrates an aluminium plate (Li 2009, section 5.2.3, Figs. 5.14 to 5.23), in 3D.

The sphere, 1.7 mm in diameter, flies along the first axis, against it, at the middle of a plate 10 mm
thick with a radius of 10 mm. Tables 5.2 and 5.3 give both metals. The thesis leaves open the rate
exponent m, its reference rate, the equation of state, and how the plate is held: the defaults are m =
10, 1000 /s, ``K (ln J)^2 / 2`` and rollers under the plate; the surfaces are smooth. There is no exact
solution. The depth is that of the plate's point under the sphere when the sphere has 1 % of its
kinetic energy left; nan when it keeps more until the end. Particles inside may go on vibrating, which
linear functions do not damp, so depth and instant are also given by the energy of the sphere's centre.

Nodes that are those of the bodies are graded: no farther apart than a fifth of the sphere's radius,
0.17 mm, within 2.5 mm of the impact with the default resolution of 5, and then farther by up to
two fifths from each to the next. A grid has cells of 0.25 mm then, and particles that are spread
evenly, since each of its cells needs some.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, ClassVar

import numpy as np

from mpmbench.core.bodies import Part
from mpmbench.core.choices import Choices
from mpmbench.core.errors import NotApplicable, require
from mpmbench.core.geometry import Box, Cloud
from mpmbench.core.geometry.triangulate import (
    all_quarters,
    barycentres,
    extruded,
    graded_disc,
    graded_levels,
    in_columns,
    quarter_ball,
)
from mpmbench.core.materials import Material
from mpmbench.core.registry import register
from mpmbench.core.setting import setting
from mpmbench.core.simulation import Solution
from mpmbench.core.stability import step_of_impact
from mpmbench.core.state import State
from mpmbench.problems.collision import Collision, captured, inside_others

# Tables 5.2 and 5.3, and Mie and Grueneisen's numbers of steel, which the thesis does not give.
STEEL = {
    "young_modulus": 200.0e9,
    "poisson_ratio": 0.29,
    "density": 7850.0,
    "yield_stress": 1.5e9,
    "reference_strain": 0.001,
    "hardening_exponent": 22.0,
    "specific_heat": 477.0,
    "melting_temperature": 1777.0,
    "softening_exponent": 1.17,
    "grueneisen": 1.9,
    "hugoniot_slope": 1.49,
}
NEAR = 2.5e-3  # from the impact, where graded nodes are fine [m]
GROWTH = 1.4  # of the distances between graded nodes farther away
FEWEST = 12  # parts of a quarter circle of nodes, which keep the plate round
GRID = 25.0 / 17.0  # cell of a grid over the distance of nodes at the impact
ROOM = 3.0e-3  # of a grid above the plate, for the sphere and what is thrown out [m]
LEFT = 0.01  # of the sphere's kinetic energy, when depth and time are read off
COURANT_ON_BODY, COURANT_ON_GRID = 0.4, 0.3  # over the shortest cell, in times of the fastest wave
PLATE, SPHERE = 0, 1


@register("problem", "sphere_impact")
@dataclass(frozen=True)
class SphereImpact(Collision):
    """Steel sphere on an aluminium plate at 500 to 3000 m/s, Li 2009, Sect. 5.2.3: depth of penetration."""

    speed: float = setting(1000.0, "of the sphere", unit="m/s", above=0.0, most=10_000.0)
    radius: float = setting(0.85e-3, "of the sphere", unit="m", above=0.0, most=2.0e-3)
    plate_radius: float = setting(10.0e-3, "of the plate", unit="m", least=4.0e-3, most=1.0)
    thickness: float = setting(10.0e-3, "of the plate", unit="m", least=4.0e-3, most=1.0)
    gap: float = setting(
        0.02e-3, "between sphere and plate at the start", unit="m", above=0.0, most=1.0e-3
    )
    support: str = setting(
        "rollers",
        "of the plate: its lower face slides on a smooth plane, sticks to it, or is free",
        options=("rollers", "clamped", "free"),
    )
    model: str = setting(
        "quarter", "between planes of symmetry, or all", options=("quarter", "full")
    )
    spread: str = setting(
        "auto",
        "of particles: graded towards the impact, even, or what the method needs",
        options=("auto", "graded", "even"),
    )
    dimension: ClassVar[int] = 3
    samples: ClassVar[int] = 400
    known_early: ClassVar[tuple[str, ...]] = (
        *("captured_most", "time_to_dissipation", "depth_over_diameter"),
        *("time_to_dissipation_of_centre", "depth_over_diameter_of_centre"),
    )

    @property
    def reference_length(self) -> float:  # type: ignore[override]
        """Cells are counted along the radius of the sphere."""
        return self.radius

    def suited_to(self, choices: Choices) -> "SphereImpact":
        """Particles are graded with the nodes of bodies, and even on a grid."""
        if self.spread != "auto":
            return self
        return replace(self, spread="graded" if choices.on_body else "even")

    def check(self, material: Material, choices: Choices, basis: str, resolution: int) -> None:
        super().check(material, choices, basis, resolution)
        require(resolution >= 2, "resolution", resolution, "at least 2 (cells along the radius)")
        if not choices.on_body and self.spread == "graded":
            raise NotApplicable(
                "problem.spread=graded leaves cells of a grid without particles: take even"
            )
        if choices.on_body and self.spread == "graded" and basis not in ("lme", "linear"):
            raise NotApplicable(
                f"basis={basis} has supports of one size, or round ones, and the nodes of sphere_impact are "
                "graded along each axis by itself: take basis=lme or linear, or problem.spread=even"
            )

    def check_particles(self, particles_per_cell: int) -> None:
        require(particles_per_cell == 3, "particles_per_cell", particles_per_cell, "3 (per prism)")

    # geometry

    def cell(self, resolution: int) -> float:
        """Distance of nodes at the impact, or cell of a grid [m]."""
        return self.radius / resolution * (GRID if self.spread == "even" else 1.0)

    def bodies(self, resolution: int, particles_per_cell: int) -> tuple[Part, ...]:
        return plate_and_sphere(self, resolution)

    def domain(self, resolution: int) -> Box:
        h = self.cell(resolution)
        across = math.ceil(self.plate_radius / h - 1e-9) + 1
        back = 0 if self.model == "quarter" else -across
        below = math.ceil(self.thickness / h - 1e-9) + (2 if self.support == "free" else 0)
        h_down = self.thickness / math.ceil(self.thickness / h - 1e-9)
        above = math.ceil(max(ROOM, 2.0 * self.radius + self.gap + h_down) / h_down)
        lower = (-below * h_down, back * h, back * h)
        upper = (above * h_down, across * h, across * h)
        return Box(lower, upper, (below + above, across - back, across - back))

    # initial and boundary conditions

    def materials(self, material: Material) -> tuple[Material, ...]:
        """The material of the run, whose numbers are those of aluminium, and steel by the same law."""
        known = {name: value for name, value in STEEL.items() if hasattr(material, name)}
        return material, replace(material, **known)  # type: ignore[type-var]

    def velocity(self, X: np.ndarray, material: Material) -> np.ndarray:
        """The sphere is what is above the plate."""
        v = np.zeros_like(X)
        v[X[:, 0] > 0.0, 0] = -self.speed
        return v

    def fixed(self, x: np.ndarray) -> np.ndarray:
        """Planes of symmetry hold what is normal to them, rollers what leads into them."""
        held = np.zeros(x.shape, dtype=bool)
        near = 1e-9 * self.radius
        if self.model == "quarter":
            held[:, 1:] = x[:, 1:] < near
        below = x[:, 0] < near - self.thickness
        if self.support == "clamped":
            held[below] = True
        elif self.support == "rollers":
            held[below, 0] = True
        return held

    def adaptive_step(self, state: State) -> Callable[[State], float] | None:
        """A part of the time in which the fastest wave crosses a cell, which is shortened with nodes on the body."""
        return step_of_impact(state, self.speed, COURANT_ON_BODY, COURANT_ON_GRID)

    # quantities of interest

    def observe(self, state: State) -> dict[str, Any]:
        """Depth of the plate's point under the sphere [m], and what lies inside the other body."""
        surface, p = state.bodies.surface, state.particles
        places = state.basis.nodes if surface.on_nodes else p.x
        starts = state.initial_nodes if surface.on_nodes else p.X
        own = surface.row[surface.body == PLATE]
        middle = own[np.argmin(np.sum(starts[own] ** 2, axis=1))]
        return {"depth": -float(places[middle, 0]), "captured_now": captured(state)}

    def quantities(self, solution: Solution, material: Material) -> dict[str, tuple[Any, ...]]:
        series = {name: np.array(values) for name, values in solution.history.items()}
        kinetic = series["body_kinetic_energy"][:, SPHERE]
        mass, momentum = solution.body_masses[SPHERE], series["body_momentum"][:, SPHERE, 0]
        found: dict[str, tuple[Any, ...]] = {}
        for suffix, whose, energy in (
            ("", "the sphere", kinetic),
            ("_of_centre", "the sphere's centre", momentum**2),
        ):
            when = instant(series["time"], energy / energy[0], LEFT)
            depth = float(np.interp(when, series["time"], series["depth"]))  # nan at nan
            text = f"instant at which {whose} has 1 % of its kinetic energy left"
            found[f"time_to_dissipation{suffix}"] = (when, "s", text)
            text = (
                f"depth of the plate's point under it, over its diameter, when {whose} has 1 % left"
            )
            found[f"depth_over_diameter{suffix}"] = (depth / (2.0 * self.radius), "1", text)
        return found | {
            **inside_others(series["captured_now"]),
            "depth": (series["depth"], "m", "depth of the plate's point under the sphere"),
            "sphere_velocity": (momentum / mass, "m/s", "mean velocity of the sphere along x_1"),
            "sphere_energy_left": (
                float(kinetic[-1] / kinetic[0]),
                "1",
                "kinetic energy of the sphere at the end over that at the start",
            ),
        }


def instant(time: np.ndarray, values: np.ndarray, level: float) -> float:
    """When falling `values`, shape (T,), first come down to a level, between two instants; nan if never."""
    below = np.flatnonzero(values <= level)
    if not len(below):
        return float("nan")
    k = int(below[0])
    if k == 0:
        return float(time[0])
    share = (values[k - 1] - level) / (values[k - 1] - values[k])
    return float(time[k - 1] + share * (time[k] - time[k - 1]))


@lru_cache(maxsize=4)
def plate_and_sphere(problem: SphereImpact, resolution: int) -> tuple[Part, ...]:
    """Both bodies, without their materials."""
    h = problem.cell(resolution)
    growth = 1.0 if problem.spread == "even" else GROWTH
    section = graded_disc(graded_levels(problem.plate_radius, NEAR, h, growth), FEWEST)
    depths = graded_levels(problem.thickness, NEAR, h, growth)
    plate = extruded(section, -depths[::-1])
    ball = quarter_ball(problem.radius, math.ceil(problem.radius / h - 1e-9))
    lift = np.array([problem.gap - ball.nodes[:, 0].min(), 0.0, 0.0])
    ball = replace(ball, nodes=ball.nodes + lift)
    parts = []
    for name, mesh, speed in (("plate", plate, 0.0), ("sphere", ball, -problem.speed)):
        whole: Cloud = mesh if problem.model == "quarter" else all_quarters(mesh)
        points = in_columns(*barycentres(whole), h)
        parts.append(Part(name, whole, *points, (speed, 0.0, 0.0)))
    return tuple(parts)
