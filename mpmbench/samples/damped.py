"""A time loop: the explicit one with viscous damping of the particles, for rest positions."""

from dataclasses import dataclass, replace

from mpmbench import Explicit, LoopPromises, State, register, setting


@register("method", "damped")
@dataclass(frozen=True)
class Damped(Explicit):
    """Explicit MPM with viscous damping."""

    damping: float = setting(100.0, "share of the velocity lost per second", unit="1/s", least=0.0)

    @property
    def promises(self) -> LoopPromises:
        """Damping takes momentum and energy away, and there is no exact solution to compare with."""
        undamped = super().promises
        if self.damping == 0.0:
            return undamped
        return replace(undamped, conserves=frozenset({"mass"}), order=None)

    def step(self, s: State, dt: float) -> None:
        """Do one explicit step, after which velocities lose the share ``damping dt``."""
        super().step(s, dt)
        s.particles.v *= 1.0 - self.damping * dt
