"""B-splines of degree 1 to 3 with open knots, fixed or moving (Wobbes 2020, section 6.2)."""

from dataclasses import dataclass
from typing import ClassVar

from mpmbench.core.bases import BasisSettings, Promises
from mpmbench.core.bases.grid.spline import TensorSpline
from mpmbench.core.bases.grid.tls import ReconstructedSpline
from mpmbench.core.choices import Choices
from mpmbench.core.errors import NotApplicable
from mpmbench.core.geometry import Box, Geometry
from mpmbench.core.registry import register
from mpmbench.core.setting import setting


@register("basis", "bspline")
@dataclass(frozen=True)
class BSpline(BasisSettings):
    """B-splines on an open knot vector; degrees of freedom sit at the Greville abscissae.

    So the basis is linearly complete at every degree, against what the paper says (sections 4, 7).
    """

    degree: int = setting(2, "of the polynomials", unit="-", options=(1, 2, 3))
    reconstruction: str = setting(
        "none",
        "nodal sums over particles, or over Gauss points of Taylor least squares (Wobbes et al. 2019)",
        options=("none", "tls"),
    )
    reconstruction_degree: int = setting(1, "of the Taylor functions", unit="-", options=(1, 2))
    filled: float = setting(
        0.9,
        "share of a cell whose volume its particles have where it is reconstructed, or as much too much",
        unit="-",
        above=0.0,
        most=1.0,
    )
    promises: ClassVar[Promises] = Promises(kronecker="hull", grid=True, bends=False)
    background_grid: ClassVar[bool] = True  # its cells can carry ghost stiffness

    @property
    def stands_in(self) -> bool:
        """With a reconstruction."""
        return self.reconstruction != "none"

    def check(self, choices: Choices, touches_fixed_nodes: bool) -> None:
        """A reconstruction is for lumped sums on a grid that stays."""
        if self.stands_in and (choices.implicit or choices.on_body or choices.mass != "lumped"):
            raise NotApplicable(
                f"basis.reconstruction={self.reconstruction} is for explicit methods with "
                "method.mass=lumped, method.nodes=fixed and method.shape_functions=updated"
            )

    def build(self, geometry: Geometry, particles: int, moving: bool) -> TensorSpline:
        if not isinstance(geometry, Box):
            raise NotApplicable(
                "bspline needs a grid: this problem has an unstructured set of nodes"
            )
        if self.stands_in:
            degree, order = self.degree, self.reconstruction_degree
            return ReconstructedSpline(geometry, degree, particles, order, self.filled)
        return TensorSpline(geometry, self.degree, moving)
