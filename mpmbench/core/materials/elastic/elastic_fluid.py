"""Elastic without shear stiffness: ``sigma = K ln(J) I``, in 1D ``P = E ln J`` (Li 2009, 4.2.1).

Its tangent modulus ``dP/dJ = K / J`` falls with stretch: a bar of it shows the tensile instability
early.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from mpmbench.core.compiled import implements
from mpmbench.core.compiled.algebra import determinant
from mpmbench.core.materials import Material, energy_density
from mpmbench.core.materials.elastic import elastic_moduli, elastic_stress, isotropic_moduli
from mpmbench.core.registry import register
from mpmbench.core.setting import setting


class ElasticFluidLaw(NamedTuple):
    """Bulk modulus [Pa]."""

    bulk: float


@register("material", "elastic_fluid")
@dataclass(frozen=True)
class ElasticFluid(Material):
    """Elastic without shear stiffness, sigma = K ln(J) I; in 1D a bar with P = E ln J."""

    bulk_modulus: float = setting(1.0, "K; the modulus E of a bar in 1D", unit="Pa", above=0.0)
    density: float = setting(1.0, "of the undeformed body", unit="kg/m3", above=0.0)

    @property
    def law(self) -> ElasticFluidLaw:
        return ElasticFluidLaw(float(self.bulk_modulus))

    def lame_parameters(self) -> tuple[float, float]:
        return self.bulk_modulus, 0.0


@implements(elastic_stress, ElasticFluidLaw)
def _stress(law, axes, F, tau):
    J = determinant(axes, F)
    pressure = law.bulk * J * np.log(J)
    for i in range(len(axes)):
        for j in range(len(axes)):
            tau[i, j] = pressure if i == j else 0.0


@implements(elastic_moduli, ElasticFluidLaw)
def _moduli(law, axes, F, tau, moduli):
    """``c = (tau + K J) I (x) I - 2 tau I_sym``."""
    isotropic_moduli(axes, tau[0, 0] + law.bulk * determinant(axes, F), -tau[0, 0], tau, moduli)


@implements(energy_density, ElasticFluidLaw)
def _energy(law, axes, F, state):
    J = determinant(axes, F)
    return law.bulk * (J * np.log(J) - J + 1.0)
