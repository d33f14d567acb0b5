"""FLIP: particles keep their velocities, which the nodal accelerations change (Wobbes 2020, Eqs. 27, 97)."""

from typing import Any, ClassVar

from mpmbench.core.registry import register
from mpmbench.core.transfer import Transfer, TransferPromises


@register("transfer", "flip")
class Flip(Transfer):
    """Fluid-implicit-particle transfer, Brackbill and Ruppel 1986: no dissipation, some noise."""

    promises: ClassVar[TransferPromises] = TransferPromises(energy=True, order=3.0)

    def flip_weight(self, choices: Any) -> float:
        """All of it."""
        return 1.0
