"""The posterior of an order, against integrals on a grid and densities whose mode is known."""

import numpy as np
import pytest

from mpmbench.analysis import posterior
from mpmbench.analysis.posterior import DEVIATION_WEIGHTS, DEVIATIONS, most_probable


@pytest.mark.parametrize("power", (1, 2))
def test_evidence_of_a_floor_is_the_integral_over_it(power: int) -> None:
    """Against sums over ``c`` and ``f``, for the smallest deviation: floors are flat up to 1.05 of the least error."""
    s = 0.5 ** np.arange(4.0)
    e = s**2 + 0.02 if power == 1 else np.sqrt(s**4 + 0.02**2)
    g, constant = (s**2 / e) ** power, (e.min() / e) ** power
    found = posterior._fits(g[:, None, None], constant[:, None, None], power)
    without, with_floor, share, misfit = (np.ravel(part) for part in found)
    assert share[0] == pytest.approx((0.02 / e.min()) ** power, rel=1e-9)
    assert misfit[0] < 1e-6
    deviation, most = power * DEVIATIONS[0], 1.05**power
    c = np.linspace(0.7, 1.3, 1201)[:, None]
    f = np.linspace(0.0, most, 1401)
    r = c[:, :, None] * g + f[None, :, None] * constant - 1.0
    likelihood = np.exp(-0.5 * np.sum(r**2, axis=2) / deviation**2) / (power * c)
    integral = likelihood.sum() * (c[1, 0] - c[0, 0]) * (f[1] - f[0]) / most
    expected = np.log(DEVIATION_WEIGHTS[0]) - len(s) * np.log(DEVIATIONS[0]) + np.log(integral)
    assert with_floor[0] == pytest.approx(expected, abs=0.01)
    c = np.linspace(0.3, 3.0, 20001)[:, None]
    r = c * g - 1.0
    exponent = -0.5 * np.sum(r**2, axis=1) / deviation**2 - np.log(power * c[:, 0])
    integral_log = np.log(np.exp(exponent - exponent.max()).sum() * (c[1, 0] - c[0, 0]))
    expected = np.log(DEVIATION_WEIGHTS[0]) - len(s) * np.log(DEVIATIONS[0])
    assert without[0] == pytest.approx(expected + integral_log + exponent.max(), abs=0.05)


def test_the_prior_of_the_deviation() -> None:
    """Each is twice the one before, and the weights add up to one."""
    assert np.allclose(np.divide(DEVIATIONS[1:], DEVIATIONS[:-1]), 2.0)
    assert sum(DEVIATION_WEIGHTS) == pytest.approx(1.0)


@pytest.mark.parametrize("mode", (1.37, 2.0, 2.62))
def test_the_mode_of_a_bell_is_found_between_bins(mode: float) -> None:
    values = np.arange(0.0, 4.0, 0.1)
    assert most_probable(values, np.exp(-((values - mode) ** 2))) == pytest.approx(mode, abs=1e-12)


def test_the_mode_at_an_end_or_alone_is_a_bin() -> None:
    values = np.arange(4.0)
    for weight, mode in (((4, 2, 1, 0), 0.0), ((0, 1, 2, 4), 3.0), ((0, 0, 1, 0.5), 2.0)):
        assert most_probable(values, np.array(weight, dtype=float)) == mode
