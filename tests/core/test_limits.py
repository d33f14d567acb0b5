"""Choices that must give the same numbers, to round-off or to a stated order."""

from typing import Any

import numpy as np
import pytest

from mpmbench.contracts.loops import MethodCase
from mpmbench.core import registry
from mpmbench.core.bases.grid.bspline import BSpline
from mpmbench.core.bases.grid.linear import Linear
from mpmbench.core.geometry import Box, Cloud
from mpmbench.core.geometry.triangulate import triangulation
from mpmbench.core.loops.explicit import Explicit
from mpmbench.core.particles import Particles
from mpmbench.core.simulation import simulate
from tests.core.support import run

FIELDS = ("displacement", "velocity", "stress")
BAR = {"resolution": 8, "time_step": 1e-5, "end_time": 4e-3}


@pytest.mark.parametrize("basis", (BSpline(degree=1), Linear()))
@pytest.mark.parametrize("dim", (1, 2))
def test_splines_of_degree_one_are_hats(dim: int, basis: Any) -> None:
    """Products of ``max(0, 1 - |x - x_i| / h)`` along the axes, and their slopes."""
    box = Box((0.0,) * dim, (1.0,) * dim, (4, 3)[:dim])
    x = np.random.default_rng(0).uniform(size=(50, dim))
    found, n = basis.build(box, len(x), False).evaluate(x), len(box.points)
    offset = (x[:, None, :] - box.points) / box.spacing
    hats = np.maximum(0.0, 1.0 - np.abs(offset))
    assert np.allclose(found.matrix(n), hats.prod(axis=2), rtol=0.0, atol=1e-14)
    for d in range(dim):
        slope = np.where(hats[:, :, d] > 0.0, -np.sign(offset[:, :, d]) / box.spacing[d], 0.0)
        expected = slope * np.delete(hats, d, axis=2).prod(axis=2)
        assert np.allclose(found.gradient_matrix(n)[:, :, d], expected, rtol=0.0, atol=1e-13)


def test_local_maxent_at_large_gamma_is_linear_on_a_delaunay_triangulation() -> None:
    """Away from edges, where two nodes compete, the rest falls like ``exp(-gamma s)``."""
    nodes = Box((0.0, 0.0), (1.0, 1.0), (3, 3)).points.copy()
    inside = np.all((nodes > 1e-9) & (nodes < 1.0 - 1e-9), axis=1)
    nodes[inside] += np.random.default_rng(1).uniform(-0.05, 0.05, (int(inside.sum()), 2))
    nodes[:, 0] += 0.2 * nodes[:, 1]  # one diagonal of each cell is the shorter one
    cloud = Cloud(nodes, triangulation(nodes, 1.0))
    x = nodes[cloud.simplices].mean(axis=1)
    linear = Linear().build(cloud, len(x), True).evaluate(x).matrix(len(nodes))
    errors = []
    for gamma in (10.0, 20.0, 40.0, 80.0):
        settings = {"gamma": gamma, "tolerance": 1e-12}
        basis = registry.get("basis", "lme")(**settings).build(cloud, len(x), False)
        errors.append(np.abs(basis.evaluate(x).matrix(len(nodes)) - linear).max(axis=1))
    largest = np.max(errors, axis=1)
    assert largest[0] > 1e-2 and largest[-1] < 1e-3, largest
    assert np.all(largest[1:] < 0.5 * largest[:-1]), largest


def test_unified_with_fixed_nodes_is_mpm_with_splines_and_consistent_mass() -> None:
    unified = run("bar_fixed_ends", "unified", "bspline", method__nodes="fixed", **BAR)
    mpm = run("bar_fixed_ends", "mpm", "bspline", method__mass="consistent", **BAR)
    assert all(np.array_equal(unified[name], mpm[name]) for name in FIELDS)


def block(amplitude: float, **choices: Any) -> Particles:
    """A free block on a line that starts with a velocity of the space of finite elements."""

    def velocity(x: np.ndarray) -> np.ndarray:
        return amplitude * np.sin(4.0 * x)

    state = MethodCase(Explicit(mass="consistent", **choices), 1).block(velocity)
    p, nodes = state.particles, state.basis.nodes
    p.v[:] = state.basis.evaluate(p.x).matrix(len(nodes)) @ velocity(nodes)
    solution = simulate(state, 5e-4, 0.02)
    assert solution.status == "ok", solution.reason
    return p


def difference(amplitude: float, nodes: str) -> float:
    """How far particles are from those of finite elements, of the largest value of each field."""
    particles = block(amplitude, nodes=nodes)
    elements = block(amplitude, nodes="moving", transfer="nodal")
    rest = {"x": elements.X, "F": 1.0, "sigma": 0.0}
    errors = []
    for name, zero in rest.items():
        given, expected = getattr(particles, name), getattr(elements, name)
        errors.append(np.abs(given - expected).max() / np.abs(expected - zero).max())
    return float(max(errors))


def test_linear_functions_that_move_are_finite_elements() -> None:
    """Velocities go to particles and back: with a consistent mass, nothing is lost on the way."""
    assert difference(1.0, "moving") < 1e-10


def test_mpm_without_crossing_approaches_finite_elements_with_its_particles() -> None:
    """At first order in the displacement, by which particles move through their cells."""
    large, small = (difference(amplitude, "fixed") for amplitude in (1e-2, 1e-3))
    assert small < 1e-2
    assert large / small == pytest.approx(10.0, rel=0.1)
