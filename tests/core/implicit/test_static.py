"""The static cantilever of Iaconeta 2017, section 5.1: reference values, rates, load steps, Dirichlet conditions."""

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import xarray as xr

from mpmbench import case
from mpmbench.analysis.slopes import fitted_order
from mpmbench.core.errors import BadSetting, NotApplicable, NotConverged
from mpmbench.core.implicit import newton as newton_iteration
from mpmbench.core.implicit import step as steps
from mpmbench.core.implicit.newton import Equations, newton
from mpmbench.core.implicit.step import at_nodes, prepare
from mpmbench.core.loads import external_force
from mpmbench.core.matrix import blocks
from mpmbench.core.simulation import simulate
from mpmbench.core.state import State
from mpmbench.settings.files import BadInput
from tests.core.support import compose

# deflection of A [m] at h = 0.25 and 0.125 m, confirmed with the authors' own program and an
# independent prototype
REFERENCE = {
    ("fem", "linear"): (-0.6539116, -0.6691249),
    ("implicit_mpm", "linear"): (-0.6539116, -0.6691249),
    ("gmm", "mls"): (-0.655931, -0.669658),
    ("gmm", "lme"): (-0.652816, -0.668601),
}
MEAN_OF_PARTICLES = {1: -0.648223, 5: -0.652002, 10: -0.652992, 20: -0.653701, 50: -0.656123}


def cantilever(method: str, basis: str = "linear", **changes: Any) -> xr.Dataset:
    result = case.solve(compose("cantilever_self_weight", method, basis, **changes))
    assert result.attrs["status"] == "ok", result.attrs["reason"]
    return result


@pytest.mark.parametrize(("method", "basis"), REFERENCE)
def test_reference_values_and_rates(method: str, basis: str) -> None:
    """Six digits for FEM and MPM, the printed six for GMM; errors fall with rate 2 against the converged value."""
    errors = []
    for resolution, reference in zip((32, 64), REFERENCE[method, basis], strict=True):
        result = cantilever(method, basis, resolution=resolution)
        assert float(result.tip_deflection) == pytest.approx(reference, abs=6e-7)
        errors.append(float(result.error_tip))
    errors.append(float(cantilever(method, basis, resolution=128).error_tip))
    assert fitted_order([0.25, 0.125, 0.0625], errors) == pytest.approx(1.95, abs=0.06)


@pytest.mark.parametrize(("method", "basis"), REFERENCE)
def test_newton_converges_quadratically(method: str, basis: str) -> None:
    """Ratios ``r_(k+1) / r_k^2`` stay bounded near the solution, and the first step may make the residual grow."""
    norms = cantilever(method, basis, resolution=64).newton_residual.values[0]
    norms = norms[~np.isnan(norms)]
    assert 30.0 < norms[1] / norms[0] < 1000.0  # rotation makes membrane stress
    assert norms[-1] < 1e-8
    assert len(norms) == 5
    ratios = norms[2:4] / norms[1:3] ** 2  # the last residual is round-off
    assert (
        ratios[1] < 10.0 * ratios[0]
    )  # a linear rate would make it grow by the factor norms[1] / norms[2] = 350
    assert norms[3] < 1e-4 * norms[2]


@pytest.mark.parametrize(("steps", "reference"), MEAN_OF_PARTICLES.items())
def test_load_steps_move_the_answer_of_mpm(steps: int, reference: float) -> None:
    """Particles are located anew after each load step: the answer drifts, by 1.2 % at 50 steps."""
    result = cantilever("implicit_mpm", problem__load_steps=steps)
    assert float(result.tip_deflection_of_particles) == pytest.approx(reference, abs=6e-7)
    assert int(result.steps) == steps


def test_load_steps_do_not_move_the_others() -> None:
    for method, basis, drift in (
        ("fem", "linear", 1e-9),
        ("gmm", "mls", 5e-5),
        ("gmm", "lme", 5e-5),
    ):
        once = float(cantilever(method, basis).tip_deflection)
        often = float(cantilever(method, basis, problem__load_steps=20).tip_deflection)
        assert abs(often / once - 1.0) < drift, method


def test_a_tracer_beyond_the_last_particle_is_carried() -> None:
    """The tracked point and the particles around it agree after re-location, with and without ghost stiffness."""
    for ghost in (0.0, 1e-6):
        result = cantilever("implicit_mpm", problem__load_steps=20, method__ghost_stiffness=ghost)
        gap = float(result.tip_deflection - result.tip_deflection_of_particles)
        assert gap == pytest.approx(-0.0057, abs=0.0004)  # half a particle spacing times the slope


def test_ghost_stiffness_stiffens_in_proportion() -> None:
    """It resists the rotation of an increment: by 0.7 % with eps = 1e-4 and ten load steps, by 5 % in one."""

    def change(eps: float, steps: int) -> float:
        plain = cantilever("implicit_mpm", problem__load_steps=steps)
        held = cantilever("implicit_mpm", problem__load_steps=steps, method__ghost_stiffness=eps)
        return float(held.tip_deflection / plain.tip_deflection - 1.0)

    assert change(1e-4, 10) == pytest.approx(-0.006, abs=0.002)
    assert change(1e-4, 1) == pytest.approx(10.0 * change(1e-4, 10), rel=0.3)
    assert change(1e-6, 1) == pytest.approx(0.01 * change(1e-4, 1), rel=0.06)


def test_ways_to_hold_the_clamp_agree_where_they_should() -> None:
    """Up to R = sqrt(2) h nodes and multipliers coincide; beyond, nodes do not interpolate and are refused."""
    direct = float(cantilever("gmm", "mls").tip_deflection)
    exact = float(cantilever("gmm", "mls", method__dirichlet="multipliers").tip_deflection)
    assert exact == pytest.approx(direct, rel=1e-9)
    with pytest.raises(NotApplicable, match="relative_radius=2"):
        case.read(compose("cantilever_self_weight", "gmm", "mls", basis__relative_radius=2.0))
    wide = cantilever(
        "gmm", "mls", basis__relative_radius=2.0, method__dirichlet="multipliers", resolution=64
    )
    assert float(wide.error_tip) < 4e-4


def test_multipliers_hold_the_points_and_nodes_stay_with_them(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """With a wide support ``sum_I N_I(x_d) u_I`` vanishes, and the coefficients of the nodes there do not."""
    increments = []

    def noted(s: State, du: np.ndarray) -> np.ndarray:
        increments.append(du.copy())
        return at_nodes(s, du)

    monkeypatch.setattr(steps, "at_nodes", noted)
    config = compose(
        "cantilever_self_weight",
        "gmm",
        "mls",
        basis__relative_radius=2.5,
        method__dirichlet="multipliers",
        resolution=16,
    )
    state = case.build(case.read(config))
    assert simulate(state, 1.0, 1.0).status == "ok"
    clamp = np.flatnonzero(state.fixed.any(axis=1))
    held = state.workspace.held
    assert np.abs(held.u).max() < 1e-12
    assert np.abs(held.x - state.initial_nodes[clamp]).max() < 1e-12
    assert np.abs(np.sum(increments, axis=0)[clamp]).max() > 1e-4
    assert np.abs(state.basis.nodes - state.initial_nodes)[clamp].max() < 1e-12


@pytest.mark.parametrize(("method", "basis"), REFERENCE)
def test_the_clamp_carries_the_weight(method: str, basis: str) -> None:
    """Momentum balance: the reaction is minus the load, to the tolerance of the residual."""
    weight = 8.0 * 1000.0 * 9.81
    reaction = cantilever(method, basis).reaction.values[-1]
    assert reaction == pytest.approx([0.0, weight], abs=1e-6 * weight)
    if method == "gmm":
        held = cantilever(method, basis, method__dirichlet="multipliers").reaction.values[-1]
        assert held == pytest.approx([0.0, weight], abs=1e-6 * weight)


def test_quadratic_splines_on_a_grid() -> None:
    assert float(cantilever("implicit_mpm", "bspline", resolution=64).error_tip) < 1e-3


def test_other_solvers_give_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    """Banded Cholesky, banded LU and the sparse factorisation solve the same system."""
    config = compose("cantilever_self_weight", "fem", "linear", resolution=16)
    state = case.build(case.read(config))
    w = prepare(state)
    force = external_force(state, w.phi, 1.0, state.nodes.f_external)
    equations = Equations(state, w, force, 1.0, None)
    du = np.zeros_like(state.nodes.v)
    residual = equations.residual(du)
    assert residual is not None
    w.memory.take(1000, 1000)[:] = np.nan  # what was there before does not matter
    cholesky = equations.correction(du, residual)
    w.memory.take(1000, 1000)[:] = np.nan
    monkeypatch.setattr(blocks, "_cholesky", lambda *_: None)
    band = equations.correction(du, residual)
    monkeypatch.setattr(blocks, "LARGEST_BAND", 0)
    sparse = equations.correction(du, residual)
    assert np.abs(cholesky).max() > 0.1
    assert np.allclose(band, cholesky, rtol=1e-8, atol=1e-10)
    assert np.allclose(sparse, cholesky, rtol=1e-8, atol=1e-10)


def test_a_load_that_inverts_cells_is_rescued_or_ends_with_a_reason(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Ten times the weight in one step throws particles inside out: steps are shortened, then loads are halved."""
    heavy = case.solve(compose("cantilever_self_weight", "fem", "linear", problem__gravity=98.1))
    assert heavy.attrs["status"] == "ok"
    gentle = cantilever("fem", problem__gravity=98.1, problem__load_steps=40)
    assert float(heavy.tip_deflection) == pytest.approx(float(gentle.tip_deflection), rel=1e-6)
    monkeypatch.setattr(newton_iteration, "MOST_ITERATIONS", 1)
    hopeless = case.solve(
        compose("cantilever_self_weight", "fem", "linear", method__step_halvings=0)
    )
    assert hopeless.attrs["status"] == "not_converged"
    assert "after 1 iterations" in hopeless.attrs["reason"]


@dataclass
class GivenResiduals:
    """Equations of one unknown whose residuals are those of a list, one after the other."""

    sizes: list[float]

    def residual(self, du: np.ndarray) -> np.ndarray:
        return np.array([[self.sizes.pop(0)]])

    def correction(self, du: np.ndarray, residual: np.ndarray) -> np.ndarray:
        return np.ones((1, 1))

    def reference(self, du: np.ndarray, residual: np.ndarray) -> float:
        return 1.0

    def size(self, du: np.ndarray, residual: np.ndarray) -> float:
        return float(residual[0, 0])

    def meet(self, du: np.ndarray, residual: np.ndarray, reference: float) -> bool:
        return False


@pytest.mark.parametrize(
    ("residuals", "given_up_after"),
    [
        ([1.0, 500.0, *(0.5**k for k in range(26)), 0.0], None),  # slow, but it gets there
        ([1.0, 500.0, 0.1, *[0.2] * 7, 0.05, *[0.2] * 7, 0.0], None),  # a rest of seven iterations
        ([1.0, 500.0, 0.1, *[0.2, 0.15] * 14], 10),  # in circles
        ([1.0, 500.0, *(0.9**k for k in range(40))], 30),  # MOST_ITERATIONS
    ],
)
def test_newton_gives_up_what_goes_in_circles(
    residuals: list[float], given_up_after: int | None
) -> None:
    """A residual that has not fallen for eight iterations will not; slow convergence may take all iterations."""
    state: Any = SimpleNamespace(
        choices=SimpleNamespace(residual_tolerance=1e-8, line_search=False)
    )
    equations: Any = GivenResiduals(list(residuals))
    norms: list[float] = []
    if given_up_after is None:
        newton(state, equations, np.zeros((1, 1)), 0.0, norms)
        assert norms == residuals
    else:
        with pytest.raises(NotConverged, match=f"after {given_up_after} iterations"):
            newton(state, equations, np.zeros((1, 1)), 0.0, norms)


def test_residuals_are_compared_with_the_external_or_the_largest_force() -> None:
    equations = SimpleNamespace(size=lambda du, residual: 2.0)
    for external, internal, reference in ((5.0, 9.0, 5.0), (0.0, 9.0, 9.0), (0.0, 1.0, 2.0)):
        equations.external, equations.internal = np.array([external]), np.array([internal])
        assert Equations.reference(equations, None, None) == reference  # type: ignore[arg-type]
    equations.size = lambda du, residual: 0.0
    equations.internal = np.zeros(1)
    assert Equations.reference(equations, None, None) == 1.0  # type: ignore[arg-type]


def test_settings_are_checked() -> None:
    for changes, message in (
        ({"resolution": 12}, "multiple of 8"),
        ({"problem__load_steps": 0}, "load_steps"),
        ({"method__residual_tolerance": 0.0}, "residual_tolerance"),
        ({"basis__weight": "sinc"}, "cubic_spline"),
    ):
        with pytest.raises((BadInput, BadSetting), match=message):
            case.read(compose("cantilever_self_weight", "gmm", "mls", **changes))
    for method, changes, message in (
        ("gmm", {"method__transfer": "flip"}, "transfer=nodal"),
        ("implicit_mpm", {"method__transfer": "pic"}, "transfer=flip"),
        ("implicit_mpm", {"method__dirichlet": "multipliers"}, "nodes=moving"),
        ("implicit_mpm", {"method__time": "newmark"}, "static problem"),
        ("implicit_mpm", {"method__stress_update": "musl"}, "stress_update=usl"),
    ):
        with pytest.raises(NotApplicable, match=message):
            case.read(
                compose(
                    "cantilever_self_weight",
                    method,
                    "mls" if method == "gmm" else "linear",
                    **changes,
                )
            )


def test_what_is_held_makes_no_step_when_accelerations_are_found() -> None:
    held = SimpleNamespace(u=np.arange(6.0).reshape(3, 2), point=[0, 2], component=[1, 0])
    still = SimpleNamespace(prescribed=np.ones((3, 2)), w=SimpleNamespace(held=held))
    Equations.hold_still(still)  # type: ignore[arg-type]
    assert not still.prescribed.any()
    assert list(still.wanted) == [1.0, 4.0]
