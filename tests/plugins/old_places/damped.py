"""A time loop from outside: the explicit one with viscous damping of the particles, for rest positions."""

from mpmbench.core.materials import cauchy_stress
from mpmbench.core.methods import explicit
from mpmbench.core.registry import register
from mpmbench.core.state import State

DAMPING = 100.0  # [1/s]


@register("method", "damped")
def step(s: State, dt: float) -> None:
    """One explicit step, after which velocities lose the share ``DAMPING dt``."""
    explicit.step(s, dt)
    s.particles.v *= 1.0 - DAMPING * dt


step.check = explicit.check  # type: ignore[attr-defined]
step.needs = cauchy_stress  # type: ignore[attr-defined]
