"""What theory says is one, to round-off, across files; the others stand where they belong.

There are: transfers that are one, and the series towards the consistent mass (test_transfers), reproducing
kernels as moving least squares (test_rkpm), affine gradients as those of hats and of APIC
(test_affine_gradients), CPDI2 as CPDI in affine motion (test_cpdi2), OTM, MPM and the unified method by
their choices (tests/problems/test_bar_fixed_ends).
"""

from typing import Any

import numpy as np
import pytest

from mpmbench.core import registry
from mpmbench.core.bases import Basis
from mpmbench.core.bases.grid.ddmp import DualDomain
from mpmbench.core.geometry import Box
from mpmbench.core.loops.explicit import Explicit
from mpmbench.core.particles import Particles
from tests.core.support import run
from tests.core.test_transfers import after, difference

CELLS = 6


def grid(dim: int) -> Box:
    return Box((0.0,) * dim, (3.0, 1.5)[:dim], (CELLS,) * dim)


def followed(name: str, p: Particles, **settings: Any) -> Basis:
    """Functions of the particles' domains, evaluated at them."""
    basis: Basis = registry.get("basis", name)(**settings).build(grid(p.dimension), len(p.x), False)
    basis.follow(p)
    basis.locate(p.x)
    return basis


def functions(basis: Basis, p: Particles) -> tuple[np.ndarray, np.ndarray]:
    """Values (P, N) and gradients (P, N, dim)."""
    stored = basis.evaluate_particles(p.x, np.arange(len(p.x)))
    return stored.matrix(len(basis.nodes)), stored.gradient_matrix(len(basis.nodes))


def inside(dim: int, width: float) -> Particles:
    """Particles in inner cells whose domains, of this width in cells, do not reach beyond their cells."""
    rng, h = np.random.default_rng(7), grid(dim).spacing
    cell = rng.integers(1, CELLS - 1, (20, dim))
    place = rng.uniform(0.5 * width, 1.0 - 0.5 * width, (20, dim))
    return Particles.at_rest((cell + place) * h, np.full(20, np.prod(width * h)), 1.0)


@pytest.mark.parametrize("dim", (pytest.param(1, marks=pytest.mark.slow), 2))
def test_gimp_and_cpdi_without_deformation(dim: int) -> None:
    """Domains of all kinds are one at F = 1; within a cell corners say what integrals say."""
    p = inside(dim, 0.4)
    uniform = functions(followed("gimp", p, domain="uniform"), p)
    for name, settings in (
        ("gimp", {"domain": "contiguous"}),
        ("gimp", {"domain": "finite"}),
        ("cpdi", {}),
    ):
        for one, other in zip(functions(followed(name, p, **settings), p), uniform, strict=True):
            width = min(one.shape[1], other.shape[1])
            assert np.abs(one[:, :width] - other[:, :width]).max() < 1e-13, name
    stretched = inside(dim, 0.4)
    stretched.F *= 1.3
    assert (
        np.abs(functions(followed("gimp", stretched, domain="finite"), p)[0] - uniform[0]).max()
        > 1e-3
    )


@pytest.mark.parametrize("dim", (pytest.param(1, marks=pytest.mark.slow), 2))
def test_splines_of_degree_one_are_hats(dim: int) -> None:
    p = inside(dim, 0.1)
    for one, other in zip(
        functions(followed("bspline", p, degree=1), p),
        functions(followed("linear", p), p),
        strict=True,
    ):
        assert np.abs(one - other).max() < 1e-13


def test_dual_domains_in_the_middle_of_a_cell() -> None:
    """alpha = 1 there: the gradients of hats; on a face, where alpha vanishes, central differences on a line."""
    basis, h = DualDomain(alpha=1.0).build(grid(1), 5, False), 0.5
    hats = registry.get("basis", "linear")().build(grid(1), 5, False)
    middle = np.array([[2.5 * h], [3.5 * h]])
    n = len(basis.nodes)
    one, other = (b.evaluate(middle).gradient_matrix(n) for b in (basis, hats))
    assert np.abs(one - other).max() < 1e-13
    at_node = basis.evaluate(np.array([[3.0 * h]])).gradient_matrix(n)[0, :, 0]
    central = np.zeros(n)
    central[2], central[4] = -0.5 / h, 0.5 / h
    assert np.abs(at_node - central).max() < 1e-13


def test_total_lagrangian_mpm_with_nodal_velocities_is_linear_finite_elements() -> None:
    """On a line, where hats of nodes that move and hats pushed forward by F have the same gradients."""
    keys = {"resolution": 8, "particles_per_cell": 1, "time_step": 1e-3, "end_time": 0.4}
    kept = run("bar_dynamic_traction", "tlmpm", "linear", method__transfer="nodal", **keys)
    moving = run("bar_dynamic_traction", "linear_fem", "linear", **keys)
    for name in ("displacement", "velocity", "stress"):
        one, other = kept[name].values[-1], moving[name].values[-1]
        assert np.abs(one - other).max() < 1e-11 * np.abs(other).max(), name


def test_means_of_hats_over_a_cell_are_their_derivatives() -> None:
    """Conforming nodal integration on a line, where cells of midpoints do not reach over nodes, is finite elements."""
    keys = {"basis": "linear", "shape_functions": "frozen"}
    plain, means = (after(10, gradient=kind, **keys) for kind in ("functions", "conforming"))
    assert difference(plain, means) < 1e-12
    assert type(means.basis).__name__ == "FrozenBasis" and plain.choices != means.choices


def test_no_flip_and_no_separation_leave_apic_and_places_by_nodes() -> None:
    """ASFLIP's weights at zero: velocities of APIC; places of any alpha by the nodes alone."""
    plain, same = after(20, transfer="apic"), after(20, transfer="asflip", flip=0.0, separation=1.0)
    assert difference(plain, same) < 1e-12
    assert Explicit(transfer="asflip", flip=0.3).flip_weight == 0.3
