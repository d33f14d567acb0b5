"""Two neo-Hookean rings that fly at each other, flatten and rebound.

Rings of radii 3 and 4 m around (-5, 0) and (5, 0) m, with the velocities 30 and -30 m/s: a tenth of the
speed of waves. By geometry they touch at 1/30 s. Their kinetic energy is 1.979e7 J per metre of
thickness. Single-field methods on scattered points have 0.91e7 (pic) to 1.57e7 J (flip) as the total
energy at 0.2 s, where nothing is lost in fact.
"""

from dataclasses import dataclass

from mpmbench.core.bodies import Part
from mpmbench.core.geometry import Box
from mpmbench.core.geometry.triangulate import annulus
from mpmbench.core.registry import register
from mpmbench.core.setting import setting
from mpmbench.problems.collision import Collision, part_of

INNER, OUTER, CENTRE = 3.0, 4.0, 5.0  # [m]
SIDE, HEIGHT = 12, 7  # of the grid, to each side of the origin [m]


@register("problem", "elastic_rings")
@dataclass(frozen=True)
class ElasticRings(Collision):
    """Two elastic rings that collide and rebound; energy is conserved."""

    speed: float = setting(30.0, "of each ring", unit="m/s", above=0.0)
    radius: float = setting(
        4.0,
        "outer one of each ring; all other sizes are in proportion",
        unit="m",
        above=0.0,
        below=1e3,
    )

    @property
    def reference_length(self) -> float:  # type: ignore[override]
        """The thickness of a ring."""
        return (1.0 - INNER / OUTER) * self.radius

    def bodies(self, resolution: int, particles_per_cell: int) -> tuple[Part, ...]:
        inner, centre = INNER / OUTER * self.radius, CENTRE / OUTER * self.radius
        nodes, triangles = annulus(inner, self.radius, resolution)
        h = self.reference_length / resolution
        left, right = [-centre, 0.0], [centre, 0.0]
        return (
            part_of("left", nodes + left, triangles, h, particles_per_cell, (self.speed, 0.0)),
            part_of("right", right - nodes, triangles, h, particles_per_cell, (-self.speed, 0.0)),
        )

    def domain(self, resolution: int) -> Box:
        cells = (2 * SIDE * resolution, 2 * HEIGHT * resolution)
        side, height = (size / OUTER * self.radius for size in (SIDE, HEIGHT))
        return Box((-side, -height), (side, height), cells)
