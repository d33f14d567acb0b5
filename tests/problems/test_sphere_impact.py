"""The sphere and its plate: their meshes, numbers and supports, and what a coarse impact gives."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree

from mpmbench import case
from mpmbench.core import registry
from mpmbench.core.bodies import Part
from mpmbench.core.choices import Choices
from mpmbench.core.errors import NotApplicable
from mpmbench.core.geometry import simplex_volumes
from mpmbench.core.geometry.surface import facet_normals, inside_mesh
from mpmbench.core.geometry.triangulate import graded_levels
from mpmbench.problems.collision import captured
from mpmbench.problems.sphere_impact import NEAR, SPHERE, instant
from tests.core.support import compose, run

PROBLEM = registry.get("problem", "sphere_impact")
COARSE = {"resolution": 2}


def flux(part: Part) -> float:
    """Volume within the surface [m^3], by its boundary integral."""
    corners = part.mesh.nodes[part.surface.row][part.surface.facet]
    normal, size = facet_normals(corners)
    return float(np.sum(size * np.sum(normal * corners.mean(axis=1), axis=1))) / 3.0


@pytest.mark.parametrize("spread", ("graded", "even"))
@pytest.mark.parametrize("model", ("quarter", pytest.param("full", marks=pytest.mark.slow)))
def test_meshes_fill_both_bodies(spread: str, model: str) -> None:
    problem = PROBLEM(spread=spread, model=model)
    share = 0.25 if model == "quarter" else 1.0
    volumes = (np.pi * 1e-6, 4.0 / 3.0 * np.pi * 0.85e-3**3)
    coarse, fine = problem.bodies(2, 3), problem.bodies(3, 3)
    for part, better, volume in zip(coarse, fine, volumes, strict=True):
        assert flux(part) == pytest.approx(part.V0.sum(), rel=1e-10)  # closed, outwards, no overlap
        errors = [1.0 - one.V0.sum() / (share * volume) for one in (part, better)]
        assert -1e-12 <= errors[1] <= errors[0] + 1e-12 and errors[0] < 0.004
        if part.name == "sphere":  # as heavy as a round one
            assert np.abs(errors).max() < 1e-12
            assert part.mesh.nodes[:, 0].min() == pytest.approx(problem.gap)
        assert (problem.velocity(part.mesh.nodes, None) == part.velocity).all()  # that of nodes
        size = simplex_volumes(part.mesh.nodes, part.mesh.simplices)
        assert size.min() > 0.1 * np.median(size)
        if model == "quarter":
            assert part.mesh.nodes[:, 1:].min() == 0.0 and part.X[:, 1:].min() > 0.0


@pytest.mark.parametrize(("method", "basis"), (("otm", "lme"), ("mpm", "linear")))
@pytest.mark.slow  # compiles its metals in space; what is inside a mesh is asked by tests/core/test_geometry.py
def test_what_is_inside_the_plate_is_counted(method: str, basis: str) -> None:
    """The particles of a sphere that is moved into it, and its nodes where they move."""
    made = case.read(compose("sphere_impact", method, basis, **COARSE))
    s, (plate, sphere) = case.build(made), made.problem.bodies(2, 3)
    own = s.bodies.particle == SPHERE
    assert captured(s) == 0
    sinking = 4.03e-3  # with which no node of one body lies on a face of the other, within rounding
    sunk = replace(sphere.mesh, nodes=sphere.mesh.nodes - [sinking, 0.0, 0.0])
    s.particles.x[own, 0] -= sinking
    expected = len(sphere.X) + inside_mesh(plate.X, sunk).sum()
    if method == "otm":
        nodes = s.bodies.node == SPHERE
        s.basis.nodes[nodes, 0] -= sinking
        off_planes = np.array([0.0, 1e-9, 1e-9])  # those of symmetry, which are faces
        inwards = plate.mesh.nodes + off_planes
        expected += int(nodes.sum()) + inside_mesh(inwards, sunk).sum()
    assert captured(s) == expected > len(sphere.X)
    s.particles.x[own, 0] -= 9e-3  # through it
    if method == "otm":
        s.basis.nodes[nodes, 0] -= 9e-3
    assert captured(s) == 0


def test_nodes_near_the_impact_are_as_close_as_asked() -> None:
    """0.17 mm within 2.5 mm with the default resolution: each node has three neighbours there, also at edges."""
    bodies = PROBLEM(spread="graded").bodies(5, 3)
    for part in bodies:
        nodes = part.mesh.nodes
        near = np.linalg.norm(nodes, axis=1) < 2.5e-3
        distance, _ = cKDTree(nodes).query(nodes[near], k=4)
        assert near.any() and distance.max() < 0.171e-3
    assert sum(len(part.mesh.nodes) for part in bodies) < 10_000


def test_levels_are_even_and_then_grow() -> None:
    levels = graded_levels(10.0, 2.5, 0.17, 1.4)
    steps = np.diff(levels)
    assert levels[0] == 0.0 and levels[-1] == 10.0
    even = levels[1:] <= 2.55 + 1e-9
    assert np.allclose(steps[even], 0.17) and levels[1:][even][-1] >= 2.5
    growth = steps[1:] / steps[:-1]
    assert growth.max() <= 1.4 + 1e-9 and np.ptp(growth[even[1:].sum() :]) < 1e-6
    assert np.allclose(np.diff(graded_levels(10.0, 2.5, 0.17, 1.0)), 10.0 / 59)


def test_both_metals_and_the_energy_of_the_sphere() -> None:
    state = case.build(case.read(compose("sphere_impact", "mpm", "linear", **COARSE)))
    plate, sphere = state.bodies.materials
    assert (plate.young_modulus, plate.melting_temperature, plate.rate_exponent) == (
        69e9,
        853.0,
        10.0,
    )
    assert (sphere.young_modulus, sphere.yield_stress, sphere.hardening_exponent) == (
        200e9,
        1.5e9,
        22.0,
    )
    assert sphere.rate_exponent == 10.0 and sphere.reference_rate == 1000.0
    p = state.particles
    own = state.bodies.particles(1)
    energy = 0.5 * float(p.m[own] @ np.sum(p.v[own] ** 2, axis=1))
    assert energy == pytest.approx(0.5 * 7850.0 * p.V0[own].sum() * 1e6, rel=1e-12)
    assert not p.v[state.bodies.particles(0)].any()


@pytest.mark.parametrize(
    ("support", "held"),
    (("rollers", [True, False]), ("clamped", [True, True]), ("free", [False, False])),
)
def test_the_plate_is_held_from_below(support: str, held: list[bool]) -> None:
    problem = PROBLEM(support=support, spread="even")
    fixed = problem.fixed(np.array([[-10e-3, 1e-3, 1e-3], [-5e-3, 0.0, 1e-3]]))
    assert fixed[0].tolist() == [held[0], held[1], held[1]]
    assert fixed[1].tolist() == [False, True, False]
    box = problem.nodes(2, Choices())
    lowest = box.points[:, 0].min()
    assert lowest < -10.5e-3 if support == "free" else lowest == pytest.approx(-10e-3)


def test_time_and_depth_are_read_off_between_instants() -> None:
    time, energy = np.array([0.0, 1.0, 2.0, 3.0]), np.array([1.0, 0.4, 0.0, 0.2])
    assert instant(time, energy, 0.1) == pytest.approx(1.75)
    assert np.isnan(instant(time, energy, -1.0))


@pytest.mark.slow  # max-ent in space is compiled for it alone
def test_graded_nodes_have_functions_of_their_own_spacing() -> None:
    """Particles see about as many nodes far away as near the impact, and functions stay linearly complete."""
    changes = {"contact": "none", "basis__locality": "convected"}
    state = case.build(case.read(compose("sphere_impact", "otm", "lme", **COARSE, **changes)))
    p, rng = state.particles, np.random.default_rng(0)
    p.F[:] += 0.05 * rng.standard_normal(p.F.shape)
    state.basis.locate(p.x)
    phi = state.basis.handle
    used = np.arange(phi.width) < phi.size[:, None]
    values = np.where(used, phi.phi, 0.0)
    places = np.where(used[:, :, None], state.basis.nodes[phi.index], 0.0)
    assert np.allclose(values.sum(axis=1), 1.0, atol=1e-10)
    assert np.abs(np.einsum("pk,pkd->pd", values, places) - p.x).max() < 1e-10 * 10e-3
    slopes = np.where(used[:, :, None], phi.grad_phi, 0.0)
    identity = np.einsum("pka,pkb->pab", places, slopes)
    assert np.allclose(identity, np.eye(3), atol=1e-6)
    plate = state.bodies.particles(0)
    far = np.linalg.norm(p.x[plate], axis=1) > 2.0 * NEAR
    assert phi.size[plate][far].mean() < 1.5 * phi.size[plate][~far].mean()


def test_what_cannot_be_run_is_refused_with_a_reason() -> None:
    for method, basis, changes, reason in (
        ("mpm", "linear", {"problem__spread": "graded"}, "cells of a grid without particles"),
        ("otm", "mls", {}, "supports of one size"),
        ("otm", "maxent", {}, "or round ones"),  # a prior of 4 spacings sees one layer of nodes
        ("linear_fem", "linear", {}, "contact=penalty"),
        ("implicit_mpm", "linear", {"contact": "penalty"}, "no contact but that of shared nodes"),
    ):
        with pytest.raises(NotApplicable, match=reason):
            case.read(compose("sphere_impact", method, basis, **changes))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("method", "basis", "changes"),
    (
        ("mpm", "linear", {"method__stress_update": "musl"}),
        ("otm", "lme", {"basis__locality": "convected"}),
        ("mpm", "linear", {"method__stress_update": "musl", "contact": "multi_field"}),
    ),
)
def test_a_coarse_impact(method: str, basis: str, changes: dict[str, str]) -> None:
    """The sphere comes to rest in the plate, faster ones deeper; energy and symmetry are kept."""
    depths = []
    for speed in (500.0, 750.0, 1000.0):  # OTM takes minutes for faster ones
        found = run("sphere_impact", method, basis, problem__speed=speed, **COARSE, **changes)
        assert found.attrs["status"] == "ok" and float(found.energy_imbalance) < 0.03
        # particles of linear functions go on vibrating, with more than 1 % of the energy at 1000 m/s
        assert 0.0 < float(found.time_to_dissipation_of_centre) < 8e-6
        depths.append(float(found.depth_over_diameter_of_centre))
    assert 0.1 < depths[0] < depths[1] < depths[2] < 2.6
