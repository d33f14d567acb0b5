"""Two elastic disks that collide on the diagonal of the unit box (Sulsky, Chen and Schreyer 1994).

Disks of radius 0.2 m around (0.2, 0.2) and (0.8, 0.8) m fly at each other with 0.1 m/s along each
axis. By geometry they touch at 1.5858 s. Explicit finite elements of one disk on a plane of symmetry
give, for the pair, a last contact at 2.68 s, a largest strain energy of 2.37 of 2.513 J at 2.10 s and
a kinetic energy of 0.88 of that at the start afterwards, since the disks go on vibrating.
"""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from mpmbench.core.bodies import Part
from mpmbench.core.geometry import Box
from mpmbench.core.geometry.triangulate import ring_mesh
from mpmbench.core.materials import Material
from mpmbench.core.registry import register
from mpmbench.core.setting import setting
from mpmbench.core.simulation import Solution
from mpmbench.problems.collision import Collision, part_of


@register("problem", "colliding_disks")
@dataclass(frozen=True)
class CollidingDisks(Collision):
    """Two elastic disks that collide, Sulsky, Chen and Schreyer 1994; energy is conserved."""

    radius: float = setting(0.2, "of the disks", unit="m", above=0.0, below=0.5)
    centre: float = setting(
        0.2, "of the lower disk along each axis; that of the upper one mirrors it", unit="m"
    )
    speed: float = setting(0.1, "along each axis", unit="m/s", above=0.0)
    reference_length: ClassVar[float] = 1.0
    samples: ClassVar[int] = 700

    def bodies(self, resolution: int, particles_per_cell: int) -> tuple[Part, ...]:
        h = 1.0 / resolution
        nodes, triangles = ring_mesh(self.radius, max(2, round(self.radius / h)))
        v = (self.speed, self.speed)
        return (
            part_of("lower", nodes + self.centre, triangles, h, particles_per_cell, v),
            part_of(
                "upper",
                (1.0 - self.centre) - nodes,
                triangles,
                h,
                particles_per_cell,
                (-v[0], -v[1]),
            ),
        )

    def domain(self, resolution: int) -> Box:
        h, more = (
            1.0 / resolution,
            2,
        )  # cells around the box, so that splines are whole at the disks
        lower, upper = -more * h, 1.0 + more * h
        return Box((lower, lower), (upper, upper), (resolution + 2 * more,) * 2)

    def quantities(self, solution: Solution, material: Material) -> dict[str, tuple[Any, ...]]:
        out = super().quantities(solution, material)
        time, strain, kinetic = (
            np.array(solution.history[name]) for name in ("time", "strain_energy", "kinetic_energy")
        )
        text = "instant of the largest strain energy"
        out["strain_energy_max_time"] = (float(time[np.argmax(strain)]), "s", text)
        out["kinetic_energy_min"] = (float(kinetic.min()), "J", "smallest kinetic energy")
        return out
