"""One material point of metal along a path of deformation: stress, plastic strain, heat (Li 2009, section 3.2.4).

No method and no functions are in it: the law of the material takes the deformation gradients of the
path, one per time step, and each step minimises its incremental energy (Eq. 3.103). Volumes stay.
With the strain ``e = rate t`` a stretch is ``F = diag(exp(e), exp(-e/2), exp(-e/2))``, a shear has the
slide sqrt(3) e, and a cyclic stretch turns round at the amplitude. The axial stress less the lateral one,
or sqrt(3) times the shear stress, obeys an ordinary differential equation that reports solve beside it.
"""

import math
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from mpmbench.core.choices import Choices
from mpmbench.core.errors import NotApplicable
from mpmbench.core.geometry import Box
from mpmbench.core.loops.sph import update_stress
from mpmbench.core.materials import Material
from mpmbench.core.particles import seed_cells
from mpmbench.core.registry import register
from mpmbench.core.setting import setting
from mpmbench.core.simulation import Solution
from mpmbench.core.state import State
from mpmbench.problems import Problem

SERIES = {
    "strain": ("1", "logarithmic strain along the path"),
    "axial_stress": (
        "Pa",
        "Kirchhoff stress along the path: of uniaxial tension, sqrt(3) of shear",
    ),
    "plastic_strain_history": ("1", "equivalent plastic strain"),
    "temperature_history": ("K", "temperature"),
}


@register("problem", "material_point")
@dataclass(frozen=True)
class MaterialPoint(Problem):
    """One point of a metal that is stretched, sheared or cycled at a rate: stress and heat, Li 2009, Sect. 3.2.4."""

    path: str = setting(
        "stretch",
        "along one axis, in simple shear, or along one axis back and forth",
        options=("stretch", "shear", "cyclic"),
    )
    rate: float = setting(1.0e3, "of the strain", unit="1/s", above=0.0)
    amplitude: float = setting(
        0.05, "strain at which a cyclic path turns round", unit="-", above=0.0, most=1.0
    )
    dimension: ClassVar[int] = 3
    still: ClassVar[bool] = True
    reference_length: ClassVar[float] = 1.0
    samples: ClassVar[int] = 100_000  # each step is one of the law

    def check(self, material: Material, choices: Choices, basis: str, resolution: int) -> None:
        if choices.moves_particles:
            raise NotApplicable(
                f"method={choices.name} moves particles: a point that is led along a path needs "
                "method=evaluate"
            )
        if "plastic_strain" not in material.outputs:
            raise NotApplicable("material_point is for metals: this material has no plastic strain")

    # geometry

    def nodes(self, resolution: int, choices: Choices) -> Box:
        return Box((0.0,) * 3, (1.0,) * 3, (1,) * 3)

    def seed(self, resolution: int, particles_per_cell: int) -> tuple[np.ndarray, np.ndarray]:
        return seed_cells(self.nodes(resolution, Choices()), 1)

    # the path

    def strain(self, t: float) -> float:
        """Strain at the time t [s]."""
        e = self.rate * t
        if self.path != "cyclic":
            return e
        phase = math.fmod(e / self.amplitude + 1.0, 4.0)
        return self.amplitude * (phase - 1.0 if phase < 2.0 else 3.0 - phase)

    def deformation(self, t: float) -> np.ndarray:
        """Deformation gradient at the time t [s], shape (3, 3)."""
        e, F = self.strain(t), np.eye(3)
        if self.path == "shear":
            F[0, 1] = math.sqrt(3.0) * e
            return F
        return np.diag(np.exp([e, -0.5 * e, -0.5 * e]))

    # quantities of interest

    def observe(self, state: State) -> dict[str, Any]:
        """Lead the point on from where it was last, and read off stress and history."""
        p, F = state.particles, self.deformation(state.time)
        dt = state.time - (state.workspace or 0.0)
        if dt > 0.0:
            L = (F @ np.linalg.inv(p.F[0]) - np.eye(3)) / dt
            p.F[0] = F
            update_stress(state.law, state.axes, p.F, L[None], dt, p.state, p.sigma)
        state.workspace = state.time
        sigma = p.sigma[0]  # of a volume that stays
        stress = (
            math.sqrt(3.0) * sigma[0, 1]
            if self.path == "shear"
            else sigma[0, 0] - 0.5 * (sigma[1, 1] + sigma[2, 2])
        )
        fields = state.material.fields(p.state)
        temperature = fields["temperature"][0][0] if "temperature" in fields else np.nan
        values = self.strain(state.time), stress, fields["plastic_strain"][0][0], temperature
        return dict(zip(SERIES, map(float, values), strict=True))

    def quantities(self, solution: Solution, material: Material) -> dict[str, tuple[Any, ...]]:
        return {
            name: (np.array(solution.history[name]), unit, text)
            for name, (unit, text) in SERIES.items()
        }
