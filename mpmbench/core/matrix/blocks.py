"""Matrices in blocks of dim x dim: products, and factors as a band or, beyond its width, sparse."""

from collections.abc import Callable

import numpy as np
from scipy.linalg.lapack import dgbtrf, dgbtrs, dpbtrf, dpbtrs
from scipy.sparse import bsr_array, csr_array, diags_array
from scipy.sparse.linalg import splu

from mpmbench.core.compiled import compiled
from mpmbench.core.errors import BrokeDown
from mpmbench.core.matrix.pattern import Pattern

# A larger band is factorised as a sparse matrix. In space bands are 2 to 14 times as fast, since nested dissection
# fills in as much and LAPACK's kernels are faster; on fine grids in the plane, of this size, both take the same time.
LARGEST_BAND = 1_000_000_000  # [byte]

Solve = Callable[[np.ndarray], np.ndarray]


class BandMemory:
    """Memory for a band, for one matrix after another: fresh memory costs more than its use."""

    def __init__(self) -> None:
        self._values = np.empty(0)

    def take(self, rows: int, columns: int) -> np.ndarray:
        """An array of this shape, with whatever is in it."""
        if self._values.size < rows * columns:
            self._values = np.empty(rows * columns)
        return self._values[: rows * columns].reshape(rows, columns)


def factorise(
    pattern: Pattern, blocks: np.ndarray, fixed: np.ndarray, memory: BandMemory | None = None
) -> Solve:
    """Factorise the matrix without its fixed rows and columns.

    Parameters
    ----------
    pattern : Pattern
    blocks : ndarray
        Shape (blocks, dim, dim).
    fixed : ndarray of bool
        Components that are known, shape (A, dim); their solution is zero.
    memory : BandMemory, optional
        Where the factors are kept; the solver is good until the next matrix takes it.

    Returns
    -------
    callable
        ``solve(rhs)`` for right-hand sides of shape (A dim,) or (A dim, n); entries of fixed
        components are ignored.

    Raises
    ------
    BrokeDown
        When the matrix is singular.
    """
    left_out = np.ascontiguousarray(fixed.ravel())
    memory = memory or BandMemory()
    width = (pattern.band + 1) * blocks.shape[1] - 1
    solve: Solve | None = None
    if fits(len(left_out), width + 1):
        solve = _cholesky(pattern, blocks, left_out, memory)
    if solve is None and fits(len(left_out), 3 * width + 1):
        solve = _band(pattern, blocks, left_out, memory)
    return solve or _sparse(pattern, blocks, left_out)


def fits(rows: int, columns: int) -> bool:
    """Whether a band of so many numbers is worth its memory."""
    return 8 * rows * columns <= LARGEST_BAND


def _masked(solve: Solve, left_out: np.ndarray) -> Solve:
    def masked(rhs: np.ndarray) -> np.ndarray:
        right = np.array(rhs, order="F")
        right[left_out] = 0.0
        return solve(right)

    return masked


def _cholesky(
    pattern: Pattern, blocks: np.ndarray, left_out: np.ndarray, memory: BandMemory
) -> Solve | None:
    """Banded Cholesky; None when the matrix is not stored as symmetric or not positive definite."""
    if not pattern.lower:
        return None
    dim = blocks.shape[1]
    width = (pattern.band + 1) * dim - 1
    band = memory.take(len(left_out), width + 1)  # transposed: LAPACK's columns are contiguous
    fill_band(pattern.start, pattern.column, blocks, left_out, False, 0, band)
    factor, failed = dpbtrf(band.T, lower=1, overwrite_ab=1)
    if failed:
        return None
    return _masked(lambda rhs: dpbtrs(factor, rhs, lower=1)[0], left_out)


def _band(pattern: Pattern, blocks: np.ndarray, left_out: np.ndarray, memory: BandMemory) -> Solve:
    """Banded LU with partial pivoting."""
    dim = blocks.shape[1]
    width = (pattern.band + 1) * dim - 1
    band = memory.take(len(left_out), 3 * width + 1)
    fill_band(pattern.start, pattern.column, blocks, left_out, pattern.lower, 2 * width, band)
    factor, pivots, failed = dgbtrf(band.T, width, width, overwrite_ab=1)
    if failed:
        raise BrokeDown(singular(pattern, failed - 1, dim))
    return _masked(lambda rhs: dgbtrs(factor, width, width, rhs, pivots)[0], left_out)


def _sparse(pattern: Pattern, blocks: np.ndarray, left_out: np.ndarray) -> Solve:
    """Sparse LU with fill-in reduced by reordering."""
    kept = diags_array(np.where(left_out, 0.0, 1.0))
    identity = diags_array(np.where(left_out, 1.0, 0.0))
    try:
        return _masked(
            splu((kept @ whole(pattern, blocks) @ kept + identity).tocsc()).solve, left_out
        )
    except RuntimeError:
        raise BrokeDown("singular tangent matrix: a node is not held by enough particles") from None


def whole(pattern: Pattern, blocks: np.ndarray) -> csr_array:
    """The whole matrix, shape (A dim, A dim), also where only its lower half is stored."""
    shape = 2 * (len(pattern.active) * blocks.shape[1],)
    stored = bsr_array((blocks, pattern.column, pattern.start), shape=shape).tocsr()
    if not pattern.lower:
        return stored
    below = np.where((pattern.block_row > pattern.column)[:, None, None], blocks, 0.0)
    return stored + bsr_array((below, pattern.column, pattern.start), shape=shape).T.tocsr()


def singular(pattern: Pattern, row: int, dim: int) -> str:
    """What to tell the user about a pivot that is zero."""
    return (
        f"singular tangent matrix at node {pattern.active[row // dim]}, component {row % dim}: "
        "too few particles hold it"
    )


@compiled
def fill_band(start, column, blocks, left_out, mirror, diagonal, band):
    """Write the band as LAPACK takes it, transposed: ``band[j, diagonal + i - j] = K_ij``.

    Fixed rows and columns are those of the identity. With `diagonal` = 0 the band ends there; else
    LAPACK itself sets the first half of those above, which take the fill-in of pivoting, and
    `mirror` repeats the lower half in the upper one.
    """
    dim = blocks.shape[1]
    band[:, diagonal // 2 :] = 0.0
    for r in range(start.shape[0] - 1):
        for s in range(start[r], start[r + 1]):
            for a in range(dim):
                i = r * dim + a
                for b in range(dim):
                    j = column[s] * dim + b
                    if left_out[i] or left_out[j]:
                        continue
                    if i >= j or diagonal > 0:
                        band[j, diagonal + i - j] = blocks[s, a, b]
                    if mirror and column[s] < r:
                        band[i, diagonal + j - i] = blocks[s, a, b]
    for i in range(left_out.shape[0]):
        if left_out[i]:
            band[i, diagonal] = 1.0


@compiled
def product(start, column, blocks, lower, u):
    """Scalar blocks times vectors: ``out_r = sum_c M_rc u_c``, shapes (blocks,) and (A, dim)."""
    out = np.zeros_like(u)
    for r in range(start.shape[0] - 1):
        for s in range(start[r], start[r + 1]):
            c = column[s]
            for d in range(u.shape[1]):
                out[r, d] += blocks[s] * u[c, d]
                if lower and c < r:
                    out[c, d] += blocks[s] * u[r, d]
    return out
