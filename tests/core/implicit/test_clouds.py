"""Clouds of nodes: moving least squares, truncated max-ent, their repair, and the patch test."""

import tracemalloc
from typing import Any

import numpy as np
import pytest
import xarray as xr

from mpmbench import case
from mpmbench.analysis.slopes import fitted_order
from mpmbench.core.bases.clouds.mls import MovingLeastSquares
from mpmbench.core.bases.entropy.lme import LocalMaxEnt
from mpmbench.core.bases.entropy.maxent import MaxEnt
from mpmbench.core.bases.grid.linear import Linear
from mpmbench.core.bases.handle import Stencils
from mpmbench.core.compiled import threads
from mpmbench.core.errors import BrokeDown, NotApplicable
from mpmbench.core.geometry import Box, Cloud
from mpmbench.core.geometry.triangulate import ring_mesh
from mpmbench.core.loops.static import Static
from mpmbench.core.materials.elastic.neo_hookean import NeoHookean
from mpmbench.core.particles import Particles, seed_cells
from mpmbench.core.simulation import Body, build_state, simulate
from mpmbench.core.state import Loads
from mpmbench.problems.rolling_disk import split_squares
from tests.core.support import compose
from tests.support import slow_if

CLOUDS = {
    "mls": MovingLeastSquares(),
    "mls quadratic": MovingLeastSquares(degree=2, relative_radius=2.5, weight="quartic_spline"),
    "mls with xy": MovingLeastSquares(mixed_terms=True, relative_radius=2.0),
    "mls gaussian": MovingLeastSquares(weight="gaussian", relative_radius=2.0),
    "mls six nodes": MovingLeastSquares(minimum_nodes=6),
    "lme": LocalMaxEnt(relative_radius=2.0**0.5, rim="cut"),
    "lme narrow": LocalMaxEnt(relative_radius=1.01, rim="cut"),
}


def irregular(dim: int = 2, n: int = 9) -> Cloud:
    """A jittered grid on the unit square or cube."""
    line = np.linspace(0.0, 1.0, n)
    nodes = np.stack([part.ravel() for part in np.meshgrid(*[line] * dim, indexing="ij")], axis=1)
    inner = np.all((nodes > 0.0) & (nodes < 1.0), axis=1)
    nodes[inner] += np.random.default_rng(0).uniform(-0.04, 0.04, (inner.sum(), dim))
    return Cloud(nodes, spacing=1.0 / (n - 1))


# a polynomial of degree 2 is compiled anew: it is asked on a line, and all others in a plane
QUADRATIC = "mls quadratic"
REPRODUCED = [
    slow_if(dim != (1 if name == QUADRATIC else 2), name, dim)
    for name in CLOUDS
    for dim in (1, 2, 3)
]


@pytest.mark.parametrize(("name", "dim"), REPRODUCED)
def test_reproduction(name: str, dim: int) -> None:
    """Polynomials up to the degree, and their gradients, wherever the cloud needed repair too."""
    cloud = irregular(dim, 9 if dim < 3 else 6)
    basis = CLOUDS[name].build(cloud, 1, True)
    x = 0.01 + 0.98 * np.random.default_rng(1).random((60, dim))
    stored = basis.evaluate(x)
    value, gradient = stored.matrix(len(cloud.nodes)), stored.gradient_matrix(len(cloud.nodes))
    X = basis.nodes
    assert np.allclose(value.sum(axis=1), 1.0, atol=1e-10)
    assert np.allclose(value @ X, x, atol=1e-10)
    assert np.allclose(gradient.sum(axis=1), 0.0, atol=1e-7)
    assert np.allclose(np.einsum("nia,ib->nab", gradient, X), np.eye(dim), atol=1e-7)
    exact = (value @ X[:, 0] ** 2 - x[:, 0] ** 2 <= 1e-10).all() and np.allclose(
        value @ X[:, 0] ** 2, x[:, 0] ** 2
    )
    assert exact == (name == "mls quadratic")
    if dim > 1:
        product, has_products = X[:, 0] * X[:, 1], name in ("mls with xy", "mls quadratic")
        assert np.allclose(value @ product, x[:, 0] * x[:, 1]) == has_products
        slopes = np.stack([x[:, 1], x[:, 0]], axis=1)
        found = np.einsum("nia,i->na", gradient, product)[:, :2]
        assert np.allclose(found, slopes, atol=1e-6) == has_products


def test_products_beside_degree_2_are_refused() -> None:
    """These polynomials have them, and the same run would have two names."""
    changes = {"basis__mixed_terms": True, "basis__degree": 2}
    with pytest.raises(NotApplicable, match=r"mixed_terms=true with basis\.degree=2"):
        case.read(compose("rolling_disk", "gmm", "mls", **changes))


def test_a_point_outside_the_nodes_that_carry_weight_takes_in_another() -> None:
    """A point of a shear band: five of six nodes on one side, the last one at the rim, and functions up to 10."""
    band = [
        (-0.263, 0.246),
        (-0.612, -0.176),
        (0.064, 0.715),
        (-1.004, -0.572),
        (0.337, 1.216),
        (0.989, -0.984),
    ]
    beyond = [(1.3, -0.55), (0.6, -1.4), (1.6, 0.2), (-0.9, 1.4), (-1.7, 0.3)]
    x = np.zeros((1, 2))
    few = MovingLeastSquares(minimum_nodes=6).build(Cloud(np.array(band), spacing=1.0), 1, True)
    assert np.abs(few.evaluate(x).phi).max() > 9.0  # there is no other node
    basis = MovingLeastSquares(minimum_nodes=6).build(
        Cloud(np.array(band + beyond), spacing=1.0), 1, True
    )
    basis.locate(x)
    assert basis.repaired == 1
    phi = basis.handle.phi[0, : basis.handle.size[0]]
    assert basis.handle.size[0] > 6
    assert np.abs(phi).sum() < 2.0
    assert phi @ basis.nodes[basis.handle.index[0, : len(phi)]] == pytest.approx(
        [0.0, 0.0], abs=1e-12
    )


@pytest.mark.parametrize("name", [slow_if(name == QUADRATIC, name) for name in CLOUDS])
def test_gradients_are_those_of_the_values(name: str) -> None:
    """By central differences, where the cloud is the same on both sides."""
    cloud = irregular()
    basis = CLOUDS[name].build(cloud, 1, True)
    x = 0.2 + 0.6 * np.random.default_rng(2).random((40, 2))
    stored = basis.evaluate(x)
    gradient = stored.gradient_matrix(len(cloud.nodes))
    checked = 0
    for d in range(2):
        shift = 1e-6 * np.eye(2)[d]
        up, down = basis.evaluate(x + shift), basis.evaluate(x - shift)
        same = np.array(
            [
                set(a[:i]) == set(b[:j])
                for a, b, i, j in zip(up.index, down.index, up.size, down.size, strict=True)
            ]
        )
        grown = (up.size == 6) if name == "mls six nodes" else np.zeros(len(x), dtype=bool)
        change = (up.matrix(len(cloud.nodes)) - down.matrix(len(cloud.nodes))) / 2e-6
        use = (
            same & ~grown
        )  # a radius that grows with the distance of a node is held constant in the gradient
        checked += int(use.sum())
        assert np.allclose(change[use], gradient[use][:, :, d], atol=2e-6 * np.abs(gradient).max())
    assert checked > 20


def test_failing_clouds_take_in_more_nodes() -> None:
    """A point whose nearest nodes do not surround it has no max-ent functions until they do."""
    nodes = np.array(
        [
            [0.0, 0.0],
            [0.1, 0.0],
            [0.0, 0.1],
            [0.1, 0.1],
            [0.4, 0.2],
            [0.2, 0.4],
            [0.4, 0.4],
            [-0.3, 0.0],
        ]
    )
    x = np.array([[0.14, 0.14], [0.05, 0.05]])
    basis = LocalMaxEnt(spacing=0.1, relative_radius=2.0, rim="cut").build(Cloud(nodes), 2, True)
    basis.locate(x)
    assert basis.repaired == 1
    assert basis.handle.size[0] > basis.handle.size[1] == 4
    assert np.allclose(basis.handle.matrix(8) @ nodes, x, atol=1e-9)
    almost_outside = np.array(
        [[0.1 - 1e-10, 0.05]]
    )  # of its four nearest nodes: functions exist, gradients are huge
    stored = basis.evaluate(almost_outside)
    assert stored.size[0] > 4
    assert np.abs(stored.grad_phi).max() < 100.0 / 0.1
    with pytest.raises(BrokeDown, match="no functions at point 0"):
        basis.evaluate(np.array([[5.0, 5.0]]))


def test_weights_of_far_nodes_do_not_underflow() -> None:
    """In a gap all nodes are so far away that only the ratios of their Gaussians are numbers."""
    nodes = np.array([0.0, 0.1, 0.2, 0.3, 0.9, 1.05, 1.1, 1.2])[:, None]
    basis = LocalMaxEnt(gamma=100.0, spacing=0.1, relative_radius=6.0, rim="cut").build(
        Cloud(nodes), 1, True
    )
    stored = basis.evaluate(np.array([[0.6]]))
    value = stored.matrix(8)[0]
    assert value @ nodes == pytest.approx([0.6], abs=1e-12)
    near = stored.index[0, : stored.size[0]]
    assert {3, 4} < set(near)
    assert value[[3, 4]] == pytest.approx([0.5, 0.5], abs=1e-12)  # the others are far behind


def test_minimum_cloud_grows_the_radius() -> None:
    nodes = irregular().nodes
    few, many = (MovingLeastSquares(minimum_nodes=n).build(irregular(), 1, True) for n in (0, 12))
    x = np.array([[0.01, 0.01], [0.5, 0.5]])
    assert few.evaluate(x).size[0] < 6
    assert many.evaluate(x).size.min() == 12
    assert np.allclose(many.evaluate(x).matrix(len(nodes)) @ nodes, x)


@pytest.mark.parametrize("dim", [slow_if(dim != 2, dim) for dim in (1, 2, 3)])
def test_a_cloud_holds_the_nodes_within_its_radius(dim: int) -> None:
    """Against all distances, while nodes move and the room for them grows from one node at a time."""
    nodes = irregular(dim, 9 if dim < 3 else 6)
    basis = MovingLeastSquares(relative_radius=2.0).build(nodes, 300, True)
    rng = np.random.default_rng(4)
    for step in range(40):
        room = max(1, basis.handle.width - 3 - step % 3)  # at times as many as there are
        basis.handle = Stencils.empty(300, room, dim)
        x = rng.uniform(-0.05, 1.05, (300, dim))
        basis.locate(x)
        distance = np.linalg.norm(x[:, None] - basis.nodes, axis=2)
        for p, near in enumerate(distance < basis.radius):
            found = basis.handle.index[p, : basis.handle.size[p]]
            if near.sum() == len(found):
                assert set(found) == set(np.flatnonzero(near))
            else:  # repaired
                assert set(found) > set(np.flatnonzero(near)) and len(set(found)) == len(found)
        basis.move(0.01 * rng.uniform(-1.0, 1.0, basis.nodes.shape))


@pytest.mark.parametrize("settings", (CLOUDS["mls"], LocalMaxEnt(), MaxEnt(d_max=3.0)), ids=repr)
def test_functions_are_found_anew_without_new_memory(settings: Any) -> None:
    """As in every step: Python's own objects aside, which do not grow with the number of points.

    Nodes are regular, since clouds that need repair are repaired in new memory.
    """
    x = np.random.default_rng(6).uniform(0.05, 0.95, (40_000, 2))
    basis = settings.build(Box((0.0, 0.0), (1.0, 1.0), (8, 8)), len(x), True)
    basis.locate(x)
    basis.locate(x + 1e-4)
    tracemalloc.start()
    basis.locate(x)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < len(x)  # a byte for each point would be more


def test_threads_change_no_bit_of_a_cloud() -> None:
    """Each of the three chunks works in memory of its own."""
    x = np.random.default_rng(5).uniform(0.0, 1.0, (3 * threads.SMALLEST_CHUNK, 2))
    found = []
    for n in (1, 2, 4):
        threads.use(n)
        stored = [
            settings.build(irregular(), len(x), True).evaluate(x)
            for settings in (CLOUDS["mls"], CLOUDS["lme"], LocalMaxEnt())
        ]
        found.append(b"".join(part.tobytes() for one in stored for part in one[1:]))
    threads.use(1)
    assert found[0] == found[1] == found[2]


def test_the_last_node_of_a_cloud_counts_too() -> None:
    """Two nodes are within the radius of 0.14 m, and a third is needed."""
    nodes = np.array([[0.0], [0.1], [0.4], [0.6]])
    basis = MovingLeastSquares(minimum_nodes=3).build(Cloud(nodes, spacing=0.1), 1, True)
    stored = basis.evaluate(np.array([[0.05]]))
    assert stored.size[0] == 3 and set(stored.index[0, :3]) == {0, 1, 2}
    assert np.abs(stored.phi[0, :3]).min() > 1e-6


def test_points_on_the_hull() -> None:
    """Multipliers are infinite there; only the nodes of that face count."""
    box = Box((0.0, 0.0), (1.0, 1.0), (4, 4))
    basis = LocalMaxEnt(relative_radius=2.0**0.5 * 1.001, rim="cut").build(box, 1, True)
    stored = basis.evaluate(np.array([[1.0, 0.5]]))
    on_face = basis.nodes[:, 0] > 1.0 - 1e-12
    value = stored.matrix(len(basis.nodes))[0]
    assert value[~on_face].max() < 1e-9
    assert value.sum() == pytest.approx(1.0)


def patch(method: str, basis: str, **changes: Any) -> xr.Dataset:
    result = case.solve(compose("patch_test", method, basis, **changes))
    assert result.attrs["status"] == "ok", result.attrs["reason"]
    return result


def test_patch_test() -> None:
    """Finite elements pass it; the integration error of clouds falls with the spacing, slowly, and is not zero."""
    for points in (1, 3):
        assert (
            float(patch("fem", "linear", particles_per_cell=points).error_displacement_relative)
            < 1e-12
        )
    for basis in ("mls", "lme"):
        errors = [
            float(patch("gmm", basis, resolution=n).error_displacement_relative)
            for n in (8, 16, 32)
        ]
        assert errors[0] > 5e-4
        assert fitted_order([1 / 8, 1 / 16, 1 / 32], errors) == pytest.approx(0.85, abs=0.25)


@pytest.mark.parametrize("dim", (1, 3))
@pytest.mark.parametrize("name", ("linear", "mls"))
@pytest.mark.slow  # the patch test above has the plane
def test_prescribed_stretch_in_other_dimensions(name: str, dim: int) -> None:
    """A regular bar or block between two moving ends stretches evenly; sides without load contract."""
    box = Box((0.0,) * dim, (1.0, 0.5, 0.5)[:dim], (4, 2, 2)[:dim])
    X, V0 = seed_cells(box, 2**dim, "gauss")
    material = NeoHookean(young_modulus=1e5, poisson_ratio=0.0, density=1.0)
    particles = Particles.at_rest(X, V0, 1.0)

    def fixed(x: np.ndarray) -> np.ndarray:
        ends = (x[:, 0] < 1e-9) | (x[:, 0] > 1.0 - 1e-9)
        return np.stack([ends if d == 0 else x[:, d] < 1e-9 for d in range(dim)], axis=1)

    def motion(X: np.ndarray, t: float) -> np.ndarray:
        return t * 0.2 * X * (np.arange(dim) == 0)

    settings = Linear() if name == "linear" else MovingLeastSquares()
    choices = Static(nodes="moving", transfer="nodal", residual_tolerance=1e-10)
    body = Body(box, particles, fixed, lambda x: 0.0 * x, Loads(prescribed_motion=motion))
    state = build_state(body, settings, material, choices)
    solution = simulate(state, 0.5, 1.0)
    assert solution.status == "ok", solution.reason
    stress = (1.2**2 - 1.0) / 2.0 * 1e5 / 1.2  # nu = 0: no stress and no strain across
    accuracy = 1e-9 if name == "linear" else 2e-2
    assert np.allclose(particles.F[:, 0, 0], 1.2, rtol=accuracy)
    assert np.allclose(particles.sigma[:, 0, 0], stress, rtol=5 * accuracy)
    assert np.abs(particles.sigma[:, 1:, 1:]).max(initial=0.0) < 10 * accuracy * stress


def test_meshes_of_the_disk() -> None:
    nodes, triangles = ring_mesh(0.5, 6)
    edges = nodes[triangles[:, 1:]] - nodes[triangles[:, :1]]
    area = 0.5 * np.linalg.det(edges)
    assert len(nodes) == 127
    assert len(triangles) == 216
    assert (area > 0.0).all()
    polygon = 0.5 * 36 * 0.25 * np.sin(2.0 * np.pi / 36)
    assert area.sum() == pytest.approx(polygon, rel=1e-12)
    for diagonal in ("falling", "rising", "alternating"):
        corners = Box((0.0, 0.0), (3.0, 2.0), (3, 2)).points[split_squares(3, 2, diagonal)]
        areas = 0.5 * np.linalg.det(corners[:, 1:] - corners[:, :1])
        assert np.allclose(areas, 0.5)


def disk(**changes: Any) -> xr.Dataset:
    basis = changes.pop("basis", "linear")
    method = "implicit_mpm" if basis == "linear" else "gmm"
    changes = {"problem__plane": "nodes", **changes}
    return case.solve(compose("rolling_disk", method, basis, **changes))


def test_a_plane_of_nodes_is_seen_by_functions_that_reach_it() -> None:
    """Those on the nodes of the body reach no other node."""
    nodes = {"problem__plane": "nodes"}
    with pytest.raises(NotApplicable, match="basis=linear on moving nodes does not see the plane"):
        case.read(compose("rolling_disk", "fem", "linear", **nodes))
    for name in ("mls", "lme"):
        assert case.read(compose("rolling_disk", "gmm", name, **nodes)).choices.moving


def test_disk_falls_freely_before_it_lands() -> None:
    result = disk(end_time=0.06, resolution=10)
    assert result.attrs["status"] == "ok"
    t = result.time.values
    a = 9.81 * np.sin(np.pi / 3.0)
    expected = np.where(
        t > 0.0, 0.5 * a * t**2 - 0.5 * a * 2e-3 * t + 0.25 * a * 2e-3**2, 0.0
    )  # from a(0) = 0
    assert np.allclose(result.centre_displacement, expected, atol=1e-7)
    assert float(result.lowest_particle.min()) > 0.0


@pytest.mark.slow
def test_rolling_disk() -> None:
    """Coarse MPM ends 3.9 % ahead; a disk that touches the plane hangs on it; rising diagonals hold it.

    With MLS it hangs on it until it diverges.
    """
    assert float(disk().error_end_relative) == pytest.approx(0.039, abs=0.003)
    assert float(disk(problem__gap=0.0).error_end_relative) < -0.9
    assert float(disk(problem__diagonal="rising").error_end_relative) < -0.5
    for basis in ("mls", "lme"):
        free = disk(basis=basis, end_time=0.6)
        assert free.attrs["status"] == "ok"
        assert abs(float(free.error_end_relative)) < 0.2
        hung = disk(basis=basis, end_time=0.6, problem__gap=0.0)
        if basis == "mls":
            assert hung.attrs["status"] == "diverged", hung.attrs["reason"]
        else:
            assert float(hung.error_end_relative) < -0.5
