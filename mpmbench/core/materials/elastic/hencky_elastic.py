"""Hencky elasticity: ``tau = lambda tr(e) I + 2 mu e`` with ``e = ln(b) / 2``."""

from dataclasses import dataclass
from typing import ClassVar

from mpmbench.core.compiled import compiled, implements, matrix, vector
from mpmbench.core.materials import energy_density, kirchhoff_stress
from mpmbench.core.materials.elastic import elastic_stress
from mpmbench.core.materials.isotropic import IsotropicElastic, Lame
from mpmbench.core.materials.principal import (
    THREE,
    assemble,
    hencky_energy,
    hencky_stress,
    identity,
    principal_moduli,
    spatial_moduli,
    trial_state,
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
    constants: ClassVar[type[Lame]] = HenckyLaw


@compiled
def _principal(law, axes, F, strain, tau, vectors):
    """Principal strains, stresses and axes of ``b = F F^T``."""
    b = matrix(THREE, THREE)
    identity(b)
    trial_state(axes, F, b, strain, vectors)
    hencky_stress(law.lame, law.shear, strain, tau)


@implements(kirchhoff_stress, HenckyLaw)
def _kirchhoff(law, axes, increment, F, old, state, tau, moduli):
    strain, principal = vector(THREE), vector(THREE)
    vectors, D = matrix(THREE, THREE), matrix(THREE, THREE)
    _principal(law, axes, F, strain, principal, vectors)
    assemble(principal, vectors, axes, tau)
    principal_moduli(law.lame, law.shear, D)
    spatial_moduli(axes, strain, principal, D, vectors, moduli)


@implements(elastic_stress, HenckyLaw)
def _stress(law, axes, F, tau):
    strain, principal, vectors = vector(THREE), vector(THREE), matrix(THREE, THREE)
    _principal(law, axes, F, strain, principal, vectors)
    assemble(principal, vectors, axes, tau)


@implements(energy_density, HenckyLaw)
def _energy(law, axes, F, state):
    strain, principal, vectors = vector(THREE), vector(THREE), matrix(THREE, THREE)
    _principal(law, axes, F, strain, principal, vectors)
    return hencky_energy(law.lame, law.shear, strain)
