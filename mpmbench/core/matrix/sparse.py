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
from mpmbench.core.bases.handle import (
    Stencils,
    add_pairs,
    count,
    index,
    locate_batch,
    place,
    room,
)
from mpmbench.core.compiled import compiled, inlined, lean, threads
from mpmbench.core.compiled.rows import BATCH, LANES, alike, groups
from mpmbench.core.errors import BrokeDown
from mpmbench.core.matrix.axes import Axes, conjugate_gradients_by_axes, factorised
from mpmbench.core.matrix.conjugate_gradients import conjugate_gradients, matrix_product
from mpmbench.core.matrix.light import LightNodes
from mpmbench.core.particles import Particles


@compiled
def assemble_rows(phi, functions, x, m, columns, values, touched, start, stop):
    """``values[i, place] += sum_p m_p phi_i phi_j`` of particles start to stop; False when a pair has no place.

    Particles of one cell that follow each other are added together. `touched` gets the range of
    rows; `functions` is as long as there are functions at a point of a grid.
    """
    touched[0], touched[1] = values.shape[0], 0
    most, work, at = columns.shape[1], room(phi), np.empty(len(BATCH), np.int64)
    phi_p, pairs = np.empty(most), np.zeros((groups(most * (most + 1) // 2), len(LANES)))
    of_grid = np.empty((len(functions), len(functions)), np.int64)
    for k in range(len(functions)):
        for j in range(len(functions)):
            of_grid[k, j] = place(phi, columns, 0, k, 0, j)  # the same for all nodes
    first, here, fits = start, -1, True
    while first < stop and fits:
        n = locate_batch(phi, x, first, min(len(BATCH), stop - first), at, work)
        b = 0
        while b < n and fits:
            if at[b] != here:
                fits = here < 0 or hand_out(phi, here, of_grid, pairs, columns, values, touched)
                fits = fits and count(phi, at[b]) <= most
                here = at[b]
            same = alike(at, b, n)
            if fits:
                add_pairs(phi, here, b, first + b, same, work, functions, m, phi_p, pairs)
            b += same
        first += n
    return fits and (here < 0 or hand_out(phi, here, of_grid, pairs, columns, values, touched))


@inlined
def hand_out(phi, at, of_grid, pairs, columns, values, touched):
    """Add the pairs at a place to their rows, and set them back to zero; False when one has no place."""
    pair = 0
    for k in range(count(phi, at)):
        i = index(phi, at, k)
        touched[0], touched[1] = min(touched[0], i), max(touched[1], i + 1)
        for n in range(k + 1):
            j, g, b = index(phi, at, n), pair // len(LANES), pair % len(LANES)
            if of_grid.shape[0] > 0:
                before, after = of_grid[k, n], of_grid[n, k]
            else:
                before, after = place(phi, columns, i, k, j, n), place(phi, columns, j, n, i, k)
            if before < 0 or after < 0:
                return False
            values[i, before] += pairs[g, b]
            if n < k:
                values[j, after] += pairs[g, b]
            pairs[g, b] = 0.0
            pair += 1
    return True


@lean
def add_parts(parts, touched, values, start, stop):
    """Add up the rows start to stop of the parts in their order, and set them back to zero."""
    for i in range(start, stop):
        values[i] = 0.0
        for c in range(parts.shape[0]):
            if touched[c, 0] <= i < touched[c, 1]:
                for k in range(values.shape[1]):
                    values[i, k] += parts[c, i, k]
                    parts[c, i, k] = 0.0


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
        self._parts = np.zeros((1, *self.values.shape))  # sums of chunks of particles
        self._touched = np.zeros((1, 2), dtype=np.int64)
        self._axes: Axes | None = None  # on grids, where they make a good guess
        self._by_axes = False
        self._force, *self._work = (np.zeros(fixed.shape) for _ in range(5))

    def assemble(
        self, basis: Basis, p: Particles, m_i: np.ndarray, seen: list[np.ndarray] | None = None
    ) -> None:
        if not self.columns.shape[1] or not self._sum(basis, p):
            self.columns, self.diagonal = pattern(basis, p.x)
            # memory for each chunk only where rows are short
            chunked, shape = len(p.x) if isinstance(basis, GridBasis) else 0, self.columns.shape
            self._parts = threads.apart(chunked, *shape)
            self._touched = threads.apart(chunked, 2, dtype=np.int64)
            if isinstance(basis, GridBasis):
                grid = basis.handle
                self._axes = Axes.empty(grid.shape, len(grid.order), self.fixed.shape[1])
            self.values = np.zeros(shape)
            self._sum(basis, p)
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
            and factorised(self._axes, self.values, self.diagonal, self.free)
        )
        unknowns = int(self.free.sum(axis=0).max())
        if unknowns > len(p.x) - p.tracers:
            raise BrokeDown(
                f"singular consistent mass matrix: {unknowns} free nodes and only "
                f"{len(p.x) - p.tracers} particles"
            )

    def _sum(self, basis: Basis, p: Particles) -> bool:
        """Sum the values; False when the pattern lacks a pair."""

        def add(c: int, start: int, stop: int) -> bool:
            own = self.columns, self._parts[c], self._touched[c]
            return bool(assemble_rows(basis.handle, functions, p.x, p.m, *own, start, stop))

        def add_up(c: int, start: int, stop: int) -> None:
            add_parts(self._parts, self._touched, self.values, start, stop)

        on_grid = isinstance(basis, GridBasis)
        functions = (0.0,) * basis.handle.width if on_grid else ()
        found = threads.run(add, len(p.x)) if on_grid else [add(0, 0, len(p.x))]
        threads.run(add_up, len(self.values))
        return all(found)

    def solve(self, rhs: np.ndarray, out: np.ndarray) -> None:
        out[~self.fixed & ~self.active[:, None]] = 0.0
        force = self.light_nodes.gathered(rhs, self._force)
        if self._by_axes:
            assert self._axes is not None
            dim, rows = rhs.shape[1], (self._axes, self.columns, self.values, self.free)
            room = [part.reshape(dim, -1) for part in self._work]

            def component(c: int) -> int:
                own = (part[c] for part in room)
                return int(conjugate_gradients_by_axes(c, *rows, force, out, *own))

            self._by_axes = min(threads.each(component, dim, len(rhs))) >= 0
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
        self, basis: Basis, p: Particles, m_i: np.ndarray, seen: list[np.ndarray] | None = None
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
