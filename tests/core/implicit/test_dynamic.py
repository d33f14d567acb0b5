"""Newmark's method: balances, conservation, order in time, the falling cantilever and the collapsing column."""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import pytest
import xarray as xr

from mpmbench import case
from mpmbench.core import registry
from mpmbench.core.bases.clouds.mls import MovingLeastSquares
from mpmbench.core.bases.grid.linear import Linear
from mpmbench.core.errors import BadSetting, NotApplicable
from mpmbench.core.geometry import Box
from mpmbench.core.implicit import newton
from mpmbench.core.loops.newmark import Newmark
from mpmbench.core.materials.elastic.neo_hookean import NeoHookean
from mpmbench.core.particles import Particles, seed_cells
from mpmbench.core.simulation import Body, build_state, simulate
from mpmbench.core.state import Loads, State
from tests.core.support import compose

IMPLICIT = {
    "fem": Newmark(nodes="moving", transfer="nodal", mass="consistent"),
    "gmm": Newmark(nodes="moving", transfer="nodal", mass="consistent"),
    "implicit_mpm": Newmark(nodes="fixed", transfer="flip", mass="consistent"),
}


def run(problem: str, method: str, basis: str = "linear", **changes: Any) -> xr.Dataset:
    return case.solve(compose(problem, method, basis, **changes))


def free_block(
    method: str, gravity: float, choices: Newmark | None = None, tracers: np.ndarray | None = None
) -> State:
    """A soft block that stretches and turns, with nothing to hold it."""
    body = Box((0.0, 0.0), (1.0, 0.5), (8, 4))
    X, V0 = seed_cells(body, 4, "gauss")
    material = NeoHookean(young_modulus=1e4, poisson_ratio=0.3, density=1000.0)
    particles = Particles.at_rest(X, V0, material.density, tracers)

    def velocity(x: np.ndarray) -> np.ndarray:
        return (
            np.stack(
                [0.5 * (x[:, 0] - 0.5) - 0.8 * (x[:, 1] - 0.25), 0.8 * (x[:, 0] - 0.5)], axis=1
            )
            + 0.1
        )

    def weight(X: np.ndarray, t: float, b: np.ndarray) -> None:
        b[:] = [0.0, -gravity]

    particles.v[:] = velocity(particles.X)
    particles.a[:] = [0.0, -gravity]
    geometry = body if method != "implicit_mpm" else Box((-1.0, -2.0), (2.0, 1.5), (24, 28))
    basis = MovingLeastSquares() if method == "gmm" else Linear()
    free = Body(
        geometry,
        particles,
        lambda x: np.zeros(x.shape, dtype=bool),
        velocity,
        Loads(body_force=weight),
    )
    return build_state(free, basis, material, choices or IMPLICIT[method])


def test_unstable_parameters_are_refused() -> None:
    with pytest.raises(BadSetting, match="newmark_displacement"):
        Newmark(newmark_displacement=0.1)


@pytest.mark.parametrize("method", IMPLICIT)
def test_momentum_balance_of_a_free_body(method: str) -> None:
    """Mass is exact, and momentum changes by the weight alone, to the tolerance of the residual."""
    gravity, dt, steps = 2.0, 0.01, 30
    state = free_block(method, gravity)
    p = state.particles
    before, mass = p.m @ p.v, p.m.sum()
    solution = simulate(state, dt, dt * steps)
    assert solution.status == "ok", solution.reason
    assert p.m.sum() == mass == pytest.approx(500.0, rel=1e-14)
    # consistent mass: the sum over nodes of M a is that over particles of m a, so it is the weight
    assert state.nodes.m.sum() == pytest.approx(mass, rel=1e-12)
    assert p.m @ p.a == pytest.approx([0.0, -gravity * mass], abs=1e-7 * gravity * mass)
    change = p.m @ p.v - before
    assert change == pytest.approx([0.0, -gravity * mass * dt * steps], abs=1e-7 * gravity * mass)
    assert np.abs(p.F - np.eye(2)).max() > 0.05  # it did deform


def test_tracers_in_empty_cells_are_carried() -> None:
    """A massless point beyond the body turns and moves with it, though no particle is in its cell."""
    state = free_block("implicit_mpm", 0.0, tracers=np.array([[1.15, 0.25]]))
    state.particles.v[:] = 0.2 * np.stack(
        [0.25 - state.particles.X[:, 1], state.particles.X[:, 0] - 0.5], axis=1
    )
    assert simulate(state, 0.01, 0.2).status == "ok"
    turned = 0.2 * 0.2
    moved = state.particles.x[-1] - state.particles.X[-1]
    assert moved == pytest.approx([0.65 * (np.cos(turned) - 1.0), 0.65 * np.sin(turned)], abs=3e-3)


def test_energy_of_finite_elements_is_kept() -> None:
    state = free_block("fem", 0.0)
    solution = simulate(state, 0.01, 1.0)
    energy = np.array(solution.history["kinetic_energy"]) + np.array(
        solution.history["strain_energy"]
    )
    assert np.abs(energy / energy[0] - 1.0).max() < 5e-3
    assert np.ptp(solution.history["kinetic_energy"]) > 0.1 * energy[0]


def test_newmark_is_of_second_order_in_time() -> None:
    """End positions with halved steps: differences fall by four; with lambda = 0.6 only by two."""

    def end(steps: int, velocity: float) -> np.ndarray:
        zeta = 0.25 * (velocity + 0.5) ** 2
        choices = Newmark(
            nodes="moving",
            transfer="nodal",
            mass="consistent",
            newmark_velocity=velocity,
            newmark_displacement=zeta,
            residual_tolerance=1e-12,
        )
        state = free_block("fem", 0.0, choices)
        assert simulate(state, 0.2 / steps, 0.2).status == "ok"
        return state.particles.x.copy()

    for velocity, factor in ((0.5, 4.0), (0.6, 2.0)):
        x = [end(steps, velocity) for steps in (40, 80, 160)]
        ratio = np.linalg.norm(x[1] - x[0]) / np.linalg.norm(x[2] - x[1])
        assert ratio == pytest.approx(factor, rel=0.15)


@pytest.mark.parametrize("mass", ("lumped", "consistent"))
def test_masses_of_implicit_mpm(mass: str) -> None:
    """Rigid translation is exact with either mass."""
    choices = Newmark(nodes="fixed", transfer="flip", mass=mass)
    state = free_block("implicit_mpm", 0.0, choices)
    state.particles.v[:] = [0.3, -0.2]
    assert simulate(state, 0.02, 0.1).status == "ok"
    assert np.allclose(state.particles.x - state.particles.X, [0.03, -0.02], atol=1e-10)


@dataclass(frozen=True)
class Reference:
    """Quadratic total-Lagrangian finite elements on the falling cantilever."""

    first_minimum: ClassVar[float] = -3.304
    time: ClassVar[float] = 1.0475


def test_falling_cantilever_first_minimum() -> None:
    """Linear elements on 16 x 4 cells are 1.2 % short and early; the run ends where linear elements should."""
    result = run("cantilever_dynamic", "fem", end_time=1.6)
    assert float(result.first_minimum) == pytest.approx(Reference.first_minimum, rel=0.015)
    assert float(result.time_of_first_minimum) == pytest.approx(Reference.time, abs=0.02)
    assert float(result.energy_drift) < 1e-3


@pytest.mark.slow
def test_falling_cantilever_approaches_the_reference() -> None:
    errors, late = [], []
    for resolution in (16, 32, 64):
        result = run("cantilever_dynamic", "fem", resolution=resolution)
        errors.append(float(result.error_first_minimum))
        late.append(abs(float(result.late_maximum) - 0.042))
    assert errors[0] > 2.0 * errors[1] > 0.0
    assert errors[2] < 0.002
    assert late[2] < 0.003
    mpm = run("cantilever_dynamic", "implicit_mpm", particles_per_cell=16)
    assert mpm.attrs["status"] == "ok"
    assert float(mpm.error_first_minimum) < 0.02


@pytest.mark.slow  # compiles both for it alone
def test_frozen_functions_keep_the_energy_that_updated_ones_do_not() -> None:
    drifts = {
        kind: float(
            run(
                "cantilever_dynamic", "gmm", "mls", end_time=1.2, method__shape_functions=kind
            ).energy_drift
        )
        for kind in ("frozen", "updated")
    }
    assert drifts["frozen"] < 1e-3
    assert drifts["updated"] > 20.0 * drifts["frozen"]


def test_soil_column_strong_check() -> None:
    """Kinetic energies of the authors' own program, within half a joule."""
    result = run(
        "soil_column", "implicit_mpm", end_time=0.1, problem__initial_acceleration="gravity"
    )
    assert result.attrs["status"] == "ok"
    energy = result.kinetic_energy
    assert float(energy.sel(time=0.05, method="nearest", tolerance=1e-9)) == pytest.approx(
        717.1, abs=0.5
    )
    assert float(energy.sel(time=0.10, method="nearest", tolerance=1e-9)) == pytest.approx(
        239.2, abs=0.5
    )
    assert float(result.largest_plastic_strain[-1]) > 0.01
    weight = 8.0 * 1850.0 * 9.81
    momentum = result.momentum.values
    assert np.abs(result.reaction.values).max() < 10.0 * weight
    assert np.isfinite(momentum).all()


def test_initial_stress_at_rest() -> None:
    """A column under its weight starts with less motion; other laws have no history to hold the stress."""
    calm = run("soil_column", "implicit_mpm", end_time=0.05, problem__initial_stress="k0")
    sudden = run("soil_column", "implicit_mpm", end_time=0.05)
    assert calm.attrs["status"] == sudden.attrs["status"] == "ok"
    assert float(calm.kinetic_energy[-1]) < 0.3 * float(sudden.kinetic_energy[-1])
    bottom = np.argmin(calm.position_initial.values[:, 1])
    depth = 2.0 - calm.position_initial.values[bottom, 1]
    assert float(calm.stress[0, bottom, 1, 1]) == pytest.approx(-1850.0 * 9.81 * depth, rel=1e-12)
    with pytest.raises(NotApplicable, match="mohr_coulomb"):
        case.read(
            compose(
                "soil_column",
                "implicit_mpm",
                "linear",
                material="neo_hookean",
                problem__initial_stress="k0",
            )
        )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("method", "basis", "reference", "tolerance"),
    [
        ("implicit_mpm", "linear", 0.483, 0.04),
        ("gmm", "lme", 0.513, 0.06),
        ("gmm", "mls", 0.417, 0.07),
    ],
)
def test_soil_column_run_out(method: str, basis: str, reference: float, tolerance: float) -> None:
    result = run("soil_column", method, basis)
    assert result.attrs["status"] == "ok", result.attrs["reason"]
    assert float(result.final_run_out) == pytest.approx(reference, rel=tolerance)


@pytest.mark.slow
@pytest.mark.parametrize("basis", ("linear", "mls", "lme"))
def test_no_run_of_the_column_ends_without_a_reason(basis: str) -> None:
    method = "implicit_mpm" if basis == "linear" else "gmm"
    for changes in (
        {"time_step": 8e-3},
        {"method__step_halvings": 0, "method__ghost_stiffness": 0.0},
    ):
        changes = {
            k: v
            for k, v in changes.items()
            if method == "implicit_mpm" or k != "method__ghost_stiffness"
        }
        result = run("soil_column", method, basis, **changes)
        assert result.attrs["status"] == "ok" or len(result.attrs["reason"]) > 20
        assert float(result.time_reached) > 0.1


@pytest.mark.slow  # many steps of Newton's iteration, to see that it ends
def test_a_stiffer_tangent_holds_what_is_hardly_held(monkeypatch: pytest.MonkeyPatch) -> None:
    """Particles at the apex of the yield surface, just beyond the edge of a cell: alone they hold the next nodes."""
    settings = {"time_step": 1e-2, "end_time": 0.5}
    result = run("soil_column", "implicit_mpm", "linear", **settings)
    assert result.attrs["status"] == "ok", result.attrs["reason"]
    assert int(result.stiffened_steps) > 0
    assert int(result.halved_steps) == 0
    norms = result.newton_residual.values
    slow = norms[np.argmax(np.isfinite(norms).sum(axis=1))]
    slow = slow[np.isfinite(slow)]
    assert (
        slow[-1] < 1e-2 * slow[-2]
    )  # it fades with the residual; a constant one would converge linearly
    monkeypatch.setattr(newton, "STIFFENINGS", (0.0,))
    result = run("soil_column", "implicit_mpm", "linear", **settings)
    assert result.attrs["status"] == "not_converged"
    assert int(result.halved_steps) > 0


@pytest.mark.parametrize(
    ("method", "changes"),
    [
        ("gmm", {}),
        pytest.param("otm", {"time_step": 1e-4}, marks=pytest.mark.slow),
        pytest.param(
            "otm", {"time_step": 1e-4, "method__mass": "consistent"}, marks=pytest.mark.slow
        ),
    ],
)
@pytest.mark.parametrize("base", ("plane", "nodes"))
def test_moving_nodes_stick_to_the_base_that_they_reach(
    method: str, changes: dict[str, Any], base: str
) -> None:
    """A node thrown through the base stays where it lands, and its neighbours go on."""
    config = compose("soil_column", method, "lme", resolution=8, problem__base=base, **changes)
    state = case.build(case.read(config))
    node = int(np.argmin(np.linalg.norm(state.basis.nodes - [4.0, 0.5], axis=1)))
    jump = np.zeros_like(state.basis.nodes)
    jump[node] = [0.2, -0.501]
    state.basis.move(jump)
    state.nodes.v[node] = [1.0, -3.0]
    landed = state.basis.nodes[node].copy()
    assert not state.fixed[node].any()
    assert simulate(state, config["time_step"], 5 * config["time_step"]).status == "ok"
    if base == "plane":
        assert state.fixed[node].all()
        assert np.array_equal(state.basis.nodes[node], landed)
        assert not state.nodes.v[node].any()
    else:
        assert not state.fixed[node].any()
        assert not np.array_equal(state.basis.nodes[node], landed)
    assert (state.nodes.v[~state.fixed.any(axis=1), 1] < 0.0).any()


def test_splines_are_refused_where_they_cannot_be_clamped() -> None:
    with pytest.raises(NotApplicable, match="basis=linear"):
        case.read(compose("cantilever_dynamic", "implicit_mpm", "bspline"))


def test_methods_are_registered() -> None:
    assert {"static", "newmark", "explicit"} <= set(registry.names("method"))
