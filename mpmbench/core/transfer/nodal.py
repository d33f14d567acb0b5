"""Velocities stay on nodes that move with the material (Li 2009, Eq. 3.92)."""

from typing import Any, ClassVar

from mpmbench.core.errors import NotApplicable
from mpmbench.core.registry import register
from mpmbench.core.transfer import Transfer, TransferPromises


@register("transfer", "nodal")
class Nodal(Transfer):
    """No transfer: particles only read off the velocity of the nodes."""

    promises: ClassVar[TransferPromises] = TransferPromises(affine=True, energy=True)
    velocity_on_nodes: ClassVar[bool] = True

    def check(self, choices: Any) -> None:
        """Refuse nodes that do not follow the material: velocities would stay behind."""
        if not choices.on_body:
            raise NotApplicable(
                f"method.transfer={choices.transfer} needs nodes that move with the material "
                "(method.nodes=moving)"
            )
