"""Convected domains: the formulas of Sadeghirad et al. 2011, affine deformations, and bodies that hold together."""

import numpy as np
import pytest

from mpmbench.analysis.slopes import fitted_order
from mpmbench.core import registry
from mpmbench.core.bases.grid.cpdi import ConvectedDomains
from mpmbench.core.errors import BrokeDown
from mpmbench.core.geometry import Box
from mpmbench.core.particles import Particles, seed_cells
from mpmbench.core.transfer.sums import p2g_internal_force
from tests.core.support import run
from tests.support import slow_if


def followed(dim: int, box: Box, size: float, stretch: float) -> tuple[Particles, ConvectedDomains]:
    """Particles away from the edges under deformations of their own, with a point without mass."""
    rng = np.random.default_rng(dim)
    X = rng.uniform(2.0, 4.0, (20, dim)) * box.spacing
    p = Particles.at_rest(X, np.full(20, size * np.prod(box.spacing)), 1.0, X[:1] + 0.01)
    p.F[:20] += rng.uniform(-stretch, stretch, (20, dim, dim))
    basis = registry.get("basis", "cpdi")().build(box, len(p.x), False)
    basis.follow(p)
    basis.locate(p.x)
    return p, basis


def box_of(dim: int) -> Box:
    return Box((0.0,) * dim, (6.0, 3.0, 1.5)[:dim], (6,) * dim)


def test_functions_are_those_of_the_formulas_in_a_parallelogram() -> None:
    """Eqs. 25 and 26 as they are written: ``1/(2 V)`` and differences of the components of r_1 and r_2."""
    box = box_of(2)
    p, basis = followed(2, box, 0.25, 0.4)
    phi, gradient = (
        basis.handle.matrix(len(basis.nodes)),
        basis.handle.gradient_matrix(len(basis.nodes)),
    )

    def hats(x: np.ndarray) -> np.ndarray:
        return np.prod(np.maximum(1.0 - np.abs(x - basis.nodes) / box.spacing, 0.0), axis=1)

    for n in range(20):
        r1, r2 = p.F[n] @ [0.25 * box.spacing[0], 0.0], p.F[n] @ [0.0, 0.25 * box.spacing[1]]
        N1, N2, N3, N4 = (
            hats(p.x[n] + a * r1 + b * r2) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))
        )
        assert np.abs(phi[n] - 0.25 * (N1 + N2 + N3 + N4)).max() < 1e-14
        V = 4.0 * (r1[0] * r2[1] - r1[1] * r2[0])
        w1 = np.array([r1[1] - r2[1], r2[0] - r1[0]])
        w2 = np.array([r1[1] + r2[1], -r1[0] - r2[0]])
        expected = (np.outer(N1 - N3, w1) + np.outer(N2 - N4, w2)) / V
        assert np.abs(gradient[n] - expected).max() < 1e-12


@pytest.mark.parametrize("dim", [slow_if(dim != 2, dim) for dim in (1, 2, 3)])
def test_linear_fields_are_exact_whatever_the_deformation(dim: int) -> None:
    p, basis = followed(dim, box_of(dim), 0.3, 0.6 / dim)
    n, stored = len(basis.nodes), basis.handle
    phi, gradient = stored.matrix(n), stored.gradient_matrix(n)
    assert np.abs(phi.sum(axis=1) - 1.0).max() < 1e-14
    assert np.abs(phi @ basis.nodes - p.x).max() < 1e-14
    identity = np.einsum("pia,ib->pab", gradient, basis.nodes)
    assert np.abs(identity[:20] - np.eye(dim)).max() < 1e-12
    one = basis.evaluate_particles(p.x, np.array([7, 20]))
    assert np.array_equal(one.matrix(n), phi[[7, 20]])
    assert np.array_equal(basis.evaluate(p.x).phi, stored.phi)


def test_a_sheared_and_stretched_body_in_uniform_stress_has_no_forces_inside() -> None:
    """Domains of an affine deformation fill space, so that the sum of ``V_p grad phi_i`` is one over their hull."""
    F = np.array([[2.6, 0.7], [0.2, 0.8]])
    X, V0 = seed_cells(Box((0.0, 0.0), (1.0, 1.0), (5, 5)), 4)
    p = Particles.at_rest(X, V0, 1.0)
    p.x[:], p.F[:], p.V[:] = X @ F.T + [0.5, 0.5], F, V0 * np.linalg.det(F)
    p.sigma[:] = [[2.0, 0.5], [0.5, 1.0]]
    grid = Box((0.0, 0.0), (5.0, 3.0), (25, 15))
    back = np.linalg.solve(F, (grid.points - 0.5).T).T
    margin = 0.2 * np.abs(np.linalg.inv(F)).sum(axis=1)  # a cell, seen from the first box
    inside = np.all((back > margin) & (back < 1.0 - margin), axis=1)
    assert inside.sum() > 8
    largest = {}
    for name in ("cpdi", "gimp"):
        basis, forces = registry.get("basis", name)().build(grid, len(X), False), np.zeros((416, 2))
        basis.follow(p)
        basis.locate(p.x)
        p2g_internal_force(basis.handle, p.x, p.V, p.sigma, forces)
        largest[name] = np.abs(forces[inside]).max()
    assert largest["cpdi"] < 1e-14 and largest["gimp"] > 1e-3, largest


def test_a_corner_may_pass_the_edge_by_a_cell() -> None:
    box = box_of(2)
    p = Particles.at_rest(np.array([[0.3, 1.0]]), np.array([0.5]), 1.0)
    basis = registry.get("basis", "cpdi")().build(box, 1, False)
    basis.follow(p)
    p.F[0, 0, 0] = 2.0  # corners at 0.3 - 1.0 m
    basis.locate(p.x)
    assert np.abs(basis.handle.matrix(len(basis.nodes)) @ basis.nodes - p.x).max() < 1e-15
    for F_11 in (3.0, -1.0, np.nan):
        p.F[0, 0, 0] = F_11
        with pytest.raises(BrokeDown, match="particle 0 has no volume or reaches more than a cell"):
            basis.locate(p.x)


@pytest.mark.slow
def test_order_two_at_moderate_strain() -> None:
    """A plate with strains of 13 %, in which particles cross thousands of cells."""
    cells = np.array([16, 32, 64])
    changes = {"particles_per_cell": 4, "time_step": 4e-5, "problem__displacement_amplitude": 0.02}
    runs = [run("plate_axis_aligned", "mpm", "cpdi", resolution=n, **changes) for n in cells]
    errors = np.array([float(one["error_displacement_rms"]) for one in runs])
    assert 1.8 < fitted_order(1.0 / cells, errors) < 2.6, errors


@pytest.mark.slow
def test_translation_and_fall_are_exact() -> None:
    for motion in ("translation", "fall"):
        moved = run("rigid_motion", "mpm", "cpdi", problem__motion=motion)
        assert float(moved["error_displacement_rms"]) < 1e-14


@pytest.mark.slow
@pytest.mark.parametrize(
    ("basis", "gravity", "resolution", "elongation", "gap"),
    [
        ("cpdi", 300.0, 16, 0.3531, 1.01),
        ("cpdi", 1000.0, 8, 1.6666, 1.2),
        ("cpdi2", 300.0, 16, 0.3531, 1.02),
        ("cpdi2", 1000.0, 8, 1.6666, 1.2),
    ],
)
def test_a_heavy_block_holds_together(
    basis: str, gravity: float, resolution: int, elongation: float, gap: float
) -> None:
    """Until the end of its first swing, where hats, splines and boxes part: within 1 %."""
    changes = {"problem__gravity": gravity, "end_time": 0.12}
    result = run("vertical_bar", "mpm", basis, resolution=resolution, **changes)
    assert float(result.elongation) == pytest.approx(elongation, rel=0.01)
    assert float(result.largest_gap) < gap
