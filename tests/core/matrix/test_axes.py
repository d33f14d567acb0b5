"""The product of the masses along the axes as a guess at the mass: the same solution, in fewer iterations."""

from typing import Any

import numpy as np
import pytest

from mpmbench.core import registry
from mpmbench.core.geometry import Box, tensor_points
from mpmbench.core.matrix.axes import conjugate_gradients_by_axes, factorised
from mpmbench.core.matrix.light import LightNodes
from mpmbench.core.matrix.sparse import SparseMass
from mpmbench.core.particles import Particles
from mpmbench.core.transfer.sums import p2g_mass
from tests.support import slow_if


def mass_of(
    degree: int, X: np.ndarray, cells: int, fixed: Any, light: Any = False
) -> tuple[SparseMass, np.ndarray]:
    """The mass of particles on the unit square or cube, and all of it as a dense matrix."""
    dim = X.shape[1]
    box = Box((0.0,) * dim, (1.0,) * dim, (cells,) * dim)
    basis = registry.get("basis", "bspline")(degree=degree).build(box, len(X), False)
    p = Particles.at_rest(X, np.where(light, 1e-3, np.ones(len(X))) / len(X), 1000.0)
    mass = SparseMass(fixed(basis.nodes), LightNodes(0.0, fixed(basis.nodes)))
    m_i = np.zeros(len(basis.nodes))
    p2g_mass(basis.handle, p.x, p.m, m_i)
    mass.assemble(basis, p, m_i)
    phi = basis.evaluate(p.x).matrix(len(basis.nodes))
    return mass, phi.T @ (p.m[:, None] * phi)


def rollers(nodes: np.ndarray) -> np.ndarray:
    """Each component is held on both sides across it, and on single nodes elsewhere."""
    fixed = (nodes < 1e-9) | (nodes > 1.0 - 1e-9)
    fixed[:: max(2, len(nodes) // 3), 0] = True
    return fixed


def lattice(dim: int, cells: int) -> np.ndarray:
    return tensor_points([(np.arange(3 * cells) + 0.5) / (3 * cells)] * dim)


@pytest.mark.parametrize("body", ("whole", "ball", "random"))
@pytest.mark.parametrize(  # each degree and dimension is compiled anew
    ("degree", "dim", "cells"),
    ((1, 2, 9), (2, 2, 8), slow_if(True, 3, 2, 5), slow_if(True, 2, 3, 3)),
)
def test_solutions_are_those_of_the_matrix(body: str, degree: int, dim: int, cells: int) -> None:
    X = lattice(dim, cells)
    if body == "ball":
        X = X[np.linalg.norm(X - 0.45, axis=1) < 0.42]
    elif body == "random":
        X = X[np.random.default_rng(1).random(len(X)) < 0.6]
    mass, M = mass_of(degree, X, cells, rollers)
    assert mass._by_axes
    rhs = np.random.default_rng(2).uniform(-1.0, 1.0, mass.fixed.shape)
    out = np.where(mass.fixed, 0.5, 7.0)  # known where held, and to be written elsewhere
    mass.solve(rhs, out)
    assert mass._by_axes  # no other way was needed
    for d in range(dim):
        free, held = mass.free[:, d], mass.fixed[:, d]
        assert free.any() and held.any()
        wanted = rhs[free, d] - 0.5 * M[free][:, held].sum(axis=1)
        found = M[free][:, free] @ out[free, d]
        assert np.abs(found - wanted).max() < 1e-9 * np.abs(wanted).max()
        assert (out[held, d] == 0.5).all()


def iterations(mass: SparseMass) -> int:
    rhs = np.random.default_rng(2).uniform(-1.0, 1.0, mass.fixed.shape)
    rows = mass._axes, mass.columns, mass.values, mass.free
    out, dim = np.zeros(mass.fixed.shape), rhs.shape[1]
    room = [part.reshape(dim, -1)[0] for part in mass._work]
    each = (conjugate_gradients_by_axes(c, *rows, rhs, out, *room) for c in range(dim))
    return int(max(each))


@pytest.mark.slow  # one of them in space; iterations are counted below, too
def test_a_full_grid_needs_one_iteration() -> None:
    """Also where whole lines are held; single nodes in them cost some more."""

    def sides(nodes: np.ndarray) -> np.ndarray:
        return (nodes < 1e-9) | (nodes > 1.0 - 1e-9)

    assert iterations(mass_of(2, lattice(2, 8), 8, sides)[0]) == 1
    assert iterations(mass_of(2, lattice(3, 3), 3, sides)[0]) == 1
    assert 1 < iterations(mass_of(2, lattice(2, 8), 8, rollers)[0]) < 20


def test_a_density_that_varies_is_scaled_away() -> None:
    """Light material around a ball: unscaled it takes twice as many iterations."""
    X = lattice(2, 12)
    light = np.linalg.norm(X - 0.5, axis=1) > 0.4
    mass, _ = mass_of(1, X, 12, lambda nodes: np.zeros(nodes.shape, dtype=bool), light)
    scaled = iterations(mass)
    assert mass._axes is not None
    mass._axes.scale[:] = 1.0
    assert 1 < 2 * scaled < iterations(mass)


def test_what_the_axes_cannot_do_is_left_to_gauss_and_seidel() -> None:
    """Factors of nothing are refused, and a guess that leads nowhere is given up."""
    mass, _ = mass_of(2, lattice(2, 6), 6, rollers)
    rhs = np.random.default_rng(2).uniform(-1.0, 1.0, mass.fixed.shape)
    by_axes, by_sweeps = np.zeros(rhs.shape), np.zeros(rhs.shape)
    mass.solve(rhs, by_axes)
    assert mass._axes is not None and mass._by_axes
    mass._axes.scale[:] = np.nan
    mass.solve(rhs, by_sweeps)
    assert not mass._by_axes
    assert 0.0 < np.abs(by_axes - by_sweeps).max() < 1e-9 * np.abs(by_axes).max()
    mass.values[:] = 0.0
    assert not factorised(mass._axes, mass.values, mass.diagonal, mass.free)
