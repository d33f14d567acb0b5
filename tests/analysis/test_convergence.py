"""Asymptotic orders: exact on exact powers, honest intervals on 2000 synthetic cases, verdicts in plain words."""

import numpy as np
import pytest

from mpmbench.analysis.convergence import estimate_order
from mpmbench.analysis.estimate import asymptotic_text
from mpmbench.analysis.slopes import fitted_order, local_orders

CELLS = 2.0 ** np.arange(3, 10)  # 8 to 512


def synthetic(generator, floor_kind):
    """Errors of C h^p (1 + a h) + floor with 2 % log-normal noise: sizes, errors, p, floor.

    Kind "squares": as "level", but the floor adds in squares, as root mean squares of unrelated
    fields do.

    p 1 to 4, |a h| at the coarsest level up to 0.5, 4 to 7 levels. Kind "level": no floor, or one
    that equals the error of any level from the finest up to the third from the coarse end, with
    equal odds. Kind "size": none in three cases of ten, otherwise any value that makes at least a
    fifth of the finest error, up to the third level's.
    """
    levels = generator.integers(4, 8)
    order, drift = generator.uniform(1.0, 4.0), generator.uniform(-0.5, 0.5)
    h = 1.0 / CELLS[:levels]
    clean = 10.0 ** generator.uniform(-8, 0) * h**order * (1.0 + drift * h / h[0])
    if floor_kind in ("level", "squares"):
        from_level = generator.integers(2, levels + 1)
        floor = clean[from_level] if from_level < levels else 0.0
    else:
        floor = generator.uniform(clean[-1] / 4.0, clean[2]) if generator.random() < 0.7 else 0.0
    total = np.hypot(clean, floor) if floor_kind == "squares" else clean + floor
    return h, total * np.exp(0.02 * generator.standard_normal(levels)), order, floor


def score(seed, cases, floor_kind):
    """Share of intervals that hold p, median width, share of floors recognised (and of none where there is none)."""
    generator = np.random.default_rng(seed)
    covered, width, recognised = [], [], []
    for _ in range(cases):
        h, e, order, floor = synthetic(generator, floor_kind)
        found = estimate_order(h, e)
        covered.append(found.low <= order <= found.high)
        width.append(found.high - found.low)
        recognised.append((found.floor > 0) == (floor > 0))
    return np.mean(covered), np.median(width), np.mean(recognised)


@pytest.mark.slow  # two thousand fits; single ones below
def test_interval_covers_the_order_and_floors_are_recognised():
    covered, width, recognised = score(seed=2020, cases=2000, floor_kind="level")
    assert covered >= 0.93
    assert width <= 0.3
    assert recognised >= 0.95
    assert covered < 0.995, "an interval that always covers is wider than it says"


@pytest.mark.parametrize("floor_kind", ["size", "squares"])
@pytest.mark.slow
def test_interval_covers_the_order_with_other_floors(floor_kind):
    covered, _, recognised = score(seed=7, cases=400, floor_kind=floor_kind)
    assert covered >= 0.93
    assert recognised >= 0.95


def test_a_temporal_floor_of_root_mean_squares_leaves_the_order_alone():
    # quadratic B-splines with moving nodes on the bar with fixed ends, time step 1e-5 s: order 3
    # until 2.76e-10 m
    cells = np.array([7, 15, 31, 63, 127, 255, 511])
    e = np.hypot(7.6e-5 * cells**-3.0, 2.764e-10)
    found = estimate_order(1.0 / cells, e, labels=cells, predicted_floor=2.764e-10)
    assert found.low < 3.0 < found.high and found.half_width < 0.2
    assert "the time step limits" in found.verdict


def test_a_finer_level_below_it_refutes_a_floor():
    # max-ent functions on the bar with dynamic traction: four levels alone look like a floor of
    # 7e-9
    cells = np.array([16, 32, 64, 128, 256])
    e = np.array([1.56e-6, 3.32e-7, 4.37e-8, 1.27e-8, 1.91e-9])
    assert estimate_order(1.0 / cells[:4], e[:4]).floor > 5e-9
    found = estimate_order(1.0 / cells, e, labels=cells)
    assert found.floor == 0.0 and "level off" not in found.verdict
    assert not np.isfinite(found.low) or found.low <= np.mean(found.local) <= found.high


@pytest.mark.parametrize("order", [0.5, 1.0, 2.0, 3.5])
def test_exact_powers_give_their_order(order):
    h = 1.0 / CELLS
    assert fitted_order(h, 3e-5 * h**order) == pytest.approx(order, abs=1e-12)
    assert local_orders(h, 3e-5 * h**order) == pytest.approx(np.full(6, order), abs=1e-12)


def test_estimate_of_an_exact_power_is_sharp_and_has_no_floor():
    found = estimate_order(1.0 / CELLS, 3e-5 * CELLS**-3.0, labels=CELLS.astype(int))
    assert found.slope == pytest.approx(3.0, abs=1e-12)
    assert found.asymptotic == pytest.approx(3.0, abs=0.02)
    assert found.high - found.low < 0.1
    assert found.floor == 0.0
    assert not found.pre_asymptotic.any()
    assert found.verdict.startswith("slope 3.00 (3.00 to 3.00) over 8..512 cells; asymptotic order")


def test_order_and_scale_of_the_data_do_not_matter():
    h, e, *_ = synthetic(np.random.default_rng(3), "level")
    found = estimate_order(h, e)
    for other in (
        estimate_order(h[::-1], e[::-1]),
        estimate_order(1e3 * h, e),
        estimate_order(h, 1e9 * e),
    ):
        assert (other.low, other.high) == pytest.approx((found.low, found.high), rel=1e-9)


def test_floor_is_measured_and_explained_by_the_predicted_one():
    e = 1e-4 * CELLS**-3.5 + 2.76e-10
    found = estimate_order(1.0 / CELLS, e, labels=CELLS.astype(int), predicted_floor=2.764e-10)
    assert found.floor == pytest.approx(2.76e-10, rel=0.05)
    assert found.low < 3.5 < found.high
    assert found.floor_share[0] < 0.05 and found.floor_share[-1] > 0.9
    assert "near 2.8e-10 m the time step limits (predicted 2.8e-10 m)" in found.verdict
    elsewhere = estimate_order(1.0 / CELLS, e, predicted_floor=1e-12)
    assert "the errors level off" in elsewhere.verdict and "time step" not in elsewhere.verdict


def test_drift_marks_coarse_levels_as_pre_asymptotic():
    h = 1.0 / CELLS
    found = estimate_order(h, h**3 * (1.0 + 0.5 * h / h[0]), labels=CELLS.astype(int))
    assert found.low < 3.0 < found.high
    assert found.pre_asymptotic[0] and not found.pre_asymptotic[-1]
    assert "pre-asymptotic at 8" in found.verdict


def test_slopes_that_still_change_stay_inside_the_interval():
    cells = np.array([8, 16, 32])
    found = estimate_order(1.0 / cells, [1.94e-5, 5.98e-6, 1.29e-6], labels=cells)
    assert found.low <= found.local.min() and found.high >= found.local.max()
    assert found.verdict.startswith("slope 1.96 (1.70 to 2.21) over 8..32 cells")
    assert "pre-asymptotic throughout" in found.verdict


def test_errors_that_rise_again_are_left_out_and_named():
    e = 1e-4 * CELLS**-2.0
    e[5:] *= 8.0, 40.0
    found = estimate_order(1.0 / CELLS, e, labels=CELLS.astype(int))
    assert found.used.tolist() == [True] * 5 + [False] * 2
    assert found.asymptotic == pytest.approx(2.0, abs=0.02)
    assert found.verdict.startswith("rises: last slope -0.32 over 8..512 cells")
    assert (
        "from 8..128 cells" in found.verdict
        and "at 256..512 cells the errors leave this line" in found.verdict
    )


def test_errors_without_any_order_get_none():
    found = estimate_order(1.0 / CELLS, 1e-4 * np.array([1.0, 9.0, 0.5, 7.0, 0.3, 6.0, 0.2]))
    assert np.isnan(found.asymptotic) and not found.used.any()
    assert "no single order explains the slopes -3.17, 4.17" in found.verdict


def test_one_level_above_a_floor_has_no_order():
    # linear MPM on the plate, where particles cross cells from 16 cells on
    cells = np.array([8, 16, 32, 64])
    found = estimate_order(1.0 / cells, [2.30e-4, 7.30e-5, 6.84e-5, 7.31e-5], labels=cells)
    assert np.isnan(found.asymptotic) and found.floor == pytest.approx(7e-5, rel=0.05)
    assert found.verdict == (
        "levels off: last slope -0.10 over 8..64 cells; near 7e-05 m the errors level off"
    )


def test_errors_that_do_not_depend_on_the_size_get_none():
    found = estimate_order(1.0 / CELLS, np.array([1.0, 1.01, 0.99, 1.0, 1.02, 1.0, 1.01]))
    assert np.isnan(found.asymptotic)
    assert found.verdict.startswith("no order: over")


@pytest.mark.parametrize(
    ("levels", "verdict"), [(0, "no finished run"), (1, "one level only"), (2, "two levels")]
)
def test_few_levels_state_no_interval(levels, verdict):
    found = estimate_order(1.0 / CELLS[:levels], CELLS[:levels] ** -2.0)
    assert np.isnan(found.half_width)
    assert verdict in found.verdict
    if levels == 2:
        assert found.slope == pytest.approx(2.0)


def test_three_levels_are_wider_than_six_and_say_why():
    few, many = (estimate_order(1.0 / CELLS[:n], CELLS[:n] ** -2.0) for n in (3, 6))
    assert few.asymptotic == pytest.approx(2.0, abs=1e-9)
    assert few.half_width > 3.0 * many.half_width
    assert "3 levels cannot tell a floor from a drift" in few.verdict
    assert "to" in asymptotic_text(few) and "±" in asymptotic_text(many)


@pytest.mark.parametrize(
    ("sizes", "errors", "message"),
    [
        ([0.1, 0.05], [1e-3, 0.0], "positive and finite"),
        ([0.1, 0.05], [1e-3, np.nan], "positive and finite"),
        ([0.1, 0.1], [1e-3, 1e-4], "once"),
        ([0.1, 0.05], [1e-3], "same length"),
    ],
)
def test_bad_data_are_refused(sizes, errors, message):
    with pytest.raises(ValueError, match=message):
        estimate_order(sizes, errors)
    with pytest.raises(ValueError, match="at least 2 levels"):
        fitted_order([0.1], [1e-3])


def test_predicted_floor_that_three_levels_cannot_show_is_named():
    cells = np.array([8, 16, 32])
    found = estimate_order(
        1.0 / cells, [2.42e-8, 2.17e-9, 3.35e-10], labels=cells, predicted_floor=2.764e-10
    )
    assert found.asymptotic == pytest.approx(3.48, abs=0.01), (
        "the slope that the time step bends is left out"
    )
    assert (
        "at 32 cells most of the error is that of the time step (predicted 2.8e-10 m)"
        in found.verdict
    )
