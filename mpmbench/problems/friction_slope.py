"""A block on an inclined plane with Coulomb friction: it slides as a rigid one would, or sticks.

Axes are turned with the plane, y = 0. The weight rises from 0 to g within the rise time T, as
``r(t) = (1 - cos(pi t/T))/2``, so that the block hardly bounces; it then slides by

    x(t) = g (sin theta - mu cos theta) R(t),   R'' = r,   R(0) = R'(0) = 0,

and stays where it is if mu is at least tan theta, but for its elastic shear.
"""

import math
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

ROOM = 2  # cells of grid behind, in front of and above the block where it may get


@register("problem", "friction_slope")
@dataclass(frozen=True)
class FrictionSlope(Problem):
    """Block on an inclined plane with Coulomb friction; closed form, plane strain."""

    angle: float = setting(24.0, "of the plane", unit="degrees", least=0.0, below=90.0)
    friction_angle: float = setting(
        15.0, "whose tangent is the coefficient of friction", unit="degrees", least=0.0, below=90.0
    )
    gravity: float = setting(9.81, "weight per unit mass", unit="m/s2", above=0.0, below=1.0e4)
    rise_time: float = setting(
        0.1, "in which the weight rises to its full value", unit="s", least=0.0
    )
    travel: float = setting(0.25, "length of plane in front of the block", unit="m", least=0.0)
    particle_layout: str = setting(
        "gauss",
        "Gauss points of the cells, or middles of equal sub-cells",
        options=("gauss", "midpoint"),
    )
    length: float = setting(0.1, "of the block", unit="m", above=0.0, most=1e3)
    height: float = setting(0.05, "of the block", unit="m", above=0.0, most=1e3)
    dimension: ClassVar[int] = 2

    @property
    def reference_length(self) -> float:  # type: ignore[override]
        return self.length

    def check(self, material: Material, choices: Choices, basis: str, resolution: int) -> None:
        self._block(resolution)
        if not choices.dynamic:
            raise NotApplicable(
                "friction_slope is a dynamic problem: it needs method.time=explicit or newmark"
            )

    # geometry

    def _block(self, resolution: int) -> Box:
        return divided(self.length, self.height, resolution)

    def nodes(self, resolution: int, choices: Choices) -> Box:
        if choices.on_body:
            return self._block(resolution)
        h = self.reference_length / resolution
        along = resolution + ROOM + math.ceil(self.travel / h)
        up = self._block(resolution).cells[1] + ROOM
        return Box((-ROOM * h, 0.0), (along * h, up * h), (along + ROOM, up))

    def seed(self, resolution: int, particles_per_cell: int) -> tuple[np.ndarray, np.ndarray]:
        return seed_cells(self._block(resolution), particles_per_cell, self.particle_layout)

    # loads

    @property
    def friction(self) -> float:
        """Coefficient of friction [-]."""
        return math.tan(math.radians(self.friction_angle))

    def loads(self, material: Material) -> Loads:
        theta = math.radians(self.angle)

        def weight(X: np.ndarray, t: float, b: np.ndarray) -> None:
            risen = (
                0.5 * (1.0 - math.cos(math.pi * t / self.rise_time)) if t < self.rise_time else 1.0
            )
            b[:, 0] = risen * self.gravity * math.sin(theta)
            b[:, 1] = -risen * self.gravity * math.cos(theta)

        return Loads(body_force=weight, walls=(Wall((0.0, 0.0), (0.0, 1.0), self.friction),))

    # exact solution of the centre

    def travelled(self, t: np.ndarray) -> np.ndarray:
        """Displacement of a rigid block along the plane [m], shape as `t`."""
        theta, rise = math.radians(self.angle), self.rise_time
        early, late = np.minimum(t, rise), np.maximum(t - rise, 0.0)
        swing = 0.0 if rise == 0.0 else (rise / math.pi) ** 2 * (1.0 - np.cos(np.pi * early / rise))
        distance = 0.25 * early**2 - 0.5 * swing + 0.5 * rise * late + 0.5 * late**2
        drive = math.sin(theta) - self.friction * math.cos(theta)
        return np.asarray(self.gravity * max(drive, 0.0) * distance)

    # quantities of interest

    def observe(self, state: State) -> dict[str, Any]:
        """Displacement of the centre of mass [m]."""
        p = state.particles
        return {"centre_displacement": p.m @ (p.x - p.X) / p.m.sum()}

    def quantities(self, solution: Solution, material: Material) -> dict[str, tuple[Any, str, str]]:
        time = np.array(solution.history["time"])
        moved = np.array(solution.history["centre_displacement"])
        exact = self.travelled(time)
        error = moved[:, 0] - exact
        out: dict[str, tuple[Any, str, str]] = {
            "slide": (moved[:, 0], "m", "displacement of the centre of mass along the plane"),
            "slide_exact": (exact, "m", "displacement of a rigid block along the plane"),
            "rise": (moved[:, 1], "m", "displacement of the centre of mass away from the plane"),
            "error_slide_rms": (
                float(np.sqrt(np.mean(error**2))),
                "m",
                "root mean square error of the displacement along the plane",
            ),
        }
        if exact[-1] > 0.0:
            text = "error of the displacement at the end over the exact one"
            out["error_end_relative"] = (float(error[-1] / exact[-1]), "1", text)
        return out
