"""APIC with the sign of its affine term turned round: the contract must find it."""

import numpy as np

from mpmbench import State, register
from mpmbench.samples.plain_apic import PlainApic


@register("transfer", "plain_flipped")
class PlainFlipped(PlainApic):
    """What `plain_apic.py` does, with a mistake in `to_nodes`."""

    def to_nodes(self, s: State, q: np.ndarray) -> None:
        """Subtract what should be added."""
        right = np.zeros_like(q)
        super().to_nodes(s, right)
        q -= right
