"""Cantilever that falls under suddenly applied gravity: large rotations in plane strain, a standard dynamic test.

A 4 x 1 m beam of neo-Hookean material is clamped at its left end; gravity acts from t = 0. The
vertical displacement of its lower right corner has a first minimum of -3.304 m at 1.0475 s and,
after 2 s, a maximum of +0.042 m at 2.635 s: quadratic total-Lagrangian finite elements on 24 x 6
cells with a time step of 2.5 ms.
"""

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
from mpmbench.core.walls import Wall
from mpmbench.problems import Problem

FIRST_MINIMUM, TIME_OF_MINIMUM = -3.304, 1.0475  # [m], [s]
LATE_MAXIMUM, TIME_OF_MAXIMUM = 0.042, 2.635  # [m], [s]
PUBLISHED = (4.0, 1.0)  # length and height that these hold for [m]


@register("problem", "cantilever_dynamic")
@dataclass(frozen=True)
class CantileverDynamic(Problem):
    """Cantilever falling under suddenly applied gravity, plane strain, with large rotations.

    Newmark's method rings for ever after the acceleration of the particles at t = 0, and remembers it.
    The grid of B-splines ends at the clamp, since only there they interpolate: it needs a wall.
    """

    gravity: float = setting(10.0, "weight per unit mass", unit="m/s2", above=0.0, below=1.0e4)
    initial_acceleration: str = setting(  # type: ignore[misc]
        "zero", "of the particles, for Newmark's method", options=("zero", "gravity")
    )
    particle_layout: str = setting(
        "gauss",
        "Gauss points of the cells, or middles of equal sub-cells",
        options=("gauss", "midpoint"),
    )
    behind: str = setting(
        "room",
        "below the clamp the beam may swing behind it, or meets a smooth wall that lets go",
        options=("room", "wall"),
    )
    length: float = setting(4.0, "of the beam", unit="m", above=0.0, most=1e3)
    height: float = setting(1.0, "of the beam", unit="m", above=0.0, most=1e3)
    dimension: ClassVar[int] = 2
    bends: ClassVar[bool] = True
    samples: ClassVar[int] = 1200

    @property
    def reference_length(self) -> float:  # type: ignore[override]
        return self.length

    @property
    def has_reference(self) -> bool:
        """Whether the values of other codes hold for this beam."""
        return self.behind == "room" and (self.length, self.height) == PUBLISHED

    def check(self, material: Material, choices: Choices, basis: str, resolution: int) -> None:
        self._beam(resolution)
        if not choices.dynamic:
            raise NotApplicable(
                "cantilever_dynamic is a dynamic problem: it needs method.time=newmark or explicit"
            )
        if basis == "bspline" and not choices.on_body and self.behind == "room":
            raise NotApplicable(
                "the clamp of cantilever_dynamic lies inside the background grid, where basis=bspline does not "
                "interpolate: it needs problem.behind=wall or basis=linear"
            )

    # geometry

    def _beam(self, resolution: int) -> Box:
        return divided(self.length, self.height, resolution)

    def nodes(self, resolution: int, choices: Choices) -> Box:
        beam = self._beam(resolution)
        if choices.on_body:
            return beam
        # room for a beam that swings to and fro, where nodes stay
        across = beam.cells[1]
        left, right, below, above = resolution, across, resolution + across, 2 * across
        if self.behind == "wall":  # the beam turns there and hangs lower
            left, below = 0, 2 * below
        h = self.reference_length / resolution
        return Box(
            (-left * h, -below * h),
            (self.reference_length + right * h, self.height + above * h),
            (left + resolution + right, across + below + above),
        )

    def seed(self, resolution: int, particles_per_cell: int) -> tuple[np.ndarray, np.ndarray]:
        return seed_cells(self._beam(resolution), particles_per_cell, self.particle_layout)

    def tracers(self) -> np.ndarray:
        """The lower right corner."""
        return np.array([[self.reference_length, 0.0]])

    # initial and boundary conditions

    def prepare(self, particles: Any, material: Material) -> None:
        if self.initial_acceleration == "gravity":
            particles.a[:, 1] = -self.gravity

    def fixed(self, x: np.ndarray) -> np.ndarray:
        """The clamp, and nodes behind it; below it the beam may swing to the left."""
        slack = 1e-9 * self.reference_length
        clamp = (x[:, 0] < slack) & (x[:, 1] > -slack) & (x[:, 1] < self.height + slack)
        return np.repeat(clamp[:, None], 2, axis=1)

    def loads(self, material: Material) -> Loads:
        def weight(X: np.ndarray, t: float, b: np.ndarray) -> None:
            b[:, 0], b[:, 1] = 0.0, -self.gravity

        walls = (Wall((0.0, 0.0), (1.0, 0.0)),) if self.behind == "wall" else ()
        return Loads(body_force=weight, walls=walls)

    # quantities of interest

    def observe(self, state: State) -> dict[str, Any]:
        """Displacement of the corner [m]."""
        return {"tip_displacement": state.particles.x[-1] - state.particles.X[-1]}

    def quantities(self, solution: Solution, material: Material) -> dict[str, tuple[Any, str, str]]:
        time, tip = (
            np.array(solution.history["time"]),
            np.array(solution.history["tip_displacement"])[:, 1],
        )
        out: dict[str, tuple[Any, str, str]] = {
            "tip_displacement": (tip, "m", "vertical displacement of the lower right corner")
        }
        if time[-1] > 1.5 and self.has_reference:
            i = int(np.argmin(np.where(time < 1.5, tip, np.inf)))
            out["first_minimum"] = (tip[i], "m", "first minimum of tip_displacement")
            out["time_of_first_minimum"] = (time[i], "s", "time of the first minimum")
            out["error_first_minimum"] = (
                abs(tip[i] / FIRST_MINIMUM - 1.0),
                "1",
                "relative error of the first minimum",
            )
            out["lag_of_first_minimum"] = (
                time[i] - TIME_OF_MINIMUM,
                "s",
                "delay of the first minimum",
            )
        if time[-1] > 2.9 and self.has_reference:
            i = int(np.argmax(np.where(time > 2.0, tip, -np.inf)))
            out["late_maximum"] = (tip[i], "m", "maximum of tip_displacement after 2 s")
            out["time_of_late_maximum"] = (time[i], "s", "time of that maximum")
            out["lag_of_late_maximum"] = (time[i] - TIME_OF_MAXIMUM, "s", "delay of that maximum")
        return out
