"""What particles take from the nodes, against the formulas in plain numpy with dense matrices."""

import numpy as np
import pytest

from mpmbench.contracts.materials import stress
from mpmbench.core import registry
from mpmbench.core.geometry import Box
from mpmbench.core.loops.explicit import Explicit, carry, step
from mpmbench.core.particles import Particles
from mpmbench.core.simulation import Body, build_state
from mpmbench.core.state import State
from mpmbench.core.transfer.carry import Update, velocity_gradients

DT = 0.01


def scene(dim: int, choices: Explicit | None = None) -> State:
    """Deformed particles under stress and two points without mass, among nodes with any velocities."""
    rng = np.random.default_rng(dim)
    grid = Box((0.0,) * dim, (1.0,) * dim, (3,) * dim)
    law = registry.get("material", "neo_hookean")(young_modulus=10.0, density=10.0)
    X, tracers = rng.uniform(0.1, 0.9, (20, dim)), rng.uniform(0.1, 0.9, (2, dim))
    p = Particles.at_rest(X, rng.uniform(0.5, 1.0, 20), law.density, tracers, 0, True)
    p.v[:] = rng.standard_normal(p.v.shape)
    p.F[:] += 0.1 * rng.standard_normal(p.F.shape)
    p.sigma[:20] = np.eye(dim)
    free = Body(grid, p, lambda x: np.zeros(x.shape, dtype=bool), np.zeros_like)
    state = build_state(free, registry.get("basis", "linear")(), law, choices or Explicit())
    state.basis.locate(p.x)
    state.nodes.v[:] = rng.standard_normal(state.nodes.v.shape)
    state.nodes.a[:] = 10.0 * rng.standard_normal(state.nodes.a.shape)
    return state


@pytest.mark.parametrize("dim", (1, 2))
@pytest.mark.parametrize("flip", (0.0, 0.3, 1.0))
def test_velocities_are_a_blend_and_positions_follow_the_nodes(flip: float, dim: int) -> None:
    state = scene(dim)
    p, n = state.particles, state.nodes
    phi = state.basis.evaluate(p.x).matrix(len(n.v))
    x, v = p.x.copy(), p.v.copy()
    carry(state, DT, Update(True, False, True, True, flip))
    expected = flip * (v + DT * phi @ n.a) + (1.0 - flip) * phi @ n.v
    assert np.allclose(p.v, expected, rtol=0.0, atol=1e-13)
    assert np.allclose(p.x, x + DT * phi @ n.v, rtol=0.0, atol=1e-14)
    assert np.allclose(p.a, phi @ n.a, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("dim", (1, 2))
def test_deformation_and_stress_follow_the_velocity_gradient(dim: int) -> None:
    """``L = sum v_i (x) grad phi_i`` is not symmetric, and tracers are not strained."""
    state = scene(dim)
    p, eye = state.particles, np.eye(dim)
    gradient = state.basis.evaluate(p.x).gradient_matrix(len(state.nodes.v))
    L = np.einsum("pie,id->pde", gradient, state.nodes.v)
    F, v = p.F.copy(), p.v.copy()
    carry(state, DT, Update(False, True, False, False, 1.0))
    expected = np.where(p.V0[:, None, None] > 0.0, (eye + DT * L) @ F, F)
    some = p.material
    assert np.allclose(p.F, expected, rtol=0.0, atol=1e-13)
    assert np.allclose(p.L[some], L[some], rtol=0.0, atol=1e-12)
    assert np.allclose(p.V, p.V0 * np.linalg.det(p.F), rtol=1e-13)
    sigma = [stress(state.material, one) for one in p.F[some]]
    assert np.allclose(p.sigma[some], sigma, rtol=1e-12)
    assert not p.sigma[-2:].any() and not p.L[-2:].any()
    assert np.array_equal(p.v, v)
    all_L = np.zeros_like(L)
    velocity_gradients(state.basis.handle, p.x, state.nodes.v, all_L, 0, len(p.x))
    assert np.allclose(all_L, L, rtol=0.0, atol=1e-12)


def test_musl_moves_particles_as_usl_does() -> None:
    """Velocities that are mapped back once more are for the strain alone: it differs, and nothing else."""
    usl, musl = (scene(2, Explicit(stress_update=one)) for one in ("usl", "musl"))
    for state in (usl, musl):
        step(state, DT)
    assert np.array_equal(musl.particles.v, usl.particles.v)
    assert np.array_equal(musl.particles.x, usl.particles.x)
    assert np.array_equal(musl.nodes.v, usl.nodes.v)
    assert np.abs(musl.particles.F - usl.particles.F).max() > 1e-3 * DT
