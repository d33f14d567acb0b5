"""APIC, the affine particle-in-cell method (Jiang, Schroeder, Selle, Teran and Stomakhin 2015)."""

from typing import TYPE_CHECKING, ClassVar

import numpy as np

from mpmbench.core.bases.frozen import FrozenBasis
from mpmbench.core.particles import ParticleData
from mpmbench.core.registry import register
from mpmbench.core.transfer import TransferPromises
from mpmbench.core.transfer.affine import Affine, spin

if TYPE_CHECKING:
    from mpmbench.core.state import State


@register("transfer", "apic")
class Apic(Affine):
    """Affine particle-in-cell transfer, Jiang et al. 2015: particles carry B_p, and D_p is that of the new place.

    Where the functions are piecewise linear, D_p vanishes on the faces of cells. There
    ``B_p D_p^-1``, both at the old place, is the gradient, which is carried instead, and the
    angular momentum is not exact.
    """

    particle_data: ClassVar[dict[str, ParticleData]] = {
        "affine": ParticleData(("dim", "dim"), "m2 s-1", "affine part of the velocity field, B")
    }
    moments = True
    promises: ClassVar[TransferPromises] = TransferPromises(
        affine=True, energy=True, order=3.0, angular_momentum=True
    )

    def keeps_moments(self, s: "State") -> bool:
        """Unless D_p may vanish where a particle goes."""
        return s.smooth or isinstance(s.basis, FrozenBasis)

    def spin(self, s: "State") -> np.ndarray:
        """``sum_p m_p (B_yx - B_xy)`` and its like in other planes; nothing where B_p is not kept."""
        if not self.keeps_moments(s):
            return np.zeros(3)
        return spin(s.particles.data["affine"], s.particles.m)
