"""A million random states and steps: the return map of von Mises laws finds the flow stress, always."""

import time
from typing import Any

import numpy as np
import pytest

from mpmbench.core.compiled import compiled, matrix
from mpmbench.core.compiled.rows import BATCH
from mpmbench.core.materials import strain_all
from mpmbench.core.materials.plastic import PLASTIC_STRAIN, PLASTIC_WORK
from mpmbench.core.materials.plastic.radial import hardening, rate_factor, softening
from tests.core.test_material_heat import LAWS
from tests.core.test_material_plasticity import KINDS

COUNT = 1_000_000
THREE, NINE = (0.0,) * 3, (0.0,) * 9


@compiled
def explicit_steps(law, F, L, dt, state, sigma):  # type: ignore[no-untyped-def]
    """Stress and history of each particle after a step of its own length."""
    F_p, L_p, sigma_p = matrix(NINE, BATCH), matrix(NINE, BATCH), matrix(NINE, BATCH)
    V_p = matrix((0.0,), BATCH)
    V_p[0, 0] = 1.0
    for p in range(F.shape[0]):
        for i in range(3):
            for j in range(3):
                L_p[3 * i + j, 0] = L[p, i, j]
                F_p[3 * i + j, 0] = 1.0 if i == j else 0.0  # F is the increment
        strain_all(law, THREE, L_p, 0, dt[p], F_p, V_p, state[p : p + 1], sigma_p, 1)
        for i in range(3):
            for j in range(3):
                sigma[p, i, j] = sigma_p[3 * i + j, 0]


@compiled
def flow_stresses(law, dt, old, new, out):  # type: ignore[no-untyped-def]
    """What the law says of the strain, rate and temperature that were found."""
    for p in range(len(dt)):
        before, after = old[p, 6], new[p, 6]
        overstress = hardening(law, before)[0] * (
            rate_factor(law, (after - before) / dt[p])[0] - 1.0
        )
        out[p] = softening(law, old[p]) * (hardening(law, after)[0] + overstress)


def random_steps(material: Any, count: int, seed: int) -> tuple[np.ndarray, ...]:
    """Deformations from 1e-6 to 1, strains from 0 to 3, times from 1e-9 to 1 s, cold to melting."""
    rng = np.random.default_rng(seed)
    size = 10.0 ** rng.uniform(-6.0, 0.0, (count, 1, 1))
    increment = np.eye(3) + size * rng.uniform(-0.4, 0.4, (count, 3, 3))
    increment[np.linalg.det(increment) < 0.5] = np.eye(3)
    dt = 10.0 ** rng.uniform(-9.0, 0.0, count)
    state = np.zeros((count, material.history))
    state[:, :6] = 0.02 * rng.standard_normal((count, 6))
    state[:, PLASTIC_STRAIN] = rng.choice([0.0, 1e-9, 1e-3, 1.0], count) * rng.uniform(
        0.0, 3.0, count
    )
    state[:, PLASTIC_WORK] = rng.choice([0.0, 1e8, 1e10], count) * rng.random(count)
    return increment, (increment - np.eye(3)) / dt[:, None, None], dt, state


@pytest.mark.slow
@pytest.mark.parametrize("name", [*KINDS, *LAWS])
def test_a_million_returns(name: str) -> None:
    material = (KINDS | LAWS)[name]
    F, L, dt, old = random_steps(material, COUNT, 11)
    explicit_steps(material.law, F[:2], L[:2], dt[:2], old[:2].copy(), np.zeros((2, 3, 3)))
    new, sigma = old.copy(), np.ones_like(F)
    start = time.process_time()
    explicit_steps(material.law, F, L, dt, new, sigma)
    passed = time.process_time() - start
    assert np.isfinite(sigma).all() and np.isfinite(new).all()
    tau = np.linalg.det(F)[:, None, None] * sigma
    pressure = np.trace(tau, axis1=1, axis2=2) / 3.0
    deviator = tau - pressure[:, None, None] * np.eye(3)
    mises = np.sqrt(1.5 * np.sum(deviator**2, axis=(1, 2)))
    allowed = np.zeros(COUNT)
    flow_stresses(material.law, dt, old, new, allowed)
    flowed = new[:, PLASTIC_STRAIN] > old[:, PLASTIC_STRAIN]
    scale = np.abs(tau).max(axis=(1, 2)) + material.lame_parameters()[1]
    assert 0.5 < flowed.mean() < 1.0
    assert np.all(mises[~flowed] <= allowed[~flowed] + 1e-11 * scale[~flowed])
    assert np.all(np.abs(mises - allowed)[flowed] < 1e-11 * scale[flowed])
    assert np.all(new[:, PLASTIC_WORK] >= old[:, PLASTIC_WORK])
    print(f"{name}: {1e6 * passed / COUNT:.2f} microseconds for a step of explicit methods")
