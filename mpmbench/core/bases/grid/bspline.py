"""B-splines of degree 1 to 3 with open knots, fixed or moving (Wobbes 2020, section 6.2)."""

from dataclasses import dataclass
from typing import ClassVar

from mpmbench.core.bases import BasisSettings, Promises
from mpmbench.core.bases.grid.spline import TensorSpline
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
    promises: ClassVar[Promises] = Promises(kronecker="hull", grid=True, bends=False)
    background_grid: ClassVar[bool] = True  # its cells can carry ghost stiffness

    def build(self, geometry: Geometry, particles: int, moving: bool) -> TensorSpline:
        if not isinstance(geometry, Box):
            raise NotApplicable(
                "bspline needs a grid: this problem has an unstructured set of nodes"
            )
        return TensorSpline(geometry, self.degree, moving)
