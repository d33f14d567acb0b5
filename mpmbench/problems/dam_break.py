"""A column of water that collapses on a smooth floor (Martin and Moyce 1952).

A column of width a and height 2 a, a = 0.05715 m, stands between a wall and a gate that is gone at
t = 0. Martin and Moyce measured the front Z = x/a at the times T = t sqrt(2 g/a). Codes run ahead of
them by 5 to 15 %, since gate and floor held the water back in the experiment; a film of single
particles runs ahead of the front.

Water is weakly compressible, with a speed of sound of ``10 sqrt(2 g H)`` by choice of the bulk
modulus, and carries no tension (``material.tension=none``).
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from mpmbench.core.materials import Material
from mpmbench.core.registry import register
from mpmbench.core.setting import setting
from mpmbench.core.simulation import Solution
from mpmbench.problems.collapse import Collapse

# T and Z of Martin and Moyce, for n^2 = 2.
MEASURED = np.array(
    [
        (0.41, 1.11),
        (0.84, 1.22),
        (1.19, 1.44),
        (1.43, 1.67),
        (1.63, 1.89),
        (1.83, 2.11),
        (1.98, 2.33),
        (2.20, 2.56),
        (2.32, 2.78),
        (2.51, 3.00),
        (2.65, 3.22),
        (2.83, 3.44),
        (2.98, 3.67),
        (3.11, 3.89),
        (3.33, 4.11),
    ]
)


@register("problem", "dam_break")
@dataclass(frozen=True)
class DamBreak(Collapse):
    """Water column that collapses, its front against that of Martin and Moyce 1952."""

    gravity: float = setting(9.81, "weight per unit mass", unit="m/s2", above=0.0, below=1.0e4)
    width: float = setting(0.05715, "of the column", unit="m", above=0.0, most=1e3)
    height: float = setting(0.1143, "of the column", unit="m", above=0.0, most=1e3)

    @property
    def length(self) -> float:  # type: ignore[override]
        return 5.0 * self.width

    def floor_friction(self, material: Material) -> float:
        return 0.0

    def measured(self, last: float) -> tuple[np.ndarray, np.ndarray]:
        """Times [s] up to `last` and the front then [m]."""
        times = MEASURED[:, 0] / np.sqrt(2.0 * self.gravity / self.width)
        return times[times <= last], self.width * MEASURED[times <= last, 1]

    # quantities of interest

    def quantities(self, solution: Solution, material: Material) -> dict[str, tuple[Any, str, str]]:
        out = super().quantities(solution, material)
        t = np.array(solution.history["time"])
        times, front = self.measured(float(t[-1]))
        as_measured = self.height == 2.0 * self.width
        if as_measured and len(times) and solution.status == "ok":
            error = np.interp(times, t, out["front"][0]) / front - 1.0
            worst = float(error[np.argmax(np.abs(error))])
            text = "largest relative lead of the front over the measured one"
            out["lead_of_front"] = (worst, "1", text)
        return out
