"""Max-ent and local max-ent: what holds for them beyond the invariants that every basis is tested for."""

import math

import numpy as np
import pytest

from mpmbench.core.bases.clouds.search import make_buckets, nearest_distances
from mpmbench.core.bases.entropy.basis import EntropyBasis
from mpmbench.core.bases.entropy.lme import LocalMaxEnt
from mpmbench.core.bases.entropy.locality import allocate, longest_list
from mpmbench.core.bases.entropy.maxent import MaxEnt
from mpmbench.core.bases.entropy.points import evaluate_range
from mpmbench.core.bases.grid.bspline import BSpline
from mpmbench.core.compiled import lean
from mpmbench.core.compiled.exponentials import exponential, logarithm
from mpmbench.core.errors import BadSetting, BrokeDown, NotConverged
from mpmbench.core.geometry import Box, Cloud

CELLS = {1: 12, 2: 8, 3: 4}


def jittered(dim: int, share: float, seed: int = 1) -> Cloud:
    """Unit box of nodes, those inside displaced by up to `share` cells along each axis."""
    n = CELLS[dim]
    nodes = Box((0.0,) * dim, (1.0,) * dim, (n,) * dim).points
    inside = np.all((nodes > 1e-9) & (nodes < 1.0 - 1e-9), axis=1, keepdims=True)
    return Cloud(
        nodes + inside * np.random.default_rng(seed).uniform(-share, share, nodes.shape) / n
    )


def points(dim: int, count: int = 200) -> np.ndarray:
    """Random points of the unit box; the first ones come as close to its faces as 1e-7."""
    rng = np.random.default_rng(5)
    x = rng.random((count, dim))
    x[:60, 0] = 10.0 ** rng.uniform(-7.0, -1.0, 60)
    x[30:60] = 1.0 - x[30:60]
    return x


def rotated(cloud: Cloud, angle: float) -> tuple[np.ndarray, np.ndarray]:
    """The nodes turned in the plane of the first two axes, and the rotation."""
    Q = np.eye(cloud.dimension)
    Q[:2, :2] = [[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]]
    return cloud.nodes @ Q.T, Q


IN_SPACE = ((), pytest.mark.slow)  # where all is compiled once more
CASES = [
    *(
        pytest.param(MaxEnt(prior=p), 0.05, d, id=f"maxent-{p}-{d}D", marks=IN_SPACE[d == 3])
        for p in ("cubic_spline",)
        for d in (1, 2, 3)
    ),
    pytest.param(MaxEnt(prior="quartic_spline", d_max=3.0), 0.2, 2, id="maxent-quartic_spline-2D"),
    pytest.param(
        MaxEnt(prior="gaussian", d_max=3.5), 0.2, 3, id="maxent-gaussian-3D", marks=IN_SPACE[True]
    ),
    *(
        pytest.param(LocalMaxEnt(gamma=g), 0.3, d, id=f"lme-{g}-{d}D", marks=IN_SPACE[d == 3])
        for g in (0.8, 1.8, 6.8)
        for d in (1, 2, 3)
    ),
]


@pytest.mark.parametrize(("settings", "share", "dim"), CASES)
class TestFunctions:
    def test_completeness_and_sign(
        self, settings: MaxEnt | LocalMaxEnt, share: float, dim: int
    ) -> None:
        basis, x = settings.build(jittered(dim, share), 0, False), points(dim)
        stored = basis.evaluate(x)
        phi, grad = stored.matrix(len(basis.nodes)), stored.gradient_matrix(len(basis.nodes))
        assert phi.min() >= 0.0
        assert np.abs(phi.sum(axis=1) - 1.0).max() < 1e-14
        assert np.abs(phi @ basis.nodes - x).max() < settings.tolerance / CELLS[dim]
        assert np.abs(grad.sum(axis=1)).max() < 1e-12 * CELLS[dim]
        assert np.abs(np.einsum("pia,ib->pab", grad, basis.nodes) - np.eye(dim)).max() < 1e-11

    def test_gradient(self, settings: MaxEnt | LocalMaxEnt, share: float, dim: int) -> None:
        """Against central differences: of fourth order, with steps that follow the distance to the boundary."""
        basis, x = settings.build(jittered(dim, share), 0, False), points(dim)
        N = len(basis.nodes)
        grad = basis.evaluate(x).gradient_matrix(N)
        room = np.minimum(x, 1.0 - x).min(axis=1, keepdims=True)
        step = np.minimum(1e-4 / CELLS[dim], 0.01 * room)
        for d in range(dim):
            shift = step * np.eye(dim)[d]
            values = {k: basis.evaluate(x + k * shift).matrix(N) for k in (-2, -1, 1, 2)}
            difference = (8.0 * (values[1] - values[-1]) - (values[2] - values[-2])) / (12.0 * step)
            error = np.abs(grad[:, :, d] - difference).max(axis=1) / CELLS[dim]
            assert np.all(error < 1e-6 + 1e-15 / (step[:, 0] * CELLS[dim]))

    def test_scale_does_not_matter(
        self, settings: MaxEnt | LocalMaxEnt, share: float, dim: int
    ) -> None:
        """A micrometre and a megametre: no length is hidden in the tolerances."""
        cloud, x = jittered(dim, share), points(dim)
        reference = settings.build(cloud, 0, False).evaluate(x)
        for scale in (1e-6, 1e6):
            scaled = settings.build(Cloud(scale * cloud.nodes), 0, False).evaluate(scale * x)
            assert (
                np.abs(scaled.matrix(len(cloud.nodes)) - reference.matrix(len(cloud.nodes))).max()
                < 1e-9
            )
            gradient = scale * scaled.gradient_matrix(len(cloud.nodes))
            away = np.minimum(x, 1.0 - x).min(axis=1) > 1e-3
            assert np.abs(gradient - reference.gradient_matrix(len(cloud.nodes)))[away].max() < 1e-8

    def test_search_finds_what_all_nodes_give(
        self, settings: MaxEnt | LocalMaxEnt, share: float, dim: int
    ) -> None:
        cloud, x = jittered(dim, share), points(dim)
        near = settings.build(cloud, 0, False).evaluate(x)
        every = (
            type(settings)(**{**vars(settings), "search": "all"}).build(cloud, 0, False).evaluate(x)
        )
        for a, b in zip(near[1:], every[1:], strict=True):
            assert np.array_equal(a, b)


def test_cubic_prior_on_a_line_is_the_cubic_spline() -> None:
    """Fact 6: with d_max = 2, away from the ends, where the splines differ."""
    box = Box((0.0,), (3.0,), (12,))
    x = np.linspace(0.76, 2.24, 97)[
        :, None
    ]  # two cells and more away from the ends: all supports are whole
    ours = MaxEnt().build(box, 0, False).evaluate(x)
    splines = BSpline(degree=3).build(box, 0, False).evaluate(x)
    assert np.abs(ours.matrix(13) - splines.matrix(15)[:, 1:-1]).max() < 1e-14
    assert np.abs(ours.gradient_matrix(13) - splines.gradient_matrix(15)[:, 1:-1]).max() < 1e-12


@pytest.mark.parametrize("settings", [MaxEnt(), MaxEnt(prior="gaussian"), LocalMaxEnt()])
def test_end_of_a_line(settings: MaxEnt | LocalMaxEnt) -> None:
    """The end node's function is 1 there, and its slope is the limit from inside, wherever the node has moved."""
    basis = settings.build(Box((0.0,), (1.0,), (8,)), 0, True)
    for _ in range(2):
        ends = basis.nodes[[0, -1]].copy()
        stored = basis.evaluate(ends)
        assert np.array_equal(stored.matrix(9), np.eye(9)[[0, -1]])
        grad = stored.gradient_matrix(9)[:, :, 0]
        inside = basis.evaluate(ends + np.array([[1e-5], [-1e-5]])).gradient_matrix(9)[:, :, 0]
        assert (
            np.abs(grad - inside).max() < 1e-2
        )  # slopes are about 8; their change over 1e-5 is about 1e-3
        slopes = np.diff(basis.nodes[[0, 1, -2, -1], 0])[[0, 2]]
        assert grad[0, 0] == pytest.approx(-1.0 / slopes[0], rel=1e-6)
        assert grad[1, -1] == pytest.approx(1.0 / slopes[1], rel=1e-6)
        basis.move(0.02 * np.sin(np.arange(1.0, 10.0))[:, None])


@pytest.mark.parametrize("settings", [MaxEnt(d_max=2.5), LocalMaxEnt(gamma=1.8)])
@pytest.mark.parametrize("dim", [2, pytest.param(3, marks=pytest.mark.slow)])
@pytest.mark.parametrize("share", [0.0, 0.1])
def test_faces_of_a_turned_box(settings: MaxEnt | LocalMaxEnt, dim: int, share: float) -> None:
    """On a face that no axis is aligned with, only its own nodes have functions, and completeness holds."""
    cloud = jittered(dim, share)
    nodes, Q = rotated(cloud, 0.7)
    basis = settings.build(Cloud(nodes), 0, False)
    flat = points(dim, 90)[60:]
    flat[:, 0] = 0.0
    flat[0] = 0.0  # a corner
    x = flat @ Q.T
    stored = basis.evaluate(x)
    phi, grad = stored.matrix(len(nodes)), stored.gradient_matrix(len(nodes))
    assert np.abs(phi[:, cloud.nodes[:, 0] > 1e-9]).max() < 1e-11
    assert np.abs(phi @ nodes - x).max() < 1e-12
    assert phi[0].max() == pytest.approx(1.0, abs=1e-12)
    assert np.abs(np.einsum("pia,ib->pab", grad, nodes) - np.eye(dim)).max() < 1e-5
    if (
        share == 0.0
    ):  # in irregular clouds the gradient reaches its limit too slowly to be compared with a neighbour's
        inwards = basis.evaluate((flat + 1e-5 * (0.5 - flat)) @ Q.T).gradient_matrix(len(nodes))
        assert np.abs(grad - inwards).max() < 1e-3 * CELLS[dim]


@pytest.mark.parametrize("dim", [1, 2, pytest.param(3, marks=pytest.mark.slow)])
@pytest.mark.parametrize("settings", [MaxEnt(), LocalMaxEnt()])
def test_outside_is_an_error_and_inside_is_not(settings: MaxEnt | LocalMaxEnt, dim: int) -> None:
    basis = settings.build(Box((0.0,) * dim, (1.0,) * dim, (CELLS[dim],) * dim), 0, False)
    x = np.full((3, dim), 0.43)
    for distance in (1e-10, 1e-6, 0.01, 0.3, 7.0):
        x[2, 0] = 1.0 + distance
        with pytest.raises(BrokeDown, match=r"lost basis: .*point 2 at"):
            basis.evaluate(x)
        assert basis.first_outside(x) == 2
    for distance in (0.0, 1e-15, 1e-12, 1e-9, 1e-7, 1e-3):
        x[2, 0] = 1.0 - distance
        assert basis.first_outside(x) == -1
        stored = basis.evaluate(x)
        assert np.abs(stored.matrix(len(basis.nodes)) @ basis.nodes - x).max() < 1e-12
        assert np.abs(stored.gradient_matrix(len(basis.nodes)).sum(axis=1)).max() < 1e-6
    x[1] = np.nan
    with pytest.raises(BrokeDown, match="point 1"):
        basis.evaluate(x)


def test_newton_needs_its_line_search() -> None:
    """Li 2009: without it the iteration fails at most points for gamma = 6.8, and says so."""
    cloud = jittered(2, 0.3)
    x = points(2, 400)[60:]
    plain = LocalMaxEnt(gamma=6.8, line_search=False).build(cloud, 0, False)
    safe = LocalMaxEnt(gamma=6.8).build(cloud, 0, False)
    failed = plain.newton_steps(x) < 0
    assert failed.mean() > 0.5
    assert safe.newton_steps(x).min() >= 1
    with pytest.raises(NotConverged, match="Newton steps for point"):
        plain.evaluate(x)
    for gamma, gentle in ((0.8, True), (1.8, True)):
        steps = LocalMaxEnt(gamma=gamma, line_search=False).build(cloud, 0, False).newton_steps(x)
        assert ((steps >= 0).mean() > 0.95) == gentle
    some = x[~failed]
    assert np.allclose(plain.evaluate(some).phi, safe.evaluate(some).phi, rtol=0.0, atol=1e-13)


def test_limit_of_the_iteration() -> None:
    basis = LocalMaxEnt().build(jittered(2, 0.3), 0, False)
    basis.cloud = basis.cloud._replace(form=basis.cloud.form._replace(most_steps=2))
    with pytest.raises(NotConverged, match="no solution after 3 Newton steps"):
        basis.evaluate(points(2))


def moved(basis: EntropyBasis) -> np.ndarray:
    """A displacement that squeezes the nodes of the unit square together in its middle."""
    offset = basis.nodes - 0.5
    return -0.25 * offset * np.sin(np.pi * basis.nodes).prod(axis=1, keepdims=True)


@pytest.mark.parametrize("settings", [MaxEnt(d_max=3.0), LocalMaxEnt(locality="fixed")])
def test_nodes_around_a_point_are_listed_anew_when_they_have_moved(
    settings: MaxEnt | LocalMaxEnt,
) -> None:
    """One point that stays sees the same cells: what was listed of their nodes is still not theirs."""
    x = np.array([[0.47, 0.53]])
    basis = settings.build(Box((0.0, 0.0), (1.0, 1.0), (8, 8)), 1, True)
    basis.locate(x)
    basis.move(0.01 * np.sin(np.pi * basis.nodes).prod(axis=1, keepdims=True) * [1.0, -0.5])
    basis.locate(x)
    sums = basis.handle.matrix(81) @ basis.nodes
    assert np.abs(sums - x).max() < 1e-12


@pytest.mark.parametrize("settings", [MaxEnt(d_max=3.0), LocalMaxEnt()])
def test_moving_nodes(settings: MaxEnt | LocalMaxEnt) -> None:
    """After a move the basis is the one that would be built on the new nodes; wider stencils are made where needed."""
    x = points(2)
    basis = settings.build(Box((0.0, 0.0), (1.0, 1.0), (8, 8)), len(x), True)
    basis.locate(x)
    first = basis.handle
    basis.locate(x)
    assert basis.handle is first  # filled in place
    widths = [first.phi.shape[1]]
    for _ in range(3):
        basis.move(moved(basis))
        basis.locate(x)
        widths.append(basis.handle.phi.shape[1])
        keep = {"spacing": 0.125} if isinstance(settings, LocalMaxEnt) else {}
        fresh = (
            type(settings)(**{**vars(settings), **keep})
            .build(Cloud(basis.nodes), 0, False)
            .evaluate(x)
        )
        # but for rounding: multipliers start from those before
        assert np.abs(basis.handle.matrix(81) - fresh.matrix(81)).max() < 1e-13
        found, expected = basis.handle.gradient_matrix(81), fresh.gradient_matrix(81)
        assert np.abs(found - expected).max() < 1e-11 * np.abs(expected).max()
    assert isinstance(basis, EntropyBasis)
    if isinstance(
        settings, LocalMaxEnt
    ):  # the supports keep their size, so that more nodes come into them
        assert widths[-1] > widths[0]
    assert basis.iterations.min() >= 0 and 2.0 < basis.iterations.mean() < 15.0


def test_any_split_gives_the_same_bits() -> None:
    x = points(2)
    basis = LocalMaxEnt().build(jittered(2, 0.3), len(x), False)
    basis.locate(x)
    whole = [a.copy() for a in basis.handle[1:]]
    for stop in (1, 77, 150):
        for array in basis.handle[1:]:
            array[:] = 0
        for first, last in ((stop, len(x)), (0, stop)):
            status = evaluate_range(
                basis.cloud,
                allocate(2, longest_list(basis.cloud)),
                x,
                first,
                last,
                basis.handle,
                basis.iterations,
                np.zeros(x.shape),
            )
            assert status[0] == 0
            assert first == 0 or not basis.handle.size[:first].any()
        assert all(np.array_equal(a, b) for a, b in zip(whole, basis.handle[1:], strict=True))


@pytest.mark.parametrize("dim", [1, 2, 3])
def test_buckets_list_all_supports(dim: int) -> None:
    """Against all pairs, on a cloud with supports of very different sizes."""
    rng = np.random.default_rng(7)
    nodes = rng.random((60, dim)) ** 3
    support = 10.0 ** rng.uniform(-3.0, 0.0, 60)
    buckets = make_buckets(nodes, support, True)
    x = rng.uniform(-0.2, 1.2, (500, dim))
    inside = np.linalg.norm(x[:, None] - nodes, axis=2) < support
    lower, upper = nodes.min(axis=0), nodes.max(axis=0)
    place = np.clip(
        (x - lower) / (upper - lower) * buckets.cells[:dim], 0, buckets.cells[:dim] - 1
    ).astype(int)
    cell = np.zeros(len(x), dtype=int)
    for d in range(dim):
        cell = cell * buckets.cells[d] + place[:, d]
    for p in np.flatnonzero(np.all((x >= lower) & (x <= upper), axis=1)):
        listed = buckets.entry[buckets.first[cell[p]] : buckets.first[cell[p] + 1]]
        assert np.all(np.diff(listed) > 0)
        assert set(np.flatnonzero(inside[p])) <= set(listed)
    assert buckets.first[-1] < 0.5 * 60 * (len(buckets.first) - 1) or dim == 3
    one_cell = make_buckets(nodes, support, False)
    assert list(one_cell.entry[one_cell.first[0] : one_cell.first[1]]) == list(range(60))


def test_nearest_distances() -> None:
    nodes = np.random.default_rng(3).random((40, 2))
    distances = np.linalg.norm(nodes[:, None] - nodes, axis=2) + 10.0 * np.eye(40)
    assert np.allclose(nearest_distances(nodes), distances.min(axis=1))


@lean
def exponentials_of(values):  # type: ignore[no-untyped-def]
    """In the decorator's setting that the solver uses."""
    for k in range(values.shape[0]):
        values[k] = exponential(values[k])


def test_exponentials() -> None:
    x = np.concatenate(
        [np.linspace(-708.0, 708.0, 7993), [0.0, 1e-300, -1e-17, 0.34657, -0.34658, 1.0, -1.0]]
    )
    for count in (len(x), 13):  # vector instructions, and what is left over behind them
        values = x[-count:].copy()
        exponentials_of(values)
        assert np.abs(values / np.exp(x[-count:]) - 1.0).max() < 5e-16


def test_exponentials_of_extreme_values() -> None:
    """Beyond the range of doubles the nearest end, without overflow; what is no number stays none."""
    x = np.array(
        [-np.inf, -1e308, -745.0, -708.0, 708.0, 709.9, 1e308, np.inf, np.nan, -np.nan] * 3
    )
    values = x.copy()
    exponentials_of(values)
    with np.errstate(invalid="ignore"):
        assert np.allclose(
            values, np.exp(np.clip(x, -708.0, 708.0)), rtol=5e-16, atol=0.0, equal_nan=True
        )
    assert np.isnan(values[np.isnan(x)]).all()
    assert np.array_equal(values[np.isfinite(values)], np.abs(values[np.isfinite(values)]))


@pytest.mark.parametrize(
    ("settings", "wrong"),
    [
        (MaxEnt, {"d_max": 1.0}),
        (MaxEnt, {"d_max": math.nan}),
        (MaxEnt, {"prior": "cubic"}),
        (MaxEnt, {"tolerance": 0.0}),
        (MaxEnt, {"search": "none"}),
        (LocalMaxEnt, {"gamma": 0.0}),
        (LocalMaxEnt, {"gamma": math.inf}),
        (LocalMaxEnt, {"radius": -1.0}),
        (LocalMaxEnt, {"spacing": math.nan}),
        (LocalMaxEnt, {"cutoff": 1e-3}),
        (LocalMaxEnt, {"tolerance": 1.0}),
        (LocalMaxEnt, {"line_search": "yes"}),
    ],
)
def test_settings_out_of_range(settings: type, wrong: dict) -> None:
    with pytest.raises(BadSetting) as caught:
        settings(**wrong)
    assert caught.value.key == next(iter(wrong))


def test_radius_smaller_than_the_spacing() -> None:
    with pytest.raises(BadSetting, match=r"nodal spacing of 0\.25 m"):
        LocalMaxEnt(radius=0.2).build(Box((0.0,), (1.0,), (4,)), 0, False)


def test_counts_of_newton_steps() -> None:
    """Li 2009, Table 2.1 (tolerances 1e-5 and 1e-10, one jittered cloud of 11 x 11 nodes, plain Newton) within 0.6."""
    nodes = Box((0.0, 0.0), (10.0, 10.0), (10, 10)).points
    cloud = Cloud(nodes + np.random.default_rng(0).uniform(-0.3, 0.3, nodes.shape))
    line = np.linspace(0.05, 9.95, 41)
    x = np.stack(np.meshgrid(line, line, indexing="ij"), axis=-1).reshape(-1, 2)
    for gamma, published in ((0.8, (2.7, 3.6)), (1.8, (2.4, 3.5)), (2.8, (3.0, 4.0))):
        for tolerance, expected in zip((1e-5, 1e-10), published, strict=True):
            steps = {}
            for search in (False, True):
                basis = LocalMaxEnt(
                    gamma, spacing=1.0, tolerance=tolerance, line_search=search
                ).build(cloud, 0, False)
                assert isinstance(basis, EntropyBasis)
                steps[search] = basis.newton_steps(x)
            converged = steps[False] >= 0
            assert steps[False][converged].mean() == pytest.approx(expected, abs=0.6)
            assert np.all(
                steps[True][converged] >= 0
            )  # the others are outside the hull of these nodes


@lean
def logarithms_of(values):  # type: ignore[no-untyped-def]
    for k in range(values.shape[0]):
        values[k] = logarithm(values[k])


def test_logarithms() -> None:
    """To three units in the last place, next to 1 too, where most determinants are."""
    rng = np.random.default_rng(0)
    for half in (1e-12, 1e-6, 0.5, 1.0):
        values = 1.0 + half * rng.uniform(-1.0, 1.0, 2000)
        exact = np.log(values)
        logarithms_of(values)
        assert np.all(np.abs(values - exact) <= 3.0 * np.spacing(np.abs(exact)))
    values = np.exp(rng.uniform(-690.0, 709.0, 2000))
    exact = np.log(values)
    logarithms_of(values)
    assert np.all(np.abs(values - exact) <= 3.0 * np.spacing(np.abs(exact)))
    values = np.array([1.0, 0.0, -2.0, np.nan])
    logarithms_of(values)
    assert values[0] == 0.0
    assert np.isnan(values[1:]).all()
