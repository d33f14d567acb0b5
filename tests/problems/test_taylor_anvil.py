"""Taylor's test: the rod, what it keeps, and what a coarse one gives."""

import numpy as np
import pytest

from mpmbench import case
from mpmbench.contracts.materials import stress_of
from mpmbench.core import registry
from mpmbench.core.energies import dissipated_energy, strain_energy
from mpmbench.core.geometry.triangulate import barycentres
from mpmbench.core.simulation import simulate
from mpmbench.core.stability import wave_speed
from mpmbench.core.transfer.carry import Update, g2p
from mpmbench.core.transfer.parts import NOTHING
from tests.core.support import compose, run

PROBLEM = registry.get("problem", "taylor_anvil")
COPPER = registry.get("material", "j2")()


@pytest.mark.parametrize(("model", "share"), (("quarter", 0.25), ("full", 1.0)))
def test_particles_fill_the_rod(model: str, share: float) -> None:
    problem = PROBLEM(model=model)
    X, V0 = problem.seed(4, 3)
    sides = 32  # of the polygon that the rim is
    polygon = 0.5 * sides * np.sin(2.0 * np.pi / sides) * problem.radius**2
    assert V0.sum() == pytest.approx(share * polygon * problem.length, rel=1e-12)
    assert len(X) == share * 15_360
    if model == "quarter":
        assert X.min() > 0.0


@pytest.mark.parametrize(
    ("basis", "update"),
    (
        ("bspline", "usl"),
        ("lme", "usl"),
        ("linear", "musl"),
    ),
)
@pytest.mark.slow  # a rod in space: its spline kernels are compiled for this file alone
def test_the_wall_gives_all_momentum_along_the_axis(basis: str, update: str) -> None:
    config = compose("taylor_anvil", "mpm", basis, resolution=2, method__stress_update=update)
    built = case.read(config)
    s = case.build(built)
    p = s.particles
    first, given, dt = p.m @ p.v, 0.0, 2e-8
    start = float(0.5 * p.m @ np.sum(p.v**2, axis=1))
    for _ in range(100):
        s.time_step = dt
        s.choices.step(s, dt)
        given += s.walls.impulse[0, 0]
        assert np.abs(s.walls.impulse[0, 1:]).max() == 0.0
    assert given > 0.05 * p.m.sum() * 227.0
    moved = (p.m @ p.v - first)[0]
    assert moved == pytest.approx(given, rel=1e-9)
    kinetic = float(0.5 * p.m @ np.sum(p.v**2, axis=1))
    stored = strain_energy(s.law, s.axes, p.F, p.state, p.V0) + dissipated_energy(s.material, p)
    lost = s.kinetic_given - (kinetic - start)
    assert min(s.contact_energy, lost, stored) > 0.0 and kinetic < start
    assert kinetic + stored + lost + s.contact_energy == pytest.approx(start, rel=0.01)


@pytest.mark.slow  # a rod in space: its spline kernels are compiled for this file alone
def test_stresses_of_many_particles_are_those_of_each() -> None:
    """In vectors or one by one, elastic, plastic, or far from where series hold; a batch need not be full."""
    s = case.build(case.read(compose("taylor_anvil", "mpm", "bspline", resolution=2)))
    p, n, dt, (start, stop) = s.particles, s.nodes, 1e-7, (5, 470)
    for _ in range(60):
        s.time_step = dt
        s.choices.step(s, dt)
    p.state[::7, 0] += 0.3
    F, state, sigma = p.F.copy(), p.state.copy(), p.sigma.copy()
    strain = Update(False, True, False, False, 1.0)
    arrays = p.arrays, NOTHING, NOTHING, n.arrays
    g2p(s.basis.handle, s.law, *arrays, dt, strain, p.material.stop, start, stop)
    expected, flowed = sigma.copy(), p.state[:, 6] > state[:, 6]
    for k in range(start, stop):
        L = (p.F[k] @ np.linalg.inv(F[k]) - np.eye(3)) / dt
        stress_of(s.law, s.axes, p.F[k], L, dt, state[k], expected[k])
    assert np.allclose(p.sigma, expected, rtol=0.0, atol=1e-9 * np.abs(expected).max())
    assert np.allclose(p.state[:, :7], state[:, :7], rtol=0.0, atol=1e-12)
    assert np.allclose(p.state[:, 7], state[:, 7], rtol=1e-9)
    assert np.array_equal(p.sigma[:start], sigma[:start])
    assert 0.1 < flowed[start:stop].mean() < 0.9


def test_particles_of_a_cell_follow_each_other() -> None:
    """Also when the rod has moved along its axis: there are hardly more changes of the cell than cells."""
    problem = PROBLEM()
    X, V0 = problem.seed(4, 3)
    assert V0.sum() == pytest.approx(barycentres(problem._rod(4))[1].sum(), rel=1e-13)
    for moved in (0.0, 0.37):
        cells = np.floor(X / (problem.radius / 4) + [moved, 0.0, 0.0])
        changes = np.count_nonzero(np.diff(cells, axis=0).any(axis=1))
        assert changes < 1.1 * len(np.unique(cells, axis=0))


@pytest.mark.slow  # a rod in space: its spline kernels are compiled for this file alone
def test_a_coarse_rod_comes_out_as_long_as_published() -> None:
    """21.26 to 21.66 mm in Table 5.1 of Li 2009; two cells along the radius are coarse."""
    found = run("taylor_anvil", "mpm", "bspline", resolution=2)
    assert float(found.length) == pytest.approx(21.45e-3, abs=0.5e-3)
    assert 6.5e-3 < float(found.radius_nodes) < 7.4e-3
    assert 2.0 < float(found.plastic_strain_max) < 3.4
    assert float(found.kinetic_energy[-1]) < 1e-2 * float(found.kinetic_energy[0])
    assert float(found.length_history[0]) == 32.4e-3
    assert float(found.kinetic_share) == pytest.approx(
        float(found.kinetic_energy[-1] / found.kinetic_energy[0])
    )
    assert 3.2e-3 < float(found.radius_fifth) < float(found.radius_points)
    # transfers and the wall take what is missing
    assert float(found.energy_drift) > 0.03 and float(found.energy_imbalance) < 0.005
    first_layer = 0.025  # half a cell of twenty, in an elastic wave that it sends ahead
    assert 0.2 * first_layer < float(found.contact_energy[-1] / found.kinetic_energy[0]) < 0.04


@pytest.mark.slow  # a rod in space: its spline kernels are compiled for this file alone
def test_the_rod_rebounds() -> None:
    """An elastic rod comes off the wall: nothing holds it there."""
    config = compose(
        "taylor_anvil",
        "mpm",
        "bspline",
        resolution=2,
        material="hencky_elastic",
        material__young_modulus=117.0e9,
        material__poisson_ratio=0.35,
        material__density=8930.0,
        problem__speed=10.0,
        end_time=4e-5,
    )
    s = case.build(case.read(config))
    problem = PROBLEM(speed=10.0)
    solution = simulate(s, problem.adaptive_step(s), 4e-5)
    assert solution.status == "ok"
    assert float(s.particles.m @ s.particles.v[:, 0]) > 0.8 * 10.0 * s.particles.m.sum()
    assert not s.walls.nodal_impulse.any()


@pytest.mark.parametrize("model", ("quarter", "full"))
def test_the_section_of_the_undeformed_rod(model: str) -> None:
    """A polygon of 32 sides has a little less than the circle around it."""
    problem = PROBLEM(model=model)
    sides = 0.5 * 32 / np.pi * np.sin(2.0 * np.pi / 32)
    assert problem._radius_at(0.5 * problem.length, *problem.seed(4, 3)) == pytest.approx(
        problem.radius * np.sqrt(sides), rel=0.02
    )


@pytest.mark.parametrize(
    ("method", "basis", "shorter"), (("tlmpm", "bspline", 0.5), ("mpm", "bspline", 1.0))
)
def test_steps_follow_what_is_compressed(method: str, basis: str, shorter: float) -> None:
    """Functions that go with the body get as narrow as it does, also on a grid that stays in the undeformed rod."""
    s = case.build(case.read(compose("taylor_anvil", method, basis, resolution=2)))
    before = PROBLEM().adaptive_step(s)(s)
    wave, faster = wave_speed(s.material), PROBLEM(speed=1000.0).adaptive_step(s)(s)
    assert before / faster == pytest.approx((wave + 1000.0) / (wave + PROBLEM.speed))
    s.particles.F[:] *= 0.5
    assert PROBLEM().adaptive_step(s)(s) == pytest.approx(shorter * before)
    inside = np.array([PROBLEM.length, PROBLEM.radius, PROBLEM.radius])
    assert np.allclose(s.basis.nodes.max(axis=0), inside) == (method == "tlmpm")
