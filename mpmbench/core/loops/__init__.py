"""Time loops: one file per loop, registered with ``@register("method", name)``."""

from mpmbench.core.choices import Choices

__all__ = ["Choices"]
