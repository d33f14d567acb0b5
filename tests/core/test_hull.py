"""Maximum-entropy functions at the hull of the nodes and beyond it."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from mpmbench.core.bases.entropy.lme import LocalMaxEnt
from mpmbench.core.bases.entropy.maxent import MaxEnt
from mpmbench.core.errors import BrokeDown
from mpmbench.core.geometry import Box, Cloud
from mpmbench.core.geometry.hull import Hull


def test_hull_of_a_triangle() -> None:
    """Neither the bounding box nor the corners of the cells: facets decide."""
    rng = np.random.default_rng(2)
    barycentric = rng.dirichlet((1.0, 1.0, 1.0), 400)
    corners = np.array([[0.0, 0.0], [2.0, 0.3], [0.4, 1.0]])
    basis = LocalMaxEnt(gamma=1.0, radius=0.7).build(
        Cloud(np.vstack([corners, barycentric @ corners])), 0, True
    )
    assert basis.first_outside(rng.dirichlet((1.0, 1.0, 1.0), 300) @ corners) == -1
    for x in rng.uniform((0.0, 0.0), (2.0, 1.0), (300, 2)):
        weights = np.linalg.solve(np.vstack([corners.T, np.ones(3)]), [*x, 1.0])
        assert (basis.first_outside(x[None]) == 0) == (weights.min() < 0.0)
    beyond = np.vstack([corners.mean(axis=0), [1.3, 0.9], [0.1, 0.9]])
    assert basis.first_outside(beyond) == 1
    basis.move(np.tile([[0.3, 0.2]], (403, 1)))
    assert basis.first_outside(beyond) == 2


@pytest.mark.parametrize("settings", [MaxEnt(), LocalMaxEnt()])
@pytest.mark.parametrize("bend", [1e-2, -1e-2, 1e-3, -1e-3, 1e-4, -1e-4])
def test_gradients_have_no_bound_where_nodes_hardly_bend_the_hull(
    settings: MaxEnt | LocalMaxEnt, bend: float
) -> None:
    """One node is off the straight edge by `bend` spacings, and takes a point on it along.

    A node on the edge has a value of 0.7 there, a corner one of 1: a step within the bend.
    """
    nodes = Box((0.0, 0.0), (4.0, 4.0), (4, 4)).nodes()
    middle = 14
    phi = settings.build(Cloud(nodes, spacing=1.0), 1, True).evaluate(nodes[[middle]]).matrix(25)
    nodes[middle, 1] += bend
    basis = settings.build(Cloud(nodes, spacing=1.0), 1, True)
    x = phi @ nodes
    slope = basis.evaluate(x).gradient_matrix(25)[0, middle, 1]
    assert 0.05 < slope * bend < 0.15
    step = np.array([[0.0, 1e-5 * abs(bend)]])
    above, below = (basis.evaluate(x + side * step).matrix(25)[0, middle] for side in (1, -1))
    assert slope == pytest.approx((above - below) / (2.0 * step[0, 1]), rel=1e-3)


def test_nodes_that_do_not_surround_a_point() -> None:
    """A gap in the cloud: inside the hull of all nodes, outside that of those whose supports reach."""
    nodes = np.array([0.0, 0.1, 0.2, 0.3, 0.9, 1.0, 1.1, 1.2])[:, None]
    basis = MaxEnt().build(Cloud(nodes), 0, False)
    assert basis.first_outside(np.array([[0.6]])) == -1
    with pytest.raises(BrokeDown, match="outside the hull of the 0 nodes"):
        basis.evaluate(np.array([[0.6]]))
    with pytest.raises(BrokeDown, match="outside the hull of the 1 nodes"):
        basis.evaluate(np.array([[0.45]]))
    with pytest.raises(BrokeDown, match="outside the hull of the 2 nodes"):
        basis.evaluate(np.array([[0.35]]))


def test_edges_in_the_plane_are_those_of_qhull() -> None:
    """Of scattered nodes and of a lattice, whose sides have nodes on them."""
    rng = np.random.default_rng(5)
    lattice = Box((0.0, 0.0), (3.0, 2.0), (6, 4)).nodes()
    turned = lattice @ np.array([[0.8, 0.6], [-0.6, 0.8]])
    for nodes in (rng.standard_normal((200, 2)), lattice, turned, lattice[::-1], lattice[:, ::-1]):
        hull, other = Hull(np.ascontiguousarray(nodes)), ConvexHull(nodes)
        x = nodes.mean(axis=0) + 1.5 * rng.uniform(-1.0, 1.0, (400, 2)) * np.ptp(nodes, axis=0)
        outside = (other.equations @ np.column_stack([x, np.ones(400)]).T > 0.0).any(axis=0)
        assert [hull.first_outside(one[None]) == 0 for one in x] == outside.tolist()
        assert 0 < outside.sum() < 400 and hull.first_outside(nodes) == -1
    for flat in (np.outer(np.arange(4.0), [1.0, 2.0]), np.zeros((3, 2))):
        with pytest.raises(BrokeDown, match="line or plane"):
            Hull(flat)


def test_lists_of_cells_hold_until_nodes_have_moved_far() -> None:
    """With the bits of functions whose nodes were listed just now."""
    rng = np.random.default_rng(6)
    nodes = Box((0.0, 0.0), (6.0, 6.0), (6, 6)).nodes()
    basis = LocalMaxEnt().build(Cloud(nodes, spacing=1.0), 0, True)
    kept = []
    for size in (0.01, 0.01, 0.01, 0.3, 1e-4):
        before = basis.cloud.buckets.lower.copy()
        step = rng.uniform(-size, size, nodes.shape)
        basis.move(step)
        kept.append(np.array_equal(before, basis.cloud.buckets.lower))
        x = rng.dirichlet(np.ones(49), 30) @ basis.nodes
        x[0], x[1] = basis.nodes[0] * 0.999 + 0.001 * x[0], basis.nodes[-1] * 0.999 + 0.001 * x[1]
        fresh = LocalMaxEnt().build(Cloud(basis.nodes.copy(), spacing=1.0), 0, True)
        ours, theirs = basis.evaluate(x), fresh.evaluate(x)
        assert np.array_equal(ours.matrix(49), theirs.matrix(49))
        assert np.array_equal(ours.size, theirs.size)
    assert kept == [True, True, True, False, True]


def test_points_on_the_hull_start_where_they_ended() -> None:
    """With fewer steps and the same functions; also when they have left it, or come onto it."""
    nodes = Box((0.0, 0.0), (4.0, 4.0), (4, 4)).nodes()
    x = np.array([[0.0, 0.3], [2.6, 4.0], [0.0, 0.0], [1.3, 0.7], [3.9, 2.2]])
    basis = LocalMaxEnt().build(Cloud(nodes, spacing=1.0), len(x), True)
    steps = []
    for shift in (0.0, 1e-4, 0.0, 0.3, 0.0):
        places = x + shift * np.sign(2.0 - x)
        basis.locate(places)
        steps.append(basis.iterations.copy())
        fresh = basis.evaluate(places)
        assert np.allclose(basis.handle.matrix(25), fresh.matrix(25), atol=1e-11)
        inner = basis.handle.gradient_matrix(25)[3:] - fresh.gradient_matrix(25)[3:]
        assert np.abs(inner).max() < 1e-10
    basis.locate(x)
    assert (basis.iterations[:3] < 0.7 * steps[0][:3]).all() and (steps[0][:3] > 10).all()
