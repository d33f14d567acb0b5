"""Stabilised conforming nodal integration: cells, what they integrate exactly, the patch test, order, refusals."""

from typing import Any

import numpy as np
import pytest

from mpmbench import case
from mpmbench.analysis.slopes import fitted_order
from mpmbench.core.bases.clouds.rkpm import ReproducingKernel
from mpmbench.core.bases.conforming import ConformingGradients
from mpmbench.core.errors import NotApplicable
from mpmbench.core.geometry import Cloud, tensor_points
from mpmbench.core.geometry.voronoi import outline, voronoi_cells
from mpmbench.core.particles import Particles
from tests.core.support import compose, run

SIDE = np.linspace(0.0, 1.0, 8)


def points(dim: int) -> np.ndarray:
    """A jittered grid on the unit interval or square, with nodes on its boundary."""
    nodes = tensor_points([SIDE] * dim)
    inner = np.all((nodes > 0.0) & (nodes < 1.0), axis=1)
    nodes[inner] += np.random.default_rng(0).uniform(-0.04, 0.04, (inner.sum(), dim))
    return nodes


def at_nodes(dim: int) -> ConformingGradients:
    nodes = points(dim)
    plugin = ReproducingKernel(relative_radius=2.2)
    basis = plugin.build(Cloud(nodes, spacing=SIDE[1]), len(nodes), True)
    conforming = ConformingGradients(basis)
    conforming.follow(Particles.at_rest(nodes, np.ones(len(nodes)), 1.0))
    return conforming


def test_a_cell_holds_what_is_nearest_to_its_point() -> None:
    """No corner is nearer to another point, each is as near to two others or at the edge, and cells fill the square."""
    x = np.random.default_rng(4).uniform(0.0, 1.0, (60, 2))
    cells = voronoi_cells(x, outline(tensor_points([np.array([0.0, 1.0])] * 2)))
    assert cells.volumes.sum() == pytest.approx(1.0, rel=1e-13) and np.all(cells.volumes > 0.0)
    distance = np.linalg.norm(cells.corners[:, :, None] - x, axis=3)
    own = distance[np.arange(60), :, np.arange(60)]
    assert np.all(own <= distance.min(axis=2) + 1e-12)
    as_near = (distance < own[:, :, None] + 1e-12).sum(axis=2)
    edges = np.sum((cells.corners < 1e-12) | (cells.corners > 1.0 - 1e-12), axis=2)
    assert np.all(as_near + edges >= 3)
    assert np.abs(cells.areas.sum(axis=1)).max() < 1e-14  # closed


def test_cells_that_need_more_neighbours_than_are_looked_up_first() -> None:
    """Forty points on a circle around one: its cell has forty sides."""
    angle = 2.0 * np.pi * np.arange(40) / 40
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    square = np.array([[-2.0, -2.0], [2.0, -2.0], [2.0, 2.0], [-2.0, 2.0]])
    cells = voronoi_cells(np.vstack([[[0.0, 0.0]], 1.0 * ring]), square)
    assert cells.volumes[0] == pytest.approx(40 * 0.25 * np.tan(np.pi / 40), rel=1e-12)
    assert cells.volumes.sum() == pytest.approx(16.0, rel=1e-12)


@pytest.mark.parametrize("dim", (1, 2))
def test_gradients_are_integrated_over_the_boundary_alone(dim: int) -> None:
    """``sum_L V_L grad~ phi_i`` is the integral of ``phi_i n`` over the boundary; that of derivatives is not."""
    basis, nodes = at_nodes(dim), points(dim)
    conforming = basis.evaluate_particles(nodes, np.arange(len(nodes)))
    cells = voronoi_cells(nodes, outline(nodes))
    G, D = (one.gradient_matrix(len(nodes)) for one in (conforming, basis.evaluate(nodes)))
    total, plain = (np.einsum("p,pid->id", cells.volumes, one) for one in (G, D))
    faces = np.any((cells.corners < 1e-12) | (cells.corners > 1.0 - 1e-12), axis=2)
    phi = basis.evaluate(cells.corners[faces]).matrix(len(nodes))
    outside = cells.areas.copy()  # of corners at the boundary; inside, neighbours cancel
    by_boundary = np.einsum("cd,ci->id", outside[faces], phi)
    away = np.abs(phi).max(axis=0) < 1e-14
    assert away.sum() >= 4 if dim == 2 else away.any()
    assert np.abs(total[away]).max() < 1e-15 * 10 and np.abs(plain[away]).max() > 1e-4
    if dim == 1:
        assert np.abs(total - by_boundary).max() < 1e-14
    assert np.abs(G.sum(axis=1)).max() < 1e-12  # constants, and linear fields
    assert np.abs(np.einsum("pia,ib->pab", G, nodes) - np.eye(dim)).max() < 1e-12
    assert np.array_equal(conforming.matrix(len(nodes)), basis.evaluate(nodes).matrix(len(nodes)))


def patch(basis: str, gradient: str, **changes: Any) -> float:
    """Displacement error [m] of the patch test on irregular nodes, which are the particles."""
    keys = {
        "resolution": 6,
        "problem__particle_layout": "nodes",
        "method__shape_functions": "frozen",
        "method__gradient": gradient,
        **changes,
    }
    return float(run("patch_test", "gmm", basis, **keys).error_displacement_rms)


def test_the_linear_patch_test() -> None:
    """To round-off where functions of inner nodes vanish at the boundary; else what the boundary leaves of it."""
    assert patch("lme", "conforming") < 1e-12
    assert patch("lme", "functions") > 1e-2
    assert patch("lme", "conforming", method__dirichlet="multipliers") < 1e-12
    assert patch("rkpm", "conforming") < 0.1 * patch("rkpm", "functions")


@pytest.mark.slow  # the patch test above
def test_order_on_a_column_that_is_compacted() -> None:
    """Second, as with derivatives at the same points, and less error."""
    keys = {
        "problem__particle_layout": "midpoint",
        "problem__load_steps": 10,
        "method__shape_functions": "frozen",
    }
    cells = (8, 16, 32)
    conforming, plain = (
        [
            float(
                run(
                    "compaction_column",
                    "gmm",
                    "rkpm",
                    resolution=n,
                    method__gradient=gradient,
                    **keys,
                ).error_displacement_rms
            )
            for n in cells
        ]
        for gradient in ("conforming", "functions")
    )
    assert fitted_order(1.0 / np.array(cells), np.array(conforming)) == pytest.approx(2.0, abs=0.15)
    assert np.all(np.array(conforming) < np.array(plain))


@pytest.mark.parametrize(
    ("problem", "changes", "reason"),
    [
        ("patch_test", {"method__shape_functions": "updated"}, "shape_functions=frozen"),
        ("patch_test", {"problem__particle_layout": "triangles"}, "volumes of their Voronoi cells"),
        ("compaction_column", {"particles_per_cell": 9}, "volumes of their Voronoi cells"),
        ("plate_with_hole", {}, "volumes of their Voronoi cells"),
    ],
)
def test_where_it_makes_no_sense(problem: str, changes: dict[str, Any], reason: str) -> None:
    keys = {"method__shape_functions": "frozen", "method__gradient": "conforming", **changes}
    with pytest.raises(NotApplicable, match=reason):
        case.read(compose(problem, "gmm", "rkpm", **keys))
