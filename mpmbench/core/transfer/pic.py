"""PIC: particles take the interpolated velocity of the nodes, which filters it in every step."""

from typing import ClassVar

from mpmbench.core.registry import register
from mpmbench.core.transfer import Transfer, TransferPromises


@register("transfer", "pic")
class Pic(Transfer):
    """Particle-in-cell transfer, Harlow 1964: no noise, much dissipation."""

    promises: ClassVar[TransferPromises] = TransferPromises(order=0.5)
