"""A run that ends before its time has no number of the end, least of all that of its first instant."""

import numpy as np
import pytest

from mpmbench import case
from mpmbench.case.output import outcome
from mpmbench.core.simulation import simulate
from tests.core.support import compose
from tests.support import slow_if


@pytest.mark.parametrize(
    ("problem", "resolution", "of_the_end"),
    (
        # those in space are compiled for it alone
        slow_if(
            True,
            "taylor_anvil",
            2,
            {"length", "radius_fifth", "von_mises_max", "plastic_strain_max"},
        ),
        ("two_squares", 4, {"kinetic_energy_kept", "velocity_1", "pulled_back", "captured"}),
        slow_if(True, "sphere_impact", 2, {"sphere_energy_left", "captured"}),
        ("bouncing_disk", 4, {"restitution", "energy_kept"}),
        ("rolling_disk", 4, {"error_centre_rms"}),
        ("friction_slope", 4, {"error_slide_rms"}),
        ("zalesak_rotation", 6, {"shape_residual", "kinetic_energy_kept"}),
    ),
)
def test_no_number_of_the_end(problem: str, resolution: int, of_the_end: set[str]) -> None:
    config = compose(problem, "mpm", "linear", resolution=resolution)
    built = case.read(config)
    state = case.build(built)
    solution = simulate(state, 1e-9, 1e-9)
    whole = outcome(config, built, state, solution, 0.0).as_dataset()
    assert of_the_end <= set(whole.data_vars)
    solution.status, solution.snapshots = "diverged", solution.snapshots[:1]
    failed = outcome(config, built, state, solution, 0.0).as_dataset()
    assert not of_the_end & set(failed.data_vars)
    known = built.problem.quantities(solution, built.material)
    assert {name for name in built.problem.known_early if name in known} <= set(failed.data_vars)
    series = {name for name, (value, *_) in known.items() if np.ndim(value)}
    assert series <= set(failed.data_vars)
