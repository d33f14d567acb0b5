"""Checks for nodal values that no particle sees: they make a consistent mass matrix singular."""

import numpy as np
from scipy.linalg import eigh
from scipy.sparse import csr_array, diags_array
from scipy.sparse.linalg import eigsh

from mpmbench.core.bases import Basis
from mpmbench.core.bases.handle import Stencils
from mpmbench.core.errors import BrokeDown
from mpmbench.core.matrix.light import LightNodes
from mpmbench.core.particles import Particles

# Of a mass matrix over its row sums; a zigzag that no particle sees has next to no mass.
SMALLEST_EIGENVALUE = 0.03
# Of the mass of a pattern that particles see: at least a half where they are well spread.
SMALLEST_SHARE = 0.05
DENSE_NODES = 400  # up to these a dense eigenvalue problem costs next to nothing
SHIFT = -1e-4  # below the spectrum of a mass matrix over its row sums


def refuse_too_few_particles(
    basis: Basis, p: Particles, fixed: np.ndarray, light_nodes: LightNodes
) -> None:
    """Refuse fewer particles than nodes where nodal values nearly vanish at all of them.

    Light nodes have no values of their own. Held end nodes alone make such a matrix regular; its
    smallest eigenvalue still falls with the square of the spacing.

    Raises
    ------
    BrokeDown
    """
    particles = len(p.x) - p.tracers
    if particles >= len(basis.nodes):
        return
    solid = np.arange(particles)
    seen = _sparse(basis.evaluate_particles(p.x, solid), len(basis.nodes))
    seen = csr_array(seen @ light_nodes.matrix())
    nodes = len(np.unique(seen.nonzero()[1]))
    active, _, matrix = scaled_mass(seen, p.m[p.material], fixed)
    if particles >= nodes or len(active) == 0:
        return
    smallest, _ = lowest(matrix)
    if smallest < SMALLEST_EIGENVALUE:
        raise BrokeDown(
            f"singular consistent mass matrix: {nodes} nodes and only {particles} particles leave "
            f"a zigzag of the nodes with {max(smallest, 0.0):.1e} of its mass; use more particles "
            "per cell, or lumped mass"
        )


def refuse_unseen_patterns(basis: Basis, p: Particles, fixed: np.ndarray) -> None:
    """Refuse particles that a combination of nodal values escapes, however many there are.

    Raises
    ------
    BrokeDown
        In two or three dimensions only.
    """
    if p.dimension == 1:
        return
    share = seen_share(basis, p, fixed)
    if share < SMALLEST_SHARE:
        raise BrokeDown(
            f"singular consistent mass matrix: a pattern of the {len(basis.nodes)} nodes nearly "
            f"vanishes at all {len(p.x) - p.tracers} particles, which see {share:.1e} of its mass; "
            "use more particles per cell, or lumped mass"
        )


def seen_share(basis: Basis, p: Particles, fixed: np.ndarray) -> float:
    """Least mass of a pattern at the particles, over its mass halfway to their nearest nodes.

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
    stored = basis.evaluate_particles(p.x, np.arange(len(x)))
    seen = _sparse(stored, len(nodes))
    active, scale, matrix = scaled_mass(seen, m, fixed)
    if len(active) < 2:
        return 1.0
    pattern = np.zeros(len(nodes))
    pattern[active] = scale * lowest(matrix)[1]
    phi = np.where(np.arange(stored.phi.shape[1]) < stored.size[:, None], stored.phi, -1.0)
    nearest = np.argsort(-phi, axis=1, kind="stable")[:, : x.shape[1] + 1]
    between = 0.0
    for near in nearest.T:
        corner = nodes[stored.index[np.arange(len(x)), near]]
        values = _sparse(basis.evaluate(0.5 * (x + corner)), len(nodes)) @ pattern
        between += float(m @ values**2) / nearest.shape[1]
    return float(m @ (seen @ pattern) ** 2) / between


def scaled_mass(
    seen: csr_array, m: np.ndarray, fixed: np.ndarray
) -> tuple[np.ndarray, np.ndarray, csr_array]:
    """Free nodes with mass, the inverse roots of their row sums, and ``M_ij`` times both of these.

    `seen`, shape (P, N), holds the values of the functions at particles with masses `m` [kg].
    """
    M = (seen.T @ diags_array(m) @ seen).tocsr()
    row_sum = np.asarray(M.sum(axis=1)).ravel()
    active = np.flatnonzero((row_sum > 0.0) & ~fixed.all(axis=1))
    scale = 1.0 / np.sqrt(row_sum[active])
    return active, scale, diags_array(scale) @ M[active][:, active] @ diags_array(scale)


def lowest(matrix: csr_array) -> tuple[float, np.ndarray]:
    """Smallest eigenvalue of a scaled mass matrix and its vector, shape (A,)."""
    if matrix.shape[0] <= DENSE_NODES:
        values, vectors = eigh(matrix.toarray(), subset_by_index=(0, 0))
    else:
        values, vectors = eigsh(matrix.tocsc(), k=1, sigma=SHIFT, v0=np.ones(matrix.shape[0]))
    return float(values[0]), vectors[:, 0]


def _sparse(stored: Stencils, nodes: int) -> csr_array:
    """Values of the functions, shape (points, N)."""
    used = np.arange(stored.phi.shape[1]) < stored.size[:, None]
    first = np.concatenate([[0], np.cumsum(stored.size)])
    return csr_array((stored.phi[used], stored.index[used], first), shape=(len(stored.size), nodes))
