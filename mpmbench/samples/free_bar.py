"""A problem: the first axial mode of a bar with free ends.

``u = v_0/omega cos(pi X/l) sin(omega t)`` with ``omega = pi c/l`` and c^2 = (lambda + 2 mu)/rho, on
0 <= X <= l = 1 m.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from mpmbench import Box, Choices, Fields, Material, Problem, register, seed_cells, setting


@register("problem", "free_bar")
@dataclass(frozen=True)
class FreeBar(Problem):
    """First axial mode of a bar with free ends."""

    velocity_amplitude: float = setting(0.1, "v_0 at the ends", unit="m/s")
    dimension: ClassVar[int] = 1
    reference_length: ClassVar[float] = 1.0

    def nodes(self, resolution: int, choices: Choices) -> Box:
        h = 1.0 / resolution
        room = 0 if choices.moving or choices.frozen else 2
        return Box((-room * h,), (1.0 + room * h,), (resolution + 2 * room,))

    def seed(self, resolution: int, particles_per_cell: int) -> tuple[np.ndarray, np.ndarray]:
        return seed_cells(Box((0.0,), (1.0,), (resolution,)), particles_per_cell)

    def velocity(self, X: np.ndarray, material: Material) -> np.ndarray:
        return self.velocity_amplitude * np.cos(np.pi * X)

    def exact(self, X: np.ndarray, t: float, material: Material) -> Fields:
        lame, shear = material.lame_parameters()
        omega = np.pi * np.sqrt((lame + 2.0 * shear) / material.density)
        amplitude = self.velocity_amplitude / omega
        return {"displacement": amplitude * np.cos(np.pi * X) * np.sin(omega * t)}
