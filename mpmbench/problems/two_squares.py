"""Two squares that collide, head-on or with an offset: what rules of contact capture, lock and lose (Li 2009, 5.2).

Unit squares in plane strain, the first of which flies with the speed v along x_1 at the second one,
which is at rest a few spacings away. Elastic bars of equal length that meet swap their velocities;
squares nearly do, and with an offset they rotate and go on vibrating. Energy and momenta are
conserved, nothing stays inside the other body, and no energy stays locked as strain.
"""

import math
from dataclasses import dataclass

from mpmbench.core.bodies import Part
from mpmbench.core.errors import require
from mpmbench.core.geometry import Box
from mpmbench.core.geometry.triangulate import unit_square
from mpmbench.core.registry import register
from mpmbench.core.setting import setting
from mpmbench.problems.collision import Collision, part_of


@register("problem", "two_squares")
@dataclass(frozen=True)
class TwoSquares(Collision):
    """Two elastic squares that collide, after Li 2009, Sect. 5.2; energy is conserved."""

    speed: float = setting(2.0, "of the first square along x_1", unit="m/s", above=0.0)
    slip: float = setting(0.0, "speed of the first square along x_2", unit="m/s")
    side: float = setting(1.0, "of the squares", unit="m", above=0.0, below=1e3)
    offset: float = setting(0.0, "of the second square along x_2, less than a side", unit="m")
    gap: float = setting(
        0.375, "between the squares at the start", unit="m", least=0.0, below=100.0
    )
    room: float = setting(1.5, "of a grid around the squares", unit="m", above=0.0, below=100.0)
    swapped: bool = setting(False, "the square at rest is the first in the order of bodies")

    @property
    def reference_length(self) -> float:  # type: ignore[override]
        """A side of a square."""
        return self.side

    def check_together(self) -> None:
        sentence = f"a number between {-self.side:g} and {self.side:g}"
        require(abs(self.offset) < self.side, "offset", self.offset, sentence)

    def bodies(self, resolution: int, particles_per_cell: int) -> tuple[Part, ...]:
        nodes, triangles = unit_square(resolution, crossed=False)
        nodes = self.side * nodes
        h = self.side / resolution
        places = ((0.0, 0.0), (self.side + self.gap, self.offset))
        parts = tuple(
            part_of(name, nodes + place, triangles, h, particles_per_cell, velocity)
            for name, place, velocity in zip(
                ("moving", "resting"), places, ((self.speed, self.slip), (0.0, 0.0)), strict=True
            )
        )
        return parts[::-1] if self.swapped else parts

    def domain(self, resolution: int) -> Box:
        h = self.side / resolution
        room = math.ceil(self.room / h)
        left, below = -room, -room + math.floor(min(self.offset, 0.0) / h)
        right = room + math.ceil((2.0 * self.side + self.gap) / h)
        above = room + math.ceil((self.side + max(self.offset, 0.0)) / h)
        cells = (right - left, above - below)
        return Box((left * h, below * h), (right * h, above * h), cells)
