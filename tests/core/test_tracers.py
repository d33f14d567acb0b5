"""Points without mass: they end nothing, and move with the material at a free surface too."""

from typing import Any

import numpy as np
import pytest

from mpmbench.core import registry
from mpmbench.core.errors import BrokeDown
from mpmbench.core.geometry import Box
from mpmbench.core.guards import guard
from mpmbench.core.loops import find_loop
from mpmbench.core.loops.explicit import Explicit
from mpmbench.core.particles import Particles, seed_cells
from mpmbench.core.simulation import Body, build_state, simulate
from mpmbench.core.state import Loads, State


def pressed_column(cells: int) -> tuple[str, np.ndarray]:
    """Height of the tracer on a column of 50 m that its weight presses to 24.0596 m.

    Uniaxial strain, so that ``E ln(l) / l = -rho g (H - X)``; implicit MPM, quadratic splines.
    """
    h = 50.0 / cells
    block = Box((0.0, 0.0), (2.0 * h, 50.0), (2, cells))
    law = registry.get("material", "hencky_elastic")(
        young_modulus=1e4, poisson_ratio=0.0, density=80.0
    )
    X, V0 = seed_cells(block, 4, "gauss")
    p = Particles.at_rest(X, V0, 80.0, np.array([[h, 50.0]]))

    def walls(x: np.ndarray) -> np.ndarray:
        return np.stack([(x[:, 0] < 1e-9) | (x[:, 0] > 2.0 * h - 1e-9), x[:, 1] < 1e-9], axis=1)

    def weight(X: np.ndarray, t: float, b: np.ndarray) -> None:
        b[:, 0], b[:, 1] = 0.0, -10.0 * t

    body = Body(block, p, walls, np.zeros_like, Loads(body_force=weight))
    basis = registry.get("basis", "bspline")()
    state = build_state(body, basis, law, find_loop("static")(transfer="flip"))
    return simulate(state, 1.0 / 40.0, 1.0).status, p.x[-1]


def test_the_top_of_a_pressed_column_is_known() -> None:
    """By its nodes it left the grid with 8 cells, and stood at 25.77 m with 64."""
    errors = []
    for cells in (8, 16, 32):
        status, top = pressed_column(cells)
        assert status == "ok"
        errors.append(abs(top[1] - 24.0596))
    assert errors[0] < 0.45 and errors[0] > errors[1] > errors[2], errors


def moving_block(choices: Any, basis: str = "linear", velocity: float = 1.0) -> State:
    """A block in the plane with tracers on its corner and in its middle."""
    block = Box((1.0, 1.0), (2.0, 2.0), (4, 4))
    grid = Box((0.0, 0.0), (3.0, 3.0), (12, 12))
    law = registry.get("material", "neo_hookean")(young_modulus=10.0, density=10.0)
    X, V0 = seed_cells(block, 4)
    p = Particles.at_rest(X, V0, 10.0, np.array([[2.0, 2.0], [1.5, 1.5]]))
    p.v[:] = velocity
    body = Body(
        block if choices.on_body else grid,
        p,
        lambda x: np.zeros(x.shape, dtype=bool),
        lambda x: np.full(x.shape, velocity),
    )
    return build_state(body, registry.get("basis", basis)(), law, choices)


@pytest.mark.parametrize("update", ("usl", "usf", "musl"))
@pytest.mark.parametrize("basis", ("linear", "bspline"))
def test_tracers_on_a_surface_move_with_the_block(basis: str, update: str) -> None:
    """Through cells whose far nodes no particle sees, and over their edges."""
    state = moving_block(Explicit(stress_update=update), basis)
    assert simulate(state, 1.0 / 256.0, 0.75).status == "ok"
    p = state.particles
    assert np.abs(p.x - p.X - 0.75).max() < 1e-12


def test_tracers_follow_on_an_implicit_grid() -> None:
    state = moving_block(find_loop("newmark")(transfer="flip"))
    assert simulate(state, 1.0 / 64.0, 0.75).status == "ok"
    p = state.particles
    assert np.abs(p.x - p.X - 0.75).max() < 1e-7


@pytest.mark.parametrize("place", ([3.5, 2.0], [np.nan, 2.0]))
def test_a_tracer_outside_is_put_back_and_a_particle_ends_the_run(place: list[float]) -> None:
    state = moving_block(Explicit())
    p = state.particles
    p.x[-2] = place
    guard(state)
    assert state.basis.first_outside(p.x[-2:]) < 0
    assert np.linalg.norm(p.x[-2] - [2.0, 2.0]) < 1.2
    p.x[0] = [3.5, 2.0]
    with pytest.raises(BrokeDown, match="particle 0 at"):
        guard(state)
