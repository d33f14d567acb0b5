"""The expanding ring: its body force by finite differences, rims without traction, and known values."""

from typing import Any

import numpy as np
import pytest

from mpmbench.core import registry
from tests.core.support import run

MATERIAL = registry.get("material", "neo_hookean")(
    young_modulus=1e7, poisson_ratio=0.0, density=1000.0
)
SHEAR = 5e6  # [Pa]


def nominal(problem: Any, X: np.ndarray, t: float) -> tuple[np.ndarray, np.ndarray]:
    """F by differences of the displacement, and ``P = mu (F - F^-T)``."""
    F = np.zeros((len(X), 2, 2))
    for j, shift in enumerate(1e-5 * np.eye(2)):
        u = [problem.exact(X + sign * shift, t, MATERIAL)["displacement"] for sign in (1.0, -1.0)]
        F[:, :, j] = np.eye(2)[j] + (u[0] - u[1]) / 2e-5
    return F, SHEAR * (F - np.linalg.inv(F).transpose(0, 2, 1))


@pytest.mark.parametrize("t", (0.003, 0.0137))
def test_body_force_closes_the_balance_of_momentum(t: float) -> None:
    problem, random = registry.get("problem", "radial_ring")(), np.random.default_rng(0)
    R, angle = random.uniform(0.41, 0.59, 100), random.uniform(0.0, 2.0 * np.pi, 100)
    X = R[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    F, P = nominal(problem, X, t)
    cauchy = P @ F.transpose(0, 2, 1) / np.linalg.det(F)[:, None, None]
    assert np.abs(problem.exact(X, t, MATERIAL)["stress"] - cauchy).max() < 1e-6 * SHEAR
    divergence, h, tau = np.zeros_like(X), 2e-4, 2e-6
    for j, shift in enumerate(h * np.eye(2)):
        ahead, behind = (nominal(problem, X + sign * shift, t)[1] for sign in (1.0, -1.0))
        divergence += (ahead - behind)[:, :, j] / (2.0 * h)
    u = [problem.exact(X, t + k * tau, MATERIAL)["displacement"] for k in (-1, 0, 1)]
    b = np.zeros_like(X)
    problem.loads(MATERIAL).body_force(X, t, b)
    residual = 1000.0 * (u[0] - 2.0 * u[1] + u[2]) / tau**2 - divergence - 1000.0 * b
    assert np.abs(residual).max() < 1e-4 * np.abs(1000.0 * b).max()


def test_rims_are_free_and_reach_the_amplitude() -> None:
    problem = registry.get("problem", "radial_ring")()
    fields = problem.exact(np.array([[0.4, 0.0], [0.6, 0.0]]), 0.005, MATERIAL)
    assert np.abs(fields["stress"][:, 0, 0]).max() < 1e-9 * SHEAR
    assert fields["displacement"][:, 0] == pytest.approx([0.1037037, 0.1])


def test_finite_elements_follow() -> None:
    """Moving triangles at a quarter period; the error is 1 % of the motion on 4 cells."""
    result = run("radial_ring", "linear_fem", "linear", resolution=4, end_time=0.005)
    assert float(result.error_displacement_rms) < 2e-3


@pytest.mark.slow
@pytest.mark.parametrize(
    ("functions", "basis", "early", "late"),
    (
        ("updated", "bspline", (9.3e-5, 6.9e-5), (2.5e-4, 5.7e-4)),
        ("frozen", "bspline", (4.1e-5, 2.3e-5), (3.2e-4, 7.6e-5)),
        ("frozen", "linear", (6.7e-4, 4.7e-4), (3.1e-3, 1.8e-3)),
    ),
)
def test_known_values(
    functions: str, basis: str, early: tuple[float, ...], late: tuple[float, ...]
) -> None:
    """On circles of particles, at a quarter period and after a whole one; no second order there."""
    for end, values in ((0.005, early), (0.02, late)):
        found = [
            float(
                run(
                    "radial_ring", "mpm", basis, resolution=n, end_time=end,
                    method__shape_functions=functions,
                ).error_displacement_rms
            )
            for n in (8, 16)
        ]  # fmt: skip
        assert found == pytest.approx(values, rel=0.25), (end, found)
