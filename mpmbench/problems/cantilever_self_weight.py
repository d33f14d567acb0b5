"""Cantilever under its own weight, large static deflection in plane strain (Iaconeta 2017, section 5.1).

An 8 x 1 m beam of neo-Hookean material is clamped at its left end; gravity is applied in
`load_steps` equal steps, with time from 0 to 1 as the load factor. The deflection at mid-height of
the free end, A = (8, 0.5) m, is compared with the converged value -0.67436 m (Richardson
extrapolation of UL-FEM), not with the linear -0.67806 m of Eq. 62.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from mpmbench.core.choices import Choices
from mpmbench.core.errors import NotApplicable
from mpmbench.core.geometry import Box, divided
from mpmbench.core.materials import Material
from mpmbench.core.particles import seed_cells
from mpmbench.core.registry import register
from mpmbench.core.setting import setting
from mpmbench.core.simulation import Solution
from mpmbench.core.state import Loads, State
from mpmbench.problems import Problem

CONVERGED_DEFLECTION = -0.67436  # [m]
PUBLISHED = (8.0, 1.0)  # length and height that it holds for [m]
# Grid below the beam and beyond its end, in its lengths, for methods whose nodes stay.
ROOM_BELOW, ROOM_BEYOND = 0.1875, 0.0625


@register("problem", "cantilever_self_weight")
@dataclass(frozen=True)
class CantileverSelfWeight(Problem):
    """Static cantilever under its own weight, plane strain, Iaconeta et al. 2017, Sect. 5.1.

    Time is the load factor.
    """

    gravity: float = setting(9.81, "weight per unit mass", unit="m/s2", above=0.0, below=1.0e4)
    load_steps: int = setting(
        1, "equal steps in which gravity is applied", unit="-", least=1, most=10000
    )
    particle_layout: str = setting(
        "gauss",
        "Gauss points of the cells, or middles of equal sub-cells",
        options=("gauss", "midpoint"),
    )
    length: float = setting(8.0, "of the beam", unit="m", above=0.0, most=1e3)
    height: float = setting(1.0, "of the beam", unit="m", above=0.0, most=1e3)
    dimension: ClassVar[int] = 2
    bends: ClassVar[bool] = True
    initial_acceleration: ClassVar[str] = "zero"

    @property
    def reference_length(self) -> float:  # type: ignore[override]
        return self.length

    def check(self, material: Material, choices: Choices, basis: str, resolution: int) -> None:
        self._beam(resolution)
        if choices.dynamic or not choices.implicit:
            raise NotApplicable(
                "cantilever_self_weight is a static problem: it needs method.time=static"
            )

    # geometry

    def _beam(self, resolution: int) -> Box:
        return divided(self.length, self.height, resolution)

    def nodes(self, resolution: int, choices: Choices) -> Box:
        beam = self._beam(resolution)
        if choices.moving or choices.frozen:
            return beam
        room, beyond = (int(np.ceil(part * resolution)) for part in (ROOM_BELOW, ROOM_BEYOND))
        h = self.reference_length / resolution
        return Box(
            (0.0, -room * h),
            (self.reference_length + beyond * h, self.height + h),
            (resolution + beyond, beam.cells[1] + room + 1),
        )

    def seed(self, resolution: int, particles_per_cell: int) -> tuple[np.ndarray, np.ndarray]:
        return seed_cells(self._beam(resolution), particles_per_cell, self.particle_layout)

    def tracers(self) -> np.ndarray:
        """The point A."""
        return np.array([[self.reference_length, 0.5 * self.height]])

    # boundary conditions

    def fixed(self, x: np.ndarray) -> np.ndarray:
        return np.repeat(x[:, :1] < 1e-9 * self.reference_length, 2, axis=1)

    def loads(self, material: Material) -> Loads:
        def weight(X: np.ndarray, t: float, b: np.ndarray) -> None:
            b[:, 0], b[:, 1] = 0.0, -self.gravity * t

        return Loads(body_force=weight)

    def adaptive_step(self, state: State) -> Callable[[State], float]:
        """One load step in units of time, the load factor."""
        return lambda _: 1.0 / self.load_steps

    # quantities of interest

    def quantities(self, solution: Solution, material: Material) -> dict[str, tuple[Any, str, str]]:
        if len(solution.snapshots) < 2:
            return {}
        first, last = solution.snapshots[0]["x"], solution.snapshots[-1]["x"]
        deflection = float(last[-1, 1] - first[-1, 1])
        order = np.argsort(np.linalg.norm(first[:-1] - first[-1], axis=1), kind="stable")
        near = float(np.mean((last - first)[order[:2], 1]))
        found: dict[str, tuple[Any, str, str]] = {
            "tip_deflection": (
                deflection,
                "m",
                "deflection of the tracked point at mid-height of the free end",
            ),
            "tip_deflection_of_particles": (
                near,
                "m",
                "mean deflection of the two particles nearest to that point",
            ),
        }
        if (self.length, self.height) == PUBLISHED:
            error = abs(deflection / CONVERGED_DEFLECTION - 1.0)
            text = "relative error of tip_deflection against the converged value"
            found["error_tip"] = (error, "1", text)
        return found
