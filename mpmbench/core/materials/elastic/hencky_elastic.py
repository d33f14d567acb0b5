"""Hencky elasticity: ``tau = lambda tr(e) I + 2 mu e`` with the logarithmic strain ``e = ln(b) / 2``."""

import math
from dataclasses import dataclass

from mpmbench.core.compiled import implements, kernel, matrix, vector
from mpmbench.core.compiled.algebra import determinant
from mpmbench.core.materials import cauchy_stress, energy_density, kirchhoff_stress
from mpmbench.core.materials.isotropic import IsotropicElastic, Lame
from mpmbench.core.materials.principal import (
    THREE,
    assemble,
    congruence,
    eigensystem,
    elastic_moduli,
    embed,
    hencky_energy,
    hencky_stress,
    spatial_moduli,
)
from mpmbench.core.registry import register


class HenckyLaw(Lame):
    """Lame parameters [Pa]."""


@register("material", "hencky_elastic")
@dataclass(frozen=True)
class HenckyElastic(IsotropicElastic):
    """Hencky elasticity: Kirchhoff stress linear in the logarithmic strain.

    Missing dimensions are in plane strain.
    """

    young_modulus: float = 1.0e6
    poisson_ratio: float = 0.3
    density: float = 1000.0

    @property
    def law(self) -> HenckyLaw:
        return HenckyLaw(*self.lame_parameters())


@kernel
def _principal(law, axes, F, strain, tau, vectors):  # type: ignore[no-untyped-def]
    """Principal strains, stresses and axes of ``b = F F^T``."""
    full, unit, b = matrix(THREE, THREE), matrix(THREE, THREE), matrix(THREE, THREE)
    for i in range(3):
        for j in range(3):
            unit[i, j] = 1.0 if i == j else 0.0
    embed(axes, F, full)
    congruence(full, unit, b)
    eigensystem(b, strain, vectors)
    for a in range(3):
        strain[a] = 0.5 * math.log(strain[a])
    hencky_stress(law.lame, law.shear, strain, tau)


@implements(kirchhoff_stress, HenckyLaw)
def _kirchhoff(law, axes, increment, F, old, state, tau, moduli):  # type: ignore[no-untyped-def]
    strain, principal, vectors, D = (
        vector(THREE),
        vector(THREE),
        matrix(THREE, THREE),
        matrix(THREE, THREE),
    )
    _principal(law, axes, F, strain, principal, vectors)
    assemble(principal, vectors, axes, tau)
    elastic_moduli(law.lame, law.shear, D)
    spatial_moduli(axes, strain, principal, D, vectors, moduli)


@implements(cauchy_stress, HenckyLaw)
def _stress(law, axes, F, L, dt, state, sigma):  # type: ignore[no-untyped-def]
    strain, principal, vectors = vector(THREE), vector(THREE), matrix(THREE, THREE)
    _principal(law, axes, F, strain, principal, vectors)
    inverse_J = 1.0 / determinant(axes, F)
    for a in range(3):
        principal[a] *= inverse_J
    assemble(principal, vectors, axes, sigma)


@implements(energy_density, HenckyLaw)
def _energy(law, axes, F, state):  # type: ignore[no-untyped-def]
    strain, principal, vectors = vector(THREE), vector(THREE), matrix(THREE, THREE)
    _principal(law, axes, F, strain, principal, vectors)
    return hencky_energy(law.lame, law.shear, strain)
