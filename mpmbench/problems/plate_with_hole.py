"""An infinite plate with a circular hole under tension (Kirsch 1898), in small strain.

A quarter of a square of edge 8 a around the hole of radius a, in plane strain, with symmetry at both
axes. The outer edges follow the exact displacement: a uniform traction there would err by (a/4a)^2.
With the tension T along x_1, kappa = 3 - 4 nu and the angle theta,

    u_1 = T a/(8 mu) ((r/a) (kappa + 1) cos theta + 2 (a/r) ((1 + kappa) cos theta + cos 3 theta)
                      - 2 (a/r)^3 cos 3 theta),
    u_2 = T a/(8 mu) ((r/a) (kappa - 3) sin theta + 2 (a/r) ((1 - kappa) sin theta + sin 3 theta)
                      - 2 (a/r)^3 sin 3 theta);

sigma_11 is 3 T at the top of the hole, and sigma_22 is -T at its side. Particles are points of the
triangles of a mesh that follows the hole, for all methods: for a grid that is a rim without stairs.
Time is the load factor.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from mpmbench.core.choices import Choices
from mpmbench.core.errors import NotApplicable, require
from mpmbench.core.geometry import Box, Cloud, Geometry
from mpmbench.core.geometry.triangulate import check_points, seed_triangles
from mpmbench.core.materials import Material
from mpmbench.core.materials.elastic.small_strain_elastic import SmallStrainElastic
from mpmbench.core.registry import register
from mpmbench.core.setting import setting
from mpmbench.core.simulation import Solution
from mpmbench.core.state import Loads, State
from mpmbench.problems import Fields, Problem

EDGE = 4.0  # of a side over the radius of the hole
GRADING = 0.3  # spacing of the rings at the hole over the mean one
SLACK = 1e-9  # over the radius of the hole


@register("problem", "plate_with_hole")
@dataclass(frozen=True)
class PlateWithHole(Problem):
    """Plate with a hole under tension, Kirsch 1898: the exact displacement at the outer edges, small strain."""

    strain: float = setting(1e-4, "tension over Young's modulus", unit="-", above=0.0, below=0.1)
    radius: float = setting(
        1.0, "of the hole; the plate has four of them", unit="m", above=0.0, below=1e3
    )
    dimension: ClassVar[int] = 2
    bends: ClassVar[bool] = True
    initial_acceleration: ClassVar[str] = "zero"

    @property
    def reference_length(self) -> float:  # type: ignore[override]
        """A side of the plate."""
        return EDGE * self.radius

    def check(self, material: Material, choices: Choices, basis: str, resolution: int) -> None:
        require(
            resolution % 2 == 0, "resolution", resolution, "an even number (a node in the corner)"
        )
        if choices.dynamic or not choices.implicit:
            raise NotApplicable("plate_with_hole is a static problem: it needs method.time=static")

    def check_particles(self, particles_per_cell: int) -> None:
        check_points(particles_per_cell)

    # geometry

    def _mesh(self, resolution: int) -> Cloud:
        """Rings of nodes from the hole to the outer edges, closer to each other at the hole."""
        angle = 0.5 * math.pi * np.arange(resolution + 1) / resolution
        way = np.linspace(0.0, 1.0, resolution + 1)
        way = GRADING * way + (1.0 - GRADING) * way**2
        on_circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
        on_edge = self.reference_length * on_circle / np.abs(on_circle).max(axis=1, keepdims=True)
        nodes = (1.0 - way[:, None, None]) * self.radius * on_circle + way[:, None, None] * on_edge
        nodes[:, 0, 1], nodes[:, -1, 0] = 0.0, 0.0
        i, j = np.meshgrid(np.arange(resolution), np.arange(resolution), indexing="ij")
        a = (i * (resolution + 1) + j).ravel()
        b, c, d = a + 1, a + resolution + 1, a + resolution + 2
        flip = ((i + j) % 2 == 1).reshape(-1, 1)  # as on a chessboard: no direction is preferred
        pairs = np.where(
            flip, np.stack([a, c, d, a, d, b], axis=1), np.stack([a, c, b, c, d, b], axis=1)
        )
        return Cloud(nodes.reshape(-1, 2), pairs.reshape(-1, 3), self.reference_length / resolution)

    def nodes(self, resolution: int, choices: Choices) -> Geometry:
        if choices.moving:
            return self._mesh(resolution)
        return Box((0.0, 0.0), (self.reference_length,) * 2, (resolution, resolution))

    def seed(self, resolution: int, particles_per_cell: int) -> tuple[np.ndarray, np.ndarray]:
        mesh = self._mesh(resolution)
        assert mesh.simplices is not None
        return seed_triangles(mesh.nodes, mesh.simplices, particles_per_cell)

    # boundary conditions

    def fixed(self, x: np.ndarray) -> np.ndarray:
        slack = SLACK * self.radius
        outer = np.any(x > self.reference_length - slack, axis=1, keepdims=True)
        return np.asarray((x < slack) | outer)

    def loads(self, material: Material) -> Loads:
        def motion(X: np.ndarray, t: float) -> np.ndarray:
            return self._displacement(X, t, material)

        return Loads(prescribed_motion=motion)

    def adaptive_step(self, state: State) -> Callable[[State], float]:
        """All of the load at once."""
        return lambda _: 1.0

    # exact solution

    def _tension(self, t: float, material: Material) -> float:
        lame, shear = material.lame_parameters()
        return self.strain * t * shear * (3.0 * lame + 2.0 * shear) / (lame + shear)

    def _displacement(self, X: np.ndarray, t: float, material: Material) -> np.ndarray:
        """Displacement [m] at X, shape (n, 2); inside the hole, where grids have nodes, that of its rim."""
        lame, shear = material.lame_parameters()
        kappa = 3.0 - 2.0 * lame / (lame + shear)
        r = np.maximum(np.hypot(*X.T), self.radius) / self.radius
        theta = np.arctan2(X[:, 1], X[:, 0])
        c, s, c3, s3 = np.cos(theta), np.sin(theta), np.cos(3.0 * theta), np.sin(3.0 * theta)
        u = np.stack(
            [
                r * (kappa + 1.0) * c + 2.0 / r * ((1.0 + kappa) * c + c3) - 2.0 / r**3 * c3,
                r * (kappa - 3.0) * s + 2.0 / r * ((1.0 - kappa) * s + s3) - 2.0 / r**3 * s3,
            ],
            axis=1,
        )
        return np.asarray(self._tension(t, material) * self.radius / (8.0 * shear) * u)

    def exact(self, X: np.ndarray, t: float, material: Material) -> Fields:
        """Stresses along and across the radius, turned to the axes."""
        if not isinstance(material, SmallStrainElastic):
            return {}
        q = (self.radius / np.hypot(*X.T)) ** 2
        theta = np.arctan2(X[:, 1], X[:, 0])
        c, s, c2, s2 = np.cos(theta), np.sin(theta), np.cos(2.0 * theta), np.sin(2.0 * theta)
        half = 0.5 * self._tension(t, material)
        radial = half * (1.0 - q + (1.0 - 4.0 * q + 3.0 * q**2) * c2)
        hoop = half * (1.0 + q - (1.0 + 3.0 * q**2) * c2)
        shear = -half * (1.0 + 2.0 * q - 3.0 * q**2) * s2
        R = np.stack([np.stack([c, -s], axis=1), np.stack([s, c], axis=1)], axis=1)
        local = np.stack([np.stack([radial, shear], 1), np.stack([shear, hoop], 1)], axis=1)
        return {
            "displacement": self._displacement(X, t, material),
            "stress": R @ local @ R.transpose(0, 2, 1),
        }

    # quantities of interest

    def quantities(self, solution: Solution, material: Material) -> dict[str, tuple[Any, str, str]]:
        if solution.status != "ok":
            return {}
        last = solution.snapshots[-1]
        largest = float(last["sigma"][:, 0, 0].max()) / self._tension(last["time"], material)
        text = "largest stress along the tension over it; 3 at the hole"
        return {"stress_concentration": (largest, "1", text)}
