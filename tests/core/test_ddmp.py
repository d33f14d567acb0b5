"""Dual domain MPM: its gradients by their definition and at faces, and what it refuses."""

import numpy as np
import pytest

from mpmbench import case
from mpmbench.core.bases.grid.ddmp import DualDomain
from mpmbench.core.bases.grid.linear import Linear
from mpmbench.core.errors import NotApplicable
from mpmbench.core.geometry import Box
from mpmbench.core.loops.newmark import Newmark
from tests.core.support import compose

BOX = Box((-0.3, 0.1), (0.9, 1.1), (4, 3))


def by_definition(x: np.ndarray) -> np.ndarray:
    """``sum_j phi_j(x) (1/V_j) int phi_j grad phi_i`` by Gauss quadrature over all cells, shape (n, N, 2)."""
    hats, n = Linear().build(BOX, 1, False), len(BOX.points)
    point, weight = np.polynomial.legendre.leggauss(3)
    low = BOX.points.reshape(5, 4, 2)[:-1, :-1].reshape(-1, 1, 2)
    local = np.stack(np.meshgrid(point, point, indexing="ij"), axis=-1).reshape(-1, 2)
    places = (low + 0.5 * (local + 1.0) * BOX.spacing).reshape(-1, 2)
    share = np.tile(np.outer(weight, weight).ravel() / 4.0 * np.prod(BOX.spacing), len(low))
    stored = hats.evaluate(places)
    phi, grad = stored.matrix(n), stored.gradient_matrix(n)
    averages = np.einsum("q,qj,qie->jie", share, phi, grad) / (share @ phi)[:, None, None]
    return np.einsum("pj,jie->pie", hats.evaluate(x).matrix(n), averages)


@pytest.mark.parametrize("alpha", (0.5, 1.0))
def test_gradients_are_those_of_the_paper(alpha: float) -> None:
    x = np.array(BOX.lower) + np.random.default_rng(1).random((60, 2)) * [1.2, 1.0]
    n = len(BOX.points)
    t = np.mod((x - BOX.lower) / BOX.spacing, 1.0)
    share = (alpha * np.prod(4.0 * t * (1.0 - t), axis=1))[:, None, None]
    hats = Linear().build(BOX, 1, False).evaluate(x)
    expected = share * hats.gradient_matrix(n) + (1.0 - share) * by_definition(x)
    found = DualDomain(alpha=alpha).build(BOX, 1, False).evaluate(x)
    assert np.abs(found.gradient_matrix(n) - expected).max() < 1e-12
    assert np.abs(found.matrix(n) - hats.matrix(n)).max() < 1e-14


def test_gradients_on_faces_are_one_from_both_sides() -> None:
    """Also with alpha = 1 in the middle; those of the hats jump there."""
    face = np.array([[0.0, 0.4], [0.6, 0.9], [0.25, 0.1 + 1.0 / 3.0]])
    normal = np.array([[1.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    n = len(BOX.points)

    def jump(basis: DualDomain | Linear) -> float:
        functions = basis.build(BOX, 1, False)
        sides = [functions.evaluate(face + s * 1e-9 * normal).gradient_matrix(n) for s in (-1, 1)]
        return float(np.abs(sides[1] - sides[0]).max())

    assert jump(DualDomain(alpha=1.0)) < 1e-6
    assert jump(Linear()) > 1.0


def test_implicit_methods_are_refused() -> None:
    with pytest.raises(NotApplicable, match="nodes without mass"):
        DualDomain().check(Newmark(), False)


def test_too_small_grids_are_refused() -> None:
    with pytest.raises(NotApplicable, match="3 or more cells along each axis, given 2"):
        DualDomain().build(Box((0.0, 0.0), (1.0, 1.0), (4, 2)), 1, False)


@pytest.mark.parametrize("rule", ("penalty", "multi_field"))
def test_nodes_for_each_body_are_refused(rule: str) -> None:
    """Copies of a grid for bodies need functions that are products, which these gradients are not."""
    built = case.read(compose("two_squares", "mpm", "ddmp", contact=rule, resolution=4))
    with pytest.raises(NotApplicable, match="take contact=shared"):
        case.build(built)
