"""Collapse of a column of dry grains on a rough floor, plane strain (Lube et al. 2005).

A column of width L and height a L leans on a smooth wall and is released: half of one of 2 L that
runs out to both sides. Lube et al. measured in a channel, whatever the grains,

    (x_front - L)/L = 1.2 a  for a < 1.8,     1.9 a^(2/3)  for a > 2.8,
    H/L = a  for a < 1.15,     1.1 a^(2/5)  for a > 1.15,

and nothing is said of the run-out in between. Constants depend on the material: 25 % is a good
agreement. The grains are Mohr-Coulomb without cohesion, stress-free where they open, and the floor
holds as much as they do, with tan(friction_angle).
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from mpmbench.core.materials import Material
from mpmbench.core.materials.plastic.mohr_coulomb import MohrCoulomb
from mpmbench.core.registry import register
from mpmbench.core.setting import setting
from mpmbench.core.simulation import Solution
from mpmbench.problems.collapse import Collapse

STEEP = 2.5  # floor beyond the column in its widths, for each a and for a^(2/3)


@register("problem", "granular_collapse")
@dataclass(frozen=True)
class GranularCollapse(Collapse):
    """Collapse of a granular column on a rough floor, its run-out against the laws of Lube et al. 2005."""

    aspect: float = setting(1.0, "height over width of the column", unit="-", above=0.0, most=20.0)
    gravity: float = setting(9.81, "weight per unit mass", unit="m/s2", above=0.0, below=1.0e4)
    width: float = setting(0.1, "of the column", unit="m", above=0.0, most=1e3)

    @property
    def height(self) -> float:  # type: ignore[override]
        return self.aspect * self.width

    @property
    def length(self) -> float:  # type: ignore[override]
        cells = math.ceil(2.0 + STEEP * min(self.aspect, self.aspect ** (2.0 / 3.0)))
        return cells * self.width

    def floor_friction(self, material: Material) -> float:
        """That of the grains, or a floor on which nothing slides."""
        if not isinstance(material, MohrCoulomb):
            return math.inf
        return math.tan(math.radians(material.friction_angle))

    def expected(self) -> tuple[float | None, float]:
        """Run-out and height at the wall over the width."""
        a = self.aspect
        run_out = 1.2 * a if a < 1.8 else 1.9 * a ** (2.0 / 3.0) if a > 2.8 else None
        return run_out, a if a < 1.15 else 1.1 * a**0.4

    # quantities of interest

    def quantities(self, solution: Solution, material: Material) -> dict[str, tuple[Any, str, str]]:
        out = super().quantities(solution, material)
        if solution.status != "ok":
            return out
        run_out = float(out["front"][0][-1]) / self.width - 1.0
        height = float(out["height_at_wall"][0][-1]) / self.width
        kinetic = np.array(solution.history["kinetic_energy"])
        released = float(np.array(solution.history["external_work"])[-1])
        law, high = self.expected()
        out |= {
            "run_out": (run_out, "1", "advance of the front over the width of the column"),
            "final_height": (height, "1", "height at the wall over the width of the column"),
            "kinetic_share": (
                float(kinetic[-1]) / released,
                "1",
                "kinetic energy at the end over the work of the weight; below 1e-4 it rests",
            ),
        }
        if law is not None:
            text = "run_out over that of Lube et al. 2005, less 1"
            out["excess_of_run_out"] = (run_out / law - 1.0, "1", text)
            text = "absolute value of excess_of_run_out"
            out["error_run_out"] = (abs(run_out / law - 1.0), "1", text)
        text = "final_height over that of Lube et al. 2005, less 1"
        out["excess_of_height"] = (height / high - 1.0, "1", text)
        return out
