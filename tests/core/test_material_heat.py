"""Von Mises laws in which rate and temperature count, at one point."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

from mpmbench.contracts.materials import Path, energy, work_along
from mpmbench.core.errors import BadSetting
from mpmbench.core.materials.plastic import PLASTIC_STRAIN, PLASTIC_WORK
from mpmbench.core.materials.plastic.j2 import J2
from mpmbench.core.materials.plastic.johnson_cook import JohnsonCook
from mpmbench.core.materials.plastic.thermal import HEAT
from mpmbench.core.materials.plastic.thermo_viscoplastic import ThermoViscoplastic
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
from tests.core.test_material_plasticity import assert_moduli_match, assert_rotation_is_nothing
from tests.support import slow_if

LAWS = {
    "thermo_viscoplastic": ThermoViscoplastic(rate_exponent=10.0),
    "mie_grueneisen": ThermoViscoplastic(
        rate_exponent=10.0,
        equation_of_state="mie_grueneisen",
        hugoniot_slope=1.2,
        initial_temperature=500.0,
    ),
    "johnson_cook": JohnsonCook(),
}
# Soft enough for rate equations that are not stiff, and for flow that softens much in one shear.
SOFT = {
    "thermo_viscoplastic": replace(
        LAWS["thermo_viscoplastic"],
        **{
            "young_modulus": 20e9,
            "reference_strain": 0.3,
            "rate_exponent": 3.0,
            "reference_rate": 100.0,
        },
        **{"hardening_exponent": 4.0, "softening_exponent": 1.0, "initial_temperature": 600.0},
    ),
    "johnson_cook": replace(
        LAWS["johnson_cook"],
        **{"young_modulus": 2e9, "rate_sensitivity": 0.2, "reference_rate": 0.01},
        **{"softening_exponent": 1.0, "initial_temperature": 500.0, "specific_heat": 100.0},
    ),
}


def theta(material: Any, work: float) -> float:
    """Softening after so much plastic work [J/m^3]."""
    rise = material.taylor_quinney * work / (material.density * material.specific_heat)
    T0, Tm = material.reference_temperature, material.melting_temperature
    hot = np.clip((material.initial_temperature + rise - T0) / (Tm - T0), 0.0, 1.0)
    return float(1.0 - hot**material.softening_exponent)


def factor(material: Any, rate: float) -> float:
    """Flow stress at a rate over that at rest."""
    x = rate / material.reference_rate
    if isinstance(material, JohnsonCook):
        return float(1.0 + material.rate_sensitivity * np.log(max(x, 1.0)))
    return float((1.0 + x) ** (1.0 / material.rate_exponent))


def potential(material: Any, rate: float) -> float:
    """Integral of `factor` less 1 over the rate: the dual potential, over g."""
    x, rate_0 = rate / material.reference_rate, material.reference_rate
    if isinstance(material, JohnsonCook):
        x = max(x, 1.0)
        return float(material.rate_sensitivity * rate_0 * (x * np.log(x) - x + 1.0))
    m = material.rate_exponent
    return float(m * rate_0 / (m + 1.0) * ((1.0 + x) ** ((m + 1.0) / m) - 1.0) - rate)


def rate_of(material: Any, ratio: float) -> float:
    """Rate at an effective stress over the flow stress at rest, the inverse of `factor`."""
    if ratio <= 1.0:
        return 0.0
    if isinstance(material, JohnsonCook):
        return float(material.reference_rate * np.exp((ratio - 1.0) / material.rate_sensitivity))
    return float(material.reference_rate * (ratio**material.rate_exponent - 1.0))


@pytest.mark.parametrize("name", [slow_if(name == "johnson_cook", name) for name in SOFT])
def test_hot_fast_shear_follows_the_rate_equations(name: str) -> None:
    """Flow at the rate that the stress asks for, adiabatically: the limit of small steps is that of the rates."""
    material = SOFT[name]
    start = at_yield(material, 0.05, theta(material, 0.0))

    def rate(q: float, strain: float, work: float, along: float) -> float:
        return rate_of(material, q / (theta(material, work) * flow(material, strain)[0]))

    time = 1e-3
    expected = integrated(material, start, 1.0, time, rate)
    found = extrapolated([sheared(material, start, 1.0, 16 * 2**k, time) for k in range(10)])
    assert theta(material, 1e6 * expected[7]) < 0.9 * theta(material, 0.0)
    slow = theta(material, 1e6 * expected[7]) * flow(material, expected[6])[0]
    assert 1e6 * np.sqrt(3.0) * expected[1] > 1.2 * slow
    assert np.abs(found - expected).max() < 1e-10 * np.abs(expected).max(), found - expected


def test_without_rate_and_heat_the_law_is_j2() -> None:
    """Rate exponent null and nothing that heats: the same path as power hardening, to rounding."""
    law = ThermoViscoplastic(taylor_quinney=0.0)
    same = {key: getattr(law, key) for key in ("young_modulus", "poisson_ratio", "yield_stress")}
    same |= {key: getattr(law, key) for key in ("hardening_exponent", "reference_strain")}
    paths = Path(law, 3), Path(J2(hardening="power", **same), 3)
    rng, F = np.random.default_rng(0), np.eye(3)
    for _ in range(20):
        F = distorted(rng, 0.1) @ F
        for path in paths:
            path.step(F, 1e-6)
    first, second = paths
    assert first.state[PLASTIC_STRAIN] > 1.0
    assert np.allclose(first.sigma, second.sigma, rtol=0.0, atol=1e-12 * np.abs(first.sigma).max())
    assert np.allclose(first.state[:8], second.state, rtol=1e-12, atol=1e-14)


def test_heat_softens_as_in_closed_form() -> None:
    """With ``theta = 1 - T*`` and no rate ``theta = exp(-k G(e))``, along a stretch that keeps the volume."""
    material = ThermoViscoplastic(softening_exponent=1.0)
    mu, end = material.lame_parameters()[1], 0.8
    span = material.melting_temperature - material.reference_temperature
    k = material.taylor_quinney / (material.density * material.specific_heat * span)

    def excess(e: float) -> float:
        g, stored = flow(material, e)
        return float(3.0 * mu * (end - e) - g * np.exp(-k * stored))

    strain = brentq(excess, 0.0, end, xtol=1e-15, rtol=1e-14)
    onset = material.yield_stress / (3.0 * mu)
    found = []
    for n in (64 * 2**k for k in range(9)):
        path = Path(material, 3)
        for x in np.linspace(onset, end, n + 1):
            path.step(np.diag(np.exp([x, -0.5 * x, -0.5 * x])), 1.0)
        found.append(
            np.array([path.state[PLASTIC_STRAIN], theta(material, path.state[PLASTIC_WORK])])
        )
    softened = np.exp(-k * flow(material, strain)[1])
    assert softened < 0.8
    assert np.allclose(extrapolated(found), [strain, softened], rtol=1e-10, atol=0.0)
    temperature = material.fields(path.state)["temperature"][0]
    assert temperature == pytest.approx(300.0 + (1.0 - softened) * span, rel=1e-3)


@pytest.mark.parametrize("name", LAWS)
def test_the_update_is_the_minimiser_of_its_incremental_energy(name: str) -> None:
    """Elastic energy, hardening and dual potential together grow with any other plastic strain."""
    material, rng, dt = LAWS[name], np.random.default_rng(4), 1e-5
    mu = material.lame_parameters()[1]
    for size in (0.05, 0.5):
        old = hot(material, rng)
        increment = distorted(rng, size)
        _, _, state = step(material, increment, old, dt)
        trial = strain_of(increment @ b_of(old) @ increment.T)
        found = trial - strain_of(b_of(state))

        def total(plastic: np.ndarray, old: np.ndarray = old, trial: np.ndarray = trial) -> float:
            e = trial - plastic
            e = e - np.trace(e) / 3.0 * np.eye(3)
            return float(mu * np.sum(e**2)) + plastic_part(material, plastic, old, dt)

        least = total(found)
        assert np.linalg.norm(found) > 0.01 * size
        for _ in range(20):
            other = rng.standard_normal((3, 3))
            other = other + other.T - 2.0 / 3.0 * np.trace(other) * np.eye(3)
            other *= 1e-4 * np.linalg.norm(found) / np.linalg.norm(other)
            up, down = total(found + other), total(found - other)
            assert up > least and down > least
            assert abs(up - down) < 1e-3 * (up + down - 2.0 * least)


def hot(material: Any, rng: np.random.Generator) -> np.ndarray:
    """History of a warm particle after large flow."""
    state = deformed(material, rng)
    state[PLASTIC_WORK] += 5e8
    state[HEAT] += 4e8
    return state


def plastic_part(material: Any, plastic: np.ndarray, old: np.ndarray, dt: float) -> float:
    """Hardening and dual potential of an increment of plastic strain, at the temperature before it."""
    increment = float(np.sqrt(2.0 / 3.0 * np.sum(plastic**2)))
    g, stored = flow(material, old[PLASTIC_STRAIN])
    grown = flow(material, old[PLASTIC_STRAIN] + increment)[1] - stored
    return theta(material, old[PLASTIC_WORK]) * (
        grown + g * dt * potential(material, increment / dt)
    )


@pytest.mark.parametrize("name", LAWS)
def test_the_stress_is_the_derivative_of_the_incremental_energy(name: str) -> None:
    """``P = dW/dF`` of the smallest incremental energy W, by central differences, with the heat of the start."""
    material, rng, dt = LAWS[name], np.random.default_rng(6), 1e-5
    old, increment = hot(material, rng), distorted(rng, 0.1)

    def total(increment: np.ndarray) -> float:
        _, _, state = step(material, increment, old, dt)
        plastic = strain_of(increment @ b_of(old) @ increment.T) - strain_of(b_of(state))
        state[PLASTIC_WORK], state[HEAT] = old[PLASTIC_WORK], old[HEAT]
        return energy(material, np.eye(3), state) + plastic_part(material, plastic, old, dt)

    tau, _, state = step(material, increment, old, dt)
    assert state[PLASTIC_STRAIN] > old[PLASTIC_STRAIN]
    P = np.zeros((3, 3))
    for i, j in np.ndindex(3, 3):
        small = np.zeros((3, 3))
        small[i, j] = 1e-5
        P[i, j] = (total(increment + small) - total(increment - small)) / 2e-5
    assert np.abs(P @ increment.T - tau).max() < 1e-7 * np.abs(tau).max()


@pytest.mark.parametrize("name", LAWS)
def test_the_stress_is_the_flow_stress_of_rate_and_temperature(name: str) -> None:
    material, rng, dt = LAWS[name], np.random.default_rng(7), 1e-5
    for size in (0.02, 0.3, 1.0):
        old = hot(material, rng)
        tau, _, state = step(material, distorted(rng, size), old, dt)
        grown = state[PLASTIC_STRAIN] - old[PLASTIC_STRAIN]
        g, before = (flow(material, one[PLASTIC_STRAIN])[0] for one in (state, old))
        sigma = g + before * (factor(material, grown / dt) - 1.0)
        assert grown > 0.0
        assert von_mises(tau) == pytest.approx(theta(material, old[PLASTIC_WORK]) * sigma, rel=1e-9)
        work = flow(material, state[PLASTIC_STRAIN])[1] - flow(material, old[PLASTIC_STRAIN])[1]
        work = theta(material, old[PLASTIC_WORK]) * (work + (sigma - g) * grown)
        assert state[PLASTIC_WORK] - old[PLASTIC_WORK] == pytest.approx(work, rel=1e-9)


@pytest.mark.parametrize("dim", [slow_if(dim != 2, dim) for dim in (1, 2, 3)])
@pytest.mark.parametrize("name", LAWS)
def test_moduli_are_the_derivative_of_the_stress_in_fast_flow(name: str, dim: int) -> None:
    assert_moduli_match(LAWS[name], np.random.default_rng(dim), dim, 1e-5)


@pytest.mark.parametrize("name", LAWS)
def test_a_rigid_rotation_turns_the_stress_and_nothing_else(name: str) -> None:
    assert_rotation_is_nothing(LAWS[name], 1e-6)


@pytest.mark.parametrize("name", LAWS)
def test_temperatures_out_of_range(name: str) -> None:
    """Below the reference nothing softens and nothing is NaN; from melting on only pressure is left."""
    cold, molten = (replace(LAWS[name], initial_temperature=kelvin) for kelvin in (10.0, 5000.0))
    at_reference = replace(LAWS[name], initial_temperature=cold.reference_temperature)
    increment = distorted(np.random.default_rng(8), 0.1)
    new = np.zeros(cold.history)
    expected = step(at_reference, increment, new, 1e-5)[0]
    tau = step(cold, increment, new, 1e-5)[0]
    assert np.allclose(tau, expected, rtol=1e-13) and von_mises(tau) > 1e8
    tau, moduli, state = step(molten, increment, new, 1e-5)
    assert von_mises(tau) < 1e-9 * abs(np.trace(tau)) and np.isfinite(moduli).all()
    assert state[PLASTIC_STRAIN] > 0.0 == state[PLASTIC_WORK]
    assert molten.fields(state)["temperature"][0] == 5000.0
    state[PLASTIC_WORK] = 1e12
    assert cold.fields(state)["temperature"][0] == cold.melting_temperature
    assert np.allclose(np.linalg.det(b_of(state)), np.linalg.det(increment) ** 2)


@pytest.mark.parametrize("name", LAWS)
def test_work_is_stored_or_lost(name: str) -> None:
    """Also where heat does work: squeezed and let go while it shears, the work is all there."""
    path, work, before = Path(LAWS[name], 3), 0.0, 0.0
    shear = np.array([[0.0, 0.4, 0.0], [0.1, 0.0, 0.0], [0.0, 0.0, 0.0]])
    for share in np.linspace(0.0, 1.0, 4001)[1:]:
        F = (1.0 - 0.1 * np.sin(np.pi * share)) * (np.eye(3) + share * shear)
        work += work_along(path, [F], 1e-7)
        assert path.state[PLASTIC_WORK] >= before
        before = path.state[PLASTIC_WORK]
    assert before > 1e7
    assert work - path.energy == pytest.approx(before, rel=1e-3)


@pytest.mark.parametrize("J", (0.6, 0.9, 1.05))
def test_pressure_of_mie_and_grueneisen(J: float) -> None:
    """``dE/dJ = -p``, and where ``E = p_H x / 2``, as behind a shock, the pressure is Hugoniot's."""
    material = replace(LAWS["mie_grueneisen"], hugoniot_slope=1.3, grueneisen=1.7)
    lame, mu = material.lame_parameters()
    K, x = lame + 2.0 / 3.0 * mu, 1.0 - J
    shock = K * x / (1.0 - 1.3 * x) ** 2 if x > 0.0 else K * x

    def history(J: float, heat: float) -> np.ndarray:
        state = np.zeros(material.history)
        state[:3], state[HEAT] = J ** (2.0 / 3.0) - 1.0, heat
        return state

    def pressure(heat: float) -> float:
        tau, _, _ = step(material, np.eye(3), history(J, heat))
        assert np.allclose(tau, tau[0, 0] * np.eye(3), rtol=1e-12, atol=1.0)
        return float(-tau[0, 0] / J)

    def stored(J: float, heat: float) -> float:
        return energy(material, np.eye(3), history(J, heat))

    heat = (0.5 * shock * x - stored(J, 0.0)) * np.exp(-1.7 * x)
    assert stored(J, heat) == pytest.approx(0.5 * shock * x, rel=1e-12)
    assert pressure(heat) == pytest.approx(shock, rel=1e-11)
    slope = (stored(J + 1e-5, 1e8) - stored(J - 1e-5, 1e8)) / 2e-5
    assert pressure(1e8) == pytest.approx(-slope, rel=1e-7)
    assert pressure(1e8) - pressure(0.0) == pytest.approx(1.7 * 1e8 * np.exp(1.7 * x), rel=1e-6)


def test_heat_raises_the_pressure() -> None:
    """Work done at a volume is heat there: ``p`` grows by ``Gamma beta`` times it."""
    material = replace(LAWS["mie_grueneisen"], taylor_quinney=0.8)
    path = Path(material, 3)
    squeezed = 0.9 ** (1.0 / 3.0)
    path.step(squeezed * np.eye(3), 1e-3)
    before = -np.trace(path.sigma) / 3.0
    for x in (0.1, 0.2, *(0.3,) * 8):  # the last step has the heat of all others
        path.step(squeezed * np.diag(np.exp([x, -x, 0.0])), 1e-3)
    gained = -np.trace(path.sigma) / 3.0 - before
    assert path.state[PLASTIC_WORK] > 1e8
    assert gained == pytest.approx(2.0 * 0.8 * path.state[PLASTIC_WORK], rel=1e-9)


def test_melting_below_the_reference_is_refused() -> None:
    with pytest.raises(BadSetting, match="melting_temperature"):
        JohnsonCook(melting_temperature=200.0)
