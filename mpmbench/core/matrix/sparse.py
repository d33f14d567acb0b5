"""The consistent mass matrix in rows of equal width, solved iteratively or factorised once.

Row i holds ``values[i, :]`` in ``columns[i, :]``, ascending, its diagonal at ``diagonal[i]``;
unused places hold 0. On tensor grids the place of a pair in its row depends only on the two
functions, so assembly is plain arithmetic; elsewhere it is searched for.
"""

from typing import Any, NamedTuple

import numpy as np
from scipy.sparse import csc_array, csr_array, diags_array, eye_array
from scipy.sparse.linalg import SuperLU, splu

from mpmbench.core.bases import Basis
from mpmbench.core.bases.grid.product import GridBasis
from mpmbench.core.bases.handle import Stencils, count, index, locate, place, scratch, value
from mpmbench.core.compiled import compiled, vector
from mpmbench.core.errors import BrokeDown
from mpmbench.core.matrix.axes import Axes, conjugate_gradients_by_axes, factorise_axes
from mpmbench.core.matrix.conjugate_gradients import conjugate_gradients, matrix_product
from mpmbench.core.matrix.light import LightNodes
from mpmbench.core.particles import Particles


@compiled
def assemble_rows(phi, x, m, columns, values):
    """``values[i, place] = sum_p m_p phi_i phi_j``; returns False when a pair has no place."""
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


class Rows(NamedTuple):
    """A matrix in rows of equal width, as above."""

    columns: np.ndarray
    values: np.ndarray
    diagonal: np.ndarray


class SparseMass:
    """``M_ij = sum_p m_p phi_i phi_j`` (Wobbes 2020, Eqs. 19, 48, 90) by conjugate gradients."""

    def __init__(self, fixed: np.ndarray, light_nodes: LightNodes) -> None:
        self.fixed, self.light_nodes = fixed, light_nodes
        self.free = ~fixed
        self.active = np.ones(len(fixed), dtype=np.bool_)
        self.system: Rows
        self.columns = np.zeros((len(fixed), 0), dtype=np.int64)
        self.values = np.zeros((len(fixed), 0))
        self.diagonal = np.zeros(len(fixed), dtype=np.int64)
        self._axes: Axes | None = None  # on grids, where they make a good guess
        self._by_axes = False
        self._force, *self._work = (np.zeros(fixed.shape) for _ in range(5))

    def assemble(
        self, basis: Basis, p: Particles, m_i: np.ndarray, seen: np.ndarray | None = None
    ) -> None:
        if not self.columns.shape[1] or not assemble_rows(
            basis.handle, p.x, p.m, self.columns, self.values
        ):
            self.columns, self.diagonal = pattern(basis, p.x)
            if isinstance(basis, GridBasis):
                grid = basis.handle
                self._axes = Axes.empty(grid.shape, len(grid.order), self.fixed.shape[1])
            self.values = np.zeros(self.columns.shape)
            assemble_rows(basis.handle, p.x, p.m, self.columns, self.values)
        mass = self.values[np.arange(len(self.fixed)), self.diagonal]
        self.active = mass > 0.0
        self.system = Rows(self.columns, self.values, self.diagonal)
        whole = not self.light_nodes.find(basis, p, m_i, mass, seen)
        if not whole:
            self.active &= ~self.light_nodes.light
            self.system = condensed(self.system, self.light_nodes)
        np.logical_and(~self.fixed, self.active[:, None], out=self.free)
        self._by_axes = (
            whole
            and self._axes is not None
            and factorise_axes(self._axes, self.values, self.diagonal, self.free)
        )
        unknowns = int(self.free.sum(axis=0).max())
        if unknowns > len(p.x) - p.tracers:
            raise BrokeDown(
                f"singular consistent mass matrix: {unknowns} free nodes and only "
                f"{len(p.x) - p.tracers} particles"
            )

    def solve(self, rhs: np.ndarray, out: np.ndarray) -> None:
        out[~self.fixed & ~self.active[:, None]] = 0.0
        force = self.light_nodes.gathered(rhs, self._force)
        if self._by_axes:
            rows = self._axes, self.columns, self.values
            found = conjugate_gradients_by_axes(*rows, self.free, force, out, *self._work)
            self._by_axes = found >= 0
            for part in () if self._by_axes else self._work:
                part[:] = 0.0  # no NaN may be left, which unused places would multiply by 0
        if not self._by_axes and (
            conjugate_gradients(*self.system, self.free, force, out, *self._work) < 0
        ):
            raise BrokeDown("singular consistent mass matrix: conjugate gradients do not converge")
        self.light_nodes.scatter(out)

    def multiply(self, a: np.ndarray) -> np.ndarray:
        out = np.zeros_like(a)
        matrix_product(self.columns, self.values, a, out)
        return out


class DirectMass(SparseMass):
    """A mass matrix of functions that do not change at the particles, factorised once."""

    def __init__(self, fixed: np.ndarray, light_nodes: LightNodes) -> None:
        super().__init__(fixed, light_nodes)
        self._factors: list[SuperLU] = []
        self._coupling: list[csr_array] = []

    def assemble(
        self, basis: Basis, p: Particles, m_i: np.ndarray, seen: np.ndarray | None = None
    ) -> None:
        if self._factors:
            return
        super().assemble(basis, p, m_i, seen)
        matrix = compressed(self.system)
        for d in range(self.fixed.shape[1]):
            free = self.free[:, d]
            if d > 0 and np.array_equal(free, self.free[:, d - 1]):
                self._factors.append(self._factors[-1])
                self._coupling.append(self._coupling[-1])
                continue
            try:
                self._factors.append(splu(csc_array(matrix[free][:, free])))
            except RuntimeError as error:
                raise BrokeDown(f"singular consistent mass matrix: {error}") from None
            self._coupling.append(matrix[free][:, ~free])

    def solve(self, rhs: np.ndarray, out: np.ndarray) -> None:
        out[~self.fixed & ~self.active[:, None]] = 0.0
        force = self.light_nodes.gathered(rhs, self._force)
        for d, factor in enumerate(self._factors):
            free = self.free[:, d]
            out[free, d] = factor.solve(force[free, d] - self._coupling[d] @ out[~free, d])
        self.light_nodes.scatter(out)


def compressed(rows: Rows) -> csr_array:
    """The same matrix without its unused places."""
    n, width = rows.columns.shape
    entries = rows.values.ravel(), rows.columns.ravel(), np.arange(0, n * width + 1, width)
    matrix = csr_array(entries, shape=(n, n), copy=True)
    matrix.eliminate_zeros()
    return matrix


def condensed(rows: Rows, pairs: LightNodes) -> Rows:
    """``T^T M T``; rows of light nodes, and of those without mass, become those of the identity."""
    T = pairs.matrix()
    matrix = T.T @ compressed(rows) @ T
    return padded(csr_array(matrix + diags_array((matrix.diagonal() == 0.0).astype(float))))


def padded(matrix: csr_array) -> Rows:
    """A matrix whose diagonal is stored, in rows of equal width."""
    n = matrix.shape[0]
    matrix.sort_indices()
    length = np.diff(matrix.indptr)
    place_in_row = np.arange(matrix.nnz) - np.repeat(matrix.indptr[:-1], length)
    row = np.repeat(np.arange(n), length)
    columns = np.full((n, int(length.max())), n - 1, dtype=np.int64)
    values = np.zeros(columns.shape)
    columns[row, place_in_row], values[row, place_in_row] = matrix.indices, matrix.data
    return Rows(columns, values, place_in_row[matrix.indices == row])


def pattern(basis: Basis, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Columns of each row, shape (N, width), and the place of the diagonal, shape (N,).

    On product grids all pairs within reach, whether or not particles see them; with any other
    handle the pairs that particles see, which is made anew when a new pair appears.
    """
    n, handle = len(basis.nodes), basis.handle
    if isinstance(basis, GridBasis):
        return grid_pattern(handle)
    stored = handle if isinstance(handle, Stencils) else basis.evaluate(x)
    used = np.arange(stored.width) < stored.size[:, None]
    first = np.concatenate([[0], np.cumsum(stored.size)])
    seen = csr_array((np.ones(first[-1]), stored.index[used], first), shape=(len(x), n))
    pairs = padded(csr_array(seen.T @ seen + eye_array(n)))
    return pairs.columns, pairs.diagonal


def grid_pattern(grid: Any) -> tuple[np.ndarray, np.ndarray]:
    """Neighbours within the degree along each axis; beyond the grid the row itself, worth 0."""
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
