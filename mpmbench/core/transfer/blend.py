"""A mean of FLIP and PIC."""

from typing import Any

from mpmbench.core.registry import register
from mpmbench.core.transfer import Transfer


@register("transfer", "blend")
class Blend(Transfer):
    """A mean: FLIP with the weight ``method.flip``, PIC with the rest."""

    def flip_weight(self, choices: Any) -> float:
        """The method's setting."""
        return float(choices.flip)
