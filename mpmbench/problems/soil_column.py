"""Collapse of a cohesive soil column under its own weight, plane strain (Iaconeta 2017, section 5.3; Bui et al. 2008).

A column of Mohr-Coulomb material, with a roller on its left wall and a rough
base, is released: gravity acts at once. Its right side slumps over the base. Clouds of moving nodes
need nodes of the base beyond the column too, on which the soil comes to rest; between these, nodes
pass through the base unless they are held there.
"""

import math
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from mpmbench.core.choices import Choices
from mpmbench.core.errors import NotApplicable
from mpmbench.core.geometry import Box, Cloud, Geometry, divided
from mpmbench.core.materials import Material
from mpmbench.core.materials.plastic import PLASTIC_STRAIN
from mpmbench.core.materials.plastic.mohr_coulomb import MohrCoulomb
from mpmbench.core.particles import Particles, seed_cells
from mpmbench.core.registry import register
from mpmbench.core.setting import setting
from mpmbench.core.simulation import Solution
from mpmbench.core.state import Loads, State
from mpmbench.core.walls import Wall
from mpmbench.problems import Problem

RUN_OUT = 2.0  # base beyond the column, in its heights
ABOVE = 1.1  # height of the grid over that of the column
MARGIN = 4  # cells of grid beyond both
SLACK = 4e-9  # [m]


@register("problem", "soil_column")
@dataclass(frozen=True)
class SoilColumn(Problem):
    """Collapse of a cohesive soil column, plane strain, Iaconeta et al. 2017, Sect. 5.3.

    Initial stress k0 is the weight of the soil above, with ``1 - sin phi`` times the vertical stress
    across. Moving nodes that reach the base ``plane`` stick to it for good, a rough ``wall`` lets them
    go; where only the ``nodes`` of the base stop them, as in the paper, they sink between these.
    """

    gravity: float = setting(
        9.81, "weight per unit mass; acts from t = 0", unit="m/s2", above=0.0, below=1.0e4
    )
    initial_acceleration: str = setting(  # type: ignore[misc]
        "zero", "of the particles, for Newmark's method", options=("zero", "gravity")
    )
    initial_stress: str = setting(
        "none", "none, or that of a column at rest under its weight", options=("none", "k0")
    )
    base: str = setting(
        "plane",
        "a rough plane that holds for good, a rough wall that lets go, or only nodes of the base",
        options=("plane", "wall", "nodes"),
    )
    particle_layout: str = setting(
        "gauss",
        "Gauss points of the cells, or middles of equal sub-cells",
        options=("gauss", "midpoint"),
    )
    width: float = setting(4.0, "of the column", unit="m", above=0.0, most=1e3)
    height: float = setting(2.0, "of the column", unit="m", above=0.0, most=1e3)
    dimension: ClassVar[int] = 2
    bends: ClassVar[bool] = True
    samples: ClassVar[int] = 1000

    @property
    def reference_length(self) -> float:  # type: ignore[override]
        return self.width

    def check(self, material: Material, choices: Choices, basis: str, resolution: int) -> None:
        self._column(resolution)
        if not choices.dynamic:
            raise NotApplicable(
                "soil_column is a dynamic problem: it needs method.time=newmark or explicit"
            )
        if self.base != "wall" and choices.moving and basis in ("linear", "bspline"):
            raise NotApplicable(
                f"basis={basis} on moving nodes ends where the column ends: it cannot meet the base"
            )
        if choices.moving and choices.dirichlet != "direct" and self.base == "plane":
            raise NotApplicable(
                "problem.base=plane holds the nodes themselves: it needs method.dirichlet=direct"
            )
        if self.initial_stress == "k0" and not isinstance(material, MohrCoulomb):
            raise NotApplicable(
                "problem.initial_stress=k0 needs material=mohr_coulomb, whose history holds the stress"
            )

    # geometry

    def _column(self, resolution: int) -> Box:
        return divided(self.width, self.height, resolution)

    def nodes(self, resolution: int, choices: Choices) -> Geometry:
        h = self.reference_length / resolution
        along = round((self.width + RUN_OUT * self.height) / h)
        if choices.on_body and self.base == "wall":
            return self._column(resolution)
        if choices.moving:
            rest = np.arange(resolution + 1, along + 1) * h
            base = np.stack([rest, np.zeros_like(rest)], axis=1)
            return Cloud(np.vstack([self._column(resolution).points, base]), spacing=h)
        along, up = along + MARGIN, math.ceil(ABOVE * self.height / h - 1e-9) + MARGIN
        return Box((0.0, 0.0), (along * h, up * h), (along, up))

    def seed(self, resolution: int, particles_per_cell: int) -> tuple[np.ndarray, np.ndarray]:
        return seed_cells(self._column(resolution), particles_per_cell, self.particle_layout)

    # initial and boundary conditions

    def prepare(self, particles: Particles, material: Material) -> None:
        if self.initial_acceleration == "gravity":
            particles.a[:, 1] = -self.gravity
        if self.initial_stress == "k0":
            assert isinstance(material, MohrCoulomb)
            at_rest = 1.0 - math.sin(math.radians(material.friction_angle))
            vertical = -material.density * self.gravity * (self.height - particles.X[:, 1])
            tau = vertical[:, None] * np.array([at_rest, 1.0, at_rest])
            particles.state[:] = material.history_of_stress(tau)
            particles.sigma[:, 0, 0], particles.sigma[:, 1, 1] = tau[:, 0], tau[:, 1]

    def fixed(self, x: np.ndarray) -> np.ndarray:
        wall = x[:, 0] < SLACK
        roller = np.stack([wall, np.zeros_like(wall)], axis=1)
        return roller if self.base == "wall" else self.landed(x) | roller

    def landed(self, x: np.ndarray) -> np.ndarray:
        """Nodes on the base or below it, both components."""
        return np.repeat(x[:, 1:] < SLACK, 2, axis=1)

    def loads(self, material: Material) -> Loads:
        def weight(X: np.ndarray, t: float, b: np.ndarray) -> None:
            b[:, 0], b[:, 1] = 0.0, -self.gravity

        if self.base == "wall":
            return Loads(body_force=weight, walls=(Wall((0.0, 0.0), (0.0, 1.0), math.inf),))
        return Loads(body_force=weight, landing=self.landed if self.base == "plane" else None)

    # quantities of interest

    def observe(self, state: State) -> dict[str, Any]:
        """Run-out [m] and the largest equivalent plastic strain."""
        p = state.particles
        out = {"run_out": float(p.x[:, 0].max()) - self.reference_length}
        if p.state.shape[1] > PLASTIC_STRAIN:
            out["largest_plastic_strain"] = float(p.state[:, PLASTIC_STRAIN].max())
        return out

    def quantities(self, solution: Solution, material: Material) -> dict[str, tuple[Any, str, str]]:
        history = {name: np.array(values) for name, values in solution.history.items()}
        out: dict[str, tuple[Any, str, str]] = {
            "run_out": (
                history["run_out"],
                "m",
                "advance of the foremost particle beyond the column's foot",
            ),
            "final_run_out": (history["run_out"][-1], "m", "run_out at the end"),
        }
        if "largest_plastic_strain" in history:
            text = "largest equivalent plastic strain"
            out["largest_plastic_strain"] = (history["largest_plastic_strain"], "1", text)
        return out
