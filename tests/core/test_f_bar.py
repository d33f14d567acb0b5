"""F-bar in the explicit loop: who shares, that forces do the work that is stored, and that bodies lock no more."""

from copy import deepcopy
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from mpmbench import case
from mpmbench.contracts import loops
from mpmbench.core.energies import strain_energy
from mpmbench.core.errors import NotApplicable
from mpmbench.core.loops.explicit import Explicit, total_force, update_particles
from mpmbench.core.loops.f_bar import around_nodes
from mpmbench.core.state import State
from mpmbench.settings.schema import composed
from tests.core.support import compose, run
from tests.core.test_methods import FOR_ALL

METHODS = [
    Explicit(**composed("method", name)["method"] | {"volumetric": "f_bar"})
    for name in ("otm", "linear_fem")
]
DT = 1e-3


def state_of(dimension: int = 2, seed: int = 1) -> State:
    """A block after one step at random velocities of its nodes, so that its particles differ."""
    block = loops.MethodCase(METHODS[1], dimension).block(np.zeros_like)
    for k in range(2):
        move(block, random_velocity(block, seed + k), DT)
    return block


def random_velocity(s: State, seed: int) -> np.ndarray:
    return 10.0 * np.random.default_rng(seed).standard_normal(s.nodes.v.shape)


def move(s: State, v: np.ndarray, dt: float) -> None:
    s.nodes.v[:] = v
    update_particles(s, dt, strain=True)


def cells_of(s: State) -> list[np.ndarray]:
    cells = s.around.cells
    return np.split(cells.member, cells.first[1:-1])


@pytest.mark.parametrize("choices", METHODS, ids=lambda c: c.name)
@pytest.mark.parametrize("check", FOR_ALL)
def test_contract(check: str, choices: Explicit) -> None:
    one = loops.MethodCase(choices, 2)
    if check in loops.CHECKS.of(one):
        finding = loops.CHECKS[check](one)
        assert finding.passed, finding.text


@pytest.mark.parametrize("dimension", (2, pytest.param(3, marks=pytest.mark.slow)))
def test_forces_are_the_derivative_of_the_energy(dimension: int) -> None:
    s = state_of(dimension)
    total_force(s)
    v = random_velocity(s, 7)
    power, dt = float(np.sum(s.nodes.f * v)), 1e-6

    def stored(v: np.ndarray) -> float:
        twin = deepcopy(s)
        move(twin, v, dt)
        p = twin.particles
        return float(strain_energy(twin.law, twin.axes, p.F, p.state, p.V0))

    assert -power == pytest.approx((stored(v) - stored(-v)) / (2.0 * dt), rel=1e-6)


def test_particles_around_a_node_have_one_change_of_volume_and_one_pressure() -> None:
    s = state_of()
    p = s.particles
    before, F, v = p.V.copy(), p.F.copy(), random_velocity(s, 7)
    plain = deepcopy(s)
    plain.choices = replace(s.choices, volumetric="standard")
    move(s, v, DT)
    move(plain, v, DT)
    J_bar = np.linalg.det(p.F) / np.linalg.det(F)
    pressure = np.trace(p.sigma, axis1=1, axis2=2)
    for member in cells_of(s):
        volume = plain.particles.V[member]
        assert (
            len(member) == 1 or np.ptp(volume / before[member]) > 1e-3
        )  # by themselves they differ
        assert np.ptp(J_bar[member]) < 1e-12
        assert np.ptp(pressure[member]) < 1e-9 * np.abs(pressure).max()
        assert p.V[member].sum() == pytest.approx(volume.sum(), rel=1e-12)
    isochoric = [q.F / np.sqrt(np.linalg.det(q.F))[:, None, None] for q in (p, plain.particles)]
    assert np.allclose(*isochoric, atol=1e-12)  # the change of shape is their own


def test_who_shares_is_nearest_to_a_node_of_its_own_body() -> None:
    """Half a cell aside, nodes of the other body are nearer to some particles."""
    settings: dict[str, Any] = {"method__volumetric": "f_bar", "problem__gap": 1e-3}
    settings |= {"problem__offset": 0.125 / 2.0, "particles_per_cell": 3}
    config = compose("two_squares", "linear_fem", "linear", contact="penalty", **settings)
    s = case.build(case.read(config))
    move(s, np.zeros_like(s.nodes.v), DT)
    solid = slice(0, s.particles.material.stop)
    distance = np.linalg.norm(s.particles.X[solid, None] - s.initial_nodes, axis=2)
    foreign = s.bodies.node != s.bodies.particle[solid, None]
    nearest = np.argmin(np.where(foreign, np.inf, distance), axis=1)
    assert np.any(nearest != np.argmin(distance, axis=1))
    expected = {tuple(np.flatnonzero(nearest == node)) for node in nearest}
    assert {tuple(one) for one in cells_of(s)} == expected


def test_bodies_of_two_materials_share_among_their_own() -> None:
    """A sphere of steel on a plate of aluminium: implicit cells would have both, those around nodes have one."""
    settings: dict[str, Any] = {"method__volumetric": "f_bar", "resolution": 2}
    settings |= {"problem__plate_radius": 4e-3, "problem__thickness": 4e-3}
    config = compose("sphere_impact", "linear_fem", "linear", contact="penalty", **settings)
    s = case.build(case.read(config))
    cells = around_nodes(s).cells
    shared = np.split(s.bodies.particle[cells.member], cells.first[1:-1])
    assert all(np.ptp(bodies) == 0 for bodies in shared)
    assert {int(bodies[0]) for bodies in shared} == {0, 1}


@pytest.mark.slow
def test_a_rod_of_tetrahedra_locks_no_more() -> None:
    """The foot of Taylor's rod spreads, as it does by all methods that do not lock, and energy is accounted for."""
    found = {}
    for volumetric in ("standard", "f_bar"):
        changes = {"resolution": 2, "method__volumetric": volumetric}
        found[volumetric] = run("taylor_anvil", "linear_fem", "linear", **changes)
        assert float(found[volumetric].energy_imbalance) < 0.02
    assert float(found["standard"].plastic_strain_max) < 1.0
    assert 1.8 < float(found["f_bar"].plastic_strain_max) < 3.4
    assert float(found["standard"].radius_nodes) < 5e-3 < 6e-3 < float(found["f_bar"].radius_nodes)
    assert float(found["f_bar"].length) == pytest.approx(21.45e-3, abs=0.5e-3)


@pytest.mark.parametrize("method", ("mpm", "tlmpm"))
def test_refused_where_no_node_goes_with_the_particles(method: str) -> None:
    config = compose("two_squares", method, "bspline", method__volumetric="f_bar")
    with pytest.raises(NotApplicable, match=r"method\.volumetric=f_bar.*method\.nodes=moving"):
        case.read(config)
