"""Maximum-entropy functions with priors on supports (Wobbes 2020, 6.1; Sukumar and Wright 2007)."""

from dataclasses import dataclass

import numpy as np

from mpmbench.core.bases.clouds.search import nearest_distances
from mpmbench.core.bases.entropy.basis import EntropyBasis, EntropySettings
from mpmbench.core.bases.entropy.priors import Formulation
from mpmbench.core.bases.radial import WEIGHTS
from mpmbench.core.geometry import Geometry
from mpmbench.core.registry import register
from mpmbench.core.setting import setting

GAUSSIAN_RIM = 6.25  # exp(-(r / 0.4)^2): the customary width of a Gaussian on a compact support


@register("basis", "maxent")
@dataclass(frozen=True)
class MaxEnt(EntropySettings):
    """Maximum-entropy functions with a prior, Sukumar and Wright 2007, on any set of nodes.

    The priors are those of Wobbes 2020, Eqs. 88-90; the Gaussian exp(-6.25 r^2) is lowered by its
    tangent in r^2 at the rim, so that value and slope vanish there. With d_max = 2 and the cubic spline
    on a uniform line of nodes the functions are the cubic B-splines, away from the ends.
    """

    prior: str = setting(
        "cubic_spline",
        "weight on the support",
        options=("cubic_spline", "quartic_spline", "gaussian"),
    )
    d_max: float = setting(
        2.0, "radius of the prior's support in node spacings", unit="-", above=1.0, most=10.0
    )

    def build(self, geometry: Geometry, particles: int, moving: bool) -> EntropyBasis:
        def supports(nodes: np.ndarray) -> np.ndarray:
            return self.d_max * nearest_distances(nodes)

        form = Formulation(
            axes=(0.0,) * geometry.dimension,
            prior=WEIGHTS[self.prior],
            rim_exponent=GAUSSIAN_RIM,
            spacing=1.0 / self.d_max,
            tolerance=self.tolerance,
        )
        local = self.search == "local"
        return EntropyBasis(geometry.points, particles, supports, form, local=local)
