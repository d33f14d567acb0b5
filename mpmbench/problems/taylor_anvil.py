"""A copper rod that hits a rigid wall: Taylor's test of dynamic yielding (Li 2009, section 5.1), in 3D.

The rod, 32.4 mm long with a radius of 3.2 mm, flies with 227 m/s along its axis, the first one,
against a smooth wall at its foot, and has come to rest after 80 us, but for vibration and rebound.
There is no exact solution. Axisymmetric finite elements give, with j2 and its defaults, a length of
21.43 mm, a radius at the foot of 7.15 mm, plastic strains up to 3.0 to 3.4, rising with refinement,
and a von Mises stress of 460 to 480 MPa. All methods have the same particles: the barycentres of
tetrahedra, three to a prism.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from mpmbench.core.choices import Choices
from mpmbench.core.errors import NotApplicable, require
from mpmbench.core.geometry import Box, Cloud, Geometry
from mpmbench.core.geometry.triangulate import (
    barycentres,
    extruded,
    first_quadrant,
    in_columns,
    ring_mesh,
)
from mpmbench.core.materials import Material
from mpmbench.core.materials.fields import derived_fields
from mpmbench.core.registry import register
from mpmbench.core.setting import setting
from mpmbench.core.simulation import Solution
from mpmbench.core.stability import step_of_impact
from mpmbench.core.state import Loads, State
from mpmbench.core.walls import Wall
from mpmbench.problems import Problem

SECTORS = 8  # of the rings of nodes, so that symmetry planes cut no cell
ROOM = 1.75  # radii beside the rod that its foot spreads to, on a grid
ABOVE = 2  # cells of grid above the rod
# Over the shortest cell, in times of the elastic wave; shapes and energies are those of half of it.
COURANT_ON_BODY, COURANT_ON_GRID = 0.6, 0.3  # light nodes of a grid bear less: 0.9 breaks B-splines
SLICE = 0.5  # radii, in which the section is measured at the end
SHARES = (
    ("kinetic", "kinetic_energy", "kinetic energy at the end"),
    ("contact", "contact_energy", "energy that the wall has taken"),
    ("transfer", "numerical_dissipation", "energy that transfers have lost"),
)


@register("problem", "taylor_anvil")
@dataclass(frozen=True)
class TaylorAnvil(Problem):
    """Copper rod against a rigid smooth wall, Li 2009, Sect. 5.1: Taylor's test in 3D."""

    radius: float = setting(3.2e-3, "of the rod", unit="m", above=0.0, below=10.0)
    length: float = setting(32.4e-3, "of the rod", unit="m", above=0.0, below=100.0)
    speed: float = setting(227.0, "of the impact", unit="m/s", above=0.0)
    friction: float = setting(
        0.0, "coefficient of Coulomb friction of the wall", unit="-", least=0.0
    )
    model: str = setting(
        "quarter",
        "a quarter of the rod between planes of symmetry, or all",
        options=("quarter", "full"),
    )
    dimension: ClassVar[int] = 3
    bends: ClassVar[bool] = True
    touches_fixed_nodes: ClassVar[bool] = True
    samples: ClassVar[int] = 400

    @property
    def reference_length(self) -> float:  # type: ignore[override]
        """Cells are counted along the radius."""
        return self.radius

    def check(self, material: Material, choices: Choices, basis: str, resolution: int) -> None:
        if not choices.dynamic:
            raise NotApplicable("taylor_anvil is a dynamic problem: it needs method.time=explicit")
        require(resolution >= 2, "resolution", resolution, "at least 2 (cells along the radius)")

    def check_particles(self, particles_per_cell: int) -> None:
        require(particles_per_cell == 3, "particles_per_cell", particles_per_cell, "3 (per prism)")

    # geometry

    def _rod(self, resolution: int) -> Cloud:
        nodes, triangles = ring_mesh(self.radius, resolution, SECTORS)
        if self.model == "quarter":
            nodes, triangles = first_quadrant(nodes, triangles)
        h = self.radius / resolution
        levels = np.linspace(0.0, self.length, round(self.length / h) + 1)
        return extruded(Cloud(nodes, triangles, spacing=h), levels)

    def nodes(self, resolution: int, choices: Choices) -> Geometry:
        if choices.moving:
            return self._rod(resolution)
        # a grid that stays in the undeformed rod has no need of room
        room, above = (0.0, 0) if choices.frozen else (ROOM, ABOVE)
        h = self.radius / resolution
        across = resolution + int(np.ceil(room * resolution))
        back = 0 if self.model == "quarter" else -across
        up = round(self.length / h) + above
        top = self.length / (up - above) * up
        lower, upper = (0.0, back * h, back * h), (top, across * h, across * h)
        return Box(lower, upper, (up, across - back, across - back))

    def seed(self, resolution: int, particles_per_cell: int) -> tuple[np.ndarray, np.ndarray]:
        return in_columns(*barycentres(self._rod(resolution)), self.radius / resolution)

    def tracers(self) -> np.ndarray:
        """The axis at the top and at the foot, and the rim of the foot."""
        return np.array([[self.length, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, self.radius, 0.0]])

    # initial and boundary conditions

    def velocity(self, X: np.ndarray, material: Material) -> np.ndarray:
        v = np.zeros_like(X)
        v[:, 0] = -self.speed
        return v

    def fixed(self, x: np.ndarray) -> np.ndarray:
        """Planes of symmetry hold what is normal to them."""
        held = np.zeros(x.shape, dtype=bool)
        if self.model == "quarter":
            held[:, 1:] = x[:, 1:] < 1e-9 * self.radius
        return held

    def loads(self, material: Material) -> Loads:
        return Loads(walls=(Wall((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), self.friction),))

    def adaptive_step(self, state: State) -> Callable[[State], float] | None:
        """A part of the time in which an elastic wave crosses a cell, which is shortened with nodes on the body."""
        return step_of_impact(state, self.speed, COURANT_ON_BODY, COURANT_ON_GRID)

    # quantities of interest

    def _radius_at(self, height: float, x: np.ndarray, V: np.ndarray) -> float:
        """Radius [m] of the circle with the mean section of a slice, `SLICE` radii thick."""
        inside = np.abs(x[:, 0] - height) < 0.5 * SLICE * self.radius
        section = V[inside].sum() / (SLICE * self.radius)
        turns = 0.25 if self.model == "quarter" else 1.0
        return float(np.sqrt(section / (turns * np.pi)))

    def observe(self, state: State) -> dict[str, Any]:
        """Length on the axis, radius at the rim of the foot and of the outermost particle [m], wall force [N]."""
        p = state.particles
        top, foot, rim = p.x[p.material.stop :]
        step = state.time_step if state.time > 0.0 else np.inf
        return {
            "length": float(top[0] - foot[0]),
            "radius_nodes": float(np.hypot(*rim[1:])),
            "radius_points": float(np.hypot(*p.x[p.material, 1:].T).max()),
            "wall_force": float(state.walls.impulse[0, 0] / step),
        }

    def quantities(self, solution: Solution, material: Material) -> dict[str, tuple[Any, str, str]]:
        series = {name: np.array(values) for name, values in solution.history.items()}
        last = solution.snapshots[-1]
        solid = slice(0, len(last["x"]) - len(self.tracers()))
        fields = {name: field[0][solid] for name, field in derived_fields(material, last).items()}
        start = series["kinetic_energy"][0]
        out: dict[str, tuple[Any, str, str]] = {
            **{
                f"{name}_share": (
                    float(series[full][-1] / start),
                    "1",
                    f"{text} over that of impact",
                )
                for name, full, text in SHARES
            },
            "radius_fifth": (
                self._radius_at(0.2 * self.length, last["x"][solid], last["V"][solid]),
                "m",
                "radius at a fifth of the rod's length above the wall, by the volume in a slice",
            ),
            "length": (series["length"][-1], "m", "length of the rod on its axis at the end"),
            "radius_nodes": (series["radius_nodes"][-1], "m", "radius of the foot at its rim"),
            "radius_points": (series["radius_points"][-1], "m", "that of the outermost particle"),
            "length_history": (series["length"], "m", "length of the rod on its axis"),
            "radius_history": (series["radius_nodes"], "m", "radius of the foot at its rim"),
            "wall_force": (series["wall_force"], "N", "force of the wall on the rod"),
            "von_mises_max": (
                float(fields["von_mises"].max()),
                "Pa",
                "largest von Mises stress at the end",
            ),
        }
        if "plastic_strain" in fields:
            strain = float(fields["plastic_strain"].max())
            out["plastic_strain_max"] = (strain, "1", "largest equivalent plastic strain")
        touching = np.flatnonzero(series["wall_force"] > 0.0)
        if len(touching):
            text = "last instant at which the wall holds the rod"
            out["last_contact"] = (float(series["time"][touching[-1]]), "s", text)
        return out
