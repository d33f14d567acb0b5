"""Patterns of nodal values that the particles hardly see: with them a consistent mass matrix is next to singular."""

import numpy as np
from scipy.linalg import eigh
from scipy.sparse import csr_matrix, diags_array
from scipy.sparse.linalg import eigsh

from mpmbench.core.bases import Basis
from mpmbench.core.bases.handle import Stencils
from mpmbench.core.particles import Particles

DENSE_NODES = 400  # up to these a dense eigenvalue problem costs next to nothing
SHIFT = -1e-4  # below the spectrum of a mass matrix over its row sums


def seen_share(basis: Basis, p: Particles, fixed: np.ndarray) -> float:
    """Mass of the pattern that has least at the particles, over its mass halfway between them and their nearest nodes.

    About 1 or more where the particles are many and well spread. With one at the centre of each
    cell a zigzag of the nodes nearly vanishes at all of them, and only there.

    Parameters
    ----------
    basis : Basis
        With functions in stencils.
    p : Particles
    fixed : ndarray
        Constrained components, shape (N, dim).
    """
    x, m, nodes = p.x[p.material], p.m[p.material], basis.nodes
    stored = basis.evaluate(x)
    seen = _sparse(stored, len(nodes))
    M = (seen.T @ diags_array(m) @ seen).tocsr()
    row_sum = np.asarray(M.sum(axis=1)).ravel()
    active = np.flatnonzero((row_sum > 0.0) & ~fixed.all(axis=1))
    if len(active) < 2:
        return 1.0
    scale = 1.0 / np.sqrt(row_sum[active])
    matrix = diags_array(scale) @ M[active][:, active] @ diags_array(scale)
    if len(active) <= DENSE_NODES:
        vector = eigh(matrix.toarray(), subset_by_index=(0, 0))[1][:, 0]
    else:
        vector = eigsh(matrix.tocsc(), k=1, sigma=SHIFT, v0=np.ones(len(active)))[1][:, 0]
    pattern = np.zeros(len(nodes))
    pattern[active] = scale * vector
    phi = np.where(np.arange(stored.phi.shape[1]) < stored.size[:, None], stored.phi, -1.0)
    nearest = np.argsort(-phi, axis=1, kind="stable")[:, : x.shape[1] + 1]
    between = 0.0
    for near in nearest.T:
        corner = nodes[stored.index[np.arange(len(x)), near]]
        values = _sparse(basis.evaluate(0.5 * (x + corner)), len(nodes)) @ pattern
        between += float(m @ values**2) / nearest.shape[1]
    return float(m @ (seen @ pattern) ** 2) / between


def _sparse(stored: Stencils, nodes: int) -> csr_matrix:
    """Values of the functions, shape (points, N)."""
    used = np.arange(stored.phi.shape[1]) < stored.size[:, None]
    first = np.concatenate([[0], np.cumsum(stored.size)])
    return csr_matrix(
        (stored.phi[used], stored.index[used], first), shape=(len(stored.size), nodes)
    )
