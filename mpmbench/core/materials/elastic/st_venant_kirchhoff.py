"""St. Venant-Kirchhoff elasticity: ``S = lambda tr(E) I + 2 mu E`` with the Green-Lagrange strain E; objective."""

from dataclasses import dataclass

from mpmbench.core.compiled import implements, matrix
from mpmbench.core.compiled.algebra import determinant
from mpmbench.core.materials import cauchy_stress, energy_density, kirchhoff_stress
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

    @property
    def law(self) -> StVenantKirchhoffLaw:
        return StVenantKirchhoffLaw(*self.lame_parameters())


@implements(cauchy_stress, StVenantKirchhoffLaw)
def _stress(law, axes, F, L, dt, state, sigma):  # type: ignore[no-untyped-def]
    dim = len(axes)
    S, FS = matrix(axes, axes), matrix(axes, axes)
    trace = 0.0
    for i in range(dim):
        for j in range(dim):
            E = -0.5 if i == j else 0.0  # E = (F^T F - I) / 2
            for k in range(dim):
                E += 0.5 * F[k, i] * F[k, j]
            S[i, j] = 2.0 * law.shear * E
            if i == j:
                trace += E
    for i in range(dim):
        S[i, i] += law.lame * trace
    inverse_J = 1.0 / determinant(axes, F)
    for i in range(dim):  # sigma = F S F^T / J
        for j in range(dim):
            FS[i, j] = 0.0
            for k in range(dim):
                FS[i, j] += F[i, k] * S[k, j]
    for i in range(dim):
        for j in range(dim):
            total = 0.0
            for k in range(dim):
                total += FS[i, k] * F[j, k]
            sigma[i, j] = total * inverse_J


@implements(kirchhoff_stress, StVenantKirchhoffLaw)
def _kirchhoff(law, axes, increment, F, old, state, tau, moduli):  # type: ignore[no-untyped-def]
    """``tau = lambda tr(E) b + mu (b b - b)`` and ``c_abcd = lambda b_ab b_cd + mu (b_ac b_bd + b_ad b_bc)``."""
    dim = len(axes)
    b = matrix(axes, axes)
    trace = 0.0
    for i in range(dim):
        for j in range(dim):
            b[i, j] = 0.0
            for k in range(dim):
                b[i, j] += F[i, k] * F[j, k]
        trace += 0.5 * (b[i, i] - 1.0)
    for i in range(dim):
        for j in range(dim):
            square = 0.0
            for k in range(dim):
                square += b[i, k] * b[k, j]
            tau[i, j] = law.lame * trace * b[i, j] + law.shear * (square - b[i, j])
    for i in range(dim):
        for c in range(dim):
            for j in range(dim):
                for d in range(dim):
                    value = law.lame * b[i, c] * b[j, d] + law.shear * (
                        b[i, j] * b[c, d] + b[i, d] * b[c, j]
                    )
                    moduli[i, c, j, d] = value + (tau[c, d] if i == j else 0.0)


@implements(energy_density, StVenantKirchhoffLaw)
def _energy(law, axes, F, state):  # type: ignore[no-untyped-def]
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
