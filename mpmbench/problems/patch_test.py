"""Patch test on an irregular set of nodes: a linear displacement at the boundary must continue inside.

The unit square of a homogeneous material is deformed by ``u = t A X`` at its boundary nodes. Finite
elements reproduce it exactly. Functions that are no polynomials on the cells of the quadrature do
not: the error is that of integration, because every basis here can represent the solution.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from mpmbench.core.choices import Choices
from mpmbench.core.errors import NotApplicable, require
from mpmbench.core.geometry import Cloud
from mpmbench.core.geometry.triangulate import (
    check_points,
    jittered,
    seed_triangles,
    triangulation,
)
from mpmbench.core.geometry.voronoi import outline, voronoi_cells
from mpmbench.core.materials import Material
from mpmbench.core.registry import register
from mpmbench.core.setting import setting
from mpmbench.core.state import Loads, State
from mpmbench.problems import Fields, Problem

GRADIENT = np.array([[1.0, 0.5], [-0.3, -0.7]])  # A / strain


@register("problem", "patch_test")
@dataclass(frozen=True)
class PatchTest(Problem):
    """Patch test on an irregular triangulation: the integration error of meshfree functions.

    Time is the load factor.
    """

    strain: float = setting(
        0.1, "largest component of the displacement gradient, not 0", unit="-", least=-0.5, most=0.5
    )
    jitter: float = setting(
        0.3,
        "largest displacement of inner nodes from a regular grid, in cells",
        unit="-",
        least=0.0,
        below=0.5,
    )
    particle_layout: str = setting(
        "triangles",
        "points of the triangles between nodes, or the nodes with the volumes of their Voronoi cells",
        options=("triangles", "nodes"),
    )
    side: float = setting(1.0, "of the square", unit="m", above=0.0)
    random_seed: int = 0
    dimension: ClassVar[int] = 2

    @property
    def reference_length(self) -> float:  # type: ignore[override]
        return self.side

    def check_together(self) -> None:
        require(self.strain != 0.0, "strain", self.strain, "a number other than 0")

    def check(self, material: Material, choices: Choices, basis: str, resolution: int) -> None:
        require(resolution >= 2, "resolution", resolution, "a whole number of at least 2")
        if choices.dynamic or not (choices.implicit and choices.moving):
            raise NotApplicable(
                "patch_test is a static test of nodes in the body: it needs method=fem or gmm"
            )

    def check_particles(self, particles_per_cell: int) -> None:
        check_points(particles_per_cell)

    # geometry

    def _cloud(self, resolution: int) -> Cloud:
        line, h = np.linspace(0.0, self.side, resolution + 1), self.side / resolution
        x, y = (part.ravel() for part in np.meshgrid(line, line, indexing="ij"))
        nodes = np.stack([x, y], axis=1)
        nodes = jittered(nodes, h, self.jitter, self.fixed(nodes), self.random_seed)
        return Cloud(nodes, triangulation(nodes, self.side**2), spacing=h)

    def nodes(self, resolution: int, choices: Choices) -> Cloud:
        return self._cloud(resolution)

    def seed(self, resolution: int, particles_per_cell: int) -> tuple[np.ndarray, np.ndarray]:
        cloud = self._cloud(resolution)
        if self.particle_layout == "nodes":
            return cloud.nodes, voronoi_cells(cloud.nodes, outline(cloud.nodes)).volumes
        assert cloud.simplices is not None
        return seed_triangles(cloud.nodes, cloud.simplices, particles_per_cell)

    # boundary conditions

    def fixed(self, x: np.ndarray) -> np.ndarray:
        slack = 1e-9 * self.side
        boundary = np.any((x < slack) | (x > self.side - slack), axis=1)
        return np.repeat(boundary[:, None], 2, axis=1)

    def loads(self, material: Material) -> Loads:
        return Loads(prescribed_motion=lambda X, t: t * self.strain * X @ GRADIENT.T)

    def adaptive_step(self, state: State) -> Callable[[State], float]:
        """One load step: time is the load factor."""
        return lambda _: math.inf

    # exact solution

    def exact(self, X: np.ndarray, t: float, material: Material) -> Fields:
        return {"displacement": t * self.strain * X @ GRADIENT.T}
