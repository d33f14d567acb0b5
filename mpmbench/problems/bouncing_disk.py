"""An elastic disk that bounces from a frictionless wall: half of two disks that collide (Sulsky et al. 1994).

The disk of radius r starts with its lowest point at the height d above the wall y = 0 and meets it
with the speed v, by geometry at t = d/v. Only a part of its kinetic energy comes back as
translation, since it goes on vibrating; its energy, kinetic and stored, is conserved. Explicit
finite elements on 64 cells give a restitution of 0.907 at v = 0.12 c, a largest strain energy of
2.372 J at 2.10 s, a smallest kinetic energy of 0.133 J and the last contact at 2.68 s.
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

ROOM = 2  # cells of grid beside and above the disk


@register("problem", "bouncing_disk")
@dataclass(frozen=True)
class BouncingDisk(Problem):
    """Elastic disk that bounces from a frictionless wall, plane strain; energy is conserved."""

    radius: float = setting(0.2, "of the disk", unit="m", above=0.0, below=1e3)
    speed: float = setting(0.1414213562373095, "towards the wall", unit="m/s", above=0.0)
    distance: float = setting(
        0.2242640687119285, "from the disk to the wall at the start", unit="m", least=0.0
    )
    particle_layout: str = setting(
        "triangles",
        "points in the triangles of the disk, or the nodes, as SPH asks for",
        options=("triangles", "nodes"),
    )
    dimension: ClassVar[int] = 2
    bends: ClassVar[bool] = True
    touches_fixed_nodes: ClassVar[bool] = True
    samples: ClassVar[int] = 1000
    known_early: ClassVar[tuple[str, ...]] = ("first_contact", "strain_energy_max")

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
                "bouncing_disk is a dynamic problem: it needs method.time=explicit or newmark"
            )

    def check_particles(self, particles_per_cell: int) -> None:
        check_points(particles_per_cell)

    # geometry

    def nodes(self, resolution: int, choices: Choices) -> Geometry:
        h = 2.0 * self.radius / resolution
        if choices.on_body:
            disk, triangles = ring_mesh(self.radius, resolution // 2)
            return Cloud(disk + self._centre, triangles, spacing=h)
        across = resolution + 2 * ROOM
        up = resolution + ROOM + math.ceil(self.distance / h)
        return Box((-0.5 * across * h, 0.0), (0.5 * across * h, up * h), (across, up))

    @property
    def _centre(self) -> np.ndarray:
        return np.array([0.0, self.radius + self.distance])

    def seed(self, resolution: int, particles_per_cell: int) -> tuple[np.ndarray, np.ndarray]:
        nodes, triangles = ring_mesh(self.radius, resolution // 2)
        if self.particle_layout == "nodes":
            _, areas = seed_triangles(nodes, triangles, 1)
            shares = np.repeat(areas / 3.0, 3)
            return nodes + self._centre, np.bincount(triangles.ravel(), shares)
        return seed_triangles(nodes + self._centre, triangles, particles_per_cell)

    # initial condition and loads

    def velocity(self, X: np.ndarray, material: Material) -> np.ndarray:
        v = np.zeros_like(X)
        v[:, 1] = -self.speed
        return v

    def loads(self, material: Material) -> Loads:
        return Loads(walls=(Wall((0.0, 0.0), (0.0, 1.0)),))

    # quantities of interest

    def observe(self, state: State) -> dict[str, Any]:
        """Speed of the centre away from the wall [m/s], and the force of the wall [N]."""
        p = state.particles
        force = state.walls.impulse[0, 1] / state.time_step if state.time > 0.0 else 0.0
        return {"centre_speed": float(p.m @ p.v[:, 1] / p.m.sum()), "wall_force": float(force)}

    def quantities(self, solution: Solution, material: Material) -> dict[str, tuple[Any, str, str]]:
        series = {name: np.array(values) for name, values in solution.history.items()}
        time, touching = series["time"], np.flatnonzero(series["wall_force"] > 0.0)
        energy = series["kinetic_energy"] + series["strain_energy"]
        out: dict[str, tuple[Any, str, str]] = {
            "centre_speed": (series["centre_speed"], "m/s", "speed of the centre from the wall"),
            "wall_force": (series["wall_force"], "N", "force of the wall on the disk"),
            "restitution": (
                float(series["centre_speed"][-1] / self.speed),
                "1",
                "speed of the centre at the end over that at the start",
            ),
            "energy_kept": (
                float(energy[-1] / energy[0]),
                "1",
                "energy at the end over that before",
            ),
            "strain_energy_max": (
                float(series["strain_energy"].max()),
                "J",
                "largest strain energy",
            ),
            "kinetic_energy_min": (
                float(series["kinetic_energy"].min()),
                "J",
                "smallest kinetic energy",
            ),
        }
        if len(touching):
            text = "{} instant at which the wall holds the disk"
            out["first_contact"] = (float(time[touching[0]]), "s", text.format("first"))
            out["last_contact"] = (float(time[touching[-1]]), "s", text.format("last"))
        return out
