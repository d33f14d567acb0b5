"""Benchmark 8.1: reference values, orders before the floor, crossings and the floor of the time step."""

import numpy as np
import pytest

from mpmbench.analysis.norms import root_mean_square
from tests.core.support import ConvergenceStudy, run

FINE_STEP = {"time_step": 1e-6}  # at 1e-5 the floor of the time step bends the fine end


class TestMpmLinear(ConvergenceStudy):
    changes = FINE_STEP


@pytest.mark.slow  # the crossings are counted below
class TestMpmLinearUntilItCrosses(ConvergenceStudy):
    cells = (31, 63, 127)  # 32, 64, 128 nodes
    changes = FINE_STEP


@pytest.mark.slow  # the order of hats, by the same kernels; its error is a reference value below
class TestMpmBSplineLumped(ConvergenceStudy):
    basis, changes = "bspline", FINE_STEP


class TestMpmBSplineConsistent(ConvergenceStudy):
    basis, order = "bspline", 3.0
    changes = FINE_STEP | {"method__mass": "consistent"}


class TestOtmLinear(ConvergenceStudy):
    method, changes = "otm", FINE_STEP


@pytest.mark.slow  # four grids; by default its error is a reference value, and its order in time
class TestOtmMaxEnt(ConvergenceStudy):
    method, basis, order, tolerance = "otm", "maxent", 3.5, 0.1
    cells = (8, 16, 32, 64)
    changes = FINE_STEP


@pytest.mark.slow  # the same functions as below, and the method of hats above
class TestOtmBSpline(ConvergenceStudy):
    """Admissible, against the paper: Greville points make B-splines linearly complete."""

    method, basis, order, changes = "otm", "bspline", 3.0, FINE_STEP


class TestUnified(ConvergenceStudy):
    method, basis, order, changes = "unified", "bspline", 3.0, FINE_STEP


class TestUnifiedStress(ConvergenceStudy):
    """Stress is one order below displacement."""

    method, basis, order, changes = "unified", "bspline", 2.0, FINE_STEP
    norm = "error_stress_rms"


class TestNodalLumped(ConvergenceStudy):
    method = "otm"
    changes = FINE_STEP | {"method__mass": "lumped", "method__transfer": "nodal"}


class TestFrozen(ConvergenceStudy):
    changes = FINE_STEP | {"method__shape_functions": "frozen"}


class TestTimeStep(ConvergenceStudy):
    """Order 2 in time: steps per run are varied, at a resolution whose error in space is below them."""

    method, basis, cells = "otm", "maxent", (10, 20, 40)

    def test_order(self) -> None:
        errors = [
            float(
                run(self.problem, self.method, self.basis, resolution=64, time_step=1e-3 / n)[
                    "error_displacement_rms"
                ]
            )
            for n in self.cells
        ]
        slopes = np.log(np.array(errors[:-1]) / errors[1:]) / np.log(2.0)
        assert np.all(np.abs(slopes - 2.0) < 0.1), errors


@pytest.mark.parametrize(
    ("method", "basis", "mass", "expected"),
    [
        ("mpm", "linear", "lumped", 7.33e-7),
        ("otm", "linear", "consistent", 1.59e-7),
        ("mpm", "bspline", "consistent", 2.55e-9),
        ("mpm", "bspline", "lumped", 1.40e-6),
        ("unified", "bspline", "consistent", 2.55e-9),
        ("otm", "maxent", "consistent", 3.49e-10),
    ],
)
def test_reference_values_at_32_nodes(method: str, basis: str, mass: str, expected: float) -> None:
    result = run("bar_fixed_ends", method, basis, method__mass=mass)
    assert float(result["error_displacement_rms"]) == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize(
    ("nodes", "crossings"), [(32, 0), (64, 0), (128, 80), (256, 306), (512, 1185)]
)
def test_crossing_counts(nodes: int, crossings: int) -> None:
    result = run("bar_fixed_ends", "mpm", "linear", resolution=nodes - 1)
    assert int(result["n_cell_crossings"]) == pytest.approx(crossings, rel=0.1)


def test_second_order_is_lost_to_crossing() -> None:
    errors = [
        float(run("bar_fixed_ends", "mpm", "linear", resolution=n)["error_displacement_rms"])
        for n in (127, 255)
    ]
    assert np.log2(errors[0] / errors[1]) < 1.0


@pytest.mark.parametrize("time_step", (1e-5, 5e-6))
def test_floor_of_the_time_step_is_predicted(time_step: float) -> None:
    """Where the error in space is smaller, the error is the exactly computable one of the leapfrog scheme."""
    result = run("bar_fixed_ends", "unified", "bspline", resolution=255, time_step=time_step)
    assert float(result["error_displacement_rms"]) == pytest.approx(
        float(result["predicted_temporal_floor"]), rel=0.1
    )
    if time_step == 1e-5:
        assert float(result["predicted_temporal_floor"]) == pytest.approx(2.764e-10, rel=1e-3)


def test_small_strain_law_is_exact_at_large_strain() -> None:
    """v_0 = 20 m/s: 20 % strain, still the linear solution; the order of the moving methods remains."""
    changes = {"problem__velocity_amplitude": 20.0, "end_time": 0.02, "time_step": 2e-5}
    errors = [
        float(
            run("bar_fixed_ends", "otm", "linear", resolution=n, **changes)[
                "error_displacement_rms"
            ]
        )
        for n in (8, 16, 32)
    ]
    slopes = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(np.abs(slopes - 2.0) < 0.15), errors


def test_stored_errors_are_those_of_the_stored_fields() -> None:
    result = run("bar_fixed_ends", "mpm", "linear", resolution=8)
    for name in ("displacement", "velocity", "stress"):
        last = (result[name] - result[f"{name}_exact"]).isel(snapshot=-1).values
        assert float(result[f"error_{name}_rms"]) == pytest.approx(
            root_mean_square(last), rel=1e-12
        )
