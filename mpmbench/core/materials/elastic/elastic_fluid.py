"""Elastic without shear stiffness: ``sigma = K ln(J) I``, in 1D the bar ``P = E ln J`` of Li 2009, section 4.2.1.

Its tangent modulus ``dP/dJ = K / J`` falls with stretch: a bar of it shows the tensile instability
early.
"""

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np

from mpmbench.core.compiled import implements
from mpmbench.core.compiled.algebra import determinant
from mpmbench.core.materials import cauchy_stress, energy_density, kirchhoff_stress
from mpmbench.core.registry import register
from mpmbench.core.setting import Settings, setting


class ElasticFluidLaw(NamedTuple):
    """Bulk modulus [Pa]."""

    bulk: float


@register("material", "elastic_fluid")
@dataclass(frozen=True)
class ElasticFluid(Settings):
    """Elastic without shear stiffness, sigma = K ln(J) I; in 1D a bar with P = E ln J."""

    bulk_modulus: float = setting(1.0, "K; the modulus E of a bar in 1D", unit="Pa", above=0.0)
    density: float = setting(1.0, "of the undeformed body", unit="kg/m3", above=0.0)
    history: ClassVar[int] = 0
    rate_dependent: ClassVar[bool] = False
    symmetric: ClassVar[bool] = True
    conserves_energy: ClassVar[bool] = True
    symmetric_tangent: ClassVar[bool] = True

    @property
    def law(self) -> ElasticFluidLaw:
        return ElasticFluidLaw(float(self.bulk_modulus))

    def lame_parameters(self) -> tuple[float, float]:
        """Bulk modulus and no shear modulus [Pa]."""
        return self.bulk_modulus, 0.0


@implements(cauchy_stress, ElasticFluidLaw)
def _stress(law, axes, F, L, dt, state, sigma):  # type: ignore[no-untyped-def]
    pressure = law.bulk * np.log(determinant(axes, F))
    for i in range(len(axes)):
        for j in range(len(axes)):
            sigma[i, j] = pressure if i == j else 0.0


@implements(kirchhoff_stress, ElasticFluidLaw)
def _kirchhoff(law, axes, increment, F, old, state, tau, moduli):  # type: ignore[no-untyped-def]
    """``tau = K J ln J I`` and ``c = (tau + K J) I (x) I - 2 tau I_sym``."""
    dim = len(axes)
    J = determinant(axes, F)
    pressure = law.bulk * J * np.log(J)
    for i in range(dim):
        for c in range(dim):
            tau[i, c] = pressure if i == c else 0.0
            for j in range(dim):
                for d in range(dim):
                    value = pressure + law.bulk * J if i == c and j == d else 0.0
                    if (
                        i == d and c == j
                    ):  # the other half of -2 tau I_sym cancels the geometric part
                        value -= pressure
                    moduli[i, c, j, d] = value


@implements(energy_density, ElasticFluidLaw)
def _energy(law, axes, F, state):  # type: ignore[no-untyped-def]
    J = determinant(axes, F)
    return law.bulk * (J * np.log(J) - J + 1.0)
