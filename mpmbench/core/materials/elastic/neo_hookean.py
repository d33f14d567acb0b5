"""Compressible neo-Hookean elasticity: ``sigma = (lambda ln J / J) I + (mu / J) (F F^T - I)`` (Wobbes 2020, Eq. 11)."""

from dataclasses import dataclass

import numpy as np

from mpmbench.core.compiled import implements
from mpmbench.core.compiled.algebra import determinant
from mpmbench.core.materials import cauchy_stress, energy_density, kirchhoff_stress
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

    @property
    def law(self) -> NeoHookeanLaw:
        return NeoHookeanLaw(*self.lame_parameters())


@implements(cauchy_stress, NeoHookeanLaw)
def _stress(law, axes, F, L, dt, state, sigma):  # type: ignore[no-untyped-def]
    J = determinant(axes, F)
    inverse_J = 1.0 / J
    pressure_part = law.lame * np.log(J) * inverse_J - law.shear * inverse_J
    for i in range(len(axes)):
        for j in range(len(axes)):
            b = 0.0
            for k in range(len(axes)):
                b += F[i, k] * F[j, k]
            sigma[i, j] = law.shear * inverse_J * b + (pressure_part if i == j else 0.0)


@implements(kirchhoff_stress, NeoHookeanLaw)
def _kirchhoff(law, axes, increment, F, old, state, tau, moduli):  # type: ignore[no-untyped-def]
    """``tau = lambda ln J I + mu (b - I)`` and ``c = lambda I (x) I + 2 (mu - lambda ln J) I_sym``."""
    dim = len(axes)
    volumetric = law.lame * np.log(determinant(axes, F))
    for i in range(dim):
        for j in range(dim):
            b = 0.0
            for k in range(dim):
                b += F[i, k] * F[j, k]
            tau[i, j] = law.shear * b + (volumetric - law.shear if i == j else 0.0)
    shear = law.shear - volumetric
    for i in range(dim):
        for c in range(dim):
            for j in range(dim):
                for d in range(dim):
                    value = tau[c, d] if i == j else 0.0
                    if i == c and j == d:
                        value += law.lame
                    if i == j and c == d:
                        value += shear
                    if i == d and c == j:
                        value += shear
                    moduli[i, c, j, d] = value


@implements(energy_density, NeoHookeanLaw)
def _energy(law, axes, F, state):  # type: ignore[no-untyped-def]
    log_J = np.log(determinant(axes, F))
    stretch = 0.0  # tr(F F^T) - dim
    for i in range(len(axes)):
        for k in range(len(axes)):
            stretch += F[i, k] * F[i, k]
        stretch -= 1.0
    return 0.5 * law.shear * (stretch - 2.0 * log_J) + 0.5 * law.lame * log_J * log_J
