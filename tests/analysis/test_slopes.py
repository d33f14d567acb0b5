"""The printed order is what the levels show, on curves that converge and on those that do not."""

import re

import numpy as np
import pytest

from mpmbench.analysis.convergence import estimate_order
from mpmbench.analysis.estimate import asymptotic_text, slopes_text
from mpmbench.analysis.slopes import course_of
from tests.support import slow_if

CELLS = 2.0 ** np.arange(3, 10)  # 8 to 512
NEAR = 0.1  # how far two slopes may differ and still be called the same


def curve(slopes):
    """Errors with these slopes between neighbouring levels, from 8 cells on."""
    return np.exp2(-np.append(0.0, np.cumsum(slopes)))


def estimate(slopes, **more):
    e = curve(slopes)
    return estimate_order(1.0 / CELLS[: len(e)], e, labels=CELLS[: len(e)].astype(int), **more)


@pytest.mark.parametrize(
    ("slopes", "text"),
    [
        ((3.03, 3.00, 2.97), "3.00 (2.97 to 3.03)"),
        ((1.13, 1.56, 2.28), "1.65 (1.13 to 2.28)"),
        ((1.99, 1.29), "1.64 (1.99 falling to 1.29)"),
        ((2.01,), "2.01"),
        ((1.78, 0.57), "levels off: last slope 0.57"),
        ((2.07, 1.42, 0.17), "levels off: last slope 0.17"),
        ((1.08, 1.13, 0.29, 0.46), "levels off: last slopes 0.29, 0.46"),
        ((3.00, 2.57, 0.55, -0.01, -0.08), "levels off: last slope -0.08"),
        ((0.10, 0.76, 0.09, -0.64), "rises: last slope -0.64"),
        ((1.21, -0.23, -0.89, -0.06), "rises: last slopes -0.89, -0.06"),
        ((0.02, 0.00, -0.001), "stays: slopes 0.00 to 0.02"),
        ((-3.2, 4.2, -3.8, 4.5, -4.3, 4.9), "uneven: slopes -4.30 to 4.90"),
        ((), "none"),
    ],
)
def test_the_order_is_what_the_levels_show(slopes, text):
    assert slopes_text(estimate(slopes)) == text


@pytest.mark.parametrize(
    "slopes",
    [
        (1.78, 0.57),
        (2.07, 1.42, 0.17),
        (1.01, 1.12, 0.95),
        (0.10, 0.76, 0.09, -0.64),
        (1.69, 2.20, 1.90),
        (2.19, 2.06, 2.03),
    ],
)
def test_no_asymptotic_order_is_named_outside_the_slopes_without_a_reason_that_they_show(slopes):
    found = estimate(slopes)
    named = found.asymptotic
    assert np.isnan(named) or min(slopes) - 0.05 <= named <= max(slopes) + 0.05
    if np.isnan(named):
        assert asymptotic_text(found) == "none" or " if " in asymptotic_text(found)


def test_a_floor_that_the_slopes_show_is_a_reason():
    e = 1e-4 * CELLS**-2.0
    found = estimate_order(1.0 / CELLS, e + e[3])
    assert found.asymptotic == pytest.approx(2.0, abs=0.05) and found.local.max() < 2.0
    assert asymptotic_text(found).endswith(f"without a floor of {found.floor:.2g} m")
    assert slopes_text(found).startswith("levels off")


def test_errors_of_rounding_have_no_order():
    # a rigid block that moves by 0.1 m
    cells = np.array([4, 8, 16])
    found = estimate_order(1.0 / cells, [8e-16, 1e-15, 4e-16], labels=cells, scale=0.1)
    assert slopes_text(found) == "round-off" and np.isnan(found.slope)
    assert found.verdict == "no order: at 4..16 cells the errors are round-off"
    assert (
        slopes_text(estimate_order(1.0 / cells, [8e-16, 1e-15, 4e-16], scale=1e-9)) != "round-off"
    )


def test_levels_of_rounding_are_left_out_of_a_curve():
    e = np.append(1e-4 * CELLS[:5] ** -3.0, [1e-15, 3e-15])
    found = estimate_order(1.0 / CELLS, e, labels=CELLS.astype(int), scale=1.0)
    assert found.slope == pytest.approx(3.0) and len(found.local) == 4
    assert found.verdict.endswith("at 256..512 cells the errors are round-off")
    assert found.used.tolist() == [True] * 5 + [False] * 2


def test_an_error_below_it_shows_that_a_predicted_floor_is_none():
    # the unified method at large strain, time step 1e-5 s
    cells = np.array([8, 16, 32, 64, 128])
    e = np.array([2.22e-5, 3.02e-6, 4.77e-7, 6.21e-8, 3.98e-8])
    found = estimate_order(1.0 / cells, e, labels=cells, predicted_floor=5.73e-8)
    assert "the time step limits" not in found.verdict
    assert (
        "errors fall below 5.7e-08 m, the error of time integration alone: that of space may "
        "cancel it" in found.verdict
    )


def test_three_levels_do_not_show_a_predicted_floor_that_one_of_them_is_below():
    cells = np.array([8, 16, 32])
    found = estimate_order(1.0 / cells, [4e-6, 5e-7, 6e-8], labels=cells, predicted_floor=7e-8)
    assert not found.floor_share.any() and "most of the error" not in found.verdict


def synthetic(generator, kind):
    """A curve that does not converge, with 2 % noise: a floor, errors that grow again, or no order at all."""
    levels = generator.integers(4, 8)
    cells = CELLS[:levels]
    clean = cells ** -generator.uniform(1.0, 4.0)
    turn = clean[generator.integers(1, levels - 1)]  # reached before the finest level
    rest = {
        "adds": lambda: clean + turn,
        "squares": lambda: np.hypot(clean, turn),
        "grows": lambda: clean + turn * (cells / cells[-2]) ** generator.uniform(0.5, 2.0),
        "alternates": lambda: 10.0 ** generator.uniform(-1.0, 1.0, levels),
    }[kind]()
    return 1.0 / cells, rest * np.exp(0.02 * generator.standard_normal(levels))


@pytest.mark.parametrize(
    "kind", [slow_if(kind != "adds", kind) for kind in ("adds", "squares", "grows", "alternates")]
)
def test_the_printed_slope_of_a_curve_that_does_not_converge_never_misleads(kind):
    generator = np.random.default_rng(2020)
    stated = 0
    for _ in range(100):
        found = estimate_order(*synthetic(generator, kind))
        text, local = slopes_text(found), found.local
        assert local.min() <= found.slope <= local.max()
        number = re.match(r"-?[\d.]+", text)
        stated += number is not None
        if number is not None and float(number[0]) > local[-2:].max() + NEAR:
            assert f"falling to {local[-1]:.2f}" in text, (text, local)
        if number is None:
            assert re.search(r"last slopes? |slopes .* to ", text), text
    if kind != "alternates":  # a random curve may happen to fall all the way
        assert stated <= 5, f"{stated} of 100 curves that level off were given an order"


@pytest.mark.parametrize("drift", [-0.5, 0.0, 0.5])
def test_a_curve_that_converges_is_given_its_slope(drift):
    generator = np.random.default_rng(1)
    for order in generator.uniform(1.0, 4.0, 30):
        h = 1.0 / CELLS[: generator.integers(3, 8)]
        e = h**order * (1.0 + drift * h / h[0]) * np.exp(0.02 * generator.standard_normal(len(h)))
        found = estimate_order(h, e)
        assert found.converges, (order, found.local)
        assert re.match(r"[\d.]+ \(", slopes_text(found))


@pytest.mark.parametrize(
    ("local", "course"),
    [((2.0, 0.05, 2.0, 2.0), "converges"), ((2.0, -0.2, 2.0, 2.0), "uneven")],
)
def test_a_level_that_helps_little_is_no_step_back(local: tuple[float, ...], course: str) -> None:
    assert course_of(1.0 / CELLS[:5], curve(local)) == (course, 1)
