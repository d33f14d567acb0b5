"""Von Mises plasticity at one point: closed forms, integrated rate equations, its incremental energy."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mpmbench.contracts.materials import Path
from mpmbench.core.errors import BadSetting
from mpmbench.core.materials.plastic import PLASTIC_STRAIN, PLASTIC_WORK
from mpmbench.core.materials.plastic.j2 import J2
from tests.core.plasticity import (
    at_yield,
    b_of,
    deformed,
    distorted,
    extrapolated,
    flow,
    integrated,
    sheared,
    step,
    strain_of,
    von_mises,
)
from tests.support import slow_if

KINDS = {
    "linear": J2(),
    "power": J2(hardening="power"),
    "voce": J2(hardening="voce"),
}


@pytest.mark.parametrize("parts", (1, 7))
@pytest.mark.parametrize("kind", KINDS)
def test_pull_and_push_have_a_closed_form(kind: str, parts: int) -> None:
    """Uniaxial stress to and fro: ``ln l = tau / E + e_p`` at every turn, whatever the number of steps to it.

    The stored energy is ``tau^2 / 2 E`` and what is lost the integral of the flow stress.
    """
    material, path = KINDS[kind], Path(KINDS[kind], 3)
    E, nu = material.young_modulus, material.poisson_ratio
    logs, total, plastic = np.zeros(3), 0.0, 0.0
    for sign, length in ((1.0, 0.05), (-1.0, 0.3), (1.0, 1.5), (-1.0, 0.001)):
        total, plastic = total + length, plastic + sign * length
        yielding, lost = flow(material, total)
        tau = sign * yielding
        end = np.array([tau / E + plastic, *[-nu * tau / E - 0.5 * plastic] * 2])
        for k in range(1, parts + 1):
            path.step(np.diag(np.exp(logs + k / parts * (end - logs))), 1.0)
        logs = end
        J = np.exp(logs.sum())
        assert np.allclose(
            J * path.sigma, np.diag([tau, 0.0, 0.0]), rtol=0.0, atol=1e-10 * yielding
        )
        assert path.state[PLASTIC_STRAIN] == pytest.approx(total, rel=1e-10)
        assert path.energy == pytest.approx(tau**2 / (2.0 * E), rel=1e-10)
        assert path.state[PLASTIC_WORK] == pytest.approx(lost, rel=1e-10)


@pytest.mark.parametrize("kind", KINDS)
def test_simple_shear_follows_the_rate_equations(kind: str) -> None:
    """Axes turn and flow does not follow one direction: the limit of small steps is that of the rates."""
    material = replace(KINDS[kind], young_modulus=5e9, reference_strain=0.3)
    start = at_yield(material, 0.0)
    slope = {
        "linear": lambda e: material.hardening_modulus,
        "power": lambda e: flow(material, e)[0] / (4.0 * (0.3 + e)),
        "voce": lambda e: (material.saturation_stress - flow(material, e)[0]) / 0.3,
    }[kind]
    mu = material.lame_parameters()[1]

    def rate(q: float, strain: float, work: float, along: float) -> float:
        """``q' = 2 mu along - 3 mu e' = g' e'``, since dev(tau) : l is the rate of q while b stays."""
        return float(2.0 * mu * along / (3.0 * mu + slope(strain)))

    expected = integrated(material, start, 1.0, 1.0, rate)
    found = extrapolated([sheared(material, start, 1.0, 8 * 2**k, 1.0) for k in range(10)])
    assert np.abs(found - expected).max() < 1e-10 * np.abs(expected).max(), found - expected


@pytest.mark.parametrize("kind", KINDS)
def test_the_stress_returns_to_the_yield_surface(kind: str) -> None:
    """From any state by any step: the effective stress is the flow stress, and volumes are elastic."""
    material, rng = KINDS[kind], np.random.default_rng(3)
    for size in (1e-4, 1e-2, 0.3, 1.0):
        for _ in range(50):
            old = deformed(material, rng)
            increment = distorted(rng, size)
            tau, _, state = step(material, increment, old)
            J = np.linalg.det(b_of(old)) * np.linalg.det(increment) ** 2
            assert np.linalg.det(b_of(state)) == pytest.approx(J, rel=1e-12)
            yielding = flow(material, state[PLASTIC_STRAIN])[0]
            assert von_mises(tau) <= yielding * (1.0 + 1e-9 * (1.0 + np.abs(tau).max() / yielding))
            if state[PLASTIC_STRAIN] > old[PLASTIC_STRAIN]:
                assert von_mises(tau) == pytest.approx(yielding, rel=1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_small_strains_need_no_axes(kind: str) -> None:
    """The explicit step, by series of tensors, is the one in principal axes, before and after yield."""
    material, rng, flowing = KINDS[kind], np.random.default_rng(5), set()
    for size in (1e-4, 1e-3, 1e-2):
        for _ in range(20):
            path, F = Path(material, 3), np.eye(3) + size * rng.standard_normal((3, 3))
            path.state[:6] = size * rng.uniform(-1.0, 1.0, 6)
            tau, _, state = step(material, F, path.state)
            path.step(F, 1.0)
            largest = np.abs(tau).max()
            assert np.allclose(np.linalg.det(F) * path.sigma, tau, rtol=0.0, atol=1e-11 * largest)
            assert np.allclose(path.state, state, rtol=1e-9, atol=1e-13)
            flowing.add(bool(state[PLASTIC_STRAIN] > 0.0))
    assert flowing == {False, True}


@pytest.mark.parametrize("kind", KINDS)
def test_the_update_is_the_minimiser_of_its_incremental_energy(kind: str) -> None:
    """Elastic energy and the integral of the flow stress grow with any other plastic strain, in size or direction."""
    material, rng = KINDS[kind], np.random.default_rng(4)
    lame, mu = material.lame_parameters()
    for size in (0.02, 0.5):
        old = deformed(material, rng)
        increment = distorted(rng, size)
        _, _, state = step(material, increment, old)
        trial = strain_of(increment @ b_of(old) @ increment.T)
        found = trial - strain_of(b_of(state))

        def total(plastic: np.ndarray, old: np.ndarray = old, trial: np.ndarray = trial) -> float:
            e = trial - plastic
            grown = old[PLASTIC_STRAIN] + np.sqrt(2.0 / 3.0 * np.sum(plastic**2))
            return float(
                0.5 * lame * np.trace(e) ** 2 + mu * np.sum(e**2) + flow(material, grown)[1]
            )

        least = total(found)
        assert np.linalg.norm(found) > 0.01 * size
        for _ in range(20):
            other = rng.standard_normal((3, 3))
            other = other + other.T - 2.0 / 3.0 * np.trace(other) * np.eye(3)
            other *= 1e-4 * np.linalg.norm(found) / np.linalg.norm(other)
            up, down = total(found + other), total(found - other)
            assert up > least and down > least
            assert abs(up - down) < 1e-3 * (up + down - 2.0 * least)  # the slope is zero


@pytest.mark.parametrize("dim", [slow_if(dim != 2, dim) for dim in (1, 2, 3)])
@pytest.mark.parametrize("kind", KINDS)
def test_moduli_are_the_derivative_of_the_stress_in_flow(kind: str, dim: int) -> None:
    """``dP F^T = a : (dF F^-1)`` by central differences, from states with history, in small and large steps."""
    material, rng = KINDS[kind], np.random.default_rng(dim)
    assert_moduli_match(material, rng, dim, float("inf"))


def assert_moduli_match(material: Any, rng: np.random.Generator, dim: int, dt: float) -> None:
    lame, mu = material.lame_parameters()
    for size in (0.02, 0.02, 0.2):
        flows = False
        while not flows:
            old, increment = deformed(material, rng), distorted(rng, size, dim)
            if dim < 3:
                old[[4, 5]] = 0.0
            if dim < 2:
                old[3] = 0.0
            _, moduli, state = step(material, increment, old, dt)
            flows = state[PLASTIC_STRAIN] > old[PLASTIC_STRAIN]
        for j, d in np.ndindex(dim, dim):
            gradient = np.zeros((dim, dim))
            gradient[j, d] = 1e-6
            ends = []
            for sign in (1.0, -1.0):
                F = (np.eye(dim) + sign * gradient) @ increment
                ends.append(step(material, F, old, dt)[0] @ np.linalg.inv(F).T)
            change = (ends[0] - ends[1]) / 2e-6 @ increment.T
            assert np.abs(change - moduli[:, :, j, d]).max() < 1e-6 * (lame + 2.0 * mu)


@pytest.mark.parametrize("kind", KINDS)
def test_a_rigid_rotation_turns_the_stress_and_nothing_else(kind: str) -> None:
    assert_rotation_is_nothing(KINDS[kind], float("inf"))


def assert_rotation_is_nothing(material: Any, dt: float) -> None:
    """Of a state that is about to flow, by any angle; what is hot has ceased to soften."""
    rng = np.random.default_rng(5)
    for Q in Rotation.random(10, rng=rng).as_matrix():
        old = deformed(material, rng)
        for _ in range(10):
            _, _, old = step(material, np.eye(3), old)
        before, _, _ = step(material, np.eye(3), old, dt)
        tau, _, state = step(material, Q, old, dt)
        assert np.abs(tau - Q @ before @ Q.T).max() < 1e-11 * np.abs(tau).max()
        assert np.allclose(b_of(state), Q @ b_of(old) @ Q.T, rtol=0.0, atol=1e-13)
        assert np.allclose(state[6:], old[6:], rtol=1e-13, atol=0.0)


@pytest.mark.parametrize("dim", [slow_if(dim != 2, dim) for dim in (1, 2)])
@pytest.mark.parametrize("kind", KINDS)
def test_lower_dimensions_are_plane_strain_in_flow(kind: str, dim: int) -> None:
    """A path in 1D or 2D is that of 3D with F = 1 in the missing directions."""
    material, rng = KINDS[kind], np.random.default_rng(dim)
    low, high = Path(material, dim), Path(material, 3)
    F = np.eye(dim)
    for _ in range(5):
        F = distorted(rng, 0.2, dim) @ F
        whole = np.eye(3)
        whole[:dim, :dim] = F
        low.step(F, 1.0)
        high.step(whole, 1.0)
        assert np.allclose(low.sigma, high.sigma[:dim, :dim], rtol=1e-11, atol=1e-3)
        assert np.allclose(low.state, high.state, rtol=1e-11, atol=1e-14)


def test_hardening_that_softens_is_refused() -> None:
    with pytest.raises(BadSetting, match="saturation_stress"):
        J2(hardening="voce", saturation_stress=1e8)
    assert J2(saturation_stress=1e8).law.modulus == J2().hardening_modulus
