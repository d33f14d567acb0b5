"""Stresses and moduli of the implicit solver: finite differences, the return map, and the global tangent."""

from typing import Any

import numpy as np
import pytest

from mpmbench import case
from mpmbench.contracts.materials import stress_of, typical
from mpmbench.core import registry
from mpmbench.core.compiled import compiled, has_version
from mpmbench.core.implicit.newton import Equations
from mpmbench.core.implicit.step import prepare
from mpmbench.core.loads import external_force
from mpmbench.core.materials import kirchhoff_stress
from mpmbench.core.materials.plastic import PLASTIC_STRAIN, return_map
from mpmbench.core.materials.plastic.mohr_coulomb import (
    APEX,
    COMPRESSION_EDGE,
    ELASTIC,
    EXTENSION_EDGE,
    PLANE,
    MohrCoulomb,
)
from tests.core.plasticity import INFINITE, evaluate
from tests.core.support import compose
from tests.support import slow_if

TANGENT = [
    name
    for name in registry.names("material")
    if has_version(kirchhoff_stress, type(registry.get("material", name)().law))
]
# each law is compiled anew for each dimension: that of the plane here, with a direction out of it
DIMENSIONS = [slow_if(dim != 2, dim) for dim in (1, 2, 3)]
REGIONS = {ELASTIC, PLANE, COMPRESSION_EDGE, EXTENSION_EDGE, APEX}


def kirchhoff(
    material: Any, increment: np.ndarray, F_old: np.ndarray, old: np.ndarray
) -> tuple[np.ndarray, ...]:
    dim = len(F_old)
    state, tau, moduli = np.zeros_like(old), np.zeros((dim, dim)), np.zeros((dim,) * 4)
    # as a static step does it, whose time is infinite
    F = increment @ F_old
    evaluate(material.law, (0.0,) * dim, increment, F, INFINITE, old, state, tau, moduli)
    return tau, moduli, state


def piola(material: Any, increment: np.ndarray, F_old: np.ndarray, old: np.ndarray) -> np.ndarray:
    return kirchhoff(material, increment, F_old, old)[0] @ np.linalg.inv(increment @ F_old).T


def assert_moduli_match(
    material: Any, increment: np.ndarray, F_old: np.ndarray, old: np.ndarray, size: float
) -> None:
    """``dP F^T = a : (dF F^-1)`` by central differences."""
    dim = len(F_old)
    F = increment @ F_old
    _, moduli, _ = kirchhoff(material, increment, F_old, old)
    for j in range(dim):
        for d in range(dim):
            gradient = np.zeros((dim, dim))
            gradient[j, d] = size
            up, down = ((np.eye(dim) + sign * gradient) @ increment for sign in (1.0, -1.0))
            change = (
                (piola(material, up, F_old, old) - piola(material, down, F_old, old))
                / (2.0 * size)
                @ F.T
            )
            assert np.abs(change - moduli[:, :, j, d]).max() <= 1e-6 * np.abs(moduli).max()


@pytest.mark.parametrize("dim", DIMENSIONS)
@pytest.mark.parametrize("name", TANGENT)
def test_moduli_are_the_derivative_of_the_stress(name: str, dim: int) -> None:
    material = typical(name)
    rng = np.random.default_rng(dim)
    for _ in range(4):
        increment, F_old = (np.eye(dim) + 0.1 * rng.standard_normal((dim, dim)) for _ in range(2))
        assert_moduli_match(material, increment, F_old, np.zeros(material.history), 1e-5)
    if name == "hencky_elastic":  # equal principal stretches
        assert_moduli_match(material, 1.1 * np.eye(dim), np.eye(dim), np.zeros(0), 1e-5)


@pytest.mark.parametrize("dim", DIMENSIONS)
@pytest.mark.parametrize("name", TANGENT)
def test_both_stresses_agree(name: str, dim: int) -> None:
    """The explicit methods' stress is ``tau / J`` of the implicit ones', and so is the history, in slow steps."""
    material = typical(name)
    L = 2e-11 * np.random.default_rng(dim + 7).standard_normal((dim, dim))
    F_old, dt = np.diag([1.05, 0.97, 1.02][:dim]), 3e9
    old = np.zeros(material.history)
    tau, _, state = kirchhoff(material, np.eye(dim) + dt * L, F_old, old)
    F, sigma = (np.eye(dim) + dt * L) @ F_old, np.zeros((dim, dim))
    stress_of(material.law, (0.0,) * dim, F, L, dt, old, sigma)
    assert np.allclose(sigma, tau / np.linalg.det(F), rtol=1e-12, atol=1e-9 * np.abs(tau).max())
    assert np.allclose(old, state, rtol=1e-12, atol=1e-14)


@compiled
def return_of(law, trial, tau, moduli):  # type: ignore[no-untyped-def]
    return return_map(law, trial, tau, moduli)


def returned(material: MohrCoulomb, trial: np.ndarray) -> tuple[int, np.ndarray, np.ndarray]:
    tau, moduli = np.zeros(3), np.zeros((3, 3))
    return return_of(material.law, trial, tau, moduli), tau, moduli


@pytest.mark.parametrize("dilatancy", (0.0, 10.0, 25.0))
def test_return_map_satisfies_the_yield_condition(dilatancy: float) -> None:
    """Over 10,000 random trial stresses: on the surface to 1e-10, ordered, every region met, flow outwards."""
    material = MohrCoulomb(dilatancy_angle=dilatancy)
    law, c, phi = material.law, material.cohesion, np.radians(material.friction_angle)
    rng = np.random.default_rng(1)
    met: dict[int, int] = dict.fromkeys(REGIONS, 0)
    for _ in range(10_000):
        trial = np.sort(
            10.0 ** rng.uniform(2, 6) * rng.standard_normal(3) + rng.uniform(-5e4, 3e4)
        )[::-1].copy()
        region, tau, _ = returned(material, trial)
        met[region] += 1
        # the textbook form, written independently of the code's slopes
        f = (tau[0] - tau[2]) + (tau[0] + tau[2]) * np.sin(phi) - 2.0 * c * np.cos(phi)
        scale = max(c, np.abs(trial).max())
        if region == ELASTIC:
            assert np.array_equal(tau, trial)
            assert f <= 1e-10 * scale
            continue
        assert abs(f) < 1e-10 * scale
        assert tau[0] >= tau[1] - 1e-10 * scale
        assert tau[1] >= tau[2] - 1e-10 * scale
        lost = np.linalg.solve(
            law.lame * np.ones((3, 3)) + 2.0 * law.shear * np.eye(3), trial - tau
        )
        assert lost @ trial - lost @ tau > 0.0  # plastic strain is not elastic energy won
        if region == PLANE:  # along the normal of the potential
            assert np.allclose(lost / lost[2], [-law.dilatancy, 0.0, 1.0], atol=1e-8)
    assert min(met.values()) > 50, met


@pytest.mark.parametrize("region", (ELASTIC, PLANE, COMPRESSION_EDGE, EXTENSION_EDGE, APEX))
@pytest.mark.parametrize("dilatancy", (0.0, 25.0))
def test_algorithmic_tangent_in_every_region(region: int, dilatancy: float) -> None:
    """Moduli against finite differences, from a deformed state with history, in two and three dimensions."""
    material = MohrCoulomb(dilatancy_angle=dilatancy)
    strains = {
        ELASTIC: (1e-4, -1e-4, 0.0),
        PLANE: (0.02, -0.03, -0.004),
        COMPRESSION_EDGE: (0.01, 0.0095, -0.05),
        EXTENSION_EDGE: (0.05, -0.03, -0.0305),
        APEX: (0.06, 0.05, 0.04),
    }[region]
    lame, shear = material.lame_parameters()
    stress = np.sort(lame * sum(strains) + 2.0 * shear * np.array(strains))[::-1].copy()
    assert returned(material, stress)[0] == region
    for dim in (2, 3):
        angle = 0.4
        Q = np.eye(dim)
        Q[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
        if dim == 2:  # the plane strain direction carries the third strain in the history
            old = np.zeros(material.history)
            old[2] = np.expm1(2.0 * strains[2])
            order = strains[:2]
        else:
            old, order = np.zeros(material.history), strains
        increment = Q @ np.diag(np.exp(order)) @ Q.T
        size = 1e-7 if region != ELASTIC else 1e-6
        assert_moduli_match_relative(material, increment, old, size)


def assert_moduli_match_relative(
    material: MohrCoulomb, increment: np.ndarray, old: np.ndarray, size: float
) -> None:
    dim = len(increment)
    _, moduli, _ = kirchhoff(material, increment, np.eye(dim), old)
    lame, shear = material.lame_parameters()
    for j in range(dim):
        for d in range(dim):
            gradient = np.zeros((dim, dim))
            gradient[j, d] = size
            up, down = ((np.eye(dim) + sign * gradient) @ increment for sign in (1.0, -1.0))
            change = piola(material, up, np.eye(dim), old) - piola(material, down, np.eye(dim), old)
            change = change / (2.0 * size) @ increment.T
            assert np.abs(change - moduli[:, :, j, d]).max() <= 1e-6 * (lame + 2.0 * shear)


def test_plastic_history() -> None:
    """A simple shear far beyond yield: b_e stays on the surface and the equivalent plastic strain adds up."""
    material = MohrCoulomb()
    state = np.zeros(material.history)
    increment = np.array([[1.0, 0.01], [0.0, 1.0]])
    F = np.eye(2)
    for _ in range(100):
        tau, _, state = kirchhoff(material, increment, F, state)
        F = increment @ F
    # with shear strain rate 1/2 gamma' each way: sqrt(2/3 (2 (1/2)^2)) = 1/sqrt(3) per unit of
    # gamma, less the elastic
    assert 0.55 < state[PLASTIC_STRAIN] < 1.0 / np.sqrt(3.0)
    principal = np.linalg.eigvalsh(tau)
    law = material.law
    assert law.friction * principal[1] - principal[0] == pytest.approx(law.strength, rel=1e-9)


def test_angles_are_checked() -> None:
    with pytest.raises(ValueError, match="dilatancy_angle = 30"):
        MohrCoulomb(dilatancy_angle=30.0)
    assert not MohrCoulomb().symmetric_tangent
    assert MohrCoulomb(dilatancy_angle=25.0).symmetric_tangent


@pytest.mark.parametrize(
    ("method", "basis", "changes"),
    [
        ("fem", "linear", {}),
        ("implicit_mpm", "linear", {"method__ghost_stiffness": 1e-3}),
        ("implicit_mpm", "bspline", {}),
        # the membrane of tests/problems/test_cook_membrane.py has it by default
        slow_if(True, "implicit_mpm", "linear", {"method__volumetric": "f_bar"}),
        ("gmm", "mls", {}),
        ("gmm", "mls", {"basis__relative_radius": 2.0, "method__dirichlet": "multipliers"}),
        ("gmm", "lme", {}),
    ],
)
def test_global_tangent_is_the_derivative_of_the_residual(
    method: str, basis: str, changes: dict
) -> None:
    config = compose("cantilever_self_weight", method, basis, resolution=8, **changes)
    state = case.build(case.read(config))
    w = prepare(state)
    force = external_force(state, w.phi, 1.0, state.nodes.f_external)
    equations = Equations(state, w, force, 1.0, None)
    rng = np.random.default_rng(5)
    pattern = equations.pattern
    du = np.zeros_like(state.nodes.v)
    du[pattern.active] = 0.02 * rng.standard_normal((len(pattern.active), 2))
    direction = np.zeros_like(du)
    direction[pattern.active] = rng.standard_normal((len(pattern.active), 2))

    def augmented(du: np.ndarray) -> np.ndarray:
        """The residual whose root a step of Newton's iteration looks for."""
        residual = equations.residual(du)
        assert residual is not None
        if w.held is not None:
            pull = equations.young_modulus * (equations.G.T @ equations.gap(du))
            residual[pattern.active] -= pull.reshape(-1, 2)
        return residual

    augmented(du)
    dense = np.zeros((2 * len(pattern.active),) * 2)
    for s, (r, c) in enumerate(zip(pattern.block_row, pattern.column, strict=True)):
        dense[2 * r : 2 * r + 2, 2 * c : 2 * c + 2] = equations.blocks[s]
        if pattern.lower:
            dense[2 * c : 2 * c + 2, 2 * r : 2 * r + 2] = equations.blocks[s].T
    expected = dense @ direction[pattern.active].ravel()
    up, down = augmented(du + 1e-6 * direction), augmented(du - 1e-6 * direction)
    change = -(up - down)[pattern.active].ravel() / 2e-6
    assert np.abs(change - expected).max() < 1e-6 * np.abs(expected).max()
