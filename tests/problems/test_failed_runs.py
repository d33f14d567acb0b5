"""A run that ends before its time has no number of the end, least of all that of its first instant."""

import numpy as np
import pytest

from mpmbench import case
from mpmbench.core.simulation import simulate
from tests.core.support import compose


@pytest.mark.parametrize(
    ("problem", "resolution", "names"),
    (
        ("taylor_anvil", 2, {"length", "radius_fifth", "von_mises_max", "plastic_strain_max"}),
        ("two_squares", 4, {"kinetic_energy_kept", "velocity_1", "pulled_back", "captured"}),
        ("sphere_impact", 2, {"sphere_energy_left", "captured"}),
        ("zalesak_rotation", 6, {"shape_residual", "kinetic_energy_kept"}),
    ),
)
def test_no_number_of_the_end(problem: str, resolution: int, names: set[str]) -> None:
    built = case.read(compose(problem, "mpm", "linear", resolution=resolution))
    solution = simulate(case.build(built), 1e-9, 1e-9)
    assert names <= set(built.problem.quantities(solution, built.material))
    solution.status, solution.snapshots = "diverged", solution.snapshots[:1]
    found = built.problem.quantities(solution, built.material)
    assert not names & {name for name, value in found.items() if np.ndim(value[0]) == 0}
