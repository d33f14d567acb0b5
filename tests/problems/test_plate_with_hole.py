"""The plate with a hole: Kirsch's solution is one, and conforming elements reach it with order 2."""

import numpy as np
import pytest

from mpmbench.analysis.slopes import fitted_order
from mpmbench.core import registry
from tests.core.support import run

MATERIAL = registry.get("material", "small_strain_elastic")(
    young_modulus=1e6, poisson_ratio=0.3, density=1000.0
)
TENSION = 100.0  # [Pa]


def test_kirsch_is_in_equilibrium_with_hooke() -> None:
    """Stress from differences of the displacement, without divergence; and its known values at the hole."""
    problem, random = registry.get("problem", "plate_with_hole")(), np.random.default_rng(0)
    r, angle = random.uniform(1.05, 3.9, 100), random.uniform(0.05, 1.5, 100)
    X = r[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    lame, shear = MATERIAL.lame_parameters()
    gradient, divergence, h = np.zeros((100, 2, 2)), np.zeros((100, 2)), 1e-4
    for j, shift in enumerate(h * np.eye(2)):
        ahead, behind = (problem.exact(X + sign * shift, 1.0, MATERIAL) for sign in (1.0, -1.0))
        gradient[:, :, j] = (ahead["displacement"] - behind["displacement"]) / (2.0 * h)
        divergence += (ahead["stress"] - behind["stress"])[:, :, j] / (2.0 * h)
    strain = 0.5 * (gradient + gradient.transpose(0, 2, 1))
    trace = np.trace(strain, axis1=1, axis2=2)[:, None, None]
    hooke = lame * trace * np.eye(2) + 2.0 * shear * strain
    assert np.abs(hooke - problem.exact(X, 1.0, MATERIAL)["stress"]).max() < 1e-5 * TENSION
    assert np.abs(divergence).max() < 1e-5 * TENSION
    corners = problem.exact(np.array([[0.0, 1.0], [1.0, 0.0]]), 1.0, MATERIAL)["stress"]
    assert corners[0, 0, 0] == pytest.approx(3.0 * TENSION)
    assert corners[1, 1, 1] == pytest.approx(-TENSION)
    assert np.abs(corners[[0, 1], [1, 0], [1, 0]]).max() < 1e-10 * TENSION


def test_finite_elements_have_order_2() -> None:
    cells = (8, 16, 32)
    results = [run("plate_with_hole", "fem", "linear", resolution=n) for n in cells]
    errors = np.array([float(result.error_displacement_rms) for result in results])
    assert fitted_order(1.0 / np.array(cells), errors) == pytest.approx(2.0, abs=0.2), errors
    assert float(results[-1].stress_concentration) == pytest.approx(3.0, rel=0.15)


@pytest.mark.slow
def test_clouds_converge_and_a_grid_that_cuts_the_hole_does_so_slowly() -> None:
    """The mesh of the particles follows the hole, the cells of a grid do not: an order of about a half."""
    cells = (8, 16, 32)
    for method, basis, low, high in (
        ("gmm", "lme", 0.8, 3.0),
        ("implicit_mpm", "bspline", 0.3, 1.2),
    ):
        errors = [
            float(run("plate_with_hole", method, basis, resolution=n).error_displacement_rms)
            for n in cells
        ]
        order = fitted_order(1.0 / np.array(cells), np.array(errors))
        assert low < order < high, (method, errors)


def test_f_bar_keeps_stresses_right_where_volume_cannot_change() -> None:
    """At nu = 0.4999 hats lock: stresses and displacements are far off, with F-bar neither is."""
    standard, f_bar = (
        run(
            "plate_with_hole",
            "implicit_mpm",
            "linear",
            resolution=16,
            method__time="static",
            method__ghost_stiffness=1e-6,
            method__volumetric=volumetric,
            material__poisson_ratio=0.4999,
        )
        for volumetric in ("standard", "f_bar")
    )
    assert float(f_bar.error_displacement_rms) < 0.4 * float(standard.error_displacement_rms)
    assert float(f_bar.error_stress_rms) < 0.02 * float(standard.error_stress_rms)
    assert 2.0 < float(f_bar.stress_concentration) < 5.0 < float(standard.stress_concentration)
