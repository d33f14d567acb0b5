"""The mu(I) rheology at one point: its curve in steady shear, Bagnold's profile, grains that part, and slow flow."""

import math

import numpy as np
import pytest

from mpmbench.contracts.materials import Path
from mpmbench.core.materials.plastic import PLASTIC_WORK
from mpmbench.core.materials.plastic.mu_i import OPENED, MuI, shear_stress
from tests.core.plasticity import step, strain_of

GRAINS = MuI(young_modulus=1e9, cohesion=0.0)
BULK = GRAINS.young_modulus / (3.0 * (1.0 - 2.0 * GRAINS.poisson_ratio))


def sheared(material: MuI, pressure: float, rate: float, strain: float, steps: int = 400) -> Path:
    """A point under a pressure [Pa] that is sheared along x at a rate [1/s] up to a strain."""
    path, squeeze = Path(material, 2), math.exp(-0.5 * pressure / BULK)
    path.step(squeeze * np.eye(2), 1.0)
    for share in np.linspace(0.0, strain, steps + 1)[1:]:
        path.step(np.array([[1.0, share], [0.0, 1.0]]) * squeeze, strain / steps / rate)
    return path


def mu(inertial: float) -> float:
    """``mu_s + (mu_2 - mu_s) / (I_0 / I + 1)``, by the angles."""
    slow, fast = (math.tan(math.radians(angle)) for angle in (21.0, 33.0))
    return slow + (fast - slow) / (0.3 / inertial + 1.0)


@pytest.mark.parametrize("inertial", (1e-4, 0.03, 0.3, 10.0))
def test_steady_shear_has_the_friction_of_its_inertial_number(inertial: float) -> None:
    """``I = rate d / sqrt(p / rho_s)``; stiff grains, so that elastic strains are of no account."""
    pressure = 2000.0
    rate = inertial * math.sqrt(pressure / GRAINS.grain_density) / GRAINS.grain_diameter
    sigma = sheared(GRAINS, pressure, rate, 0.02).sigma
    mean = -(sigma[0, 0] + sigma[1, 1]) / 2.0
    assert mean == pytest.approx(pressure, rel=2e-3)
    assert sigma[0, 1] / mean == pytest.approx(mu(inertial), rel=2e-3)


def test_bagnold_profile_balances_the_weight() -> None:
    """On 27 degrees ``du/dy = I/d sqrt(rho g cos (h - y) / rho_s)``, and the shear stress is ``rho g sin (h - y)``."""
    slope, depth, gravity = math.radians(27.0), 0.1, 9.81
    friction = math.tan(slope)
    slow, fast = (math.tan(math.radians(angle)) for angle in (21.0, 33.0))
    inertial = 0.3 * (friction - slow) / (fast - friction)
    along, across = (GRAINS.density * gravity * f(slope) for f in (math.sin, math.cos))
    for y in (0.0, 0.05, 0.09):
        # du / dy of the profile
        rate = (
            inertial
            / GRAINS.grain_diameter
            * math.sqrt(across * (depth - y) / GRAINS.grain_density)
        )
        sigma = sheared(GRAINS, across * (depth - y), rate, 0.01).sigma
        assert sigma[0, 1] == pytest.approx(along * (depth - y), rel=3e-3)


def test_slow_shear_is_that_of_static_friction_and_a_step_without_time_too() -> None:
    slow = sheared(GRAINS, 2000.0, 1e-9, 0.02).sigma
    mean = -(slow[0, 0] + slow[1, 1]) / 2.0
    assert slow[0, 1] / mean == pytest.approx(math.tan(math.radians(21.0)), rel=1e-3)
    squeeze = math.exp(-2000.0 / BULK / 3.0)
    increment = squeeze * np.array([[1.0, 0.01, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    tau, _, _ = step(GRAINS, increment, np.zeros(9))
    deviator = tau - np.trace(tau) / 3.0 * np.eye(3)
    friction = math.sqrt(0.5 * np.sum(deviator**2)) / (-np.trace(tau) / 3.0)
    assert friction == pytest.approx(math.tan(math.radians(21.0)), rel=1e-12)


@pytest.mark.parametrize("dt", (1e-4, 1e-2, 1.0))
def test_a_step_of_any_size_ends_on_the_curve_of_its_own_rate(dt: float) -> None:
    """``q = mu(I) p`` with the rate ``(q_trial - q) / (G dt)``, exactly, and derivatives as differences say."""
    soft = MuI(young_modulus=1e6, cohesion=0.0)
    shear = soft.lame_parameters()[1]
    squeeze = math.exp(-0.001)
    increment = squeeze * np.array([[1.0, 0.02, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    tau, _, _ = step(soft, increment, np.zeros(9), dt)
    pressure = -np.trace(tau) / 3.0
    strain = strain_of(increment @ increment.T)
    trial, q = (
        math.sqrt(0.5 * np.sum((one - np.trace(one) / 3.0 * np.eye(3)) ** 2))
        for one in (2.0 * shear * strain, tau)
    )
    assert q < trial
    rate = (trial - q) / (shear * dt)
    inertial = rate * soft.grain_diameter / math.sqrt(pressure / soft.grain_density)
    assert q == pytest.approx(mu(inertial) * pressure, rel=1e-9)
    _, by_trial, by_pressure = shear_stress(soft.law, trial, pressure, dt)
    for number, given in enumerate((by_trial, by_pressure)):
        off = np.zeros(2)
        off[number] = 1e-4 * pressure
        ends = [
            shear_stress(soft.law, trial + s * off[0], pressure + s * off[1], dt)[0]
            for s in (1.0, -1.0)
        ]
        assert (ends[0] - ends[1]) / (2.0 * off[number]) == pytest.approx(given, rel=1e-5, abs=1e-9)


def test_grains_apart_carry_nothing_until_they_are_together_again() -> None:
    """What opened must close, to the last bit of volume; what was stored when they parted is lost."""
    path = Path(GRAINS, 1)
    path.step(np.array([[0.999]]), 1.0)
    stored = path.energy
    pressed = path.sigma[0, 0]
    assert pressed < 0.0
    for stretch in (1.05, 1.2, 1.1, 1.001):
        path.step(np.array([[stretch]]), 1.0)
        assert path.sigma[0, 0] == 0.0
        assert path.state[OPENED] == pytest.approx(math.log(stretch), abs=2e-3)
    lost = path.state[PLASTIC_WORK]
    assert lost > 0.0 and stored > 0.0
    path.step(np.array([[0.999]]), 1.0)
    assert path.sigma[0, 0] < 0.5 * pressed and path.state[OPENED] == 0.0


def test_cohesion_bears_tension_up_to_its_limit() -> None:
    """``c / mu_s``, the pressure that cohesion stands for."""
    sticky = MuI(young_modulus=1e9, cohesion=1000.0)
    limit = 1000.0 / math.tan(math.radians(21.0))
    for share, holds in ((0.9, True), (1.1, False)):
        path = Path(sticky, 3)
        path.step(math.exp(share * limit / BULK / 3.0) * np.eye(3), 1.0)
        expected = share * limit if holds else 0.0
        assert path.sigma[0, 0] == pytest.approx(expected, rel=1e-5)
