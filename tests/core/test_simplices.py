"""Linear functions on triangulations that move."""

import numpy as np
import pytest

from mpmbench.core.bases.cells.simplices import MovingSimplices
from mpmbench.core.bases.grid.linear import Linear
from mpmbench.core.errors import BrokeDown, NotApplicable
from mpmbench.core.geometry import Box, Cloud
from mpmbench.core.geometry.triangulate import jittered, triangulation


def make(dim: int) -> tuple[MovingSimplices, np.ndarray]:
    nodes = Box((0.0,) * dim, (1.0,) * dim, (4,) * dim).points
    nodes = jittered(nodes, 0.25, 0.2, (nodes < 1e-9) | (nodes > 1.0 - 1e-9), 5)
    cloud = Cloud(nodes, triangulation(nodes, 1.0))
    assert cloud.simplices is not None
    weights = np.random.default_rng(0).dirichlet(np.full(dim + 1, 4.0), len(cloud.simplices))
    x = np.einsum("sk,skd->sd", weights, nodes[cloud.simplices])
    basis = Linear().build(cloud, len(x), True)
    assert isinstance(basis, MovingSimplices)
    return basis, x


@pytest.mark.parametrize("dim", (1, 2, 3))
def test_functions_move_with_their_nodes(dim: int) -> None:
    """Complete before and after a motion, values constant along it, gradients those of functions found anew."""
    basis, x = make(dim)
    n = len(basis.nodes)
    basis.locate(x)
    before = basis.handle.matrix(n).copy()
    basis.move(0.03 * np.sin(3.0 * basis.nodes))
    moved = before @ basis.nodes
    basis.locate(moved)
    assert np.array_equal(basis.handle.matrix(n), before)
    assert before.min() > -1e-9
    assert np.abs(before.sum(axis=1) - 1.0).max() < 1e-14
    gradient = basis.handle.gradient_matrix(n)
    assert np.abs(np.einsum("pid,ie->ped", gradient, basis.nodes) - np.eye(dim)).max() < 1e-12
    fresh = basis.evaluate(moved)
    assert np.abs(fresh.matrix(n) - before).max() < 1e-12
    assert np.abs(fresh.gradient_matrix(n) - gradient).max() < 1e-10


def test_a_simplex_turned_inside_out_ends_the_run() -> None:
    basis, x = make(2)
    basis.locate(x)
    basis.move(-2.0 * basis.nodes * np.array([1.0, 0.0]))
    with pytest.raises(BrokeDown, match="inside out"):
        basis.locate(x)


def test_points_outside_and_sets_without_simplices_are_refused() -> None:
    basis, x = make(2)
    with pytest.raises(BrokeDown, match="outside all simplices"):
        basis.evaluate(np.array([[1.5, 0.5]]))
    with pytest.raises(NotApplicable, match="triangulation"):
        Linear().build(Cloud(basis.nodes), len(x), True)
