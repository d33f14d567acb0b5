"""Compressible Newtonian fluid: ``sigma = p(J) I + 2 eta dev(d)`` (Li 2009, Eqs. 4.6-4.16).

The pressure p is positive in tension, ``p(J) = K (J - 1/J) / 2``, from the energy ``A(J) = K (J^2 -
2 ln J - 1) / 4``. The rate of deformation ``d = sym(L)`` is that of the last step, half a step
before the pressure. A fluid that carries no tension has p = 0 where J > 1, and pressure again only
when it has come together.
"""

import math
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np

from mpmbench.core.compiled import implements
from mpmbench.core.compiled.algebra import determinant
from mpmbench.core.materials import Material, cauchy_stress, energy_density
from mpmbench.core.registry import register
from mpmbench.core.setting import setting


class NewtonianLaw(NamedTuple):
    """Bulk modulus [Pa], viscosity [Pa s], and the largest J that counts: infinite, or 1 without tension."""

    bulk: float
    viscosity: float
    largest: float = math.inf


@register("material", "newtonian_fluid")
@dataclass(frozen=True)
class NewtonianFluid(Material):
    """Compressible Newtonian fluid with p(J) = K (J - 1/J) / 2, Li 2009, Eqs. 4.6-4.16.

    Stokes' hypothesis: there is no bulk viscosity.
    """

    bulk_modulus: float = setting(1.0, "K of the undeformed fluid", unit="Pa", above=0.0)
    viscosity: float = setting(0.0025, "shear viscosity eta", unit="Pa s", least=0.0)
    density: float = setting(1.0, "of the undeformed body", unit="kg/m3", above=0.0)
    tension: str = setting(
        "carried", "tension where J > 1: carried, or none", options=("carried", "none")
    )
    rate_dependent: ClassVar[bool] = True
    conserves_energy: ClassVar[bool] = False

    @property
    def law(self) -> NewtonianLaw:
        largest = 1.0 if self.tension == "none" else math.inf
        return NewtonianLaw(float(self.bulk_modulus), float(self.viscosity), largest)

    def lame_parameters(self) -> tuple[float, float]:
        return self.bulk_modulus, 0.0

    def pressure(self, J: np.ndarray) -> np.ndarray:
        """``p(J)`` [Pa], positive in tension (Eq. 4.16)."""
        J = np.minimum(J, self.law.largest)
        return 0.5 * self.bulk_modulus * (J - 1.0 / J)


@implements(cauchy_stress, NewtonianLaw)
def _stress(law, axes, F, L, dt, state, sigma):
    J = min(determinant(axes, F), law.largest)
    dilatation = 0.0
    for i in range(len(axes)):
        dilatation += L[i, i]
    isotropic = 0.5 * law.bulk * (J - 1.0 / J) - 2.0 / 3.0 * law.viscosity * dilatation
    for i in range(len(axes)):
        for j in range(len(axes)):
            sigma[i, j] = law.viscosity * (L[i, j] + L[j, i]) + (isotropic if i == j else 0.0)


@implements(energy_density, NewtonianLaw)
def _energy(law, axes, F, state):
    J = min(determinant(axes, F), law.largest)
    return 0.25 * law.bulk * (J * J - 2.0 * np.log(J) - 1.0)
