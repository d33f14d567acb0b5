"""The reproducing kernel particle method (Liu, Jun and Zhang 1995; Liu, Jun, Li, Adee and Belytschko 1995).

``N_I(x) = C(x; x - x_I) w_a(x - x_I) dV_I`` with the correction ``C = H(0) . M^-1 H(x - x_I)``, the
monomials H up to the order, and ``M = sum_I H (x) H w_a dV_I``. With equal volumes dV_I, which
cancel, these are the functions of moving least squares with the same weight: they are found by the
same kernels. Order 0 (Shepard's functions) corrects constants only: linear fields are not kept.
"""

import math
from dataclasses import dataclass, replace
from functools import partial
from typing import ClassVar

from mpmbench.core.bases import BasisSettings, Promises
from mpmbench.core.bases.clouds.cloud import CloudBasis
from mpmbench.core.bases.clouds.mls import Recipe, fill_points, refuse_direct_constraints
from mpmbench.core.bases.radial import WEIGHTS
from mpmbench.core.choices import Choices
from mpmbench.core.geometry import Geometry
from mpmbench.core.registry import register
from mpmbench.core.setting import setting

SUPPORT = 0.5  # over the radius: the splines vanish at the radius


@register("basis", "rkpm")
@dataclass(frozen=True)
class ReproducingKernel(BasisSettings):
    """Reproducing kernel functions on any set of nodes, Liu et al. 1995, corrected up to an order of 0 to 2."""

    order: int = setting(1, "of the monomials that are reproduced", unit="-", options=(0, 1, 2))
    weight: str = setting(
        "cubic_spline",
        "window of a node by its distance",
        options=("cubic_spline", "quartic_spline", "gaussian"),
    )
    relative_radius: float = setting(
        1.4142135623730951,
        "radius of the window over the nodal spacing",
        unit="-",
        above=1.0,
        most=3.0,
    )
    promises: ClassVar[Promises] = Promises(non_negative=False, extrapolates=True)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.order == 0:
            shepard = replace(self.promises, linear_completeness=False, non_negative=True)
            object.__setattr__(self, "promises", shepard)

    def check(self, choices: Choices, touches_fixed_nodes: bool) -> None:
        """Refuse to hold single nodes where functions of their neighbours do not vanish."""
        refuse_direct_constraints("rkpm", self.relative_radius, choices, touches_fixed_nodes)

    def build(self, geometry: Geometry, particles: int, moving: bool) -> CloudBasis:
        monomials = math.comb(geometry.dimension + self.order, self.order)
        axes, terms = (0.0,) * geometry.dimension, (0.0,) * monomials
        recipe = Recipe(axes, terms, self.order, WEIGHTS[self.weight], SUPPORT)
        radius = self.relative_radius * geometry.nodal_spacing
        fill = partial(fill_points, recipe)
        return CloudBasis(geometry.points, particles, radius, monomials, fill, moving)
