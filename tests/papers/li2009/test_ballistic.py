"""Particles without interaction (Li 2009, section 3.1): Eq. 3.52 carries them on straight lines, for any step.

An affine velocity is in the space of the functions, so that a body next to without stiffness moves as its
particles would alone: ``x = X + t v(X)``, with the density of Eq. 3.41 and the action of Eq. 3.48.
"""

from typing import Any

import numpy as np
import pytest

from mpmbench import case
from mpmbench.core import registry
from mpmbench.core.loops.explicit import Explicit
from mpmbench.core.simulation import simulate
from mpmbench.core.state import State
from mpmbench.papers.li2009.support import CONSISTENT, LUMPED
from mpmbench.settings import schema

RATE, END = 0.5, 0.3  # of the stretch [1/s]; [s]
STIFFNESS = 1e-30  # [Pa]


def flown(form: dict[str, str], dt: float) -> tuple[State, np.ndarray]:
    """A stretching block of 4 x 4 cells at the end, and its initial velocity [m/s]."""
    own = {"mass": form["mass"], "transfer": form["method__transfer"]}
    choices = Explicit(**schema.composed("method", "otm")["method"] | own)
    problem = registry.get("problem", "rigid_motion")(stretch=RATE)
    law = registry.get("material", "neo_hookean")(young_modulus=STIFFNESS, density=10.0)
    body = case.Case(problem, choices, registry.get("basis", "lme")(), law, "lme", 4, 4)
    state = case.build(body)
    start = problem.velocity(state.particles.X, state.material)
    solution = simulate(state, dt, END)
    assert solution.status == "ok", solution.reason
    return state, start


@pytest.mark.parametrize("dt", [0.3, 0.1, 0.004])
@pytest.mark.parametrize("form", [LUMPED, CONSISTENT], ids=["nodal", "position differences"])
def test_particles_fly_on_straight_lines(form: Any, dt: float) -> None:
    state, v = flown(form, dt)
    p = state.particles
    assert np.abs(p.x - (p.X + END * v)).max() < 1e-11
    assert np.abs(p.v - v).max() < 1e-10
    assert np.abs(p.V / p.V0 - (1.0 + RATE * END) ** 2).max() < 1e-10
    action = 0.5 * float(p.m @ ((p.x - p.X) ** 2).sum(axis=1)) / END
    assert action == pytest.approx(END * 0.5 * float(p.m @ (v**2).sum(axis=1)), rel=1e-10)


def test_position_differences_with_a_lumped_mass_are_a_filter() -> None:
    """They slow a stretch down, since the projection on the nodes smooths the velocity."""
    state, v = flown(LUMPED | {"method__transfer": "position_difference"}, 0.004)
    p = state.particles
    assert np.abs(p.x - (p.X + END * v)).max() > 0.01
