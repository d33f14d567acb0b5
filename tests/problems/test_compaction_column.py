"""The compacted column: its closed form, and orders of finite elements and splines."""

import numpy as np
import pytest
from scipy.special import lambertw

from mpmbench.analysis.slopes import fitted_order
from mpmbench.case import read
from mpmbench.core import registry
from mpmbench.core.choices import Choices
from mpmbench.core.errors import NotApplicable
from tests.core.support import compose, run


def law(name: str, **settings: float) -> object:
    given = {"young_modulus": 1e4, "poisson_ratio": 0.0, "density": 80.0} | settings
    return registry.get("material", name)(**given)


def test_its_width_is_that_of_the_body_and_of_its_grid() -> None:
    problem = registry.get("problem", "compaction_column")(width=12.5)
    for resolution in (8, 16):
        X, V0 = problem.seed(resolution, 4)
        assert V0.sum() == pytest.approx(12.5 * 50.0) and 0.0 < X[:, 0].min() < X[:, 0].max() < 12.5
        assert problem.nodes(resolution, Choices()).points[:, 0].max() == 12.5


def test_closed_forms() -> None:
    """Hencky without Poisson effect by Lambert's function, u e^-u = P/E; neo-Hookean by its quadratic."""
    problem = registry.get("problem", "compaction_column")()
    X = np.stack([np.zeros(11), np.linspace(0.0, 50.0, 11)], axis=1)
    exact = problem.exact(X, 1.0, law("hencky_elastic"))
    u = -lambertw(4.0 * (1.0 - X[:, 1] / 50.0)).real
    place = 12.5 * ((u - 0.5 * u**2) - (u - 0.5 * u**2)[0])
    assert X[:, 1] + exact["displacement"][:, 1] == pytest.approx(place, abs=1e-10)
    assert place[-1] == pytest.approx(24.0596, abs=1e-4)
    assert exact["stress"][0, 1, 1] == pytest.approx(-40e3)
    hooke = problem.exact(X, 1.0, law("neo_hookean"))
    assert 50.0 + hooke["displacement"][-1, 1] == pytest.approx(16.1696, abs=1e-4)


@pytest.mark.parametrize("name", ("hencky_elastic", "neo_hookean"))
def test_the_stress_is_that_of_the_law(name: str) -> None:
    """P from the stretch by differences of the exact places, with a Poisson ratio."""
    problem, material = registry.get("problem", "compaction_column")(), law(name, poisson_ratio=0.3)
    heights, h = np.linspace(1.0, 49.0, 9), 1e-4
    X = np.stack([np.zeros(9), heights], axis=1)
    ahead, behind = (
        problem.exact(X + np.array([0.0, s]), 0.7, material)["displacement"][:, 1] for s in (h, -h)
    )
    l = 1.0 + (ahead - behind) / (2.0 * h)
    lame, shear = material.lame_parameters()
    own = 2.0 * shear * np.log(l) if name == "hencky_elastic" else shear * (l**2 - 1.0)
    stress = problem.exact(X, 0.7, material)["stress"]
    assert stress[:, 1, 1] == pytest.approx((lame * np.log(l) + own) / l, rel=1e-5)
    assert stress[:, 0, 0] == pytest.approx(lame * np.log(l) / l, rel=1e-5)


def test_finite_elements_follow_a_neo_hookean_column() -> None:
    """A column compacted to a third, with order 2, and its base carries all of the weight."""
    cells = (4, 8, 16)
    results = [
        run(
            "compaction_column",
            "fem",
            "linear",
            resolution=n,
            problem__width=50.0 / n,
            material="neo_hookean",
        )
        for n in cells
    ]
    errors = np.array([float(result.error_height_relative) for result in results])
    assert fitted_order(1.0 / np.array(cells), errors) > 1.5 and errors[-1] < 0.02, errors
    assert float(results[-1].base_stress) == pytest.approx(-40e3, rel=0.05)


@pytest.mark.slow
def test_finite_elements_converge_with_order_2() -> None:
    """Heights as this project had them: 23.9457, 24.0293 and 24.0519 m at 8, 16 and 32 cells."""
    cells = (8, 16, 32)
    results = [
        run("compaction_column", "fem", "linear", resolution=n, problem__width=50.0 / n)
        for n in cells
    ]
    heights = [float(result.height) for result in results]
    assert heights == pytest.approx((23.9457, 24.0293, 24.0519), abs=2e-3)
    errors = np.array([float(result.error_displacement_rms) for result in results])
    assert fitted_order(1.0 / np.array(cells), errors) == pytest.approx(2.0, abs=0.15)
    assert float(results[-1].base_stress) == pytest.approx(-40e3, rel=0.01)


@pytest.mark.slow
def test_splines_stay_and_linear_functions_cross_cells() -> None:
    """Stress errors of implicit MPM at 32 cells: below 1 % with quadratic splines, several with linear ones."""
    errors = {
        basis: float(
            run("compaction_column", "implicit_mpm", basis, resolution=32).error_stress_weighted
        )
        for basis in ("bspline", "linear")
    }
    assert errors["bspline"] < 0.01 < 0.03 < errors["linear"], errors


def test_explicit_methods_need_a_drag() -> None:
    with pytest.raises(NotApplicable, match=r"method\.drag"):
        read(compose("compaction_column", "tlmpm", "linear"))
    keys = {"method__drag": 0.7, "problem__rise_time": 60.0}
    problem = read(compose("compaction_column", "tlmpm", "linear", **keys)).problem
    assert [problem.load(t) for t in (0.0, 30.0, 60.0, 90.0)] == [0.0, 0.5, 1.0, 1.0]
    static = read(compose("compaction_column", "fem", "linear", problem__rise_time=60.0)).problem
    assert static.load(0.3) == 0.3


@pytest.mark.slow
def test_dynamic_relaxation_ends_in_the_closed_form() -> None:
    """Total Lagrangian with splines on 16 cells: 24.0596 m and -40 kPa to 1e-4, at rest; hats come with order 2."""
    keys = {"method__drag": 0.7, "problem__rise_time": 60.0, "end_time": 200.0}
    found = run("compaction_column", "tlmpm", "bspline", resolution=16, **keys)
    assert float(found.height) == pytest.approx(24.0596, rel=1e-4)
    assert float(found.base_stress) == pytest.approx(-40e3, rel=1e-4)
    assert float(found.kinetic_share) < 1e-10
    errors = [
        float(
            run("compaction_column", "tlmpm", "linear", resolution=n, **keys).error_height_relative
        )
        for n in (8, 16)
    ]
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.15)
