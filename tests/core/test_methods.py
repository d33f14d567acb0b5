"""The contract of every method: the presets and every choice that differs from them, in every dimension.

Each combination of nodes, functions, mass, transfer and stress update either runs the whole contract, or says why not.
"""

import itertools
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from mpmbench.core import registry
from mpmbench.core.errors import NotApplicable
from mpmbench.core.geometry import Box
from mpmbench.core.methods import Choices
from mpmbench.core.methods.explicit import update_particles
from mpmbench.core.particles import Particles, seed_cells
from mpmbench.core.simulation import Body, build_state, simulate
from mpmbench.core.state import Loads, State
from tests.core.support import options, section

PRESETS = [Choices(**section("method", name)) for name in options("method")]
EXPLICIT = [choices for choices in PRESETS if choices.time == "explicit"]
COMBINATIONS = [
    Choices("combination", "explicit", *parts)
    for parts in itertools.product(
        ("fixed", "moving"),
        ("updated", "frozen"),
        ("lumped", "consistent"),
        ("flip", "pic", "blend", "position_difference", "nodal"),
        (0.9,),
        ("usl", "usf", "musl"),
    )
]


def applicable(choices: Choices) -> bool:
    try:
        registry.get("method", choices.time).check(choices)
    except NotApplicable:
        return False
    return True


def name_of(choices: Choices) -> str:
    return "-".join((choices.nodes, choices.shape_functions, choices.mass, choices.transfer, choices.stress_update))


ALL = pytest.mark.parametrize("choices", [c for c in COMBINATIONS if applicable(c)], ids=name_of)
DIMENSIONS = pytest.mark.parametrize("dim", (1, 2, 3))


def body(
    choices: Choices,
    dim: int,
    velocity: Any,
    basis: str = "linear",
    material: str = "neo_hookean",
    loads: Loads | None = None,
    fixed: Any = None,
    cells: int = 3,
) -> State:
    """A block of `cells` a side, 3 particles per axis and cell, with two empty cells around it on the fixed grid."""
    h = 0.25
    block = Box((2 * h,) * dim, ((2 + cells) * h,) * dim, (cells,) * dim)
    domain = Box((0.0,) * dim, ((4 + cells) * h,) * dim, (4 + cells,) * dim)
    law = registry.get("material", material)(young_modulus=1e4, poisson_ratio=0.3 if dim > 1 else 0.0, density=10.0)
    X, V0 = seed_cells(block, 3**dim)
    p = Particles.at_rest(X, V0, law.density)
    p.v[:] = velocity(p.X)
    geometry = block if choices.moving or choices.frozen else domain
    free = fixed or (lambda x: np.zeros(x.shape, dtype=bool))
    plugin = registry.get("basis", basis)()
    return build_state(Body(geometry, p, free, velocity, loads or Loads()), plugin, law, choices)


def steps(state: State, n: int = 20, dt: float = 5e-4) -> None:
    solution = simulate(state, dt, n * dt)
    assert solution.status == "ok", solution.reason


@ALL
@DIMENSIONS
def test_rigid_translation_is_exact(choices: Choices, dim: int) -> None:
    v = np.arange(1.0, dim + 1.0)
    state = body(choices, dim, lambda x: np.tile(v, (len(x), 1)))
    steps(state)
    p = state.particles
    assert np.allclose(p.x, p.X + state.time * v, atol=1e-12)
    assert np.allclose(p.v, v, atol=1e-10)
    assert np.abs(p.F - np.eye(dim)).max() < 1e-12
    assert np.abs(p.sigma).max() < 1e-6


@ALL
@DIMENSIONS
def test_free_fall_follows_the_leapfrog(choices: Choices, dim: int) -> None:
    """Constant body force: v after n steps is n dt g and x is X + n (n + 1)/2 dt^2 g, exactly."""
    g = -np.arange(1.0, dim + 1.0)

    def gravity(X: np.ndarray, t: float, b: np.ndarray) -> None:
        b[:] = g

    state = body(choices, dim, np.zeros_like, loads=Loads(body_force=gravity))
    steps(state, n=20, dt=5e-4)
    p = state.particles
    assert np.allclose(p.v, 20 * 5e-4 * g, atol=1e-10)
    assert np.allclose(p.x - p.X, 0.5 * 20 * 21 * 5e-4**2 * g, atol=1e-12)
    momentum = p.m @ p.v
    assert np.allclose(momentum, p.m.sum() * state.time * g, rtol=1e-10)
    assert state.external_work == pytest.approx(0.5 * p.m.sum() * (g @ g) * state.time * (state.time + 5e-4), rel=1e-9)


@ALL
@DIMENSIONS
def test_mass_and_momentum_are_conserved(choices: Choices, dim: int) -> None:
    """A block that vibrates freely: stress waves change shape, not momentum."""

    def velocity(x: np.ndarray) -> np.ndarray:
        return 0.5 * np.sin(3.0 * x[:, ::-1] + 1.0) + 0.2

    state = body(choices, dim, velocity)
    before = state.particles.m @ state.particles.v
    steps(state)
    p = state.particles
    after = p.m @ p.v
    assert np.allclose(after, before, atol=1e-11 * p.m.sum())
    assert np.abs(p.sigma).max() > 1.0  # something did happen
    assert np.allclose(p.V, p.V0 * np.linalg.det(p.F), rtol=1e-12)


@ALL
@pytest.mark.parametrize("dim", (2, 3))
@pytest.mark.parametrize("material", ("neo_hookean", "small_strain_elastic"))
def test_angular_momentum_is_conserved_as_declared(choices: Choices, dim: int, material: str) -> None:
    """A spinning block that is also sheared: exact with a consistent mass and a symmetric stress, and only then."""

    def velocity(x: np.ndarray) -> np.ndarray:
        v = np.zeros_like(x)
        v[:, 0], v[:, 1] = -(x[:, 1] - 0.8) + x[:, 0] ** 2, 2.0 * (x[:, 0] - 0.9) * x[:, 1]
        return v

    state = body(choices, dim, velocity, material=material)
    solution = simulate(state, 5e-4, 0.01)  # short: nothing enters an empty cell
    assert solution.status == "ok", solution.reason
    spin = np.array(solution.history["angular_momentum"])[:, 2]
    drift = np.abs(spin - spin[0]).max() / np.abs(spin[0])
    declared = "angular_momentum" in choices.conserves and state.material.symmetric
    assert (drift < 1e-11) == declared, drift


@ALL
@DIMENSIONS
def test_patch_of_uniform_stretch(choices: Choices, dim: int) -> None:
    """A linear velocity field deforms every particle alike, in one step: F = I + dt grad v, x follows the same map."""
    gradient = 0.3 * np.arange(1.0, dim * dim + 1.0).reshape(dim, dim) / dim**2
    state = body(choices, dim, lambda x: x @ gradient.T, cells=5)
    dt = 1e-3
    steps(state, n=1, dt=dt)
    p = state.particles
    if choices.mass == "consistent" or choices.transfer == "nodal":
        assert np.allclose(p.F, np.eye(dim) + dt * gradient, atol=1e-10)
        if choices.stress_update != "usf":  # there the new stress accelerates the particles within the step
            assert np.allclose(p.x, p.X @ (np.eye(dim) + dt * gradient).T, atol=1e-10)
    else:  # the lumped projection is exact only away from the free surface
        inner = np.all(np.abs(p.X - 1.125) < 0.125, axis=1)
        assert np.allclose(p.F[inner], np.eye(dim) + dt * gradient, atol=1e-12)


@ALL
def test_stress_free_body_at_rest_stays(choices: Choices) -> None:
    state = body(choices, 2, np.zeros_like)
    steps(state)
    assert np.abs(state.particles.x - state.particles.X).max() == 0.0


@pytest.mark.parametrize("choices", [c for c in COMBINATIONS if not applicable(c)], ids=name_of)
def test_senseless_combinations_are_refused_with_a_reason(choices: Choices) -> None:
    with pytest.raises(NotApplicable, match="method\\."):
        registry.get("method", choices.time).check(choices)


@pytest.mark.parametrize("choices", EXPLICIT, ids=lambda c: c.name)
def test_constraints_act_per_component(choices: Choices) -> None:
    """Rollers: the fixed component of a boundary node rests, the other is free."""

    def floor(x: np.ndarray) -> np.ndarray:
        mask = np.zeros(x.shape, dtype=bool)
        mask[:, 1] = x[:, 1] < 0.501
        return mask

    state = body(choices, 2, lambda x: np.column_stack([np.ones(len(x)), -np.ones(len(x))]), fixed=floor)
    steps(state, n=10)
    p = state.particles
    assert np.allclose(p.m @ p.v[:, 0], p.m.sum(), rtol=1e-10)
    lowest = p.X[:, 1] < 0.55
    assert np.abs(p.v[lowest, 1]).max() < 0.9


@pytest.mark.parametrize("choices", EXPLICIT, ids=lambda c: c.name)
def test_tracers_follow_and_do_nothing(choices: Choices) -> None:
    """Massless points change nothing and move with the material around them."""
    with_tracer = body(choices, 1, lambda x: np.sin(x))
    p = with_tracer.particles
    extra = Particles.at_rest(p.X.copy(), p.V0, 10.0, tracers=np.array([[0.5], [0.9]]))
    extra.v[:] = np.sin(extra.X)
    geometry = Box((0.5,), (1.25,), (3,)) if choices.moving or choices.frozen else Box((0.0,), (1.75,), (7,))
    plugin = registry.get("basis", "linear")()
    fixed = np.zeros_like
    other = build_state(
        Body(geometry, extra, lambda x: fixed(x, dtype=bool), np.sin), plugin, with_tracer.material, choices
    )
    steps(with_tracer)
    steps(other)
    assert np.array_equal(other.particles.x[:-2], p.x)
    assert np.array_equal(other.particles.sigma[:-2], p.sigma)
    assert np.all(np.abs(other.particles.x[-2:] - other.particles.X[-2:]) > 1e-3)


def test_flip_weight_of_the_blend() -> None:
    assert replace(Choices(), transfer="blend", flip=0.95).flip_weight == 0.95
    assert replace(Choices(), transfer="pic").flip_weight == 0.0
    assert Choices().flip_weight == 1.0


@DIMENSIONS
def test_deformations_multiply_from_the_left(dim: int) -> None:
    """Two linear velocity fields one after the other: ``F = (I + dt B)(I + dt A)``, not the other way round."""
    rng = np.random.default_rng(dim)
    state = body(Choices(), dim, np.zeros_like)
    expected = np.eye(dim)
    for gradient in rng.standard_normal((2, dim, dim)):
        state.nodes.v[:] = state.basis.nodes @ gradient.T
        update_particles(state, 0.1, strain=True)
        expected = (np.eye(dim) + 0.1 * gradient) @ expected
    assert np.allclose(state.particles.F, expected, atol=1e-12)
    assert np.allclose(state.particles.V, state.particles.V0 * np.linalg.det(expected), rtol=1e-12)
