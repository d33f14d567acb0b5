"""Small-strain linear elasticity: ``P = lambda tr(e) I + 2 mu e`` with ``e = sym F - I``.

P is the first Piola-Kirchhoff stress that belongs to the energy ``lambda tr(e)^2 / 2 + mu e : e``
per reference volume; the Cauchy stress ``P F^T / J`` follows from it. In 1D with nu = 0 this is
``sigma = E (F - 1)`` at any strain, which gives benchmark 8.1 an exact solution. Not objective: a
rotation makes stress. Replaces Wobbes 2020, Eq. 10, which is neither objective nor symmetric.
"""

from dataclasses import dataclass
from typing import ClassVar

from mpmbench.core.compiled import implements, matrix
from mpmbench.core.compiled.algebra import multiply_transposed
from mpmbench.core.materials import energy_density
from mpmbench.core.materials.elastic import elastic_moduli, elastic_stress
from mpmbench.core.materials.isotropic import IsotropicElastic, Lame
from mpmbench.core.registry import register


class SmallStrainLaw(Lame):
    """Lame parameters [Pa]."""


@register("material", "small_strain_elastic")
@dataclass(frozen=True)
class SmallStrainElastic(IsotropicElastic):
    """Linear elasticity for small strains and rotations; not objective."""

    symmetric: ClassVar[bool] = False
    constants: ClassVar[type[Lame]] = SmallStrainLaw


@implements(elastic_stress, SmallStrainLaw)
def _stress(law, axes, F, tau):
    """``tau = P F^T``, which is not symmetric."""
    P = matrix(axes, axes)
    trace = 0.0
    for i in range(len(axes)):
        trace += F[i, i] - 1.0
    for i in range(len(axes)):
        for j in range(len(axes)):
            P[i, j] = law.shear * (F[i, j] + F[j, i])
        P[i, i] += law.lame * trace - 2.0 * law.shear
    multiply_transposed(axes, P, F, tau)


@implements(elastic_moduli, SmallStrainLaw)
def _moduli(law, axes, F, tau, moduli):
    """``a_icjd = F_ck F_dn dP_ik/dF_jn`` with constant moduli of P."""
    dim = len(axes)
    b = matrix(axes, axes)
    multiply_transposed(axes, F, F, b)
    for i in range(dim):
        for c in range(dim):
            for j in range(dim):
                for d in range(dim):
                    value = law.lame * F[c, i] * F[d, j] + law.shear * F[c, j] * F[d, i]
                    moduli[i, c, j, d] = value + (law.shear * b[c, d] if i == j else 0.0)


@implements(energy_density, SmallStrainLaw)
def _energy(law, axes, F, state):
    trace, square = 0.0, 0.0
    for i in range(len(axes)):
        for j in range(len(axes)):
            e = 0.5 * (F[i, j] + F[j, i]) - (1.0 if i == j else 0.0)
            square += e * e
            if i == j:
                trace += e
    return 0.5 * law.lame * trace * trace + law.shear * square
