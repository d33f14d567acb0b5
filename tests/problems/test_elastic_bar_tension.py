"""The elastic bar in tension and the stretched bar: tolerances of the specification, and controls that must fail."""

from typing import Any

import numpy as np
import pytest
import xarray as xr

from mpmbench.case import read, solve
from mpmbench.core.errors import NotApplicable
from mpmbench.core.materials.elastic.small_strain_elastic import SmallStrainElastic
from mpmbench.core.stability import wave_speed
from mpmbench.problems.elastic_bar_tension import ElasticBarTension
from tests.core.support import compose, run
from tests.support import slow_if

LUMPED = {"method__mass": "lumped", "method__transfer": "nodal"}
IRREGULAR = {"problem__irregularity": 0.3, "end_time": 1.2e-4}  # one period and a little more
AMPLITUDE = 3.2975e-5  # of the tip [m]


def bar(method: str, basis: str, **changes: Any) -> xr.Dataset:
    return run("elastic_bar_tension", method, basis, **changes)


def test_exact_tip() -> None:
    """Rises to 3.2975e-5 m at 6.6 us, holds to 46.17, falls to -3.2975e-5 at 59.36."""
    problem = ElasticBarTension()
    steel = SmallStrainElastic(young_modulus=200e9, poisson_ratio=0.0, density=7833.0)
    assert wave_speed(steel) == pytest.approx(5053.02, rel=1e-6)
    tip = np.array([[problem.reference_length]])
    for t, expected in (
        (0.0, 0.0),
        (3.3e-6, 0.5),
        (6.6e-6, 1.0),
        (46.1e-6, 1.0),
        (59.36e-6, -1.0),
        (98.9e-6, -1.0),
    ):
        assert problem.exact(tip, t, steel)["displacement"][0, 0] == pytest.approx(
            expected * AMPLITUDE, abs=2e-8
        ), t


def test_exact_fields_are_one_wave() -> None:
    """v and sigma are the derivatives of u, away from the fronts, and the ends are held and free."""
    problem = ElasticBarTension()
    steel = SmallStrainElastic(young_modulus=200e9, poisson_ratio=0.0, density=7833.0)
    X = np.linspace(0.0, problem.reference_length, 57)[:, None]
    for t in (2.1e-6, 3.1e-5, 7.7e-5, 1.9e-4):
        fields = problem.exact(X, t, steel)
        dt, dX = 1e-9, 1e-7
        later, earlier = (problem.exact(X, t + s * dt, steel)["displacement"] for s in (1, -1))
        right, left = (problem.exact(X + s * dX, t, steel)["displacement"] for s in (1, -1))
        assert np.mean(np.abs((later - earlier) / (2 * dt) - fields["velocity"]) < 1e-5) > 0.9
        stress = 200e9 * (right - left) / (2 * dX)
        assert np.mean(np.abs(stress - fields["stress"][:, 0]) < 1e2) > 0.9
        assert fields["displacement"][0, 0] == pytest.approx(0.0, abs=1e-18)
        assert fields["stress"][-1, 0, 0] == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize(
    ("method", "basis", "changes", "energy"),
    [
        ("otm", "lme", LUMPED | {"particles_per_cell": 1}, 0.015),
        slow_if(True, "otm", "lme", {}, 0.001),
        slow_if(True, "linear_fem", "linear", {}, 0.015),
        slow_if(True, "linear_fem", "linear", IRREGULAR, 0.015),
        slow_if(True, "otm", "lme", LUMPED | IRREGULAR, 0.015),
    ],
    ids=["otm-lumped", "otm-consistent", "fem", "fem-irregular", "otm-irregular"],
)
def test_tip_history(method: str, basis: str, changes: dict[str, Any], energy: float) -> None:
    result = bar(method, basis, **changes)
    assert float(result["tip_displacement_max"]) == pytest.approx(AMPLITUDE, rel=0.03)
    assert float(result["tip_displacement_min"]) == pytest.approx(-AMPLITUDE, rel=0.06)
    assert float(result["tip_displacement_error"]) <= 0.03
    assert float(result["tip_velocity_max"]) <= 7.0
    assert float(result["total_energy_drift"]) <= energy
    kept = result["total_energy"][-1] / result["total_energy"][0]
    assert float(result["total_energy_end"]) == float(kept)


@pytest.mark.slow
def test_lumped_position_differences_lose_energy() -> None:
    result = bar("otm", "lme", method__mass="lumped", particles_per_cell=1)
    assert 0.01 < float(result["total_energy_end"]) < 0.25


def test_sph_explodes() -> None:
    result = solve(
        compose("elastic_bar_tension", "sph", "sph_kernel", problem__particle_layout="nodes")
    )
    assert result.attrs["status"] == "diverged"
    assert "the free end is displaced" in result.attrs["reason"]


@pytest.mark.slow  # plain SPH above; both by their contract in tests/core/test_loops.py
def test_symmetric_sph_is_better_and_still_wrong() -> None:
    result = bar(
        "sph", "sph_kernel", problem__particle_layout="nodes", method__derivatives="symmetric"
    )
    assert float(result["tip_displacement_error"]) > 0.5
    assert float(result["total_energy_drift"]) < 0.01


@pytest.mark.parametrize(
    ("method", "basis", "changes", "words"),
    [
        ("sph", "sph_kernel", {}, "particle_layout=nodes"),
        ("sph", "lme", {"problem__particle_layout": "nodes"}, "basis=sph_kernel"),
        ("otm", "sph_kernel", {}, "reproduces no constants"),
        ("mpm", "linear", {"problem__irregularity": 0.2}, "irregular nodes"),
        ("sph", "sph_kernel", {"method__mass": "consistent"}, "method.mass=consistent"),
    ],
)
def test_combinations_that_make_no_sense(
    method: str, basis: str, changes: dict[str, Any], words: str
) -> None:
    with pytest.raises(NotApplicable, match=words):
        read(compose("elastic_bar_tension", method, basis, **changes))


def growth(**changes: Any) -> float:
    method, basis = changes.pop("method", "otm"), changes.pop("basis", "lme")
    result = solve(compose("prestretched_bar", method, basis, **changes))
    return float(result["growth"])


@pytest.mark.parametrize(
    ("gamma", "stretch", "stable"),
    [
        slow_if(True, 0.8, 1.1, True),  # a stable bar is the one in tension above
        (0.8, 1.25, False),
        slow_if(True, 1.8, 1.3, True),
        slow_if(True, 1.8, 1.6, False),
        slow_if(True, 4.0, 2.0, True),
    ],
)
def test_tensile_instability(gamma: float, stretch: float, stable: bool) -> None:
    """Unstable from a stretch of about 1.2 (gamma 0.8) or 1.5 (1.8); stable for gamma of 4 and more."""
    found = growth(basis__gamma=gamma, problem__stretch=stretch)
    assert found < 2.0 if stable else found > 1e4


@pytest.mark.slow  # the stretches of the table above are cheaper
def test_frozen_functions_and_finite_elements_are_stable() -> None:
    assert growth(problem__stretch=2.0, method__shape_functions="frozen") < 2.0
    assert growth(problem__stretch=2.0, method="linear_fem", basis="linear") < 2.0
