"""FMPM, the full mass matrix by a series (Nairn and Hammerquist 2021)."""

from typing import TYPE_CHECKING

from mpmbench.core.registry import register
from mpmbench.core.transfer.series import Series

if TYPE_CHECKING:
    from mpmbench.core.state import State


@register("transfer", "fmpm")
class Fmpm(Series):
    """Velocities by ``method.transfer_order`` terms towards the consistent mass, Nairn and Hammerquist 2021.

    ``v = sum_{l < k} (1 - S+ S)^l (p + f dt) / m``, of which velocities, positions and deformations
    are taken: ``V = S v``, ``x += dt S v``. With k = 1 it is PIC. Forces are not in the range of the
    consistent mass where particles are few; there the sum grows like k, and so must the time step fall.
    """

    def refine(self, s: "State") -> None:
        """Add the further terms to the nodal velocities."""
        s.nodes.v += self.higher_terms(s, s.nodes.v)
