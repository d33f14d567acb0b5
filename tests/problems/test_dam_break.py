"""The dam break: the measured front, and a fluid without tension."""

import numpy as np
import pytest

from mpmbench.core import registry
from mpmbench.core.compiled import compiled
from mpmbench.core.materials import cauchy_stress, energy_density
from tests.core.support import run


@compiled
def stress_and_energy(law, axes, F, L, state, sigma):  # type: ignore[no-untyped-def]
    cauchy_stress(law, axes, F, L, 1.0, state, sigma)
    return energy_density(law, axes, F, state)


def test_a_fluid_without_tension_carries_pressure_only() -> None:
    """In 1D, where F is J: ``K (J - 1/J) / 2`` below 1 and nothing above, and no energy there."""
    carried, none = (
        registry.get("material", "newtonian_fluid")(bulk_modulus=7.0, tension=tension)
        for tension in ("carried", "none")
    )
    sigma, none_of_it = np.zeros((1, 1)), np.zeros((1, 1))
    for J in (0.9, 1.0, 1.2):
        for material, expected in ((carried, J), (none, min(J, 1.0))):
            F = np.array([[J]])
            energy = stress_and_energy(material.law, (0.0,), F, none_of_it, np.zeros(0), sigma)
            assert sigma[0, 0] == pytest.approx(3.5 * (expected - 1.0 / expected), abs=1e-14)
            assert material.pressure(F)[0, 0] == pytest.approx(sigma[0, 0], abs=1e-14)
            assert energy == pytest.approx(
                1.75 * (expected**2 - 2.0 * np.log(expected) - 1.0), abs=1e-14
            )


def test_measured_front_is_scaled_with_width_and_gravity() -> None:
    problem = registry.get("problem", "dam_break")()
    times, front = problem.measured(1.0)
    assert len(times) == 15
    assert times[-1] == pytest.approx(3.33 * np.sqrt(0.05715 / (2.0 * 9.81)))
    assert front[-1] == pytest.approx(4.11 * 0.05715)
    assert len(problem.measured(0.1)[0]) == np.sum(times <= 0.1)


@pytest.mark.slow
def test_front_runs_as_measured_and_a_little_ahead() -> None:
    """Within 15 % at all 15 instants, for two transfers that keep the energy, and not by PIC's."""
    fluid = {
        "material__bulk_modulus": 2.2426e5,
        "material__viscosity": 1e-3,
        "material__density": 1e3,
    }
    for transfer, resolution in (("apic", 8), ("apic", 16), ("blend", 16)):
        result = run(
            "dam_break",
            "mpm",
            "bspline",
            resolution=resolution,
            method__transfer=transfer,
            method__flip=0.95,
            material__tension="none",
            **fluid,
        )
        assert abs(float(result.lead_of_front)) < 0.15
        times, front = registry.get("problem", "dam_break")().measured(0.18)
        assert 1.0 < np.interp(times[-1], result.time, result.front) / front[-1] < 1.15
        assert float(result.front[0]) == pytest.approx(0.05715, rel=0.03)
    held_back = run("dam_break", "mpm", "bspline", resolution=8, method__transfer="pic", **fluid)
    assert float(held_back.lead_of_front) < -0.2


def test_ritters_wave_on_a_dry_bed() -> None:
    """It keeps the volume, meets the column and the bed, and what is seeded as it is has no error."""
    problem = registry.get("problem", "dam_break")(width=1.0, height=0.1)
    c, t = np.sqrt(9.81 * 0.1), 0.6
    x = np.linspace(1.0 - c * t, 1.0 + 2.0 * c * t, 30001)
    depth = problem.ritter(x, t)
    assert depth[0] == pytest.approx(0.1) and depth[-1] == pytest.approx(0.0, abs=1e-12)
    assert np.trapezoid(depth, x) == pytest.approx(0.1 * c * t, rel=1e-6)
    assert problem.ritter(np.array([1.0]), t)[0] == pytest.approx(4.0 / 9.0 * 0.1)
    sampled = problem.profile_error(x, depth * (x[1] - x[0]), t)
    assert sampled is not None and sampled < 1e-3
    off = problem.profile_error(x, 0.5 * depth * (x[1] - x[0]), t)
    assert off is not None and off > 0.1
    assert (
        problem.profile_error(x, depth, 0.2) is None
        and problem.profile_error(x, depth, 1.1) is None
    )


@pytest.mark.slow
def test_a_long_column_runs_out_as_shallow_water() -> None:
    """Within 15 % of its depth of Ritter's profile."""
    keys = {"problem__width": 1.0, "problem__height": 0.1, "material__bulk_modulus": 1.962e5}
    result = run("dam_break", "mpm", "bspline", resolution=40, end_time=0.6, **keys)
    assert float(result.error_profile) < 0.15
