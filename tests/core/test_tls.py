"""Taylor least squares: totals of each cell, fields that are exact, and cells that keep their particles."""

import numpy as np
import pytest

from mpmbench.analysis.slopes import fitted_order
from mpmbench.case import read
from mpmbench.core.bases.grid.bspline import BSpline
from mpmbench.core.bases.grid.tls import ReconstructedSpline
from mpmbench.core.errors import NotApplicable
from mpmbench.core.geometry import Box
from mpmbench.core.particles import ParticleArrays, Particles, seed_cells
from mpmbench.core.transfer.sums import p2g_internal_force
from tests.core.support import compose, run
from tests.support import slow_if


def box_of(dim: int) -> Box:
    return Box((-0.4,) * dim, (0.8, 1.0, 0.2)[:dim], (4, 3, 2)[:dim])


def built(box: Box, p: Particles, **settings: float) -> ReconstructedSpline:
    basis = BSpline(reconstruction="tls", **settings).build(box, len(p.x), False)  # type: ignore[arg-type]
    assert isinstance(basis, ReconstructedSpline)
    return basis


def points_of(basis: ReconstructedSpline, p: Particles) -> ParticleArrays:
    return basis.sources(p.arrays, lambda *_: None)[0]


def cell_sums(box: Box, x: np.ndarray, values: np.ndarray) -> np.ndarray:
    cell = np.floor((x - box.lower) / box.spacing).astype(int)
    numbers = np.ravel_multi_index(tuple(cell.T), box.cells)
    sums = np.zeros((int(np.prod(box.cells)), *values.shape[1:]))
    np.add.at(sums, numbers, values)
    return sums


def scattered(dim: int, box: Box, per_cell: int) -> Particles:
    """Particles moved off their lattice, with fields of their own; the last cell is half empty."""
    rng = np.random.default_rng(dim)
    X, V0 = seed_cells(box, per_cell)
    keep = len(X) - per_cell // 2
    X, V0 = X[:keep], V0[:keep]
    p = Particles.at_rest(X, V0, 1.0, np.array([box.upper]) - 0.01)
    solid = p.material
    p.x[solid] += 0.3 * (per_cell ** (-1.0 / dim)) * box.spacing * rng.uniform(-1, 1, X.shape)
    np.clip(p.x, np.array(box.lower) + 1e-3, np.array(box.upper) - 1e-3, out=p.x)
    p.m[solid] *= rng.uniform(0.8, 1.2, keep)
    p.V[solid] *= rng.uniform(0.95, 1.1, keep)  # so that full cells are so by a part only
    p.v[:], p.b[:] = rng.standard_normal(p.x.shape), rng.standard_normal(p.x.shape)
    p.sigma[solid] = rng.standard_normal(p.sigma[solid].shape)
    return p


@pytest.mark.parametrize("degree", (1, 2))
@pytest.mark.parametrize("dim", [slow_if(dim != 2, dim) for dim in (1, 2, 3)])
def test_totals_of_each_cell_are_kept(dim: int, degree: int) -> None:
    """Mass, momentum, body force and volume times stress, to 1e-14 of the sum of their sizes."""
    box = box_of(dim)
    p = scattered(dim, box, 3**dim)
    basis = built(box, p, reconstruction_degree=degree, filled=0.8)
    q = points_of(basis, p)
    assert basis.statistics()["plain_cells"][0] == 1.0 / np.prod(box.cells)
    for before, after in (
        (p.m, q.m),
        (p.m[:, None] * p.v, q.m[:, None] * q.v),
        (p.m[:, None] * p.b, q.m[:, None] * q.b),
        (p.V[:, None, None] * p.sigma, q.V[:, None, None] * q.sigma),
    ):
        size = cell_sums(box, p.x, np.abs(before))
        change = cell_sums(box, q.x, after) - cell_sums(box, p.x, before)
        assert np.abs(change / size).max() < 1e-14, dim


@pytest.mark.parametrize("degree", (1, 2))
def test_polynomials_of_its_degree_are_exact_at_gauss_points(degree: int) -> None:
    """Of densities that are the quotients of sums over Gauss points of the start, which integrate them exactly."""
    box = box_of(2)
    X, V0 = seed_cells(box, 9, "gauss")
    p = Particles.at_rest(X, V0, 1.0)

    def field(x: np.ndarray) -> np.ndarray:
        return 3.0 + x[:, 0] - 0.5 * x[:, 1] + (degree - 1.0) * (x[:, 0] - 0.7 * x[:, 1]) ** 2

    p.m[:], p.v[:, 0], p.sigma[:, 0, 1] = V0 * field(X), 1.0, field(X)
    q = points_of(built(box, p, reconstruction_degree=degree), p)
    assert len(q.x) == 12 * (4 if degree == 1 else 9)
    assert np.abs(q.m / q.V - field(q.x)).max() < 1e-13
    assert np.abs(q.sigma[:, 0, 1] - field(q.x)).max() < 1e-13
    assert np.abs(q.v[:, 0] - 1.0).max() < 1e-14
    assert q.V.sum() == pytest.approx(1.2 * 1.4)


def test_forces_of_a_linear_stress_are_those_of_the_integral() -> None:
    """On two particles in each cell, whose plain sums are wrong by some percent."""
    box = Box((0.0,), (1.0,), (5,))
    X, V0 = seed_cells(box, 2)
    p = Particles.at_rest(X, V0, 1.0)
    p.sigma[:, 0, 0] = 2.0 + X[:, 0]
    basis = built(box, p)

    def forces(x: np.ndarray, V: np.ndarray, sigma: np.ndarray) -> np.ndarray:
        f = np.zeros((len(basis.nodes), 1))
        p2g_internal_force(basis.handle, x, V, sigma, f)
        return f

    fine, weight = seed_cells(box, 4, "gauss")
    exact = forces(fine, weight, (2.0 + fine[:, 0])[:, None, None])
    q = points_of(basis, p)
    assert np.abs(forces(q.x, q.V, q.sigma) - exact).max() < 1e-14
    assert np.abs(forces(p.x, p.V, p.sigma) - exact).max() > 5e-3


@pytest.mark.parametrize(
    ("count", "size", "why"),
    [(1, 1.0, "too few"), (3, 0.8, "not filled"), (3, 1.2, "too full"), (3, 1.0, "one place")],
)
def test_cells_that_cannot_be_reconstructed_keep_their_particles(
    count: int, size: float, why: str
) -> None:
    box = Box((0.0,), (3.0,), (3,))
    X = np.full((count, 1), 1.501) if why == "one place" else 1.2 + 0.2 * np.arange(count)[:, None]
    p = Particles.at_rest(X, np.full(count, size / count), 1.0)
    basis = built(box, p, filled=0.9)
    q = points_of(basis, p)
    assert np.array_equal(q.x, p.x) and np.array_equal(q.m, p.m)
    assert basis.statistics()["plain_cells"][0] == 1.0
    if why in ("not filled", "too full"):
        assert len(points_of(built(box, p, filled=0.7), p).x) == 2


def test_a_density_that_would_be_negative_is_not_taken() -> None:
    box = Box((0.0,), (1.0,), (1,))
    p = Particles.at_rest(np.array([[0.45], [0.55]]), np.full(2, 0.5), 1.0)
    p.m[:] = 0.9, 0.1
    assert np.array_equal(points_of(built(box, p), p).m, p.m)
    p.m[:] = 0.51, 0.49
    assert len(points_of(built(box, p), p).m) == 2 and points_of(built(box, p), p).x[0, 0] < 0.3


@pytest.mark.parametrize(
    ("method", "changes", "match"),
    [
        ("mpm", {"method__mass": "consistent"}, "explicit methods with method.mass=lumped"),
        ("tlmpm", {}, "method.shape_functions=updated"),
        ("moving_mesh_mpm", {}, "method.nodes=fixed"),
        ("implicit_mpm", {}, "explicit methods"),
        ("mpm", {"method__transfer": "apic"}, "given functions and apic"),
        ("mpm", {"method__transfer": "xpic"}, "given functions and xpic"),
        ("mpm", {"method__gradient": "affine"}, "given affine and flip"),
    ],
)
def test_what_makes_no_sense_is_refused(method: str, changes: dict, match: str) -> None:
    config = compose(
        "plate_axis_aligned", method, "bspline", basis__reconstruction="tls", **changes
    )
    with pytest.raises(NotApplicable, match=match):
        read(config)


def test_a_bar_moves_as_with_plain_sums() -> None:
    """Until particles cross, to the third digit; momentum is kept in each step, and translation is exact."""
    plain, tls = (
        run("bar_fixed_ends", "mpm", "bspline", resolution=16, basis__reconstruction=name)
        for name in ("none", "tls")
    )
    assert float(tls.plain_cells) < 0.2 and "plain_cells" not in plain
    difference = float(np.abs(tls.displacement - plain.displacement).max())
    assert 0.0 < difference < 0.05 * float(np.abs(plain.displacement).max())


@pytest.mark.slow
@pytest.mark.parametrize("motion", ("translation", "fall"))
def test_translation_and_fall_are_exact(motion: str) -> None:
    keys = {"basis__reconstruction": "tls", "problem__motion": motion}
    moved = run("rigid_motion", "mpm", "bspline", **keys)
    assert float(moved["error_displacement_rms"]) < 1e-13
    assert 0.0 < float(moved.plain_cells) < 1.0


@pytest.mark.slow
def test_order_of_a_plate_whose_particles_do_not_cross() -> None:
    cells = np.array([4, 8, 16])
    changes = {"basis__reconstruction": "tls", "problem__displacement_amplitude": 1e-3}
    changes |= {"particles_per_cell": 4, "time_step": 4e-5}
    runs = [run("plate_axis_aligned", "mpm", "bspline", resolution=n, **changes) for n in cells]
    errors = np.array([float(one["error_displacement_rms"]) for one in runs])
    assert fitted_order(1.0 / cells, errors) > 1.8, errors
