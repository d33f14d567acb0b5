"""Velocities from differences of positions, as OTM has them (Li 2009; Wobbes 2020, Eq. 49).

They are those of PIC: ``(x^{s+1} - x^s)/dt = sum_i phi_i v_i^{s+1}`` (Eq. 68), here without the
cancellation of subtracting positions. The name stays, for the method is known by it.
"""

from mpmbench.core.registry import register
from mpmbench.core.transfer.pic import Pic


@register("transfer", "position_difference")
class PositionDifference(Pic):
    """PIC under the name that papers on OTM give it."""
