"""St. Venant-Kirchhoff elasticity: ``S = lambda tr(E) I + 2 mu E`` with Green-Lagrange strain."""

from dataclasses import dataclass
from typing import ClassVar

from mpmbench.core.compiled import implements, matrix
from mpmbench.core.compiled.algebra import multiply_transposed
from mpmbench.core.materials import energy_density
from mpmbench.core.materials.elastic import elastic_moduli, elastic_stress
from mpmbench.core.materials.isotropic import IsotropicElastic, Lame
from mpmbench.core.registry import register


class StVenantKirchhoffLaw(Lame):
    """Lame parameters [Pa]."""


@register("material", "st_venant_kirchhoff")
@dataclass(frozen=True)
class StVenantKirchhoff(IsotropicElastic):
    """St. Venant-Kirchhoff: second Piola-Kirchhoff stress linear in the Green-Lagrange strain.

    It loses stiffness in strong compression.
    """

    constants: ClassVar[type[Lame]] = StVenantKirchhoffLaw


@implements(elastic_stress, StVenantKirchhoffLaw)
def _stress(law, axes, F, tau):
    """``tau = F S F^T = lambda tr(E) b + mu (b b - b)``."""
    b = matrix(axes, axes)
    multiply_transposed(axes, F, F, b)
    multiply_transposed(axes, b, b, tau)
    trace = 0.0
    for i in range(len(axes)):
        trace += 0.5 * (b[i, i] - 1.0)
    for i in range(len(axes)):
        for j in range(len(axes)):
            tau[i, j] = law.lame * trace * b[i, j] + law.shear * (tau[i, j] - b[i, j])


@implements(elastic_moduli, StVenantKirchhoffLaw)
def _moduli(law, axes, F, tau, moduli):
    """``c_abcd = lambda b_ab b_cd + mu (b_ac b_bd + b_ad b_bc)``."""
    dim = len(axes)
    b = matrix(axes, axes)
    multiply_transposed(axes, F, F, b)
    for i in range(dim):
        for c in range(dim):
            for j in range(dim):
                for d in range(dim):
                    value = law.lame * b[i, c] * b[j, d] + law.shear * (
                        b[i, j] * b[c, d] + b[i, d] * b[c, j]
                    )
                    moduli[i, c, j, d] = value + (tau[c, d] if i == j else 0.0)


@implements(energy_density, StVenantKirchhoffLaw)
def _energy(law, axes, F, state):
    dim = len(axes)
    trace, square = 0.0, 0.0
    for i in range(dim):
        for j in range(dim):
            E = -0.5 if i == j else 0.0
            for k in range(dim):
                E += 0.5 * F[k, i] * F[k, j]
            square += E * E
            if i == j:
                trace += E
    return 0.5 * law.lame * trace * trace + law.shear * square
