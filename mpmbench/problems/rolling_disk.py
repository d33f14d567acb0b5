"""A disk that rolls down an inclined plane without slipping (Iaconeta 2017, section 5.2).

The centre of a rigid disk moves along the plane by ``u = (1/2) (2/3) g sin(theta) t^2``: Eq. 64,
integrated from rest (Eqs. 65 and 66 count the displacement twice). Axes are turned with the plane,
y = 0: a rough wall that lets go. In the paper it is a row of fixed nodes, and contact is whatever
the shape functions make of them. A disk that touches these at the start is glued to them and hangs,
so it starts a little above, falls, and bounces. The paper gives no radius, angle, time step or gap.
"""

import math
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from mpmbench.core.choices import Choices
from mpmbench.core.errors import NotApplicable, require
from mpmbench.core.geometry import Box, Cloud, Geometry
from mpmbench.core.geometry.triangulate import check_points, ring_mesh, seed_triangles
from mpmbench.core.materials import Material
from mpmbench.core.registry import register
from mpmbench.core.setting import setting
from mpmbench.core.simulation import Solution
from mpmbench.core.state import Loads, State
from mpmbench.core.walls import Wall
from mpmbench.problems import Problem

GRID_GAP, CLOUD_GAP = (
    1.0,
    1.5 * math.sqrt(2.0),
)  # cells between disk and plane: one, or the paper's largest radius
BEHIND, ABOVE = 2, 6  # cells of grid behind and above the disk


@register("problem", "rolling_disk")
@dataclass(frozen=True)
class RollingDisk(Problem):
    """Disk rolling down an inclined plane without slipping, Iaconeta et al. 2017, Sect. 5.2.

    Gap 0 glues the disk to a plane of nodes, and so do rising diagonals; gap null is none on a wall, and
    above nodes one cell of a grid and the largest search radius of the paper for clouds.
    """

    plane: str = setting(
        "wall", "a wall that lets go, or fixed nodes as in the paper", options=("wall", "nodes")
    )
    friction: float | None = setting(
        None,
        "coefficient of Coulomb friction of the wall; null: nothing slides",
        unit="-",
        least=0.0,
    )

    radius: float = setting(0.5, "of the disk", unit="m", above=0.0, below=1e3)
    angle: float = setting(60.0, "inclination of the plane", unit="degrees", above=0.0, below=90.0)
    gravity: float = setting(9.81, "weight per unit mass", unit="m/s2", above=0.0, below=1.0e4)
    gap: float | None = setting(
        None,
        "cells between disk and plane at the start; null: 0, above nodes 1 (grids) or 1.5 sqrt(2) (clouds)",
        unit="-",
        least=0.0,
        most=100.0,
    )
    travel: float = setting(
        3.5, "length of plane in front of the disk", unit="m", above=0.0, below=1e3
    )
    background: str = setting(
        "triangles",
        "cells of the background grid; triangles are split squares",
        options=("triangles", "quads"),
    )
    diagonal: str = setting(
        "falling",
        "cut of the squares, seen in the direction of motion",
        options=("falling", "rising", "alternating"),
    )
    dimension: ClassVar[int] = 2
    bends: ClassVar[bool] = True
    initial_acceleration: ClassVar[str] = "zero"
    samples: ClassVar[int] = 1000
    touches_fixed_nodes: ClassVar[bool] = True

    @property
    def reference_length(self) -> float:  # type: ignore[override]
        """Cells are counted along the diameter."""
        return 2.0 * self.radius

    def check(self, material: Material, choices: Choices, basis: str, resolution: int) -> None:
        require(
            resolution % 2 == 0 and resolution >= 4,
            "resolution",
            resolution,
            "an even number, at least 4",
        )
        if not choices.dynamic:
            raise NotApplicable(
                "rolling_disk is a dynamic problem: it needs method.time=newmark or explicit"
            )
        if self.plane == "wall":
            return
        if self.friction is not None:
            raise NotApplicable("problem.friction is that of a wall: it needs problem.plane=wall")
        if choices.moving and basis in ("linear", "bspline"):
            raise NotApplicable(
                f"basis={basis} on moving nodes does not see the plane: contact needs a grid or clouds"
            )
        if choices.dirichlet != "direct":
            raise NotApplicable(
                f"method.dirichlet={choices.dirichlet} holds points of the body, and the plane is none"
            )
        if choices.frozen:
            raise NotApplicable("method.shape_functions=frozen never lets the disk meet the plane")

    def check_particles(self, particles_per_cell: int) -> None:
        check_points(particles_per_cell)

    # geometry

    def _spacing(self, resolution: int) -> float:
        return 2.0 * self.radius / resolution

    def _centre(self, resolution: int, moving: bool) -> np.ndarray:
        h = self._spacing(resolution)
        gap = self.gap
        if gap is None:
            gap = 0.0 if self.plane == "wall" else CLOUD_GAP if moving else GRID_GAP
        return np.array([self.radius + BEHIND * h, self.radius + gap * h])

    def nodes(self, resolution: int, choices: Choices) -> Geometry:
        h = self._spacing(resolution)
        along = resolution + 2 * BEHIND + math.ceil(self.travel / h)
        if choices.on_body and self.plane == "wall":
            disk, triangles = ring_mesh(self.radius, resolution // 2)
            return Cloud(disk + self._centre(resolution, True), triangles, spacing=h)
        if choices.moving:
            plane = np.stack([np.arange(along + 1) * h, np.zeros(along + 1)], axis=1)
            disk, _ = ring_mesh(self.radius, resolution // 2)
            return Cloud(np.vstack([disk + self._centre(resolution, True), plane]), spacing=h)
        up = resolution + ABOVE + math.ceil(self._centre(resolution, False)[1] / h - resolution / 2)
        box = Box((0.0, 0.0), (along * h, up * h), (along, up))
        if self.background == "quads":
            return box
        return Cloud(box.points, split_squares(along, up, self.diagonal), spacing=h)

    def seed(self, resolution: int, particles_per_cell: int) -> tuple[np.ndarray, np.ndarray]:
        """Points of the triangles of a ring mesh about the origin; `place` moves them to where the disk starts."""
        nodes, triangles = ring_mesh(self.radius, resolution // 2)
        return seed_triangles(nodes, triangles, particles_per_cell)

    def place(self, X: np.ndarray, resolution: int, choices: Choices) -> np.ndarray:
        return X + self._centre(resolution, choices.moving)

    # initial and boundary conditions

    def fixed(self, x: np.ndarray) -> np.ndarray:
        held = (x[:, 1:] < 1e-9 * self.radius) & (self.plane == "nodes")
        return np.repeat(held, 2, axis=1)

    def loads(self, material: Material) -> Loads:
        theta = math.radians(self.angle)

        def weight(X: np.ndarray, t: float, b: np.ndarray) -> None:
            b[:, 0], b[:, 1] = self.gravity * math.sin(theta), -self.gravity * math.cos(theta)

        if self.plane == "nodes":
            return Loads(body_force=weight)
        friction = math.inf if self.friction is None else self.friction
        return Loads(body_force=weight, walls=(Wall((0.0, 0.0), (0.0, 1.0), friction),))

    # exact solution of the centre

    def travelled(self, t: np.ndarray) -> np.ndarray:
        """Displacement of the centre of a rigid disk that rolls from rest [m]."""
        return self.gravity * math.sin(math.radians(self.angle)) / 3.0 * t**2

    # quantities of interest

    def observe(self, state: State) -> dict[str, Any]:
        """Displacement of the centre of mass, and the height of the lowest particle [m]."""
        p = state.particles
        return {
            "centre_displacement": p.m @ (p.x - p.X) / p.m.sum(),
            "lowest_particle": float(p.x[:, 1].min()),
        }

    def quantities(self, solution: Solution, material: Material) -> dict[str, tuple[Any, str, str]]:
        time, moved = (
            np.array(solution.history["time"]),
            np.array(solution.history["centre_displacement"]),
        )
        exact = self.travelled(time)
        error = moved[:, 0] - exact
        out: dict[str, tuple[Any, str, str]] = {
            "centre_displacement": (
                moved[:, 0],
                "m",
                "displacement of the centre of mass along the plane",
            ),
            "centre_rise": (
                moved[:, 1],
                "m",
                "displacement of the centre of mass away from the plane",
            ),
            "centre_displacement_exact": (
                exact,
                "m",
                "displacement of a rigid disk that rolls without slipping",
            ),
            "lowest_particle": (
                np.array(solution.history["lowest_particle"]),
                "m",
                "height of the lowest particle",
            ),
            "error_sum": (
                float(np.sqrt(np.sum(error**2))),
                "m",
                "error of Eq. 67: it grows with the number of samples",
            ),
            "error_centre_rms": (
                float(np.sqrt(np.mean(error**2))),
                "m",
                "root mean square error of the displacement",
            ),
        }
        if exact[-1] > 0.0:
            text = "error of the displacement at the end over the exact one"
            out["error_end_relative"] = (float(error[-1] / exact[-1]), "1", text)
            landed = (
                int(np.argmax(np.diff(moved[:, 1]) > 0.0))
                if np.any(np.diff(moved[:, 1]) > 0.0)
                else 0
            )
            out["bounce_height"] = (
                float(moved[landed:, 1].max() - moved[: landed + 1, 1].min()),
                "m",
                "highest rise of the centre after its first landing",
            )
        return out


def split_squares(along: int, up: int, diagonal: str) -> np.ndarray:
    """Triangles of a grid of squares, each cut along a diagonal; node numbers as in `Box.nodes`, shape (2 cells, 3).

    `diagonal` is ``falling`` (towards positive x), ``rising``, or ``alternating`` as on a
    chessboard.
    """
    i, j = np.meshgrid(np.arange(along), np.arange(up), indexing="ij")
    corner = (i * (up + 1) + j).ravel()
    right, above, opposite = corner + up + 1, corner + 1, corner + up + 2
    falling = np.stack([corner, right, above, right, opposite, above], axis=1)
    rising = np.stack([corner, right, opposite, corner, opposite, above], axis=1)
    share = {"falling": np.zeros_like(i), "rising": np.ones_like(i), "alternating": (i + j) % 2}[
        diagonal
    ]
    return np.where(share.reshape(-1, 1) == 1, rising, falling).reshape(-1, 3)
