"""A free block that is translated, falls or turns: nothing strains it, whatever the method.

``x = X + v t``, ``x = X + v t + g t^2 / 2`` or ``x = c + Q(t) (X - c)``, the last with the force that
holds a turning point on its circle, ``b = -omega^2 (x - c)``, so that no stress has to. Translation and
free fall are exact for any time step, and wherever particles meet the edges of cells, those of a
layout on the nodes from the start. With a `stretch` the block vibrates: momentum and energy are
known, not more.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from mpmbench.core.choices import Choices
from mpmbench.core.errors import NotApplicable, require
from mpmbench.core.geometry import Box, tensor_points
from mpmbench.core.materials import Material
from mpmbench.core.particles import per_axis, seed_cells
from mpmbench.core.registry import register
from mpmbench.core.setting import setting
from mpmbench.core.state import Loads
from mpmbench.problems import Fields, Problem

DIRECTION = np.array([1.0, 0.5, 0.25])  # of velocity and gravity along the axes


@register("problem", "rigid_motion")
@dataclass(frozen=True)
class RigidMotion(Problem):
    """Rigid motion of a free block: translation, free fall and rotation are known exactly."""

    motion: str = setting(
        "translation",
        "what the block does; a rotation is about the third axis",
        options=("translation", "fall", "rotation"),
    )
    velocity_amplitude: float = setting(
        1.0,
        "along the first axis, half and a quarter along the others; 0 in a rotation",
        unit="m/s",
    )
    gravity: float = setting(
        -2.0, "weight per unit mass in a fall, along the same direction", unit="m/s2"
    )
    angular_velocity: float = setting(1.0, "of a rotation", unit="rad/s")
    stretch: float = setting(
        0.0, "rate at which the block is stretched at the start, which strains it", unit="1/s"
    )
    particle_layout: str = setting(
        "midpoint",
        "middles of equal sub-cells, Gauss points, or the corners of sub-cells",
        options=("midpoint", "gauss", "nodes"),
    )
    dimension: int = setting(  # type: ignore[misc]
        2, "of the block", unit="-", least=1, most=3
    )
    side: float = setting(1.0, "of the block", unit="m", above=0.0)
    initial_acceleration: ClassVar[str] = "balance"

    def check_together(self) -> None:
        require(
            self.dimension > 1 or self.motion != "rotation",
            "motion",
            self.motion,
            "translation or fall in one dimension",
        )

    def check(self, material: Material, choices: Choices, basis: str, resolution: int) -> None:
        if not choices.dynamic:
            raise NotApplicable(
                "rigid_motion is a dynamic problem: it needs method.time=explicit, newmark or sph"
            )

    @property
    def reference_length(self) -> float:  # type: ignore[override]
        return self.side

    @property
    def bends(self) -> bool:  # type: ignore[override]
        """A rotation turns lines away from the axes."""
        return self.motion == "rotation"

    # geometry

    @property
    def _direction(self) -> np.ndarray:
        return DIRECTION[: self.dimension]

    def _block(self, resolution: int) -> Box:
        upper, cells = (self.side,) * self.dimension, (resolution,) * self.dimension
        return Box((0.0,) * self.dimension, upper, cells)

    def nodes(self, resolution: int, choices: Choices) -> Box:
        if choices.on_body:
            return self._block(resolution)
        cells = (3 * resolution,) * self.dimension  # room to move for one length of the block
        lower, upper = ((end * self.side,) * self.dimension for end in (-1.0, 2.0))
        return Box(lower, upper, cells)

    def seed(self, resolution: int, particles_per_cell: int) -> tuple[np.ndarray, np.ndarray]:
        if self.particle_layout != "nodes":
            return seed_cells(self._block(resolution), particles_per_cell, self.particle_layout)
        cells = resolution * per_axis(particles_per_cell, self.dimension)
        share = np.full(cells + 1, self.side / cells)  # those on the surface have half a cell
        share[[0, -1]] *= 0.5
        X = tensor_points([np.linspace(0.0, self.side, cells + 1)] * self.dimension)
        return X, np.prod(tensor_points([share] * self.dimension), axis=1)

    # initial condition and loads

    def velocity(self, X: np.ndarray, material: Material) -> np.ndarray:
        return self._rigid(X, 0.0)["velocity"] + self.stretch * (X - 0.5 * self.side)

    def loads(self, material: Material) -> Loads:
        if self.motion == "translation":
            return Loads()

        def force(X: np.ndarray, t: float, b: np.ndarray) -> None:
            if self.motion == "fall":
                b[:] = self.gravity * self._direction
            else:
                b[:] = 0.0
                b[:, :2] = -(self.angular_velocity**2) * self._turned(X, t)

        return Loads(body_force=force)

    # exact solution

    def exact(self, X: np.ndarray, t: float, material: Material) -> Fields:
        return self._rigid(X, t) if self.stretch == 0.0 else {}

    def _rigid(self, X: np.ndarray, t: float) -> Fields:
        u, v = np.zeros_like(X), np.zeros_like(X)
        if self.motion == "rotation":
            arm = self._turned(X, t)
            u[:, :2] = arm - (X[:, :2] - 0.5 * self.side)
            v[:, :2] = self.angular_velocity * np.stack([-arm[:, 1], arm[:, 0]], axis=1)
        else:
            v0, g = self.velocity_amplitude, self.gravity if self.motion == "fall" else 0.0
            u[:] = (v0 * t + 0.5 * g * t**2) * self._direction
            v[:] = (v0 + g * t) * self._direction
        return {"displacement": u, "velocity": v, "stress": np.zeros((*X.shape, self.dimension))}

    def _turned(self, X: np.ndarray, t: float) -> np.ndarray:
        """Arms from the middle in the plane of the rotation [m], shape (n, 2)."""
        angle = self.angular_velocity * t
        c, s = np.cos(angle), np.sin(angle)
        return np.asarray((X[:, :2] - 0.5 * self.side) @ np.array([[c, s], [-s, c]]))
