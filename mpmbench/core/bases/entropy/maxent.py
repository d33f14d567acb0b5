"""Maximum-entropy functions with a compactly supported prior (Wobbes 2020, section 6.1; Sukumar and Wright 2007)."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from mpmbench.core.bases import BasisSettings, Promises
from mpmbench.core.bases.clouds.search import nearest_distances
from mpmbench.core.bases.entropy.basis import PROMISES, EntropyBasis
from mpmbench.core.bases.entropy.priors import CUBIC_SPLINE, GAUSSIAN, QUARTIC_SPLINE
from mpmbench.core.errors import require, require_option
from mpmbench.core.geometry import Geometry
from mpmbench.core.registry import register

PRIORS = {"cubic_spline": CUBIC_SPLINE, "quartic_spline": QUARTIC_SPLINE, "gaussian": GAUSSIAN}
GAUSSIAN_RIM = (
    6.25  # exp(-(r / 0.4)^2): the customary width for a Gaussian weight on a compact support
)


@register("basis", "maxent")
@dataclass(frozen=True)
class MaxEnt(BasisSettings):
    """Settings of the max-ent basis.

    Parameters
    ----------
    prior : {"cubic_spline", "quartic_spline", "gaussian"}
        Weight w(r) on the support (Wobbes 2020, Eqs. 89, 90); the Gaussian exp(-6.25 r^2) is
        lowered by its tangent in r^2 at the rim, so that value and slope vanish there.
    d_max : float
        Radius of a support over the distance from its node to the nearest one, more than 1 (Eq.
        88). With 2 and the cubic spline on a uniform line of nodes the functions are the cubic
        B-splines, away from the ends.
    tolerance : float
        Largest residual of linear completeness, in nodal spacings.
    search : {"local", "all"}
        Look for neighbours in cells, or at all nodes for every point (as the paper did; same
        functions).
    line_search : bool
        Safeguard Newton's method; without it, it is the plain one.
    """

    prior: str = "cubic_spline"
    d_max: float = 2.0
    tolerance: float = 1e-12
    search: str = "local"
    line_search: bool = True
    promises: ClassVar[Promises] = PROMISES

    def __post_init__(self) -> None:
        require_option("prior", self.prior, tuple(PRIORS))
        require(
            1.0 < self.d_max <= 10.0, "d_max", self.d_max, "a number greater than 1, at most 10"
        )
        require(
            1e-13 <= self.tolerance <= 1e-4,
            "tolerance",
            self.tolerance,
            "a number from 1e-13 to 1e-4",
        )
        require_option("search", self.search, ("local", "all"))
        require(
            isinstance(self.line_search, bool), "line_search", self.line_search, "true or false"
        )

    def build(self, geometry: Geometry, particles: int, moving: bool) -> EntropyBasis:
        """The basis on the nodes of `geometry`, with room for `particles` particles."""

        def supports(nodes: np.ndarray) -> np.ndarray:
            return self.d_max * nearest_distances(nodes)

        return EntropyBasis(
            geometry.points,
            particles,
            supports,
            prior=PRIORS[self.prior],
            rim_exponent=GAUSSIAN_RIM,
            spacing=1.0 / self.d_max,
            tolerance=self.tolerance,
            local=self.search == "local",
            line_search=self.line_search,
        )
