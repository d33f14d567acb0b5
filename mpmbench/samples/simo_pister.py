"""A material: neo-Hookean with ``W = lambda (J - 1)^2 / 2 + mu (tr b - dim - 2 ln J) / 2``."""

from dataclasses import dataclass

import numpy as np

from mpmbench import (
    IsotropicElastic,
    Lame,
    cauchy_stress,
    determinant,
    energy_density,
    implements,
    register,
)


class SimoPisterLaw(Lame):
    """Lame parameters [Pa]."""


@register("material", "simo_pister")
@dataclass(frozen=True)
class SimoPister(IsotropicElastic):
    """Compressible neo-Hookean solid with a quadratic volumetric energy."""

    @property
    def law(self) -> SimoPisterLaw:
        return SimoPisterLaw(*self.lame_parameters())


@implements(cauchy_stress, SimoPisterLaw)
def _stress(law, axes, F, L, dt, state, sigma):
    J = determinant(axes, F)
    for i in range(len(axes)):
        for j in range(len(axes)):
            b = 0.0
            for k in range(len(axes)):
                b += F[i, k] * F[j, k]
            identity = 1.0 if i == j else 0.0
            sigma[i, j] = law.shear / J * (b - identity) + law.lame * (J - 1.0) * identity


@implements(energy_density, SimoPisterLaw)
def _energy(law, axes, F, state):
    J = determinant(axes, F)
    stretch = 0.0
    for i in range(len(axes)):
        for k in range(len(axes)):
            stretch += F[i, k] * F[i, k]
        stretch -= 1.0
    return 0.5 * law.lame * (J - 1.0) ** 2 + 0.5 * law.shear * (stretch - 2.0 * np.log(J))
