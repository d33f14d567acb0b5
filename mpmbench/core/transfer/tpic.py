"""TPIC: particles carry the gradient of the velocity field (Nakamura, Matsumura and Mizutani 2023)."""

from typing import Any, ClassVar

from mpmbench.core.errors import NotApplicable
from mpmbench.core.particles import ParticleData
from mpmbench.core.registry import register
from mpmbench.core.transfer import TransferPromises
from mpmbench.core.transfer.affine import Affine


@register("transfer", "tpic")
class Tpic(Affine):
    """Taylor particle-in-cell transfer, Nakamura et al. 2023: ``C_p = sum_i v_i (x) grad phi_i``."""

    particle_data: ClassVar[dict[str, ParticleData]] = {
        "affine": ParticleData(("dim", "dim"), "s-1", "gradient of the velocity that is carried")
    }
    moments = False
    promises: ClassVar[TransferPromises] = TransferPromises(affine=True, energy=True, order=3.0)

    def check(self, choices: Any) -> None:
        """Refuse frozen functions too, whose gradients belong to other places than their nodes."""
        super().check(choices)
        if choices.frozen:
            raise NotApplicable(
                f"method.transfer={choices.transfer} needs method.shape_functions=updated: gradients "
                "of frozen functions are pushed forward, their nodes are not; apic can be had"
            )
