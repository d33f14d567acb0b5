"""Light nodes: what they are, and that every mass matrix with them is ``T^T M T`` and nothing else."""

from typing import Any

import numpy as np
import pytest

from mpmbench.core import registry
from mpmbench.core.geometry import Box
from mpmbench.core.loops.explicit import Explicit
from mpmbench.core.matrix.band import BandMass, factorise
from mpmbench.core.matrix.light import LightNodes
from mpmbench.core.matrix.mass import LumpedMass, make_mass
from mpmbench.core.matrix.sparse import DirectMass, SparseMass
from mpmbench.core.particles import SEEN, Particles
from mpmbench.core.transfer.sums import p2g_mass
from tests.support import slow_if

CUTOFF = 0.02


def scene(dimension: int = 1, basis: str = "linear", heavy: float = 1.0) -> tuple[Any, Particles]:
    """Particles that fill the middle of a grid and reach a little into the cells around it."""
    rng = np.random.default_rng(2)
    box = Box((0.0,) * dimension, (8.0,) * dimension, (8,) * dimension)
    X = rng.uniform(2.0, 5.0, (40**dimension if dimension == 1 else 400, dimension))
    X = np.vstack([X, np.full(dimension, 5.0 + 1e-3), np.full(dimension, 2.0 - 1e-3)])
    p = Particles.at_rest(X, rng.uniform(0.5, 1.0, len(X)), 1.0)
    p.m[0] *= heavy
    functions = registry.get("basis", basis)().build(box, len(X), False)
    functions.locate(p.x)
    return functions, p


def row_sums(basis: Any, p: Particles) -> np.ndarray:
    m_i = np.zeros(len(basis.nodes))
    p2g_mass(basis.handle, p.x, p.m, m_i)
    return m_i


def dense(basis: Any, p: Particles) -> np.ndarray:
    phi = basis.evaluate(p.x).matrix(len(basis.nodes))
    return phi.T @ (p.m[:, None] * phi)


def expected(
    basis: Any, p: Particles, M: np.ndarray, fixed: np.ndarray, rhs: np.ndarray
) -> np.ndarray:
    """The solution of ``T^T M T z = T^T f`` by dense algebra, with T from its definition."""
    phi = basis.evaluate(p.x).matrix(len(basis.nodes))
    sees = phi != 0.0
    heaviest = np.where(sees, p.m[:, None], 0.0).max(axis=0)
    light = sees.any(axis=0) & ~(np.diag(M) > CUTOFF * heaviest) & ~fixed.all(axis=1)
    assert light.any()
    T = np.diag(1.0 - light)
    for l in np.flatnonzero(light):
        share = (p.m[:, None] * np.abs(phi))[sees[:, l]].sum(axis=0) * ~light
        T[l] = share / share.sum()
    out, system = np.zeros_like(rhs), T.T @ M @ T
    if not np.any(M - np.diag(np.diag(M))):
        system = np.diag(system.sum(axis=1))  # lumped again
    for d in range(rhs.shape[1]):
        kept, force = sees.any(axis=0) & ~light & ~fixed[:, d], T.T @ rhs[:, d]
        out[kept, d] = np.linalg.solve(system[np.ix_(kept, kept)], force[kept])
        out[:, d] = np.where(fixed[:, d], 0.0, T @ out[:, d])
    return out


# on a line a consistent mass is a band: the others are compiled there for this test alone, and in a plane for both
# bases, of which hats are asked here; tests/problems/test_plate_axis_aligned.py has a sparse mass with splines
KINDS = [
    slow_if(
        kind in (SparseMass, DirectMass) and (dimension, basis) != (2, "linear"),
        kind,
        dimension,
        basis,
    )
    for kind in (LumpedMass, BandMass, SparseMass, DirectMass)
    for dimension in (1, 2)
    for basis in ("linear", "bspline")
]


@pytest.mark.parametrize(("kind", "dimension", "basis"), KINDS)
def test_every_mass_matrix_hands_light_nodes_over(kind: Any, dimension: int, basis: str) -> None:
    functions, p = scene(dimension, basis)
    fixed = np.zeros(functions.nodes.shape, dtype=bool)
    fixed[np.all(np.abs(functions.nodes - 3.0) < 0.1, axis=1)] = True
    mass = kind(fixed, LightNodes(CUTOFF, fixed))
    m_i = row_sums(functions, p)
    mass.assemble(functions, p, m_i)
    rhs = np.random.default_rng(0).standard_normal(fixed.shape)
    M = np.diag(m_i) if kind is LumpedMass else dense(functions, p)
    before, out = rhs.copy(), np.zeros_like(rhs)
    mass.solve(rhs, out)
    assert np.array_equal(rhs, before)
    assert out == pytest.approx(expected(functions, p, M, fixed, rhs), rel=1e-8, abs=1e-8)


def test_momentum_is_handed_over_and_not_lost() -> None:
    functions, p = scene(2)
    m_i = row_sums(functions, p)
    fixed = np.zeros(functions.nodes.shape, dtype=bool)
    nodes = LightNodes(CUTOFF, fixed)
    assert nodes.find(functions, p, m_i, m_i)
    f = np.random.default_rng(1).standard_normal(fixed.shape)
    assert nodes.gather(f.copy()).sum(axis=0) == pytest.approx(f.sum(axis=0), rel=1e-12)
    assert nodes.gather(m_i.copy()).sum() == pytest.approx(m_i.sum(), rel=1e-14)
    ones = np.ones_like(f)
    ones[nodes.light] = 7.0
    assert nodes.scatter(ones) == pytest.approx(1.0, rel=1e-14)


def test_the_heaviest_particle_that_sees_a_node_decides() -> None:
    """Not the first one: a heavy particle far away makes no node light."""
    for heavy in (1.0, 1e4):
        functions, p = scene(1, heavy=heavy)
        m_i = row_sums(functions, p)
        nodes = LightNodes(CUTOFF, np.zeros(functions.nodes.shape, dtype=bool))
        nodes.find(functions, p, m_i, m_i)
        # the far corners of the outermost particles, whatever the first one weighs
        assert np.flatnonzero(nodes.light).tolist() == [1, 6]


def test_a_node_that_is_seen_without_mass_follows_even_without_a_cut_off() -> None:
    """A particle exactly on an edge sees the far node of its cell with weight zero."""
    box = Box((0.0,), (4.0,), (4,))
    p = Particles.at_rest(np.array([[2.0]]), np.array([1.0]), 1.0)
    functions = registry.get("basis", "linear")().build(box, 1, False)
    m_i = row_sums(functions, p)
    assert list(m_i) == [0.0, 0.0, 1.0, SEEN, 0.0]
    nodes = LightNodes(0.0, np.zeros((5, 1), dtype=bool))
    assert nodes.find(functions, p, m_i, m_i)
    z = np.array([[9.0], [9.0], [2.0], [9.0], [9.0]])
    assert nodes.scatter(z)[:, 0].tolist() == [9.0, 9.0, 2.0, 2.0, 9.0]


def test_points_without_mass_choose_neighbours_only_where_no_particle_does() -> None:
    box = Box((0.0,), (4.0,), (4,))
    X, tracers = np.array([[1.5], [1.9999]]), np.array([[2.5], [1.2]])
    p = Particles.at_rest(X, np.ones(2), 1.0, tracers)
    functions = registry.get("basis", "linear")().build(box, 4, False)
    m_i = row_sums(functions, p)
    nodes = LightNodes(1e-6, np.zeros((5, 1), dtype=bool))
    assert nodes.find(functions, p, m_i, m_i)
    assert np.flatnonzero(nodes.light).tolist() == [3]  # only the tracer at 2.5 m sees it
    assert nodes.scatter(np.array([[0.0], [1.0], [5.0], [0.0], [0.0]]))[3, 0] == 5.0


def test_a_neighbour_whose_function_is_zero_at_the_only_point_leads_nobody() -> None:
    """A massless point on a node without mass, in the cell of one that has some: its weight was 0 over 0."""
    box = Box((0.0,), (8.0,), (8,))
    p = Particles.at_rest(np.array([[4.5]]), np.ones(1), 1.0, np.array([[3.0]]))
    functions = registry.get("basis", "linear")().build(box, 2, False)
    functions.locate(p.x)
    fixed = np.zeros(functions.nodes.shape, dtype=bool)
    mass = LumpedMass(fixed, LightNodes(CUTOFF, fixed))
    mass.assemble(functions, p, row_sums(functions, p))
    assert not mass.light_nodes.light.any()
    out = np.zeros_like(fixed, dtype=float)
    mass.solve(np.eye(9)[:, 4:5], out)
    assert np.array_equal(np.flatnonzero(out), [4]) and np.isfinite(out).all()


def test_held_nodes_are_not_light() -> None:
    functions, p = scene(1)
    m_i, fixed = row_sums(functions, p), np.zeros(functions.nodes.shape, dtype=bool)
    fixed[[1, 6]] = True
    nodes = LightNodes(CUTOFF, fixed)
    assert not nodes.find(functions, p, m_i, m_i)
    assert not nodes.light.any()


@pytest.mark.parametrize(("mass", "order"), (("lumped", 1.0), ("consistent", 2.0)))
def test_the_cut_off_of_a_method_is_the_share_of_a_particle(mass: str, order: float) -> None:
    """A node ten times lighter than the cut-off is light, and one ten times heavier is not."""
    cutoff = Explicit.mass_cutoff
    for share, light in ((0.1, True), (10.0, False)):
        phi = (share * cutoff) ** (1.0 / order)  # of the node at 4 m at the last particle
        p = Particles.at_rest(np.array([[1.3], [1.7], [2.5], [3.0 + phi]]), np.ones(4), 1.0)
        functions = registry.get("basis", "linear")().build(Box((0.0,), (5.0,), (5,)), 4, False)
        functions.locate(p.x)
        fixed = np.zeros((6, 1), dtype=bool)
        chosen = make_mass(Explicit(mass=mass), fixed, functions, p)
        chosen.assemble(functions, p, row_sums(functions, p))
        assert isinstance(chosen, LumpedMass if mass == "lumped" else BandMass)
        assert chosen.light_nodes.light.tolist() == [False] * 4 + [light, False]


@pytest.mark.parametrize(("pivot", "row"), ((1e-12, -1), (1e-14, 1)))
def test_a_band_is_singular_where_a_pivot_is_round_off(pivot: float, row: int) -> None:
    band = np.array([[1.0, 0.0], [1.0 + pivot, 1.0]])
    assert factorise(band, np.zeros(2, dtype=bool), np.zeros((2, 2))) == row
