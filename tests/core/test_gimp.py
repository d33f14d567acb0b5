"""Hats averaged over domains of particles: the average itself, which domains, and what they do for runs."""

import numpy as np
import pytest
from scipy.linalg import polar

from mpmbench.analysis.slopes import fitted_order
from mpmbench.core import registry
from mpmbench.core.bases.frozen import FrozenBasis
from mpmbench.core.bases.grid.gimp import POINT, GimpBasis
from mpmbench.core.errors import BrokeDown, NotApplicable
from mpmbench.core.geometry import Box
from mpmbench.core.particles import Particles
from tests.core.support import compose, run, solve

CELLS = 5


def basis_of(domain: str, p: Particles, box: Box) -> GimpBasis:
    basis = registry.get("basis", "gimp")(domain=domain).build(box, len(p.x), False)
    basis.follow(p)
    return basis


def straight_hats(x: np.ndarray) -> np.ndarray:
    """Hats on nodes 0, 1, 2, ... [m], which go on straight beyond both ends, shape (..., CELLS + 1)."""
    cell = np.clip(np.floor(x), 0, CELLS - 1).astype(int)
    share = (x - cell)[..., None]
    number = np.arange(CELLS + 1)
    return (number == cell[..., None]) * (1.0 - share) + (number == cell[..., None] + 1) * share


@pytest.mark.parametrize(
    ("domain", "size"),
    [*(("uniform", size) for size in (0.1, 0.5, 1.0)), *(("finite", size) for size in (0.3, 1.7))],
)
def test_it_is_the_average_of_hats_over_a_domain(domain: str, size: float) -> None:
    """Everywhere, domains that reach out of the grid included, and with the size of the particle."""
    rng = np.random.default_rng(0)
    x = rng.uniform(0.0, CELLS, (60, 1))
    x[:20] = rng.uniform(0.0, 0.5, (20, 1))
    p = Particles.at_rest(x, np.full(len(x), size), 1.0)
    basis = basis_of(domain, p, Box((0.0,), (float(CELLS),), (CELLS,)))
    basis.locate(p.x)
    within = (np.arange(20000) + 0.5) / 20000 - 0.5
    average = straight_hats(x + size * within).mean(axis=1)
    stored = basis.evaluate(p.x)
    assert np.abs(stored.matrix(CELLS + 1) - average).max() < 1e-7
    ends = straight_hats(x[:, 0] + 0.5 * size) - straight_hats(x[:, 0] - 0.5 * size)
    assert np.abs(stored.gradient_matrix(CELLS + 1)[:, :, 0] - ends / size).max() < 1e-10


def test_each_particle_has_its_own_domain_and_points_have_none() -> None:
    """In cells that are no cubes too; loads and frozen functions see the particle's domain."""
    box = Box((0.0, 0.0), (4.0, 2.0), (4, 4))
    X = np.array([[0.5, 0.5], [1.5, 1.0], [2.0, 1.5]])
    p = Particles.at_rest(X, np.array([0.5, 0.125, 0.125]), 1.0, np.array([[3.0, 1.25]]))
    basis = basis_of("uniform", p, box)
    assert np.allclose(basis.handle.half[:, 0], [0.5, 0.25, 0.25, POINT])
    assert np.array_equal(basis.handle.half[:, 0], basis.handle.half[:, 1])
    stored = basis.evaluate(p.x).matrix(len(basis.nodes))
    for p_of in (3, 0):
        alone = basis.evaluate_particles(p.x, np.array([p_of])).matrix(len(basis.nodes))
        assert np.array_equal(alone[0], stored[p_of])
    hats = np.prod(
        np.maximum(1.0 - np.abs(X[:1] * 0.0 + p.x[3] - basis.nodes) / [1.0, 0.5], 0.0), 1
    )
    assert np.abs(stored[3] - hats).max() < 2.0 * POINT
    assert np.abs(stored[0] - basis.evaluate(p.x.copy()).matrix(len(basis.nodes))[0]).max() > 0.01
    frozen = FrozenBasis(basis, p.x, p.F)
    assert np.array_equal(frozen.handle.matrix(len(basis.nodes)), stored)
    with pytest.raises(NotApplicable, match="particles of one cell"):
        basis_of("uniform", Particles.at_rest(X, np.full(3, 0.6), 1.0), box)


@pytest.mark.parametrize("dim", (1, 2, 3))
def test_domains_follow_the_diagonals_of_f_and_of_u(dim: int) -> None:
    rng = np.random.default_rng(dim)
    box = Box((0.0,) * dim, (4.0,) * dim, (4,) * dim)
    p = Particles.at_rest(rng.uniform(1.0, 3.0, (30, dim)), np.full(30, 0.2), 1.0)
    p.F[:] = np.eye(dim) + rng.uniform(-0.25, 0.25, p.F.shape)
    half = 0.5 * 0.2 ** (1.0 / dim)
    for domain, stretch in (
        ("uniform", [np.ones(dim)] * 30),
        ("contiguous", [np.diag(F) for F in p.F]),
        ("finite", [np.diag(polar(F)[1]) for F in p.F]),
    ):
        basis = basis_of(domain, p, box)
        basis.locate(p.x)
        assert np.abs(basis.handle.half - half * np.array(stretch)).max() < 1e-13, domain


def test_a_rotation_shortens_contiguous_domains_only_until_they_are_lost() -> None:
    box, X = Box((0.0, 0.0), (4.0, 4.0), (4, 4)), np.array([[2.0, 2.0]])
    p = Particles.at_rest(X, np.array([0.25]), 1.0)
    bases = {name: basis_of(name, p, box) for name in ("contiguous", "finite")}
    for angle in (0.5, 1.5, 2.0):
        c, s = np.cos(angle), np.sin(angle)
        p.F[:] = [[c, -s], [s, c]]
        bases["finite"].locate(p.x)
        assert np.abs(bases["finite"].handle.half - 0.25).max() < 1e-15
        if angle < 0.5 * np.pi:
            bases["contiguous"].locate(p.x)
            assert np.abs(bases["contiguous"].handle.half - 0.25 * c).max() < 1e-15
        else:
            with pytest.raises(BrokeDown, match="particle 0 has lost its length"):
                bases["contiguous"].locate(p.x)
    p.F[:] = np.diag([1.0, 4.1])
    with pytest.raises(BrokeDown, match=r"particle 0 is 2\.05 cells long along axis 1"):
        bases["finite"].locate(p.x)


def test_a_strip_of_one_cell_is_continued_by_nodes_that_nobody_needs() -> None:
    box = Box((0.0, 0.0), (1.0, 6.0), (1, 6))
    X = np.array([[0.25, 0.25], [0.75, 3.1], [0.5, 5.75]])
    basis = basis_of("uniform", Particles.at_rest(X, np.full(3, 0.25), 1.0), box)
    stored = basis.evaluate_particles(X, np.arange(3))
    outside = basis.nodes[:, 0] > 1.0
    assert stored.matrix(len(basis.nodes))[:, outside].max() == 0.0
    assert np.abs(stored.matrix(len(basis.nodes)) @ basis.nodes - X).max() < 1e-15
    with pytest.raises(BrokeDown, match="outside"):
        basis.evaluate(np.array([[1.1, 3.0]]))


@pytest.mark.slow  # the functions are asked above, one by one
def test_order_two_without_crossings() -> None:
    cells, changes = np.array([8, 16, 32]), {"particles_per_cell": 4, "time_step": 1e-6}
    errors = [
        float(
            run("bar_fixed_ends", "mpm", "gimp", resolution=n, **changes)["error_displacement_rms"]
        )
        for n in cells
    ]
    assert fitted_order(1.0 / cells, np.array(errors)) == pytest.approx(2.0, abs=0.1)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("domain", "amplitude"),
    [("uniform", 0.005), ("contiguous", 0.02), ("finite", 0.02)],
)
def test_order_two_at_moderate_strain(domain: str, amplitude: float) -> None:
    """With strains of 3 and 13 % and thousands of crossings in the plate, whose stretch is along the axes."""
    cells = np.array([16, 32, 64])
    changes = {"particles_per_cell": 4, "time_step": 4e-5, "basis__domain": domain}
    changes["problem__displacement_amplitude"] = amplitude
    runs = [run("plate_axis_aligned", "mpm", "gimp", resolution=n, **changes) for n in cells]
    errors = np.array([float(one["error_displacement_rms"]) for one in runs])
    assert int(runs[-1].n_cell_crossings) > 5000
    assert 1.8 < fitted_order(1.0 / cells, errors) < 2.4, errors


@pytest.mark.slow
@pytest.mark.parametrize("domain", ("uniform", "contiguous", "finite"))
def test_stress_has_no_noise_of_crossings(domain: str) -> None:
    """Halved cells halve the error of the stress, whose front is a kink; that of hats jumps up."""
    changes = {"problem__traction_amplitude": -20.0}
    found: dict[str, list[float]] = {"gimp": [], "linear": []}
    for basis, errors in found.items():
        more = {"basis__domain": domain} if basis == "gimp" else {}
        for n in (32, 64, 128):
            result = run("bar_dynamic_traction", "mpm", basis, resolution=n, **changes, **more)
            assert int(result.n_cell_crossings) > 20
            errors.append(float(result["error_stress_rms"]))
    falls = -np.diff(np.log2(found["gimp"]))
    assert np.all((falls > 0.9) & (falls < 1.2)), found
    assert found["linear"][1] > 3.0 * found["linear"][0], found


@pytest.mark.slow
@pytest.mark.parametrize("domain", ("uniform", "finite"))
def test_rigid_motion(domain: str) -> None:
    """Translation and fall are exact; a turn by more than a right angle breaks domains of the diagonal of F."""
    for motion in ("translation", "fall"):
        moved = run("rigid_motion", "mpm", "gimp", problem__motion=motion, basis__domain=domain)
        assert float(moved["error_displacement_rms"]) < 1e-14
    turn = {"problem__motion": "rotation", "problem__angular_velocity": 4.0}
    errors = [
        float(
            run("rigid_motion", "mpm", "gimp", resolution=n, basis__domain=domain, **turn)[
                "error_displacement_rms"
            ]
        )
        for n in (4, 8, 16)
    ]
    assert errors[0] > 2.5 * errors[1] > 6.0 * errors[2], errors
    lost = solve(
        compose("rigid_motion", "mpm", "gimp", basis__domain="contiguous", resolution=8, **turn)
    )
    assert lost.attrs["status"] == "broke_down" and "contiguous" in lost.attrs["reason"]
