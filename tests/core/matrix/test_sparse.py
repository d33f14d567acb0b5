"""The sparse consistent mass matrix of bases that bring a handle of their own."""

from typing import NamedTuple

import numpy as np
from numba import njit

from mpmbench.core.bases.grid.bspline import BSpline
from mpmbench.core.bases.handle import Stencils, place
from mpmbench.core.geometry import Box
from mpmbench.core.matrix.light import LightNodes
from mpmbench.core.matrix.sparse import SparseMass, pattern
from mpmbench.core.particles import Particles


class OwnHandle(NamedTuple):
    """A handle that the package does not know."""

    axes: tuple[float, float]


class OwnBasis:
    """Quadratic splines behind a handle of their own."""

    def __init__(self) -> None:
        self._splines = BSpline().build(Box((0.0, 0.0), (1.0, 1.0), (5, 4)), 1, False)
        self.nodes = self._splines.nodes
        self.handle = OwnHandle((0.0, 0.0))

    def evaluate(self, x: np.ndarray) -> Stencils:
        return self._splines.evaluate(x)


def test_pairs_come_from_the_functions_at_the_particles() -> None:
    basis = OwnBasis()
    x = np.random.default_rng(3).uniform(0.0, 1.0, (9, 2))
    columns, diagonal = pattern(basis, x)  # type: ignore[arg-type]
    seen = basis.evaluate(x).matrix(len(basis.nodes)) > 0.0
    pairs = (seen.T.astype(int) @ seen > 0) | np.eye(len(basis.nodes), dtype=bool)
    for i, row in enumerate(columns):
        assert set(np.flatnonzero(pairs[i])) <= set(row)
        assert columns[i, diagonal[i]] == i


def test_places_are_searched_for_where_a_handle_does_not_say() -> None:
    columns = np.array([[1, 4, 6, 9], [0, 2, 9, 9]])

    @njit
    def place_of(handle, row, column):  # type: ignore[no-untyped-def]
        return place(handle, columns, row, 0, column, 0)

    handle = OwnHandle((0.0, 0.0))
    assert [place_of(handle, 0, j) for j in (1, 6, 9, 5)] == [0, 2, 3, -1]
    assert [place_of(handle, 1, j) for j in (2, 9, 1)] == [1, 2, -1]


def test_the_sum_over_cells_is_that_over_particles() -> None:
    """``M = sum_p m_p phi_i phi_j`` of particles of different masses, some alone in their cell."""
    basis = BSpline().build(Box((0.0, 0.0), (1.0, 1.0), (3, 4)), 1, False)
    random = np.random.default_rng(7)
    p = Particles.at_rest(random.uniform(0.0, 1.0, (60, 2)), np.full(60, 1.0 / 60.0), 1.0)
    p.m[:] = random.uniform(0.5, 1.5, 60)
    fixed = np.zeros((len(basis.nodes), 2), dtype=bool)
    mass = SparseMass(fixed, LightNodes(0.0, fixed))
    phi = basis.evaluate(p.x).matrix(len(basis.nodes))
    mass.assemble(basis, p, phi.T @ p.m)
    a = random.standard_normal(fixed.shape)
    np.testing.assert_allclose(mass.multiply(a), phi.T @ (p.m[:, None] * (phi @ a)), atol=1e-14)
