"""Velocities stay on nodes that move with the material (Li 2009, Eq. 3.92).

Masses of nodes change as functions do, and with them the momentum ``sum_i m_i v_i`` of velocities that
are kept: by about 1e-8 in each step in which bodies see each other's nodes. Between several bodies
what particles have lost or won by their new functions is given back by these,

    v_i <- v_i + 1/m_i sum_p m_p phi_i(x_p) (v_p - sum_j phi_j(x_p) v_j),

which is ``sum_p m_p v_p`` again and does not depend on a common velocity. In a single body nothing
changes: its results stay those of the thesis' equation. Energy can grow by it, as
`mpmbench.core.matrix.mass.KeptMass` says, whose masses need nothing of this.
"""

from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from mpmbench.core.errors import NotApplicable
from mpmbench.core.registry import register
from mpmbench.core.transfer import Transfer, TransferPromises
from mpmbench.core.transfer.series import there_and_back

if TYPE_CHECKING:
    from mpmbench.core.state import State


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

    def start(self, s: "State") -> None:
        """Allocate the momentum of the new functions and what is given back, each of shape (N, dim)."""
        if s.room is None:
            s.room = np.zeros_like(s.nodes.v), np.zeros_like(s.nodes.v)

    def keep_momentum(self, s: "State") -> None:
        """Give back what new functions have taken, where there are several bodies."""
        if s.bodies.count < 2 or s.choices.mass == "kept":
            return
        n, p, (momentum, change) = s.nodes, s.particles, s.room
        momentum[:], change[:] = 0.0, 0.0
        there_and_back(s.basis.handle, p.x, p.m, n.v_old, momentum)
        s.mass.solve(np.subtract(n.q, momentum, out=momentum), change)
        n.v_old += change
