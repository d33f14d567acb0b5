"""A point of metal along a path: the path, the law beside its equations, and what does not apply."""

import numpy as np
import pytest

from mpmbench.analysis.slopes import fitted_order
from mpmbench.case import read
from mpmbench.core import registry
from mpmbench.core.errors import NotApplicable
from mpmbench.papers.li2009.inelastic import exact_stress
from tests.core.support import compose, run

POINT = registry.get("problem", "material_point")
POWER = {"material__rate_exponent": 10.0}


@pytest.mark.parametrize("path", ("stretch", "shear", "cyclic"))
def test_paths_keep_the_volume(path: str) -> None:
    problem = POINT(path=path, rate=10.0, amplitude=0.05)
    for t in np.linspace(0.0, 0.03, 7):
        assert np.linalg.det(problem.deformation(t)) == pytest.approx(1.0, rel=1e-14)
    assert not np.allclose(problem.deformation(0.02), np.eye(3)) or path == "cyclic"


def test_a_cyclic_path_turns_round_at_its_amplitude() -> None:
    problem = POINT(path="cyclic", rate=10.0, amplitude=0.05)
    strains = [problem.strain(t) for t in (0.0, 0.004, 0.005, 0.007, 0.01, 0.015, 0.02, 0.024)]
    assert strains == pytest.approx([0.0, 0.04, 0.05, 0.03, 0.0, -0.05, 0.0, 0.04], abs=1e-12)


@pytest.mark.parametrize("path", ("stretch", "shear"))
def test_a_point_of_j2_is_on_its_yield_surface(path: str) -> None:
    found = run(
        "material_point", "evaluate", "linear", material="j2", problem__path=path, time_step=1e-5
    )
    stress, strain = found.axial_stress.values, found.strain.values
    j2 = read(compose("material_point", "evaluate", "linear", material="j2")).material
    settings = {
        name: getattr(j2, name)
        for name in ("young_modulus", "poisson_ratio", "yield_stress", "hardening_modulus")
    }
    exact, plastic = exact_stress(settings, found.time.values, strain)
    # the axes of a shear turn against its slide: of second order in the elastic strain
    near = 1e-12 if path == "stretch" else 1e-3
    assert np.abs(stress - exact).max() < near * exact.max()
    assert np.abs(found.plastic_strain_history.values - plastic).max() < near
    assert strain[-1] == pytest.approx(0.5) and len(strain) == 51


def test_the_equations_without_rate_are_those_of_perfect_plasticity() -> None:
    """A rate exponent so large that the rate does not count, no heat, next to no hardening: elastic, then constant."""
    settings = {
        "young_modulus": 200e9, "poisson_ratio": 0.25, "yield_stress": 400e6, "density": 8000.0,
        "rate_exponent": 200.0, "reference_rate": 1.0, "hardening_exponent": 1e6, "reference_strain": 1.0,
        "taylor_quinney": 0.0, "specific_heat": 400.0, "initial_temperature": 300.0,
        "reference_temperature": 300.0, "melting_temperature": 1500.0, "softening_exponent": 1.0,
    }  # fmt: skip
    time = np.linspace(0.0, 0.04, 81)
    strain = np.where(time <= 0.02, time, 0.04 - time)
    stress, plastic = exact_stress(settings, time, strain)
    assert stress[1] == pytest.approx(3.0 * 80e9 * strain[1], rel=1e-6)
    assert stress[40] == pytest.approx(400e6, rel=1e-2)
    assert stress[-1] == pytest.approx(-400e6, rel=1e-2)
    assert plastic[-1] == pytest.approx(0.04 - 3.0 * 400e6 / (3.0 * 80e9), rel=2e-2)


@pytest.mark.slow
@pytest.mark.parametrize("rate", (1e3, 1e6))
def test_the_update_converges_to_the_equations(rate: float) -> None:
    steps, errors = np.array([250, 500, 1000]), []
    for n in steps:
        times = {"end_time": 0.5 / rate, "time_step": 0.5 / rate / n, "problem__rate": rate}
        found = run("material_point", "evaluate", "linear", **times, **POWER)
        metal = read(compose("material_point", "evaluate", "linear", **POWER)).material
        numbers = {name: value for name, value in vars(metal).items() if isinstance(value, float)}
        exact, _ = exact_stress(numbers, found.time.values, found.strain.values)
        errors.append(np.sqrt(np.mean((found.axial_stress.values - exact) ** 2)) / exact.max())
    assert errors[-1] < 2e-3
    assert fitted_order(1.0 / steps, np.array(errors)) == pytest.approx(1.0, abs=0.15)


@pytest.mark.parametrize(
    ("method", "changes", "reason"),
    (
        ("mpm", {}, "needs method=evaluate"),
        ("evaluate", {"material": "neo_hookean"}, "no plastic strain"),
    ),
)
def test_what_does_not_apply(method: str, changes: dict[str, str], reason: str) -> None:
    with pytest.raises(NotApplicable, match=reason):
        read(compose("material_point", method, "linear", **changes))
