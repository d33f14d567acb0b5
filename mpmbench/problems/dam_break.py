"""A column of water that collapses on a smooth floor (Martin and Moyce 1952).

A column of width a and height 2 a, a = 0.05715 m, stands between a wall and a gate that is gone at
t = 0. Martin and Moyce measured the front Z = x/a at the times T = t sqrt(2 g/a). Codes run ahead of
them by 5 to 15 %, since gate and floor held the water back in the experiment; a film of single
particles runs ahead of the front.

A column much longer than high, of the depth H, runs out as Ritter (1892) found for shallow water on a dry bed:

    h(x, t) = (2 c - (x - a)/t)^2 / (9 g)   from x = a - c t to the front a + 2 c t,   c = sqrt(g H),

until the wave reaches the wall at t = a/c, and not at first, when it is not shallow, t < 3 sqrt(H/g).

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


LONG = 5.0  # width of a column over its height from which shallow water is compared
BINS = 24  # of the profile, from the tail of Ritter's wave to its front


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

    def ritter(self, x: np.ndarray, t: float) -> np.ndarray:
        """Depth at x of shallow water on a dry bed [m]."""
        c = np.sqrt(self.gravity * self.height)
        inside = (2.0 * c - (x - self.width) / t) ** 2 / (9.0 * self.gravity)
        depth = np.where(x < self.width - c * t, self.height, inside)
        return np.where(x > self.width + 2.0 * c * t, 0.0, depth)

    def profile_error(self, x: np.ndarray, V: np.ndarray, t: float) -> float | None:
        """RMS error of the depth over H in equal parts of Ritter's wave, while there is one."""
        c = np.sqrt(self.gravity * self.height)
        if not 3.0 * np.sqrt(self.height / self.gravity) <= t <= self.width / c:
            return None
        edges = np.linspace(self.width - c * t, self.width + 2.0 * c * t, BINS + 1)
        volumes = np.histogram(x, edges, weights=V)[0]
        middle = 0.5 * (edges[1:] + edges[:-1])
        error = volumes / np.diff(edges) - self.ritter(middle, t)
        return float(np.sqrt(np.mean(error**2))) / self.height

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
        if self.width >= LONG * self.height and solution.status == "ok":
            last, V0 = solution.snapshots[-1], solution.snapshots[0]["V"]  # drops take no room
            found = self.profile_error(last["x"][:, 0], V0, last["time"])
            if found is not None:
                text = "RMS error of the depth over H against Ritter's wave at the end"
                out["error_profile"] = (found, "1", text)
        return out
