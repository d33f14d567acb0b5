"""Static equilibrium under load steps: time is the load factor, and each step is one solution of ``f_int = f_ext``.

Iaconeta 2017, section 5.1. With nodes that move this is UL-FEM or GMM; with nodes that are reset it
is implicit MPM, whose particles are located anew after each load step.
"""

from dataclasses import dataclass
from typing import ClassVar

from mpmbench.core.implicit.newton import Equations, equilibrate
from mpmbench.core.implicit.step import apply_loads, convect, prepare, reaction
from mpmbench.core.loads import body_force, work_of_loads
from mpmbench.core.loops.implicit import ImplicitLoop
from mpmbench.core.registry import register
from mpmbench.core.state import State


@register("method", "static")
@dataclass(frozen=True)
class Static(ImplicitLoop):
    """The loop over load steps, each of which ends in equilibrium."""

    time: str = "static"
    dynamic: ClassVar[bool] = False

    def one_step(self, s: State, dt: float) -> None:
        """Find equilibrium with the loads at ``time + dt``."""
        w = prepare(s)
        before = body_force(s, s.time).copy()
        apply_loads(s, w, s.time + dt)
        equations = Equations(s, w, s.nodes.f_external, dt, inertia=None)
        du, residual = equilibrate(s, equations)
        moved = convect(s, w, du)
        if equations.contact is not None:
            equations.contact.finish(s, du, residual, dt)
        s.record("reaction", reaction(s, w, residual))
        s.external_work += work_of_loads(s, before, moved, dt)
        s.time += dt
