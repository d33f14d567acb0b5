"""How much of a pattern of the nodes particles see, by dense algebra."""

import numpy as np

from mpmbench.core.bases.grid.linear import Linear
from mpmbench.core.geometry import Box, Cloud
from mpmbench.core.geometry.triangulate import jittered, triangulation
from mpmbench.core.matrix.mass_checks import seen_share
from mpmbench.core.particles import Particles


def test_share_of_the_pattern_that_particles_see_least() -> None:
    """On triangles every particle has three nodes, and the points between are halfway to each of them."""
    nodes = Box((0.0, 0.0), (1.0, 1.0), (4, 4)).points
    nodes = jittered(nodes, 0.25, 0.2, (nodes < 1e-9) | (nodes > 1.0 - 1e-9), 5)
    cloud = Cloud(nodes, triangulation(nodes, 1.0))
    assert cloud.simplices is not None
    corners = nodes[cloud.simplices]
    rng, n = np.random.default_rng(0), len(nodes)
    weights = rng.dirichlet(np.full(3, 2.0), (2, len(corners)))
    X = np.einsum("rsk,skd->rsd", weights, corners).reshape(-1, 2)
    p = Particles.at_rest(X, rng.uniform(0.5, 1.0, len(X)), 2.0, np.array([[0.5, 0.5]]))
    basis = Linear().build(cloud, len(p.x), True)
    fixed = np.zeros(nodes.shape, dtype=bool)
    fixed[3] = True
    free = np.flatnonzero(~fixed.any(axis=1))

    phi, m = basis.evaluate(X).matrix(n), p.m[:-1]
    M = phi.T @ (m[:, None] * phi)
    scale = 1.0 / np.sqrt(M.sum(axis=1)[free])
    values, vectors = np.linalg.eigh(scale[:, None] * M[np.ix_(free, free)] * scale)
    pattern = np.zeros(n)
    pattern[free] = scale * vectors[:, 0]
    between = [
        m @ (basis.evaluate(0.5 * (X + np.tile(corners[:, k], (2, 1)))).matrix(n) @ pattern) ** 2
        for k in range(3)
    ]
    expected = m @ (phi @ pattern) ** 2 / np.mean(between)
    assert values[0] < 0.9 * values[1]  # one pattern is the least seen
    assert np.isclose(seen_share(basis, p, fixed), expected, rtol=1e-8)
