"""Reproducing kernel functions against the formulas of Liu et al. 1995, and against moving least squares."""

from itertools import combinations_with_replacement

import numpy as np
import pytest

from mpmbench.core import registry
from mpmbench.core.geometry import Cloud

RADIUS = 2.4  # over the spacing


def cloud(dim: int) -> np.ndarray:
    """Irregular nodes, 6 along each axis, about 1 m apart."""
    regular = np.stack(np.meshgrid(*[np.arange(6.0)] * dim, indexing="ij"), -1).reshape(-1, dim)
    return regular + np.random.default_rng(dim).uniform(-0.2, 0.2, regular.shape)


def monomials(r: np.ndarray, order: int) -> np.ndarray:
    """H(r) up to an order, shape (n, m)."""
    columns = [np.ones(len(r))]
    for degree in range(1, order + 1):
        for axes in combinations_with_replacement(range(r.shape[1]), degree):
            columns.append(np.prod(r[:, list(axes)], axis=1))
    return np.stack(columns, axis=1)


def formula(x: np.ndarray, nodes: np.ndarray, radius: float, order: int) -> np.ndarray:
    """``H(0) . M^-1 H(x - x_I) w(x - x_I)`` at one point, as it is written, with the cubic spline."""
    r = x - nodes
    t = np.linalg.norm(r, axis=1) / radius
    inner, outer = 2.0 / 3.0 - 4.0 * t**2 + 4.0 * t**3, 4.0 / 3.0 * (1.0 - t) ** 3
    w = np.where(t <= 0.5, inner, np.where(t < 1.0, outer, 0.0))
    H = monomials(r, order)
    M = np.einsum("ia,ib,i->ab", H, H, w)
    return H @ np.linalg.solve(M, monomials(np.zeros((1, r.shape[1])), order)[0]) * w


@pytest.mark.parametrize(
    ("dim", "order"),
    [
        *((1, order) for order in (0, 1, 2)),
        (2, 1),
        *(pytest.param(2, order, marks=pytest.mark.slow) for order in (0, 2)),
    ],
)
def test_functions_are_those_of_the_formula(dim: int, order: int) -> None:
    nodes = cloud(dim)
    geometry = Cloud(nodes)
    relative = RADIUS / geometry.nodal_spacing
    if relative > 3.0:
        pytest.fail("the cloud is too irregular")
    basis = registry.get("basis", "rkpm")(order=order, relative_radius=relative)
    x = np.random.default_rng(7).uniform(1.0, 4.0, (20, dim))
    stored = basis.build(geometry, len(x), False).evaluate(x)
    expected = np.array([formula(one, nodes, RADIUS, order) for one in x])
    assert np.abs(stored.matrix(len(nodes)) - expected).max() < 1e-12
    for d in range(dim):
        step = 1e-6 * np.eye(dim)[d]
        ahead, behind = (
            np.array([formula(one + way, nodes, RADIUS, order) for one in x])
            for way in (step, -step)
        )
        slope = (ahead - behind) / 2e-6
        assert np.abs(stored.gradient_matrix(len(nodes))[:, :, d] - slope).max() < 1e-7


@pytest.mark.parametrize("order", (1, 2))
def test_it_is_moving_least_squares_with_the_same_weight(order: int) -> None:
    nodes = cloud(1)
    x = np.linspace(0.2, 4.8, 40)[:, None]
    stored = [
        registry.get("basis", name)(**{key: order}, relative_radius=2.8)
        .build(Cloud(nodes), len(x), False)
        .evaluate(x)
        for name, key in (("rkpm", "order"), ("mls", "degree"))
    ]
    assert np.array_equal(stored[0].index, stored[1].index)
    assert np.abs(stored[0].phi - stored[1].phi).max() < 1e-14
    assert np.abs(stored[0].grad_phi - stored[1].grad_phi).max() < 1e-13


def test_order_0_reproduces_constants_and_is_not_negative() -> None:
    basis = registry.get("basis", "rkpm")(order=0, relative_radius=2.0)
    nodes, x = cloud(1), np.linspace(0.5, 4.5, 30)[:, None]
    values = basis.build(Cloud(nodes), len(x), False).evaluate(x).matrix(len(nodes))
    assert np.abs(values.sum(axis=1) - 1.0).max() < 1e-14 and values.min() >= 0.0
    assert np.abs(values @ nodes - x).max() > 1e-3
    assert not basis.promises.linear_completeness and basis.promises.non_negative
    assert registry.get("basis", "rkpm").promises.linear_completeness
