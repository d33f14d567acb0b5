"""A time loop from outside: the explicit one with viscous damping of the particles, for rest positions."""

from dataclasses import dataclass

from mpmbench.core.errors import require
from mpmbench.core.loops.explicit import Explicit
from mpmbench.core.registry import register
from mpmbench.core.state import State


@register("method", "damped")
@dataclass(frozen=True)
class Damped(Explicit):
    """Settings of the explicit loop, and `damping` [1/s]: velocities lose the share ``damping dt`` per step."""

    damping: float = 100.0

    def __post_init__(self) -> None:
        super().__post_init__()
        require(self.damping >= 0.0, "damping", self.damping, "a number of at least 0")

    def step(self, s: State, dt: float) -> None:
        """Do one explicit step, then damp."""
        super().step(s, dt)
        s.particles.v *= 1.0 - self.damping * dt
