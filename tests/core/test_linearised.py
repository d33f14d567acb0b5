"""Von Neumann's analysis: closed forms of known schemes, and growth as it is seen in time."""

from typing import Any

import numpy as np
import pytest

from mpmbench.analysis.von_neumann import factors, frequencies, growth_rates
from tests.core.support import run

DT = 0.1  # [s]; E = rho = h = 1


def bar(method: str, basis: str, stretch: float, **changes: Any) -> Any:
    """A few steps of the bar, and what the analysis of the first says."""
    keys = {"problem__stretch": stretch, "time_step": DT, "end_time": 1.0} | changes
    return run("prestretched_bar", method, basis, **keys)


def in_steps(omega: np.ndarray) -> np.ndarray:
    """Frequency of the leapfrog scheme: ``sin(omega' dt / 2) = omega dt / 2``."""
    return 2.0 / DT * np.arcsin(0.5 * DT * omega)


@pytest.mark.parametrize("stretch", (1.0, 1.5))
def test_linear_finite_elements(stretch: float) -> None:
    """``omega = 2 c / h sin(k h / 2)`` with a lumped mass, and ``c^2 = E / (rho J)`` in the bar as it was."""
    found = bar("linear_fem", "linear", stretch)
    exact = in_steps(2.0 * np.sin(0.5 * found.wave_number.values) / np.sqrt(stretch))
    assert np.allclose(found.wave_frequency, exact, rtol=1e-4, atol=1e-4)
    assert np.all(found.wave_growth_rate == 0.0) and float(found.growth_rate_predicted) == 0.0
    assert np.allclose(found.wave_frequency_exact, found.wave_number / np.sqrt(stretch), rtol=1e-12)


@pytest.mark.parametrize("stretch", (1.0, 1.5))
def test_one_particle_to_a_cell_of_a_grid(stretch: float) -> None:
    """``omega = sqrt((1 + ln J) / J) c / h sin(k h)``: stretched bars are too stiff, waves of two cells free.

    Particles that stay in their cells feel their volume grow and not that they become fewer.
    """
    found = bar("mpm", "linear", stretch, time_step=0.01, end_time=0.1)
    stiff = np.sqrt((1.0 + np.log(stretch)) / stretch)
    exact = in_steps(stiff * np.sin(found.wave_number.values))
    assert np.allclose(found.wave_frequency, exact, rtol=0.0, atol=0.005)
    assert float(found.wave_frequency[-1]) < 1e-3


def test_nodal_integration_has_a_mode_without_energy() -> None:
    """Gradients of symmetric functions at nodes do not see a wave of two cells; those between nodes do."""
    keys = {"method__shape_functions": "frozen"}
    nodal = bar("otm", "lme", 1.0, problem__particle_layout="nodes", **keys)
    between = bar("otm", "lme", 1.0, **keys)
    assert float(nodal.wave_frequency[-1]) < 1e-3 and float(between.wave_frequency[-1]) > 1.4
    assert np.allclose(nodal.wave_frequency[:5], nodal.wave_frequency_exact[:5], rtol=0.02)


def test_growth_of_an_eulerian_kernel_is_that_seen_in_time() -> None:
    """Functions that are evaluated anew are unstable in tension, from the shortest waves on; kept ones are not."""
    keys = {"end_time": 60.0}
    found = bar("otm", "lme", 1.5, **keys)
    unstable = np.flatnonzero(found.wave_growth_rate.values)
    assert unstable[-1] == 40 and np.all(np.diff(unstable) == 1)
    predicted = float(found.growth_rate_predicted)
    assert predicted > 0.4
    assert float(found.growth_rate) == pytest.approx(predicted, rel=0.05)
    kept = bar("otm", "lme", 1.5, method__shape_functions="frozen", **keys)
    assert float(kept.growth_rate_predicted) == 0.0 and float(kept.growth) < 2.0


def test_waves_of_a_row() -> None:
    """Advection by a cell in two steps, as averages do it, damps; a shift by one cell is exact."""
    k = np.array([0.0, 1.0, np.pi])
    shift = np.array([0.0, 0.0, 1.0]).reshape(3, 1, 1)
    found = factors(shift, k)
    assert np.allclose(found[:, 0], np.exp(-1j * k))
    assert np.allclose(frequencies(found, 0.5), k / 0.5)
    assert np.all(growth_rates(found, 0.5) == 0.0)
    assert np.allclose(growth_rates(2.0 * found, 0.5), np.log(2.0) / 0.5)
    average = factors(np.array([0.0, 0.5, 0.5]).reshape(3, 1, 1), k)
    assert np.allclose(np.abs(average[:, 0]), np.cos(0.5 * k))
