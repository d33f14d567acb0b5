"""Neo-Hookean elasticity, ``J sigma = lambda ln J I + mu (b - I)`` (Wobbes 2020, Eq. 11)."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from mpmbench.core.compiled import implements
from mpmbench.core.compiled.algebra import determinant, multiply_transposed
from mpmbench.core.compiled.exponentials import logarithm
from mpmbench.core.materials import energy_density
from mpmbench.core.materials.elastic import elastic_moduli, elastic_stress, isotropic_moduli
from mpmbench.core.materials.isotropic import IsotropicElastic, Lame
from mpmbench.core.registry import register


class NeoHookeanLaw(Lame):
    """Lame parameters [Pa]."""


@register("material", "neo_hookean")
@dataclass(frozen=True)
class NeoHookean(IsotropicElastic):
    """Compressible neo-Hookean solid.

    Missing dimensions are in plane strain; in 1D this is uniaxial strain.
    """

    constants: ClassVar[type[Lame]] = NeoHookeanLaw


@implements(elastic_stress, NeoHookeanLaw)
def _stress(law, axes, F, tau):
    """``tau = lambda ln J I + mu (b - I)``."""
    multiply_transposed(axes, F, F, tau)
    volumetric = law.lame * logarithm(determinant(axes, F))
    for i in range(len(axes)):
        for j in range(len(axes)):
            tau[i, j] = law.shear * tau[i, j] + (volumetric - law.shear if i == j else 0.0)


@implements(elastic_moduli, NeoHookeanLaw)
def _moduli(law, axes, F, tau, moduli):
    """``c = lambda I (x) I + 2 (mu - lambda ln J) I_sym``."""
    shear = law.shear - law.lame * np.log(determinant(axes, F))
    isotropic_moduli(axes, law.lame, shear, tau, moduli)


@implements(energy_density, NeoHookeanLaw)
def _energy(law, axes, F, state):
    log_J = np.log(determinant(axes, F))
    stretch = 0.0  # tr(F F^T) - dim
    for i in range(len(axes)):
        for k in range(len(axes)):
            stretch += F[i, k] * F[i, k]
        stretch -= 1.0
    return 0.5 * law.shear * (stretch - 2.0 * log_J) + 0.5 * law.lame * log_J * log_J
