"""`penalty`: forces are those of an energy, for segments and triangles, and friction stays below its bound."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from mpmbench import case
from mpmbench.core.bodies import Part, gather, surface_points
from mpmbench.core.contact.penalty import Penalty, SurfaceContact, boxes_touch
from mpmbench.core.errors import BrokeDown
from mpmbench.core.geometry import Box, Cloud
from mpmbench.core.geometry.triangulate import extruded, unit_square
from mpmbench.core.loops.explicit import total_force
from mpmbench.core.particles import SEEN, Particles
from mpmbench.core.registry import get
from tests.core.contact.checks import judge
from tests.core.support import compose, run


def two_blocks(dimension: int, friction: float = 0.0) -> tuple[Any, SurfaceContact]:
    """Two blocks that overlap a little, with a state that knows no more than their surfaces."""
    nodes, triangles = unit_square(3, crossed=False)
    mesh = Cloud(nodes, triangles, 1.0 / 3.0)
    if dimension == 3:
        mesh = extruded(mesh, np.linspace(0.0, 1.0, 4))
    shift = np.array([0.06, 0.97, 0.05])[:dimension]
    other = Cloud(mesh.nodes + shift, mesh.simplices, mesh.spacing)
    parts = [
        Part(name, one, np.zeros((1, dimension)), np.ones(1), (0.0,) * dimension)
        for name, one in (("a", mesh), ("b", other))
    ]
    law = get("material", "neo_hookean")(young_modulus=1.0, poisson_ratio=0.3, density=1.0)
    bodies = gather(parts, law, on_nodes=False)
    rng = np.random.default_rng(3)
    x = np.vstack([np.zeros((2, dimension)), surface_points(parts)])
    x += 0.004 * rng.standard_normal(x.shape)
    particles = SimpleNamespace(x=x, v=np.zeros_like(x), dimension=dimension)
    box = Box((0.0,) * dimension, (1.0,) * dimension, (3,) * dimension)
    s = SimpleNamespace(particles=particles, bodies=bodies, geometry=box, time_step=0.0)
    s.nodes = SimpleNamespace(v=np.zeros((1, dimension)))
    return s, SurfaceContact(s, Penalty(friction=friction))  # type: ignore[arg-type]


@pytest.mark.parametrize("dimension", (2, pytest.param(3, marks=pytest.mark.slow)))
def test_forces_are_the_gradient_of_the_energy(dimension: int) -> None:
    s, contact = two_blocks(dimension)
    contact._take(s)
    assert contact.find(s, 0.0) and contact.energy[0] > 0.0
    force, row = contact.force.copy(), contact.surface.row
    assert np.count_nonzero(np.abs(force).sum(axis=1)) > 4
    step, found = 1e-6, np.zeros_like(force)
    for p, d in np.ndindex(*force.shape):
        energies = []
        for sign in (1.0, -1.0):
            s.particles.x[row[p], d] += sign * step
            energies.append(contact.stored(s))
            s.particles.x[row[p], d] -= sign * step
        found[p, d] = -(energies[0] - energies[1]) / (2.0 * step)
    assert np.allclose(found, force, atol=1e-6 * np.abs(force).max())
    assert np.allclose(force.sum(axis=0), 0.0, atol=1e-14)
    arm = s.particles.x[row]
    torque = np.einsum("pa,pb->ab", arm, force)
    assert np.allclose(torque, torque.T, atol=1e-13)


def test_boxes_of_any_two_bodies_may_touch() -> None:
    x = np.array([[0.0, 0.0], [1.0, 1.0], [2.0, 0.0], [3.0, 1.0], [2.5, 1.5], [4.0, 2.0]])
    body = np.array([0, 0, 1, 1, 2, 2])
    assert not boxes_touch(x, body, 3)
    for d in range(2):
        there = x.copy()
        there[4, d] = 0.9
        assert boxes_touch(there, body, 3) == (d == 1)  # along one axis alone is not enough
    there[4:] = [[0.5, -1.0], [0.6, 0.0]]
    assert boxes_touch(there, body, 3)  # they just meet, the last and the first


def test_friction_sticks_and_slides() -> None:
    s, contact = two_blocks(2, friction=0.2)
    contact._take(s)
    contact.find(s, 0.0)
    normal = contact.force.copy()
    body = contact.surface.body
    for speed, slides in ((1e-4, False), (1.0, True)):
        contact.stuck[:] = 0.0
        contact.v[body == 1, 0] = speed
        contact.find(s, 1.0)
        along = (contact.force - normal)[body == 1].sum(axis=0)
        pressed = normal[body == 1].sum(axis=0)
        bound = 0.2 * np.linalg.norm(pressed)
        assert along[0] < 0.0
        assert (abs(along[0]) > 0.9 * bound) == slides and abs(along[0]) < 1.05 * bound
        assert (contact.energy[1] > 0.0) == slides


@pytest.mark.parametrize(
    ("method", "basis"),
    (
        ("otm", "lme"),
        pytest.param("mpm", "linear", marks=pytest.mark.slow),
        pytest.param("linear_fem", "linear", marks=pytest.mark.slow),
    ),
)
def test_the_five_checks(method: str, basis: str) -> None:
    found = judge("penalty", method, basis)
    assert found.momentum < 1e-12 and found.order < 1e-12
    assert found.kinetic > 0.8 and found.strain < 0.15 and found.energy < 0.04
    assert found.inside == 0 and found.contact == 0.0
    assert found.parted > 0.65 and found.tension < 1e-3


def test_a_surface_point_without_functions_goes_with_the_nearest_node() -> None:
    basis = get("basis", "lme")().build(Box((0.0, 0.0), (1.0, 1.0), (4, 4)), 3, True)
    X = np.array([[0.4, 0.4], [0.6, 0.6]])
    p = Particles.at_rest(X, np.ones(2), 1.0, tracers=np.array([[1.001, 0.26]]))
    basis.follow(p)
    basis.locate(p.x)
    phi = basis.handle
    assert phi.size[0] > 3 and phi.size[2] == 1 and phi.phi[2, 0] == 1.0
    assert basis.nodes[phi.index[2, 0]].tolist() == [1.0, 0.25]
    assert not phi.grad_phi[2, 0].any()
    p.x[0] = 1.001, 0.26
    with pytest.raises(BrokeDown):
        basis.locate(p.x)


@pytest.mark.parametrize("rule", ("penalty", "multi_field"))
def test_nodes_too_light_for_the_step_follow_their_neighbours(rule: str) -> None:
    """Points on surfaces see them as well as heavy ones: a node of a body on a grid needs (c dt / 2 h)^2 particles."""
    chosen = {"contact": rule, "resolution": 2, "time_step": 1e-3}
    s = case.build(case.read(compose("two_squares", "mpm", "linear", **chosen)))
    s.time_step = 1e-3
    s.contact.push(s)
    speed = np.sqrt(20e6 * 0.7 / (1.3 * 0.4) / 7833.0)
    assert s.mass.light_nodes.cutoff == pytest.approx((0.5 * speed * 1e-3 / 0.5) ** 2)
    s.time_step = 1e-9
    s.contact.push(s)
    assert s.mass.light_nodes.cutoff == s.choices.mass_cutoff


@pytest.mark.slow  # compiles a grid's contact for itself
def test_points_torn_off_the_material_hold_nothing() -> None:
    """Their nodes have no mass that could take a force: it would be an acceleration of 1e300."""
    s = case.build(
        case.read(compose("two_squares", "mpm", "linear", contact="penalty", resolution=2))
    )
    s.time_step, p, h = 1e-6, s.particles, s.geometry.nodal_spacing
    first, second = (s.bodies.particle == b for b in range(2))
    p.x[second, 0] -= p.x[second, 0].min() - p.x[first, 0].max() + 0.3 * h
    s.basis.locate(p.x)
    total_force(s)
    assert not s.contact.torn.any() and s.contact.force.any()
    p.x[p.m > 0.0] = np.asarray(s.geometry.lower) + 0.25 * h
    s.basis.locate(p.x)
    total_force(s)
    assert s.contact.torn.all() and not s.contact.force.any() and s.contact.energy[0] == 0.0
    assert not s.nodes.f[s.nodes.m <= 2.0 * SEEN].any()


@pytest.mark.slow
def test_squares_that_meet_head_on_explain_their_energy() -> None:
    """Corners that crossed into a row of cells without particles had thrown points of the surface about."""
    found = run("two_squares", "mpm", "linear", contact="penalty")
    assert float(found.energy_imbalance) < 0.03 and int(found.captured_most) == 0
