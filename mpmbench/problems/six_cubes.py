"""Six cubes that hit each other at different moments and angles (Li 2009, section 5.2.1, Figs. 5.8 to 5.12).

Unit squares in plane strain of unit thickness, three of which fly at those that are at rest. Each has
145 nodes and 256 particles, the barycentres of a triangulation with four triangles to a cell. With
the density of 7833 kg/m^3 they have the energy 93,996 J, the momentum (0, -31,332) kg m/s and the
angular momentum -78,330 kg m^2/s, all of which are conserved. Nodes stand at corners and in the
middle of cells: the spacing of locality and supports is the distance between these.
"""

import math
from dataclasses import dataclass

from mpmbench.core.bodies import Part
from mpmbench.core.geometry import Box
from mpmbench.core.geometry.triangulate import unit_square
from mpmbench.core.registry import register
from mpmbench.core.setting import setting
from mpmbench.problems.collision import Collision, part_of

CORNERS = ((0.0, 0.0), (3.2, 0.4), (1.4, 0.0), (2.2, 3.0), (1.9, 1.6), (0.2, 1.6))
VELOCITIES = ((2.0, 0.0), (-2.0, 0.0), (0.0, 0.0), (0.0, -4.0), (0.0, 0.0), (0.0, 0.0))
ROOM = 3  # sides of grid around the cubes


@register("problem", "six_cubes")
@dataclass(frozen=True)
class SixCubes(Collision):
    """Six elastic cubes that collide, Li 2009, Sect. 5.2.1; energy and momenta are conserved."""

    reverse: bool = setting(False, "the bodies are named in the opposite order")
    side: float = setting(
        1.0, "of the cubes, whose distances are in proportion", unit="m", above=0.0, below=1e3
    )

    @property
    def reference_length(self) -> float:  # type: ignore[override]
        """A side of a cube."""
        return self.side

    def bodies(self, resolution: int, particles_per_cell: int) -> tuple[Part, ...]:
        nodes, triangles = unit_square(resolution, crossed=True)
        h = self.side / resolution / math.sqrt(2.0)  # from a corner of a cell to its middle
        parts = tuple(
            part_of(
                f"cube {k + 1}",
                self.side * (nodes + corner),
                triangles,
                h,
                particles_per_cell,
                velocity,
            )
            for k, (corner, velocity) in enumerate(zip(CORNERS, VELOCITIES, strict=True))
        )
        return parts[::-1] if self.reverse else parts

    def domain(self, resolution: int) -> Box:
        lower, upper = (-ROOM, -ROOM), (5 + ROOM, 4 + ROOM)
        cells = tuple((b - a) * resolution for a, b in zip(lower, upper, strict=True))
        left, below, right, above = (self.side * place for place in (*lower, *upper))
        return Box((left, below), (right, above), cells)
