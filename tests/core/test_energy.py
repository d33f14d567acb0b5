"""Energy balance: what loads and constraints put in is there, or is lost to a dissipation that is known."""

from typing import Any

import numpy as np
import pytest

from mpmbench.contracts.loops import MethodCase
from mpmbench.contracts.materials import Path, work_along
from mpmbench.core import registry
from mpmbench.core.geometry import Box
from mpmbench.core.loops.explicit import Explicit
from mpmbench.core.particles import Particles, seed_cells
from mpmbench.core.simulation import Body, build_state, simulate
from mpmbench.core.state import Loads, State
from tests.core.support import run
from tests.support import slow_if


@pytest.mark.parametrize(("mass", "most"), (("lumped", 0.05), ("consistent", 5e-3)))
def test_the_work_of_a_prescribed_motion_is_in_the_body(mass: str, most: float) -> None:
    """One end of a bar is pulled by ``c t^2``: the reaction's work becomes kinetic and stored energy.

    A lumped mass gives nodes another kinetic energy than particles have, whatever the time step.
    """

    def ends(x: np.ndarray) -> np.ndarray:
        return (x < 0.501) | (x > 1.249)

    def pulled(X: np.ndarray, t: float) -> np.ndarray:
        return np.where(X > 1.0, 200.0 * t * t, 0.0)

    choices = Explicit(nodes="moving", mass=mass, transfer="nodal")
    loads = Loads(prescribed_motion=pulled)
    state = MethodCase(choices, 1).block(np.zeros_like, loads, ends)
    solution = simulate(state, 1e-4, 0.02)
    assert solution.status == "ok", solution.reason
    kinetic, stored = (solution.history[key][-1] for key in ("kinetic_energy", "strain_energy"))
    assert stored > 1.0 and kinetic > 0.01 * stored
    assert state.external_work == pytest.approx(kinetic + stored, rel=most)


def viscous_power(law: Any, p: Particles) -> np.ndarray:
    """``2 eta dev(d) : dev(d)`` of all particles on a line [W/m^3]."""
    return 4.0 / 3.0 * law.viscosity * p.L[:, 0, 0] ** 2


class Plastic:
    """``tau : d eps_p`` of particles on a line, step by step [J/m^3]."""

    def __init__(self, law: Any) -> None:
        self.lame, self.shear = law.lame_parameters()
        self.before: Any = 0.0

    def lost(self, p: Particles) -> np.ndarray:
        elastic = 0.5 * np.log1p(p.state[:, :3])
        plastic = -elastic
        plastic[:, 0] += np.log(p.F[:, 0, 0])
        tau = self.lame * elastic.sum(axis=1, keepdims=True) + 2.0 * self.shear * elastic
        lost: np.ndarray = np.sum(tau * (plastic - self.before), axis=1)
        self.before = plastic
        return lost


@pytest.mark.parametrize(  # what a soil loses is asked below, of the law alone
    "name", ("newtonian_fluid", slow_if(True, "mohr_coulomb"))
)
def test_a_free_body_loses_what_its_material_dissipates(name: str) -> None:
    """Kinetic and stored energy and the dissipation so far stay together what they were at the start."""
    fluid = name == "newtonian_fluid"
    settings = {"viscosity": 0.01} if fluid else {"cohesion": 1e3, "friction_angle": 5.0}
    law = registry.get("material", name)(**settings)
    speed, dt, n = (0.1, 1e-3, 1000) if fluid else (1.0, 2e-5, 1000)
    body = Box((0.0,), (1.0,), (8,))
    X, V0 = seed_cells(body, 3)
    p = Particles.at_rest(X, V0, law.density, None, law.history, fluid)
    p.v[:, 0] = speed * np.cos(np.pi * X[:, 0])

    def velocity(x: np.ndarray) -> np.ndarray:
        return speed * np.cos(np.pi * x)

    choices = Explicit(nodes="moving", mass="consistent", transfer="nodal")
    free = Body(body, p, lambda x: np.zeros(x.shape, dtype=bool), velocity)
    state = build_state(free, registry.get("basis", "linear")(), law, choices)
    state.samples, plastic, lost = 10**6, Plastic(law), [0.0]

    def observe(s: State) -> dict[str, Any]:
        power = p.V @ viscous_power(law, p) * s.time_step if fluid else p.V0 @ plastic.lost(p)
        lost.append(lost[-1] + float(power))
        return {"lost": lost[-1]}

    state.observe = observe
    solution = simulate(state, dt, n * dt)
    assert solution.status == "ok", solution.reason
    kinetic, stored, dissipated = (
        np.array(solution.history[key]) for key in ("kinetic_energy", "strain_energy", "lost")
    )
    total = kinetic + stored + dissipated
    assert dissipated[-1] > 0.1 * kinetic[0], (dissipated[-1], kinetic[0])
    assert np.abs(total / total[0] - 1.0).max() < 5e-3, total


def test_viscous_dissipation_is_that_of_the_rate_of_deformation() -> None:
    """Along any path ``work - stored = int 2 eta dev(d) : dev(d) J dt``."""
    fluid = registry.get("material", "newtonian_fluid")(bulk_modulus=2.0, viscosity=0.3)
    gradient, dt, n = np.array([[0.2, 0.5], [-0.1, 0.3]]), 1e-3, 400
    path, steps = Path(fluid, 2), [np.eye(2) + k / n * gradient for k in range(n + 1)]
    path.step(steps[0], dt, gradient / (n * dt))  # with the rate of the first step
    work = work_along(path, steps[1:], dt)
    lost = 0.0
    for F in steps:
        L = gradient / (n * dt) @ np.linalg.inv(F)
        d = np.zeros((3, 3))
        d[:2, :2] = 0.5 * (L + L.T)
        deviator = d - np.trace(d) / 3.0 * np.eye(3)
        lost += 2.0 * fluid.viscosity * np.sum(deviator**2) * np.linalg.det(F) * dt
    assert work - path.energy == pytest.approx(lost, rel=5e-3)
    assert lost > 0.1 * path.energy


def test_plastic_dissipation_is_the_work_on_the_plastic_strain() -> None:
    """Compressed along its axes, Mohr-Coulomb loses ``int tau : d eps_p``, with ``eps_p = ln F - ln(b_e) / 2``."""
    soil = registry.get("material", "mohr_coulomb")()
    end, n = np.array([-0.03, -0.01, 0.015]), 600
    path, lost = Path(soil, 3), 0.0
    plastic, tau, length = np.zeros(3), np.zeros(3), 0.0
    work = 0.0
    for k in range(1, n + 1):
        strain = k / n * end
        work += work_along(path, [np.diag(np.exp(strain))], 1.0)
        now = strain - 0.5 * np.log1p(path.state[:3])
        stress = np.exp(strain.sum()) * np.diag(path.sigma)
        lost += 0.5 * (tau + stress) @ (now - plastic)
        length += np.sqrt(2.0 / 3.0 * np.sum((now - plastic) ** 2))
        plastic, tau = now, stress.copy()
    assert work - path.energy == pytest.approx(lost, rel=2e-3)
    assert lost > 0.1 * path.energy > 0.0
    assert path.state[6] == pytest.approx(length, rel=1e-9)


@pytest.mark.parametrize(
    "metal",
    (
        {"material": "j2", "material__hardening_modulus": 5.0},
        {"material": "thermo_viscoplastic", "material__rate_exponent": 5.0},
        {"material": "johnson_cook", "material__hardening_modulus": 5.0},
    ),
    ids=lambda metal: str(metal["material"]),
)
@pytest.mark.slow  # what a free fluid loses and the work on the plastic strain are asked above
def test_a_bar_of_metal_keeps_account_of_what_it_loses(metal: dict[str, Any]) -> None:
    """A bar that swings far beyond yield, by an implicit method: the series of energies add up."""
    coarse = {"resolution": 16, "time_step": 4e-4, "end_time": 0.5}
    metal = metal | {"material__yield_stress": 5.0, "problem__velocity_amplitude": 2.0}
    if metal["material"] != "j2":
        metal |= {"material__reference_rate": 0.1}
    result = run("bar_fixed_ends", "fem", "linear", method__mass="consistent", **coarse, **metal)
    lost, kinetic = result.dissipated_energy.values, result.kinetic_energy.values
    assert lost[0] == 0.0 and np.all(np.diff(lost) >= 0.0) and lost[-1] > 0.5 * kinetic[0]
    assert float(result.energy_drift) < 0.01


@pytest.mark.parametrize(
    ("changes", "loses"),
    (
        ({"method__transfer": "pic"}, 0.5),
        ({"method__transfer": "blend", "method__flip": 0.9}, 0.1),
        ({"method__transfer": "pic", "method__stress_update": "musl"}, 0.5),
    ),
)
def test_what_transfers_lose_is_counted(changes: dict[str, Any], loses: float) -> None:
    """A bar that swings: energy and its loss add up, while half of it goes with PIC."""
    result = run("bar_fixed_ends", "mpm", "bspline", resolution=16, **changes)
    lost, start = result.numerical_dissipation.values, float(result.kinetic_energy[0])
    assert lost[0] == 0.0 and lost[-1] > loses * start
    assert float(result.energy_drift) > 0.9 * lost[-1] / start
    assert float(result.energy_imbalance) < 1e-4
    assert not result.contact_energy.any() and not result.dissipated_energy.any()


@pytest.mark.parametrize("mass", ("lumped", "consistent"))
def test_nodes_that_start_at_other_velocities_than_particles_take_or_give_energy(mass: str) -> None:
    """After one step without forces the loss is ``sum_p m_p |v_p|^2 / 2`` before less after, exactly."""
    state = MethodCase(Explicit(transfer="pic", mass=mass), 2).block(
        lambda x: 1e-2 * np.random.default_rng(1).standard_normal(x.shape)
    )
    p = state.particles
    before = 0.5 * p.m @ np.sum(p.v**2, axis=1)
    lost = simulate(state, 1e-6, 1e-6).history["numerical_dissipation"]
    after = 0.5 * p.m @ np.sum(p.v**2, axis=1)
    assert lost == pytest.approx([0.0, before - after], rel=1e-6)
    assert lost[1] > 0.3 * before


@pytest.mark.slow  # the rate in one step is asked by tests/core/test_material_plasticity.py
def test_the_rate_counts_in_implicit_steps_as_in_explicit_ones() -> None:
    """A bar of a metal whose rate counts is stopped by the same strain, less than one whose rate does not."""

    def strain(method: str, time_step: float, exponent: float | None) -> float:
        metal = {"material": "thermo_viscoplastic", "material__yield_stress": 5.0}
        metal |= {"material__rate_exponent": exponent, "material__reference_rate": 0.1}
        bar = {"resolution": 16, "end_time": 0.5, "problem__velocity_amplitude": 2.0}
        result = run("bar_fixed_ends", method, "linear", time_step=time_step, **bar, **metal)
        return float(result.plastic_strain.max())

    implicit, explicit = strain("fem", 4e-4, 5.0), strain("linear_fem", 2e-4, 5.0)
    assert implicit == pytest.approx(explicit, rel=0.02)
    assert implicit < 0.9 * strain("fem", 4e-4, None)


@pytest.mark.parametrize("settings", ({}, {"mass": "lumped"}, {"volumetric": "f_bar"}))
def test_what_mapped_accelerations_do_to_energy_is_counted(settings: dict[str, str]) -> None:
    """Two squares meet by implicit MPM: accelerations mapped from particles are not those of the forces."""
    changes = {f"method__{key}": value for key, value in settings.items()}
    short = {"resolution": 4, "time_step": 4e-4, "end_time": 0.3, "particles_per_cell": 1}
    result = run("two_squares", "implicit_mpm", "linear", **short, **changes)
    drift, imbalance = float(result.energy_drift), float(result.energy_imbalance)
    assert drift > 0.01 and imbalance < 0.05 * drift, (drift, imbalance)
