"""ASFLIP, affine-augmented separable FLIP (Fei, Guo, Wu, Huang and Gao 2021).

APIC's affine part, and a share of what PIC takes from each velocity, the remainder of FLIP, given back:

    v_p <- sum_i phi_i v_i + alpha (v_p - sum_i phi_i v_i^old)
    x_p <- x_p + dt (sum_i phi_i v_i + alpha beta_p (v_p - sum_i phi_i v_i^old))

alpha is ``method.flip`` (0.97 in the authors' program), and beta_p ``method.separation`` where the
material is not compressed, else zero: particles of bodies that part follow their own velocities.
"""

from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from mpmbench.core.particles import ParticleData
from mpmbench.core.registry import register
from mpmbench.core.transfer import TransferPromises
from mpmbench.core.transfer.apic import Apic
from mpmbench.core.transfer.series import add_interpolated

if TYPE_CHECKING:
    from mpmbench.core.state import State

COMPRESSED = np.exp(-1e-3)  # of det F: below it the authors' program lets no particle separate


@register("transfer", "asflip")
class Asflip(Apic):
    """Affine-augmented separable FLIP, Fei et al. 2021: apic with ``method.flip`` and ``method.separation``.

    With ``method.flip=0`` it is APIC. Places that follow make it of order 2 on the plate, where apic has 3. What
    is given back belongs to no affine field: the angular
    momentum is not exact.
    """

    particle_data: ClassVar[dict[str, ParticleData]] = {
        **Apic.particle_data,
        "remainder": ParticleData(("dim",), "m s-1", "part of the velocity that nodes do not have"),
    }
    promises: ClassVar[TransferPromises] = TransferPromises(affine=True)

    def flip_weight(self, choices: Any) -> float:
        """The method's setting, alpha."""
        return float(choices.flip)

    def to_particles(self, s: "State", dt: float) -> None:
        """Keep ``alpha (v_p - sum_i phi_i v_i^old)``, which is v_p without the nodes' part now."""
        remainder = s.particles.data["remainder"]
        remainder[:] = 0.0
        add_interpolated(s.basis.handle, s.particles.x, s.nodes.v, remainder)
        np.subtract(s.particles.v, remainder, out=remainder)

    def shift(self, s: "State", dt: float) -> None:
        """Let particles of material that is not compressed follow it, ``x_p += dt beta remainder``."""
        p = s.particles
        free = p.V >= COMPRESSED * p.V0
        p.x[free] += dt * s.choices.separation * p.data["remainder"][free]
