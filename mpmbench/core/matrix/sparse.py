"""The consistent mass matrix in rows of equal width, by conjugate gradients or (where it is constant) factorised once.

Row i holds ``values[i, :]`` in ``columns[i, :]``, ascending, its diagonal at ``diagonal[i]``;
unused places hold 0. On tensor grids the place of a pair in its row depends only on the two
functions, so assembly is plain arithmetic.
"""

import numpy as np
from scipy.sparse import csc_matrix, csr_matrix
from scipy.sparse.linalg import SuperLU, splu

from mpmbench.core.bases import Basis
from mpmbench.core.bases.grid.spline import TensorGrid
from mpmbench.core.bases.handle import Stencils, count, index, locate, scratch, value
from mpmbench.core.compiled import implements, kernel, lean, vector
from mpmbench.core.errors import BrokeDown
from mpmbench.core.particles import Particles

# Of the residual, relative to the right-hand side, in the norm of the preconditioner.
TOLERANCE = 1e-13
MOST_ITERATIONS = 2000


def place(phi, columns, i, k, j, n):  # type: ignore[no-untyped-def]
    """Place of column j in row i, where i and j are the k-th and n-th functions at a point; -1 if there is none."""
    raise NotImplementedError


@implements(place, TensorGrid)
def _place_on_grid(phi, columns, i, k, j, n):  # type: ignore[no-untyped-def]
    order = len(phi.order)
    where, stride = 0, 1
    for _ in range(len(phi.axes)):
        where += (n % order - k % order + order - 1) * stride
        stride *= 2 * order - 1
        n //= order
        k //= order
    return where


@implements(place, Stencils)
def _place_in_cloud(phi, columns, i, k, j, n):  # type: ignore[no-untyped-def]
    low, high = 0, columns.shape[1]
    while low < high:  # unused places repeat a column beyond all others
        middle = (low + high) // 2
        if columns[i, middle] < j:
            low = middle + 1
        else:
            high = middle
    return low if low < columns.shape[1] and columns[i, low] == j else -1


@kernel
def assemble_rows(phi, x, m, columns, values):  # type: ignore[no-untyped-def]
    """``values[i, place] = sum_p m_p phi_i phi_j``; returns False when a pair has no place in the pattern."""
    work, grad_phi = scratch(phi), vector(phi.axes)
    values[:] = 0.0
    most = columns.shape[1]
    stencil, phi_p = np.empty(most, dtype=np.int64), np.empty(most)
    for p in range(x.shape[0]):
        at = locate(phi, x, p, work)
        functions = count(phi, at)
        if functions > most:
            return False
        for k in range(functions):
            stencil[k], phi_p[k] = index(phi, at, k), value(phi, at, k, work, grad_phi)
        for k in range(functions):
            i, weight = stencil[k], m[p] * phi_p[k]
            for n in range(functions):
                where = place(phi, columns, i, k, stencil[n], n)
                if where < 0:
                    return False
                values[i, where] += weight * phi_p[n]
    return True


@lean
def matrix_product(columns, values, a, out):  # type: ignore[no-untyped-def]
    """``out = M a`` for each column of `a`, shape (N, dim)."""
    for i in range(a.shape[0]):
        for d in range(a.shape[1]):
            out[i, d] = 0.0
        for k in range(columns.shape[1]):
            j = columns[i, k]
            for d in range(a.shape[1]):
                out[i, d] += values[i, k] * a[j, d]


@lean
def solve_lower(columns, values, diagonal, free, b, z):  # type: ignore[no-untyped-def]
    """``z = (D + L)^-1 b`` on the free components, zero elsewhere; `z` may be `b`."""
    n, dim = b.shape
    for i in range(n):
        inverse = 1.0 / values[i, diagonal[i]]
        for d in range(dim):
            total = b[i, d]
            for k in range(diagonal[i]):
                total -= values[i, k] * z[columns[i, k], d]
            z[i, d] = total * inverse if free[i, d] else 0.0


@lean
def solve_upper(columns, values, diagonal, free, s, t, rest):  # type: ignore[no-untyped-def]
    """``t = (D + U)^-1 s`` on the free components, zero elsewhere, and ``rest = s - D t``."""
    n, dim = s.shape
    for i in range(n - 1, -1, -1):
        diagonal_i = values[i, diagonal[i]]
        inverse = 1.0 / diagonal_i
        for d in range(dim):
            total = s[i, d]
            # what the last row has given comes last
            for k in range(columns.shape[1] - 1, diagonal[i], -1):
                total -= values[i, k] * t[columns[i, k], d]
            t[i, d] = total * inverse if free[i, d] else 0.0
            rest[i, d] = s[i, d] - diagonal_i * t[i, d]


@kernel
def conjugate_gradients(columns, values, diagonal, free, rhs, out, r, t, w, s):  # type: ignore[no-untyped-def]
    """Solve ``M out = rhs`` on the free components, given `out` on the others; each component iterates by itself.

    The preconditioner is a symmetric Gauss-Seidel sweep, ``(D + L) D^-1 (D + U)``. Since its
    factors sum up to ``M + D``, the product with M costs nothing beside the sweep (Eisenstat 1981):
    for ``t = (D + U)^-1 s``, ``(D + L)^-1 M t = t + (D + L)^-1 (s - D t)``.

    Returns the number of iterations, -1 when they do not converge or the matrix is not positive
    definite.
    """
    n, dim = rhs.shape
    for i in range(n):
        for d in range(dim):
            if free[i, d]:
                out[i, d] = 0.0
    matrix_product(columns, values, out, w)
    for i in range(n):
        for d in range(dim):
            w[i, d] = rhs[i, d] - w[i, d]
    solve_lower(columns, values, diagonal, free, w, r)
    rr, alpha, beta = (
        np.zeros(dim),
        np.zeros(dim),
        np.zeros(dim),
    )  # rr = r D r: residual P^-1 residual
    for i in range(n):
        for d in range(dim):
            s[i, d] = values[i, diagonal[i]] * r[i, d]
            rr[d] += r[i, d] * s[i, d]
    goal = TOLERANCE**2 * rr
    for iteration in range(MOST_ITERATIONS):
        if np.all(rr <= goal):
            return iteration
        solve_upper(columns, values, diagonal, free, s, t, w)
        solve_lower(columns, values, diagonal, free, w, w)
        alpha[:] = 0.0
        for i in range(n):
            for d in range(dim):
                w[i, d] += t[i, d]
                alpha[d] += s[i, d] * w[i, d]
        for d in range(dim):
            if rr[d] > goal[d]:
                if not alpha[d] > 0.0:
                    return -1
                alpha[d] = rr[d] / alpha[d]
            else:
                alpha[d] = 0.0
        beta[:] = 0.0
        for i in range(n):
            for d in range(dim):
                if free[i, d]:
                    out[i, d] += alpha[d] * t[i, d]
                r[i, d] -= alpha[d] * w[i, d]
                beta[d] += values[i, diagonal[i]] * r[i, d] * r[i, d]
        for d in range(dim):
            previous = rr[d]
            rr[d] = beta[d]
            beta[d] = rr[d] / previous if previous > 0.0 else 0.0
        for i in range(n):
            for d in range(dim):
                s[i, d] = values[i, diagonal[i]] * r[i, d] + beta[d] * s[i, d]
    return -1


class SparseMass:
    """``M_ij = sum_p m_p phi_i phi_j`` (Wobbes 2020, Eqs. 19, 48, 90) by conjugate gradients (fulfils `Mass`)."""

    def __init__(self, fixed: np.ndarray, threshold: float) -> None:
        self.fixed, self.threshold = fixed, threshold
        self.free = ~fixed
        self.active = np.ones(len(fixed), dtype=np.bool_)
        self.columns = np.zeros((len(fixed), 0), dtype=np.int64)
        self.values = np.zeros((len(fixed), 0))
        self.diagonal = np.zeros(len(fixed), dtype=np.int64)
        self._work = [np.zeros(fixed.shape) for _ in range(4)]

    def assemble(self, basis: Basis, p: Particles, m_i: np.ndarray) -> None:
        if not self.columns.shape[1] or not assemble_rows(
            basis.handle, p.x, p.m, self.columns, self.values
        ):
            self.columns, self.diagonal = pattern(basis, p.x)
            self.values = np.zeros(self.columns.shape)
            assemble_rows(basis.handle, p.x, p.m, self.columns, self.values)
        mass = self.values[np.arange(len(self.fixed)), self.diagonal]
        self.active = mass > self.threshold
        np.logical_and(~self.fixed, self.active[:, None], out=self.free)
        unknowns = int(self.free.sum(axis=0).max())
        if unknowns > len(p.x) - p.tracers:
            raise BrokeDown(
                f"singular consistent mass matrix: {unknowns} free nodes and only "
                f"{len(p.x) - p.tracers} particles"
            )

    def solve(self, rhs: np.ndarray, out: np.ndarray) -> None:
        out[~self.fixed & ~self.active[:, None]] = 0.0
        arrays = self.columns, self.values, self.diagonal, self.free
        if conjugate_gradients(*arrays, rhs, out, *self._work) < 0:
            raise BrokeDown("singular consistent mass matrix: conjugate gradients do not converge")

    def multiply(self, a: np.ndarray) -> np.ndarray:
        out = np.zeros_like(a)
        matrix_product(self.columns, self.values, a, out)
        return out


class DirectMass(SparseMass):
    """A constant mass matrix (functions that do not change at the particles), factorised once per component."""

    def __init__(self, fixed: np.ndarray, threshold: float) -> None:
        super().__init__(fixed, threshold)
        self._factors: list[SuperLU] = []
        self._coupling: list[csr_matrix] = []

    def assemble(self, basis: Basis, p: Particles, m_i: np.ndarray) -> None:
        if self._factors:
            return
        super().assemble(basis, p, m_i)
        n = len(self.fixed)
        rows = np.repeat(np.arange(n), self.columns.shape[1])
        used = self.values.ravel() != 0.0
        matrix = csr_matrix(
            (self.values.ravel()[used], (rows[used], self.columns.ravel()[used])), shape=(n, n)
        )
        for d in range(self.fixed.shape[1]):
            free = self.free[:, d]
            if d > 0 and np.array_equal(free, self.free[:, d - 1]):
                self._factors.append(self._factors[-1])
                self._coupling.append(self._coupling[-1])
                continue
            try:
                self._factors.append(splu(csc_matrix(matrix[free][:, free])))
            except RuntimeError as error:
                raise BrokeDown(f"singular consistent mass matrix: {error}") from None
            self._coupling.append(matrix[free][:, ~free])

    def solve(self, rhs: np.ndarray, out: np.ndarray) -> None:
        out[~self.fixed & ~self.active[:, None]] = 0.0
        for d, factor in enumerate(self._factors):
            free = self.free[:, d]
            out[free, d] = factor.solve(rhs[free, d] - self._coupling[d] @ out[~free, d])


def pattern(basis: Basis, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Columns of each row, shape (N, width), and the place of the diagonal, shape (N,).

    On tensor grids all pairs within the degree, whether or not particles see them; on clouds the
    pairs that particles see, which is made anew when a new pair appears.
    """
    n = len(basis.nodes)
    if isinstance(basis.handle, TensorGrid):
        return grid_pattern(basis.handle)
    handle = basis.handle
    rows = np.repeat(np.arange(len(x)), handle.index.shape[1])
    valid = (np.arange(handle.index.shape[1]) < handle.size[:, None]).ravel()
    incidence = csr_matrix(
        (np.ones(valid.sum()), (rows[valid], handle.index.ravel()[valid])), shape=(len(x), n)
    )
    pairs = csr_matrix(
        incidence.T @ incidence + csr_matrix((np.ones(n), (range(n), range(n))), shape=(n, n))
    )
    pairs.sort_indices()
    length = np.diff(pairs.indptr)
    columns = np.full((n, int(length.max())), n - 1, dtype=np.int64)
    place_in_row = np.arange(pairs.nnz) - np.repeat(pairs.indptr[:-1], length)
    row = np.repeat(np.arange(n), length)
    columns[row, place_in_row] = pairs.indices
    return columns, place_in_row[pairs.indices == row]


def grid_pattern(grid: TensorGrid) -> tuple[np.ndarray, np.ndarray]:
    """Neighbours within the degree along each axis; beyond the grid the row's own number, whose value stays 0."""
    reach = np.arange(1 - len(grid.order), len(grid.order))
    n = int(np.prod(grid.shape))
    place = np.stack(np.unravel_index(np.arange(n), grid.shape), axis=1)
    offsets = np.stack(np.meshgrid(*[reach] * len(grid.shape), indexing="ij"), axis=-1).reshape(
        -1, len(grid.shape)
    )
    neighbour = place[:, None, :] + offsets[None, :, :]
    inside = np.all((neighbour >= 0) & (neighbour < np.array(grid.shape)), axis=2)
    strides = np.array([int(np.prod(grid.shape[d + 1 :])) for d in range(len(grid.shape))])
    columns = np.where(inside, neighbour @ strides, np.arange(n)[:, None])
    return columns, np.full(n, len(offsets) // 2, dtype=np.int64)
