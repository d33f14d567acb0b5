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
from mpmbench.core.geometry.triangulate import jittered, seed_triangles, triangulation
from mpmbench.core.materials import Material
from mpmbench.core.registry import register
from mpmbench.core.state import Loads, State
from mpmbench.problems import Fields, Problem

GRADIENT = np.array([[1.0, 0.5], [-0.3, -0.7]])  # A / strain


@register("problem", "patch_test")
@dataclass(frozen=True)
class PatchTest(Problem):
    """Parameters of the patch.

    Parameters
    ----------
    strain : float
        Scale of the displacement gradient; its largest component.
    jitter : float
        Largest displacement of inner nodes from a regular grid, in cells, less than 0.5.
    jitter_seed : int
        For the random displacements.
    """

    strain: float = 0.1
    jitter: float = 0.3
    jitter_seed: int = 0
    dimension: ClassVar[int] = 2
    reference_length: ClassVar[float] = 1.0

    def __post_init__(self) -> None:
        require(
            0.0 < abs(self.strain) <= 0.5,
            "strain",
            self.strain,
            "a number from -0.5 to 0.5 other than 0",
        )
        require(0.0 <= self.jitter < 0.5, "jitter", self.jitter, "a number from 0 to less than 0.5")
        require(
            self.jitter_seed >= 0, "jitter_seed", self.jitter_seed, "a whole number of at least 0"
        )

    def check(self, material: Material, choices: Choices, basis: str, resolution: int) -> None:
        require(resolution >= 2, "resolution", resolution, "a whole number of at least 2")
        if choices.time != "static" or not choices.moving:
            raise NotApplicable(
                "patch_test is a static test of nodes in the body: it needs method=fem or gmm"
            )

    def check_particles(self, particles_per_cell: int) -> None:
        require(
            particles_per_cell in (1, 3),
            "particles_per_cell",
            particles_per_cell,
            "1 or 3 (points per triangle)",
        )

    # geometry

    def _cloud(self, resolution: int) -> Cloud:
        line = np.linspace(0.0, 1.0, resolution + 1)
        x, y = (part.ravel() for part in np.meshgrid(line, line, indexing="ij"))
        nodes = np.stack([x, y], axis=1)
        nodes = jittered(nodes, 1.0 / resolution, self.jitter, self.fixed(nodes), self.jitter_seed)
        return Cloud(nodes, triangulation(nodes, 1.0), spacing=1.0 / resolution)

    def nodes(self, resolution: int, choices: Choices) -> Cloud:
        return self._cloud(resolution)

    def seed(self, resolution: int, particles_per_cell: int) -> tuple[np.ndarray, np.ndarray]:
        cloud = self._cloud(resolution)
        assert cloud.simplices is not None
        return seed_triangles(cloud.nodes, cloud.simplices, particles_per_cell)

    # boundary conditions

    def fixed(self, x: np.ndarray) -> np.ndarray:
        boundary = np.any((x < 1e-9) | (x > 1.0 - 1e-9), axis=1)
        return np.repeat(boundary[:, None], 2, axis=1)

    def loads(self, material: Material) -> Loads:
        return Loads(prescribed_motion=lambda X, t: t * self.strain * X @ GRADIENT.T)

    def adaptive_step(self, state: State) -> Callable[[State], float]:
        """One load step: time is the load factor."""
        return lambda _: math.inf

    # exact solution

    def exact(self, X: np.ndarray, t: float, material: Material) -> Fields:
        return {"displacement": t * self.strain * X @ GRADIENT.T}
