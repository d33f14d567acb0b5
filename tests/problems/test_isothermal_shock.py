"""The isothermal shock: exact fields, levels and rates of the errors, and what must fail."""

from typing import Any

import numpy as np
import pytest
import xarray as xr

from mpmbench.case import build, read, solve
from mpmbench.core.errors import BadSetting, NotApplicable
from mpmbench.core.loops.sph import update_stress
from mpmbench.core.materials.newtonian_fluid import NewtonianFluid
from mpmbench.core.matrix.mass_checks import seen_share
from mpmbench.core.stability import smallest_stretch
from mpmbench.problems.isothermal_shock import IsothermalShock
from tests.core.support import compose, run

VELOCITY, DENSITY = "error_velocity_l2_max", "error_density_l1_max"
THESIS = {
    "method__mass": "consistent",
    "method__transfer": "position_difference",
    "particles_per_cell": 2,
}


def shock(cells: int, basis: str = "lme", method: str = "otm", **changes: Any) -> xr.Dataset:
    return run("isothermal_shock", method, basis, resolution=cells, **changes)


def rate(errors: list[float]) -> float:
    return float(np.log2(errors[0] / errors[1]))


# exact solution


def test_speed_and_width() -> None:
    """Eqs. 4.24 and 4.25."""
    speed, width = IsothermalShock().speed_and_width(NewtonianFluid())
    assert speed == pytest.approx(2.345208, rel=1e-6)
    assert width == pytest.approx(1.737191e-3, rel=1e-6)
    assert IsothermalShock().length == pytest.approx(25.0 * width, rel=1e-14)


@pytest.mark.parametrize("behind", (0.1, 0.5))
def test_wave_satisfies_the_equation_of_motion(behind: float) -> None:
    """``rho_0 phi'' = d sigma_11 / dX`` by differences of high order; J, its rate and the velocity from the motion."""
    problem, fluid = (
        IsothermalShock(jacobian_behind=behind),
        NewtonianFluid(bulk_modulus=1.3, viscosity=0.004, density=0.7),
    )
    C, L = problem.speed_and_width(fluid)
    X, t = np.linspace(-4.0, 8.0, 101) * L, 2.0 * L / C

    def derivative(field: Any, of_X: bool, step: float) -> np.ndarray:
        weights = np.array([1.0, -8.0, 0.0, 8.0, -1.0]) / 12.0 / step
        return sum(
            w * (field(X + (k - 2) * step, t) if of_X else field(X, t + (k - 2) * step))
            for k, w in enumerate(weights)
        )

    def wave(name: str) -> Any:
        return lambda X, t: problem.wave(X, t, fluid)[name]

    def sigma(X: np.ndarray, t: float) -> np.ndarray:
        return problem.exact(X[:, None], t, fluid)["stress"][:, 0, 0]

    h, dt = 3e-3 * L, 3e-3 * L / C
    exact = problem.wave(X, t, fluid)
    scale = fluid.density * np.abs(exact["acceleration"]).max()
    assert (
        np.abs(fluid.density * exact["acceleration"] - derivative(sigma, True, h)).max()
        < 1e-8 * scale
    )
    for name, field, of_X, shift in (
        ("jacobian", "displacement", True, 1.0),
        ("velocity", "displacement", False, 0.0),
        ("acceleration", "velocity", False, 0.0),
        ("rate", "jacobian", False, 0.0),
    ):
        values = exact[name] - shift
        numerical = derivative(wave(field), of_X, h if of_X else dt)
        assert np.abs(values - numerical).max() < 1e-8 * np.abs(values).max(), name
    assert np.allclose(
        sigma(X, t),
        fluid.pressure(exact["jacobian"])
        + 4 / 3 * fluid.viscosity * exact["rate"] / exact["jacobian"],
    )


def test_material_ahead_is_at_rest() -> None:
    """With - log 2, as printed in Eq. 4.23b, it would be displaced by 2 (1 - J_b) L log 2."""
    problem, fluid = IsothermalShock(), NewtonianFluid()
    ahead = problem.wave(np.array([problem.length]), 0.0, fluid)
    assert abs(ahead["displacement"][0]) < 1e-12 * problem.length
    assert ahead["jacobian"][0] == pytest.approx(1.0, abs=1e-10)


@pytest.mark.slow  # in three dimensions; the law has a contract in tests/core/test_materials.py
def test_stress_of_the_fluid() -> None:
    """The compiled law gives the exact stress, in 1D, 2D and 3D."""
    for dimension in (1, 2, 3):
        problem, fluid = IsothermalShock(dimension=dimension), NewtonianFluid()
        config = compose(
            "isothermal_shock", "otm", "lme", problem__dimension=dimension, resolution=8
        )
        state = build(read(config))
        p = state.particles
        before = p.sigma.copy()
        assert np.allclose(before, problem.exact(p.X, 0.0, fluid)["stress"])
        update_stress(state.law, state.axes, p.F, p.L, 1.0, p.state, p.sigma)
        assert np.allclose(p.sigma, before, rtol=1e-12)


# lumped mass and nodal velocities, as in the specification


def test_errors_of_lumped_otm() -> None:
    errors = {n: shock(n) for n in (50, 100)}
    assert float(errors[50][VELOCITY]) == pytest.approx(7.8e-4, rel=0.02)
    assert float(errors[100][VELOCITY]) == pytest.approx(2.0e-4, rel=0.02)
    for norm in (VELOCITY, DENSITY):
        assert 1.8 < rate([float(errors[n][norm]) for n in (50, 100)]) < 2.1
    assert float(errors[50]["newton_steps_mean"]) < 6.0
    assert int(errors[50]["enlarged_points"]) == 0


@pytest.mark.slow  # the rate with a lumped mass above
def test_rate_of_consistent_otm() -> None:
    """The thesis: 2.13 for the velocity."""
    errors = [float(shock(n, **THESIS)[VELOCITY]) for n in (25, 50)]
    assert 1.9 < rate(errors) < 2.5, errors
    assert errors[1] < 8e-4


@pytest.mark.slow  # compiles the consistent mass
def test_time_step_of_a_consistent_mass() -> None:
    """Half of the step for a lumped mass lets a zigzag grow to 1.2e-3 m^1.5/s in the first steps on fine nodes."""
    assert float(shock(200, end_time=2e-4, **THESIS)[VELOCITY]) < 1e-4


@pytest.mark.slow
def test_rates_on_fine_nodes() -> None:
    lumped = [float(shock(n)[VELOCITY]) for n in (100, 200)]
    assert 1.8 < rate(lumped) < 2.1
    consistent = [float(shock(n, **THESIS)[VELOCITY]) for n in (50, 100)]
    assert 1.9 < rate(consistent) < 2.3


@pytest.mark.slow
def test_corrected_gradients_mend_the_density_on_irregular_nodes() -> None:
    errors = {
        gradient: shock(50, problem__irregularity=0.2, basis__gradient=gradient)
        for gradient in ("exact", "consistent")
    }
    assert float(errors["consistent"][DENSITY]) < 0.4 * float(errors["exact"][DENSITY])
    assert float(errors["consistent"][VELOCITY]) < float(errors["exact"][VELOCITY]) < 1e-3


@pytest.mark.slow
def test_density_on_irregular_nodes() -> None:
    """The velocity converges, the density does not; with gradients that integrate exactly it does."""
    for gradient, low, high in (("exact", -0.5, 0.8), ("consistent", 1.0, 2.2)):
        found = [shock(n, problem__irregularity=0.2, basis__gradient=gradient) for n in (50, 100)]
        assert rate([float(r[VELOCITY]) for r in found]) > 1.5
        assert low < rate([float(r[DENSITY]) for r in found]) < high, gradient


@pytest.mark.slow  # OTM above
def test_other_methods_run() -> None:
    assert float(shock(50, "linear", "linear_fem")[VELOCITY]) < 1.5e-3
    assert float(shock(50, "bspline", "unified", particles_per_cell=2)[VELOCITY]) < 8e-4


# negative controls


@pytest.mark.slow  # filters are asked by tests/core/test_transfers.py
def test_lumped_position_differences_filter() -> None:
    error = float(shock(50, method__transfer="position_difference")[VELOCITY])
    assert error > 50.0 * 7.8e-4


def test_one_particle_per_cell_is_singular_with_consistent_mass() -> None:
    result = solve(
        compose(
            "isothermal_shock", "otm", "lme", resolution=50, **{**THESIS, "particles_per_cell": 1}
        )
    )
    assert result.attrs["status"] == "broke_down"
    assert (
        "singular consistent mass matrix: 51 nodes and only 50 particles" in result.attrs["reason"]
    )


@pytest.mark.slow  # in a plane; on a line above
def test_one_particle_per_triangle_is_singular_with_consistent_mass() -> None:
    """More particles than nodes, and still a pattern of the nodes that they do not see; four in a square do."""
    strip: dict[str, Any] = {"problem__dimension": 2, "resolution": 12}
    for gamma in (0.8, 4.0):
        result = solve(
            compose(
                "isothermal_shock",
                "otm",
                "lme",
                **strip,
                **{**THESIS, "particles_per_cell": 1},
                basis__gamma=gamma,
            )
        )
        assert result.attrs["status"] == "broke_down"
        assert (
            "a pattern of the 65 nodes nearly vanishes at all 96 particles"
            in result.attrs["reason"]
        )
        spread = {
            **strip,
            "problem__particle_layout": "midpoint",
            "particles_per_cell": 4,
            "basis__gamma": gamma,
        }
        state = build(read(compose("isothermal_shock", "otm", "lme", **spread)))
        state.basis.locate(state.particles.x)
        assert seen_share(state.basis, state.particles, state.fixed) > 0.4


def test_locality_must_follow_the_compression() -> None:
    """With a fixed h the functions grow far wider than the compressed nodes."""
    result = solve(
        compose("isothermal_shock", "otm", "lme", resolution=50, basis__locality="fixed")
    )
    assert result.attrs["status"] != "ok" or float(result[VELOCITY]) > 50.0 * 7.8e-4


def test_fixed_nodes_are_refused() -> None:
    with pytest.raises(NotApplicable, match=r"method\.nodes=moving"):
        read(compose("isothermal_shock", "mpm", "linear"))


def test_time_step_follows_the_smallest_spacing() -> None:
    """Eq. 4.26 with the current spacing."""
    result = shock(20, end_time=1e-3)
    times = result["time"].values
    assert np.diff(times)[-3] < np.diff(times)[1]
    for stretched in ([0.1, 1.0, 1.0], [1.0, 1.0, 1.0]), ([1.0, 1.0, 1.0], [0.1, 1.0, 1.0]):
        F = np.array([np.diag(stretches) for stretches in stretched])
        assert smallest_stretch(F) == pytest.approx(0.1, rel=0.02)
    assert smallest_stretch(np.array([[[0.3]]])) == pytest.approx(0.3)


# two and three dimensions


@pytest.mark.slow  # in a plane; corrected gradients are asked by tests/core/test_local_maxent.py
def test_strip() -> None:
    """Particles at barycentres do not integrate the gradients well; with corrected ones the strip is as good as 1D."""
    plain, mended = (
        shock(30, problem__dimension=2, basis__gradient=gradient)
        for gradient in ("exact", "consistent")
    )
    line = float(shock(30)[VELOCITY])
    assert float(mended[VELOCITY]) < 1.2 * line
    assert float(plain[VELOCITY]) > 5.0 * float(mended[VELOCITY])
    sideways = [np.abs(result["velocity"].values[-1, :, 1]).max() for result in (plain, mended)]
    assert sideways[1] < 0.2 * sideways[0]


def test_barycentres_take_one_particle_each() -> None:
    with pytest.raises(
        BadSetting, match=r"particles_per_cell = 4: 1, as problem\.particle_layout=barycentre"
    ):
        read(compose("isothermal_shock", "otm", "lme", problem__dimension=2, particles_per_cell=4))


def test_cylinder_has_the_nodes_of_the_thesis() -> None:
    problem = IsothermalShock(dimension=3)
    cloud = problem.nodes(50, read(compose("isothermal_shock", "otm", "lme")).choices)
    X, V = problem.seed(50, 1)
    assert (len(cloud.nodes), len(X)) == (2907, 14700)  # type: ignore[union-attr]
    h = problem.length / 50
    assert V.sum() == pytest.approx(problem.length * 48.594979 * h * h, rel=1e-6)


@pytest.mark.slow
def test_cylinder_runs() -> None:
    """The whole run of Figs. 4.8 and 4.9: under ten minutes on one core."""
    result = shock(50, problem__dimension=3)
    assert float(result["solver_time"]) < 600.0
    assert float(result[VELOCITY]) < 0.05


def test_seed_chooses_the_irregular_nodes() -> None:
    cases = [
        read(compose("isothermal_shock", "otm", "lme", problem__irregularity=0.2, seed=seed))
        for seed in (1, 1, 2)
    ]
    nodes = [case.problem.nodes(10, case.choices).nodes for case in cases]  # type: ignore[union-attr]
    assert np.array_equal(nodes[0], nodes[1])
    assert np.abs(nodes[0] - nodes[2]).max() > 1e-5
