"""Piecewise linear functions: products on fixed grids, and cells and simplices that move.

Wobbes 2020, Eqs. 75 and 76 with the slopes corrected to +1/(x_i - x_{i-1}) and -1/(x_{i+1} - x_i).
"""

from dataclasses import dataclass
from typing import ClassVar

from mpmbench.core.bases import Basis, BasisSettings, Promises
from mpmbench.core.bases.cells.quads import MovingQuads
from mpmbench.core.bases.cells.simplices import FixedSimplices, MovingSimplices
from mpmbench.core.bases.grid.spline import TensorSpline
from mpmbench.core.errors import NotApplicable
from mpmbench.core.geometry import Box, Geometry
from mpmbench.core.registry import register


@register("basis", "linear")
@dataclass(frozen=True)
class Linear(BasisSettings):
    """Piecewise linear functions: hats on a grid, tensor products of them in more dimensions."""

    promises: ClassVar[Promises] = Promises(kronecker="everywhere", continuous_gradient=False)
    background_grid: ClassVar[bool] = True  # its cells can carry ghost stiffness

    def build(self, geometry: Geometry, particles: int, moving: bool) -> Basis:
        if moving and geometry.cells is not None:
            return MovingQuads(geometry, particles)
        if isinstance(geometry, Box):
            return TensorSpline(geometry, degree=1)
        if geometry.simplices is None:
            raise NotApplicable("linear on an unstructured set of nodes needs a triangulation")
        return (MovingSimplices if moving else FixedSimplices)(geometry, particles)
