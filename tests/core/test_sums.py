"""What nodes take from particles, against the formulas in plain numpy with dense matrices."""

import numpy as np
import pytest

from mpmbench.core import registry
from mpmbench.core.geometry import Box
from mpmbench.core.loads import Loads
from mpmbench.core.loops.explicit import Explicit, total_force
from mpmbench.core.particles import SEEN, Particles
from mpmbench.core.simulation import Body, build_state
from mpmbench.core.state import State
from tests.support import slow_if


def scene(dim: int, basis: str, loads: Loads, per_cell: int, **settings: object) -> State:
    """Particles under stress, so many in some cells and one in others, and two points without mass."""
    rng = np.random.default_rng(dim)
    grid = Box((0.0,) * dim, (1.0,) * dim, (3,) * dim)
    law = registry.get("material", "neo_hookean")(young_modulus=10.0, density=10.0)
    corners = rng.permuted(grid.points[np.all(grid.points < 0.9, axis=1)])[:6]
    crowds = corners[:, None, :] + rng.uniform(0.0, 1.0 / 3.0, (len(corners), per_cell, dim))
    X = np.vstack([*crowds, rng.uniform(0.1, 0.9, (21, dim))])
    V0 = rng.uniform(0.5, 1.0, len(X)) / 3**dim
    p = Particles.at_rest(X, V0, law.density, rng.uniform(0.1, 0.9, (2, dim)))
    p.v[:], p.sigma[:] = rng.standard_normal(p.v.shape), rng.standard_normal(p.sigma.shape)
    p.V *= rng.uniform(0.9, 1.1, p.V.shape)
    free = Body(grid, p, lambda x: np.zeros(x.shape, dtype=bool), np.zeros_like, loads)
    state = build_state(free, registry.get("basis", basis)(**settings), law, Explicit())
    state.basis.locate(p.x)
    return state


def push(X: np.ndarray, t: float, b: np.ndarray) -> None:
    b[:] = np.sin(40.0 * X) + t


def check(state: State) -> None:
    p, n = state.particles, state.nodes
    state.time = 0.25
    for _ in range(2):  # the second time, what the first has left must be gone
        total_force(state)
    stored = state.basis.evaluate(p.x)
    phi, gradient = stored.matrix(len(n.m)), stored.gradient_matrix(len(n.m))
    b = np.zeros_like(p.x)
    if state.loads.body_force is not None:
        push(p.X, 0.25, b)
    expected = {
        "m": phi.T @ p.m,
        "q": phi.T @ (p.m[:, None] * p.v),
        "f_internal": -np.einsum("p,pde,pie->id", p.V, p.sigma, gradient),
        "f_external": phi.T @ (p.m[:, None] * b),
    }
    for name, value in expected.items():
        close = np.abs(getattr(n, name) - value).max() <= 1e-13 * max(1.0, np.abs(value).max())
        assert close, name
    assert np.array_equal(n.f, n.f_internal + n.f_external)


@pytest.mark.parametrize(
    ("basis", "settings", "dim", "loads"),
    [
        ("linear", {}, 2, Loads()),
        slow_if(True, "bspline", {"degree": 3}, 2, Loads()),
        # in space without a force by tests/core/test_dimensions.py
        *(slow_if(dim == 3, "linear", {}, dim, Loads(push)) for dim in (1, 2, 3)),
        *(slow_if(dim == 3, "bspline", {"degree": 2}, dim, Loads(push)) for dim in (1, 2, 3)),
        # each basis is compiled anew for each dimension
        *(slow_if(dim == 1, "gimp", {}, dim, Loads(push)) for dim in (1, 2)),
        *(slow_if(dim == 3, "lme", {}, dim, Loads(push)) for dim in (2, 3)),
    ],
)
def test_sums_are_those_of_the_formulas(basis, settings, dim: int, loads: Loads) -> None:
    for per_cell in (3, 8, 29):  # less than a vector holds, as many, and more than a batch
        check(scene(dim, basis, loads, per_cell, **settings))


def test_nodes_that_only_massless_points_see_have_next_to_no_mass() -> None:
    state = scene(1, "linear", Loads(), 3)
    p, n = state.particles, state.nodes
    p.x[: -p.tracers], p.x[-p.tracers :] = 0.1, 0.9
    total_force(state)
    assert np.all(n.m[:2] > 1.0)
    assert np.array_equal(n.m[2:], [SEEN, SEEN])
