"""A slotted disk that turns (Zalesak 1979), as a test of what transfers do to rotation.

``motion=spin``: a free elastic disk spins about its own centre of mass, x = Q(omega t) X. Methods that
conserve angular momentum go on turning. Centrifugal force opens the slot, whose halves hang on a bridge
of a third of the radius: the body turns more slowly than a rigid one, by 0.15 rad after 0.3 turns in
finite elements, and keeps a `shape_residual` of 3 mm. With ``centripetal_force`` each point is held
on its circle by b = -omega^2 Q X, nothing has to strain, and the error is that of the method alone.

``motion=advection``: all nodal velocities are prescribed, v_i = omega k x x_i, with the disk `offset`
away from the axis. Transfers do not matter, only the update of positions and of F does: a forward
step of size dt leads outwards by the factor sqrt(1 + (omega dt)^2).

The axis is the origin in both.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from mpmbench.core.choices import Choices
from mpmbench.core.errors import NotApplicable, require
from mpmbench.core.geometry import Box, Cloud, Geometry
from mpmbench.core.materials import Material
from mpmbench.core.particles import seed_cells
from mpmbench.core.registry import register
from mpmbench.core.setting import setting
from mpmbench.core.simulation import Solution
from mpmbench.core.stability import wave_speed
from mpmbench.core.state import Loads, State
from mpmbench.problems import Fields, Problem

ROOM = {"spin": 0.5, "advection": 2.0 / 3.0}  # of the square grid beside the disk, in radii
COURANT, IMPLICIT = 0.4, 4.0


@register("problem", "zalesak_rotation")
@dataclass(frozen=True)
class ZalesakRotation(Problem):
    """Rotating slotted disk, Zalesak 1979: a free one that spins, or with all nodal velocities prescribed."""

    motion: str = setting(
        "spin",
        "a free disk about its centre of mass, or prescribed velocities about an axis outside",
        options=("spin", "advection"),
    )
    angular_velocity: float = setting(
        6.283185307179586, "omega, one turn per second", unit="rad/s", above=0.0, below=1e3
    )
    centripetal_force: bool = setting(
        False, "points of the spinning disk are held on their circles: rigid rotation is exact"
    )
    radius: float = setting(0.15, "of the disk", unit="m", above=0.0)
    slot_width: float = setting(0.05, "of the slot, which is cut from below", unit="m", above=0.0)
    slot_depth: float = setting(
        0.25, "of the slot, from the lowest point of the disk", unit="m", above=0.0
    )
    offset: float = setting(
        0.25, "of the disk from the axis of prescribed velocities", unit="m", least=0.0
    )
    dimension: ClassVar[int] = 2
    bends: ClassVar[bool] = True

    @property
    def reference_length(self) -> float:  # type: ignore[override]
        return self.radius

    def check_together(self) -> None:
        for name in ("slot_width", "slot_depth"):
            size, most = getattr(self, name), 2.0 * self.radius
            require(size < most, name, size, f"less than {most:g} (the diameter)")

    def check(self, material: Material, choices: Choices, basis: str, resolution: int) -> None:
        least = math.ceil(2.0 * self.radius / self.slot_width - 1e-9)
        allowed = f"at least {least} (two cells across the slot)"
        require(resolution >= least, "resolution", resolution, allowed)
        if not choices.dynamic:
            raise NotApplicable(
                "zalesak_rotation is a dynamic problem: it needs method.time=explicit or newmark"
            )
        if self.motion == "advection" and (choices.implicit or choices.frozen):
            raise NotApplicable(
                "problem.motion=advection prescribes velocities at fixed places: "
                "it needs method.time=explicit and updated functions"
            )

    def check_particles(self, particles_per_cell: int) -> None:
        """The centre of mass is that of these particles."""
        require(particles_per_cell == 4, "particles_per_cell", particles_per_cell, "4")

    # geometry

    def _seeds(self, resolution: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Particles of cells of R/resolution with their volumes, and where the disk's own centre is."""
        R = self.radius
        X, V0 = seed_cells(Box((-R, -R), (R, R), (2 * resolution, 2 * resolution)), 4)
        slot = (np.abs(X[:, 0]) < 0.5 * self.slot_width) & (X[:, 1] < self.slot_depth - R)
        inside = (np.hypot(*X.T) < R) & ~slot
        X, V0 = X[inside], V0[inside]
        centre = -X.mean(axis=0) if self.motion == "spin" else np.array([0.0, self.offset])
        return X, V0, centre

    def seed(self, resolution: int, particles_per_cell: int) -> tuple[np.ndarray, np.ndarray]:
        X, V0, centre = self._seeds(resolution)
        return X + centre, V0

    def nodes(self, resolution: int, choices: Choices) -> Geometry:
        h = self.radius / resolution
        if choices.moving:
            X, _, centre = self._seeds(resolution)
            corners, triangles = split_cells(X + self.radius, h)
            return Cloud(corners - self.radius + centre, triangles, h)
        away = self.offset if self.motion == "advection" else 0.0
        along = math.ceil((away + (1.0 + ROOM[self.motion]) * self.radius) / h - 1e-9)
        return Box((-along * h,) * 2, (along * h,) * 2, (2 * along,) * 2)

    # initial condition and prescribed motion

    def velocity(self, X: np.ndarray, material: Material) -> np.ndarray:
        return self.angular_velocity * np.stack([-X[:, 1], X[:, 0]], axis=1)

    def fixed(self, x: np.ndarray) -> np.ndarray:
        return np.full(x.shape, self.motion == "advection")

    def loads(self, material: Material) -> Loads:
        def force(X: np.ndarray, t: float, b: np.ndarray) -> None:
            np.matmul(X, -(self.angular_velocity**2) * turned(self.angular_velocity * t).T, out=b)

        if self.motion == "spin":
            return Loads(body_force=force if self.centripetal_force else None)

        def travelled(X: np.ndarray, t: float) -> np.ndarray:
            """Way of a constant velocity, that of a place: nodes of a grid stay."""
            return t * self.velocity(X, material)

        return Loads(prescribed_motion=travelled)

    def adaptive_step(self, state: State) -> Callable[[State], float] | None:
        """The same step always: 0.4 of the time in which a wave crosses a cell, ten times that in implicit methods."""
        assert state.geometry is not None
        courant = IMPLICIT if state.choices.implicit else COURANT
        wave = wave_speed(state.material)
        bound = courant * state.geometry.nodal_spacing / wave
        turn = 2.0 * math.pi / self.angular_velocity
        step = turn / math.ceil(turn / bound)
        return lambda _: step

    # exact solution

    def exact(self, X: np.ndarray, t: float, material: Material) -> Fields:
        """Rigid rotation."""
        Q = turned(self.angular_velocity * t)
        return {
            "displacement": X @ Q.T - X,
            "velocity": self.velocity(X @ Q.T, material),
        }

    # quantities of interest

    def quantities(self, solution: Solution, material: Material) -> dict[str, tuple[Any, str, str]]:
        history = {name: np.array(values) for name, values in solution.history.items()}
        first, last = solution.snapshots[0]["x"], solution.snapshots[-1]["x"]
        angle, residual = best_rotation(first, last)
        exact = self.angular_velocity * solution.snapshots[-1]["time"]
        lag = math.remainder(exact - angle, 2.0 * math.pi)
        spin, energy = history["angular_momentum"][:, 2], history["kinetic_energy"]
        kept = "at the end over that at the start"
        return {
            "angular_momentum_kept": (float(spin[-1] / spin[0]), "1", f"angular momentum {kept}"),
            "kinetic_energy_kept": (float(energy[-1] / energy[0]), "1", f"kinetic energy {kept}"),
            "lag_of_angle": (lag, "rad", "angle behind the exact one, within half a turn"),
            "shape_residual": (
                residual,
                "m",
                "root mean square distance from the best rigid motion",
            ),
        }


def split_cells(X: np.ndarray, h: float) -> tuple[np.ndarray, np.ndarray]:
    """Corners [m] and triangles of the cells of size h [m] that hold particles at X, 2 x 2 in full cells.

    Either diagonal passes through two of four particles. The cut is such that all are in triangles
    with one inside: in another one a corner without mass would be strained.
    """
    sub = np.floor(2.0 * X / h + 1e-9).astype(np.int64)
    cells, number = np.unique(sub // 2, axis=0, return_inverse=True)
    held = np.zeros((len(cells), 2, 2), dtype=bool)
    held[number.ravel(), *(sub % 2).T] = True
    rising = held[:, 1, 0] | held[:, 0, 1]  # a diagonal with particles beside it
    rising &= ~(held.all(axis=(1, 2)) & (cells.sum(axis=1) % 2 == 1))
    steps = ((0, 0), (1, 0), (0, 1), (1, 1))
    corners, number = np.unique(
        np.concatenate([cells + step for step in steps]), axis=0, return_inverse=True
    )
    a, b, c, d = number.reshape(4, -1)
    triangles = np.concatenate(
        [
            np.stack(nodes, axis=1)[cut & held[:, *inside]]
            for cut, inside, nodes in (
                (rising, (1, 0), (a, b, d)),
                (rising, (0, 1), (a, d, c)),
                (~rising, (0, 0), (a, b, c)),
                (~rising, (1, 1), (b, d, c)),
            )
        ]
    )
    used, triangles = np.unique(triangles, return_inverse=True)
    return h * corners[used], triangles.reshape(-1, 3)


def turned(angle: float) -> np.ndarray:
    """Matrix of a rotation by an angle [rad], shape (2, 2)."""
    return np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])


def best_rotation(X: np.ndarray, x: np.ndarray) -> tuple[float, float]:
    """Angle [rad] of the rotation and translation that take X nearest to x, and what is left [m]."""
    A, a = X - X.mean(axis=0), x - x.mean(axis=0)
    angle = math.atan2(float(np.sum(A[:, 0] * a[:, 1] - A[:, 1] * a[:, 0])), float(np.sum(A * a)))
    return angle, float(np.sqrt(np.mean(np.sum((a - A @ turned(angle).T) ** 2, axis=1))))
