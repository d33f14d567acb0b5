"""Static equilibrium under load steps: time is the load factor, and each step is one solution of ``f_int = f_ext``.

Iaconeta 2017, section 5.1. With nodes that move this is UL-FEM or GMM; with nodes that are reset it
is implicit MPM, whose particles are located anew after each load step.
"""

from mpmbench.core.implicit import check_choices
from mpmbench.core.implicit.newton import Equations, equilibrate
from mpmbench.core.implicit.step import convect, halve_when_needed, prepare, reaction
from mpmbench.core.loads import body_force, external_force, work_of_loads
from mpmbench.core.materials import kirchhoff_stress
from mpmbench.core.registry import register
from mpmbench.core.state import State


def one_step(s: State, dt: float) -> None:
    """Find equilibrium with the loads at ``time + dt``."""
    w = prepare(s)
    before = body_force(s, s.time).copy()
    external_force(s, w.phi, s.time + dt, s.nodes.f_external)
    equations = Equations(s, w, s.nodes.f_external, dt, inertia=None)
    du, residual = equilibrate(s, equations)
    moved = convect(s, w, du)
    s.record("reaction", reaction(s, w, residual))
    s.external_work += work_of_loads(s, before, moved, dt)
    s.time += dt


step = register("method", "static")(halve_when_needed(one_step))
step.check = check_choices  # type: ignore[attr-defined]
step.needs = kirchhoff_stress  # type: ignore[attr-defined]
