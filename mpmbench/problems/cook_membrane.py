"""Cook's membrane (Cook 1974) at finite strain and nearly constant volume, where methods lock.

A panel with corners (0, 0), (48, 44), (48, 60) and (0, 44) mm in plane strain is clamped at its left
edge; a dead load of 6.25 N/mm^2 acts upwards on its right edge, 100 N per mm of thickness. With
mu = 80.1938 N/mm^2 and nu = 0.4999 a neo-Hookean panel rises by 6.90 mm in the middle of that edge,
(48, 52) mm, and by 6.85 mm at its upper corner (biquadratic elements, 32 along an edge: 6.896 and
6.852); values in the literature often mix both points, and the linear ones are larger (7.64 and
7.97). At nu = 0.3 the panel rises by 8.89 and 8.69 mm. The corner (0, 44) is singular: no order is to
be expected. A method locks when the middle rises by less than 90 % of the reference on 16 cells;
``method.volumetric=f_bar`` is against it. Time is the load factor.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from mpmbench.core.choices import Choices
from mpmbench.core.errors import NotApplicable
from mpmbench.core.geometry import Box, Cloud, Geometry
from mpmbench.core.materials import Material
from mpmbench.core.materials.elastic.neo_hookean import NeoHookean
from mpmbench.core.particles import seed_cells
from mpmbench.core.registry import register
from mpmbench.core.setting import setting
from mpmbench.core.simulation import Solution
from mpmbench.core.state import Loads, State
from mpmbench.problems import Problem

WIDTH, LEFT, RIGHT, TOP = 0.048, 0.044, 0.016, 0.060  # [m]: width, both edges, highest point
ROOM = 0.2  # of grid above the panel, in its heights; one cell is below
LOADED = 96  # points that share the load: each of 8, 16, 32 cells has as many
SHEAR, TRACTION = 80.1938e6, 6.25e6  # [Pa]
# rise of middle and corner of a panel of that width [m] by Poisson's ratio
CONVERGED = {0.4999: (6.90e-3, 6.85e-3), 0.3: (8.89e-3, 8.69e-3)}


@register("problem", "cook_membrane")
@dataclass(frozen=True)
class CookMembrane(Problem):
    """Cook's membrane at finite strain, nearly incompressible, plane strain: volumetric locking."""

    traction: float = setting(
        6.25e6, "dead load on the right edge, upwards", unit="Pa", above=0.0, below=1.0e12
    )
    width: float = setting(
        0.048, "of the panel, whose other sizes are in proportion", unit="m", above=0.0, below=1e3
    )
    load_steps: int = setting(
        5, "equal steps in which the load is applied", unit="-", least=1, most=10000
    )
    dimension: ClassVar[int] = 2
    bends: ClassVar[bool] = True
    initial_acceleration: ClassVar[str] = "zero"

    @property
    def reference_length(self) -> float:  # type: ignore[override]
        """The width of the panel."""
        return self.width

    def check(self, material: Material, choices: Choices, basis: str, resolution: int) -> None:
        if choices.dynamic or not choices.implicit:
            raise NotApplicable("cook_membrane is a static problem: it needs method.time=static")

    # geometry

    @property
    def _scale(self) -> float:
        """The panel over that of Cook."""
        return self.width / WIDTH

    def nodes(self, resolution: int, choices: Choices) -> Geometry:
        """A bent grid of `resolution` cells along both edges, or a background grid of such cells."""
        n, h = resolution, self.width / resolution
        if not choices.moving:
            above = int(np.ceil((1.0 + ROOM) * (self._scale * TOP) / h))
            return Box((0.0, -h), (self.width + h, above * h), (n + 1, above + 1))
        nodes = self._scale * _bent(Box((0.0, 0.0), (1.0, 1.0), (n, n)).points)
        grid = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
        a, b = grid[:-1, :-1].ravel(), grid[:-1, 1:].ravel()
        c, d = grid[1:, :-1].ravel(), grid[1:, 1:].ravel()
        triangles = np.concatenate([np.stack([a, c, d], axis=1), np.stack([a, d, b], axis=1)])
        return Cloud(nodes, triangles, h, (n, n))

    def seed(self, resolution: int, particles_per_cell: int) -> tuple[np.ndarray, np.ndarray]:
        """Gauss points of the bent cells."""
        square = Box((0.0, 0.0), (1.0, 1.0), (resolution, resolution))
        s, weight = seed_cells(square, particles_per_cell, "gauss")
        return self._scale * _bent(s), self._scale**2 * (weight * WIDTH * _height(s[:, 0]))

    def tracers(self) -> np.ndarray:
        """The points with the load, then middle and upper corner of the right edge."""
        along = np.append((np.arange(LOADED) + 0.5) / LOADED, [0.5, 1.0])
        return self._scale * _bent(np.stack([np.ones_like(along), along], axis=1))

    # boundary conditions

    def fixed(self, x: np.ndarray) -> np.ndarray:
        return np.repeat(x[:, :1] < 1e-9 * self.width, 2, axis=1)

    def loads(self, material: Material) -> Loads:
        def traction(t: float) -> np.ndarray:
            load = np.array([0.0, self.traction * t * (self._scale * RIGHT) / LOADED])
            return np.broadcast_to(load, (LOADED, 2))

        return Loads(traction=traction)

    def adaptive_step(self, state: State) -> Callable[[State], float]:
        """One load step in units of time, the load factor."""
        return lambda _: 1.0 / self.load_steps

    # quantities of interest

    def quantities(self, solution: Solution, material: Material) -> dict[str, tuple[Any, str, str]]:
        if solution.status != "ok":
            return {}
        rise = (solution.snapshots[-1]["x"] - solution.snapshots[0]["x"])[-2:, 1]
        out: dict[str, tuple[Any, str, str]] = {
            "middle_deflection": (float(rise[0]), "m", "rise of the middle of the right edge"),
            "corner_deflection": (float(rise[1]), "m", "rise of its upper corner"),
        }
        lame, shear = material.lame_parameters()
        ratio = round(0.5 * lame / (lame + shear), 6)
        published = abs(shear / SHEAR - 1.0) < 1e-4 and self.traction == TRACTION
        if isinstance(material, NeoHookean) and published and ratio in CONVERGED:
            share = float(rise[0]) / (self._scale * CONVERGED[ratio][0])
            text = "rise of the middle over the converged one; below 0.9 on 16 cells it locks"
            out["middle_over_reference"] = (share, "1", text)
        return out


def _height(s: np.ndarray) -> np.ndarray:
    """Height of the panel [m] at the share s of its width."""
    return LEFT + (RIGHT - LEFT) * s


def _bent(s: np.ndarray) -> np.ndarray:
    """Places in the panel [m] of points of the unit square, shape (n, 2); a bilinear map."""
    return np.stack([WIDTH * s[:, 0], LEFT * s[:, 0] + s[:, 1] * _height(s[:, 0])], axis=1)
