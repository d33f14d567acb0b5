"""What columns that collapse on a floor share: a smooth wall behind them, and the front that runs out.

A problem derives from `Collapse` and gives the column's `width` and `height`, the `length` of the
grid and the friction of the floor.
"""

from typing import Any, ClassVar

import numpy as np

from mpmbench.core.choices import Choices
from mpmbench.core.errors import NotApplicable
from mpmbench.core.geometry import Box, divided
from mpmbench.core.materials import Material
from mpmbench.core.particles import seed_cells
from mpmbench.core.simulation import Solution
from mpmbench.core.state import Loads, State
from mpmbench.core.walls import Wall
from mpmbench.problems import Problem

ABOVE = 0.25  # of grid above the column, in its heights
FRONT = 0.995  # share of the mass behind `front`: single particles fly ahead


class Collapse(Problem):
    """A column of `width` and `height` [m] on a floor that a grid shows for `length` [m].

    Attributes
    ----------
    width, height, length : float
    gravity : float
        Weight per unit mass [m/s2], from t = 0 on.
    """

    width: float
    height: float
    length: float
    gravity: float
    dimension: ClassVar[int] = 2
    bends: ClassVar[bool] = True

    @property
    def reference_length(self) -> float:  # type: ignore[override]
        return self.width

    def check(self, material: Material, choices: Choices, basis: str, resolution: int) -> None:
        self._column(resolution)
        if choices.implicit or not choices.dynamic:
            raise NotApplicable("a column that collapses needs method.time=explicit")

    # geometry

    def _column(self, resolution: int) -> Box:
        return divided(self.width, self.height, resolution)

    def nodes(self, resolution: int, choices: Choices) -> Box:
        if choices.on_body:
            return self._column(resolution)
        h = self.width / resolution
        along = round(self.length / h)
        up = round(self.height / h + np.ceil(ABOVE * self.height / h))
        return Box((0.0, 0.0), (along * h, up * h), (along, up))

    def seed(self, resolution: int, particles_per_cell: int) -> tuple[np.ndarray, np.ndarray]:
        return seed_cells(self._column(resolution), particles_per_cell)

    # boundary conditions

    def floor_friction(self, material: Material) -> float:
        """Coefficient of Coulomb friction on the floor [-]."""
        raise NotImplementedError

    def fixed(self, x: np.ndarray) -> np.ndarray:
        """The smooth wall: no node at a corner touches two walls that let go."""
        wall = x[:, 0] < 1e-9 * self.width
        return np.stack([wall, np.zeros_like(wall)], axis=1)

    def loads(self, material: Material) -> Loads:
        """The weight, and the floor."""

        def weight(X: np.ndarray, t: float, b: np.ndarray) -> None:
            b[:, 0], b[:, 1] = 0.0, -self.gravity

        floor = Wall((0.0, 0.0), (0.0, 1.0), self.floor_friction(material))
        return Loads(body_force=weight, walls=(floor,))

    # quantities of interest

    def observe(self, state: State) -> dict[str, Any]:
        """Where the front is and how high the column stands [m], with half a particle's width."""
        p = state.particles
        x, m = p.x[p.material], p.m[p.material]
        half = 0.5 * float(np.sqrt(p.V0[p.material].min()))
        order = np.argsort(x[:, 0])
        passed = np.searchsorted(np.cumsum(m[order]), FRONT * m.sum())
        at_wall = x[:, 0] < self.width / 4.0
        return {
            "front": float(x[order[passed], 0]) + half,
            "foremost": float(x[:, 0].max()) + half,
            "height_at_wall": float(x[at_wall, 1].max(initial=-half)) + half,
        }

    def quantities(self, solution: Solution, material: Material) -> dict[str, tuple[Any, str, str]]:
        history = {name: np.array(values) for name, values in solution.history.items()}
        percent = f"{100.0 * FRONT:g} % of the mass"
        return {
            "front": (history["front"], "m", f"place that {percent} has not passed"),
            "foremost": (history["foremost"], "m", "place of the foremost particle"),
            "height_at_wall": (
                history["height_at_wall"],
                "m",
                "highest particle in the quarter of the column's width at the wall",
            ),
        }
