"""No motion at all: for studies of shape functions, whose problem observes them."""

from dataclasses import dataclass
from typing import ClassVar

from mpmbench.core.loops import TimeLoop
from mpmbench.core.registry import register
from mpmbench.core.state import State


@register("method", "evaluate")
@dataclass(frozen=True)
class Evaluate(TimeLoop):
    """Lets the time pass."""

    time: str = "evaluate"
    dynamic: ClassVar[bool] = False
    moves_particles: ClassVar[bool] = False

    def step(self, s: State, dt: float) -> None:
        """Let `dt` [s] pass."""
        s.time += dt
