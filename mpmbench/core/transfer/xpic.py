"""XPIC, extended particle-in-cell (Hammerquist and Nairn 2017)."""

from typing import TYPE_CHECKING

from mpmbench.core.registry import register
from mpmbench.core.transfer.series import Series, add_interpolated

if TYPE_CHECKING:
    from mpmbench.core.state import State


@register("transfer", "xpic")
class Xpic(Series):
    """Extended particle-in-cell transfer, Hammerquist and Nairn 2017: a filter of order ``method.transfer_order``.

    ``V <- (1 - (1 - S S+)^k) V + dt S a``: only the velocity is filtered, not the acceleration, and
    positions follow the lumped velocities, ``x += dt S (v_old + a dt)``; the second-order rule of
    the paper for positions is not used. With k = 1 it is PIC.
    """

    def to_particles(self, s: "State", dt: float) -> None:
        """Add ``S sum_{0 < l < k} (1 - S+ S)^l v_old`` to the velocities of PIC."""
        p = s.particles
        add_interpolated(s.basis.handle, p.x, self.higher_terms(s, s.nodes.v_old), p.v)
