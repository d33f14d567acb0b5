"""Convected domains on a mesh: those of cpdi in affine motions, linear fields, and no gaps in any other motion."""

import numpy as np
import pytest

from mpmbench.case import build, read
from mpmbench.core import registry
from mpmbench.core.bases import Basis
from mpmbench.core.bases.grid.cpdi2 import MeshedDomains
from mpmbench.core.errors import BrokeDown
from mpmbench.core.geometry import Box
from mpmbench.core.particles import Particles, seed_cells
from tests.core.support import compose

# each is compiled anew; the bar runs in 1D
DIMENSIONS = [2, *(pytest.param(dim, marks=pytest.mark.slow) for dim in (1, 3))]


def block(dim: int, name: str) -> tuple[Particles, Basis, Box]:
    """Two cells of 2^dim particles along each axis in the middle of a grid of six, and a point without mass."""
    grid = Box((0.0,) * dim, (6.0, 3.0, 1.5)[:dim], (6,) * dim)
    X, V0 = seed_cells(Box(tuple(2 * grid.spacing), tuple(4 * grid.spacing), (2,) * dim), 2**dim)
    p = Particles.at_rest(X, V0, 1.0, X[:1] + 0.01)
    basis = registry.get("basis", name)().build(grid, len(p.x), False)
    basis.follow(p)
    basis.locate(p.x)
    return p, basis, grid


@pytest.mark.parametrize("dim", DIMENSIONS)
def test_affine_motions_are_those_of_cpdi_and_exact(dim: int) -> None:
    """Three steps of motions that differ, with F and places of the particles by the same motions."""
    rng = np.random.default_rng(dim)
    (p, cpdi, _), (q, cpdi2, _) = block(dim, "cpdi"), block(dim, "cpdi2")
    n, solid = len(cpdi.nodes), p.material
    for _ in range(3):
        L, v = rng.uniform(-1, 1, (dim, dim)), rng.uniform(-0.1, 0.1, dim)
        cpdi2.carry(cpdi.nodes @ L.T + v, 0.1)
        for one in (p, q):
            one.x += 0.1 * (one.x @ L.T + v)
            one.F[solid] = (np.eye(dim) + 0.1 * L) @ one.F[solid]
    p.F[solid.stop :] = p.F[0]
    cpdi.locate(p.x)
    cpdi2.locate(q.x)
    for take in ("matrix", "gradient_matrix"):
        a, b = (getattr(basis.handle, take)(n)[solid] for basis in (cpdi, cpdi2))
        assert np.abs(a - b).max() < 1e-13 * np.abs(a).max()
    phi = cpdi2.handle.matrix(n)
    assert np.abs(phi @ cpdi2.nodes - q.x).max() < 1e-9
    assert np.abs(phi[solid] @ cpdi2.nodes - q.x[solid]).max() < 1e-14
    one = cpdi2.evaluate_particles(q.x, np.array([1]))
    assert np.array_equal(one.matrix(n), phi[[1]])


@pytest.mark.parametrize("dim", DIMENSIONS)
def test_a_body_stays_whole_in_any_motion(dim: int) -> None:
    """``sum_p V_p grad phi_i`` vanishes inside, V_p those of the domains, which fill what they filled."""
    p, basis, grid = block(dim, "cpdi2")
    solid, n = p.material, len(basis.nodes)
    rim = np.any((basis.nodes < 2.01 * grid.spacing) | (basis.nodes > 3.99 * grid.spacing), axis=1)
    v = np.where(rim[:, None], 0.0, np.random.default_rng(1).uniform(-1, 1, (n, dim)))
    basis.carry(v * grid.spacing, 0.3)
    basis.locate(p.x)
    corner = basis._corner[basis._domain[solid]]  # type: ignore[attr-defined]
    moved = np.abs(np.diff(np.ptp(corner, axis=1), axis=0)).max()
    assert moved > 0.05  # domains differ
    gradient, phi = basis.handle.gradient_matrix(n)[solid], basis.handle.matrix(n)[solid]
    assert np.abs(phi.sum(axis=1) - 1.0).max() < 1e-14
    assert np.abs(np.einsum("pia,ib->pab", gradient, basis.nodes) - np.eye(dim)).max() < 1e-12
    V = volumes(corner)
    assert V.sum() == pytest.approx(np.prod(2 * grid.spacing), rel=1e-14)
    left = np.einsum("p,pia->ia", V, gradient)
    assert np.abs(left[~rim]).max() < 1e-14 and np.abs(left).max() > 1e-2


def volumes(corner: np.ndarray) -> np.ndarray:
    """Of domains with corners of shape (n, 2^dim, dim), by three Gauss points along each axis."""
    dim = corner.shape[2]
    if dim == 1:
        return corner[:, 1, 0] - corner[:, 0, 0]
    point, weight = np.polynomial.legendre.leggauss(3)
    t = np.stack(np.meshgrid(*[point] * dim, indexing="ij"), axis=-1).reshape(-1, dim)
    w = np.prod(np.stack(np.meshgrid(*[weight] * dim, indexing="ij"), axis=-1), axis=-1).ravel()
    total = np.zeros(len(corner))
    for place, share in zip(t, w, strict=True):
        J = np.zeros((len(corner), dim, dim))
        for c in range(2**dim):
            sign = np.array([2.0 * ((c >> a) & 1) - 1.0 for a in range(dim)])
            for e in range(dim):
                others = np.delete(0.5 * (1.0 + sign * place), e).prod()
                J[:, :, e] += corner[:, c] * 0.5 * sign[e] * others
        total += share * np.linalg.det(J)
    return total


def test_a_domain_that_turns_inside_out_ends_the_run() -> None:
    p, basis, _ = block(1, "cpdi2")
    basis.carry(-4.0 * basis.nodes, 0.3)
    with pytest.raises(BrokeDown, match="particle 0 has no volume"):
        basis.locate(p.x)


def test_corners_follow_the_particles_of_a_bar() -> None:
    """In 40 steps of a wave to a percent of the way; F, which is another measure of it, differs by as little."""
    config = compose("bar_fixed_ends", "mpm", "cpdi2", resolution=16)
    state = build(read(config))
    p, basis = state.particles, state.basis
    assert isinstance(basis, MeshedDomains)
    first = basis._corner[basis._domain]
    for _ in range(40):
        state.choices.step(state, config["time_step"])
    corner = basis._corner[basis._domain]
    way = p.x - p.X
    assert np.abs(way).max() > 1e-4
    difference = (corner - first).mean(axis=1) - way
    assert 0.0 < np.abs(difference).max() < 0.01 * np.abs(way).max()
    stretch = np.ptp(corner, axis=1) / np.ptp(first, axis=1) - 1.0
    strain = p.F[:, 0, 0] - 1.0
    assert np.abs(stretch[:, 0] - strain)[p.material].max() < 0.05 * np.abs(strain).max()
