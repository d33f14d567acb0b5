"""Linear functions on cells whose corners move one by one: segments, quads, hexahedra.

The parametric coordinates xi of a particle are its state, not a function of x: they are found once
and never change while particle and nodes move with the same functions. Values are then constant and
only gradients follow the nodes.
"""

import numpy as np

from mpmbench.core.bases.handle import Stencils
from mpmbench.core.compiled import kernel, matrix
from mpmbench.core.compiled.algebra import determinant, inverse
from mpmbench.core.errors import BrokeDown
from mpmbench.core.geometry import Box


@kernel
def shape_functions(axes, corners, xi, phi, derivative):  # type: ignore[no-untyped-def]
    """Values and derivatives by xi of the 2^dim linear functions at xi in [0, 1]^dim, corners as bits of the number."""
    for k in range(corners):
        phi[k] = 1.0
        for d in range(len(axes)):
            bit = (k >> (len(axes) - 1 - d)) & 1
            phi[k] *= xi[d] if bit else 1.0 - xi[d]
            derivative[k, d] = 1.0 if bit else -1.0
            for e in range(len(axes)):
                if e != d:
                    derivative[k, d] *= xi[e] if (k >> (len(axes) - 1 - e)) & 1 else 1.0 - xi[e]


@kernel
def push_gradients(axes, nodes, index, derivative, grad_phi):  # type: ignore[no-untyped-def]
    """Gradients by x from those by xi: ``grad phi = J^-T dphi/dxi`` with ``J = sum_i x_i (x) dphi_i/dxi``.

    Returns the number of the first point whose cell is turned inside out, -1 if there is none.
    """
    jacobian, inverse_jacobian = matrix(axes, axes), matrix(axes, axes)
    dim = len(axes)
    for p in range(index.shape[0]):
        for a in range(dim):
            for b in range(dim):
                jacobian[a, b] = 0.0
        for k in range(index.shape[1]):
            for a in range(dim):
                for b in range(dim):
                    jacobian[a, b] += nodes[index[p, k], a] * derivative[p, k, b]
        if not determinant(axes, jacobian) > 0.0:
            return p
        inverse(axes, jacobian, inverse_jacobian)
        for k in range(index.shape[1]):
            for a in range(dim):
                total = 0.0
                for b in range(dim):
                    total += derivative[p, k, b] * inverse_jacobian[b, a]
                grad_phi[p, k, a] = total
    return -1


@kernel
def fill_parametric(axes, corners, xi, phi, derivative):  # type: ignore[no-untyped-def]
    """`shape_functions` at the parametric coordinates of all points, shape (n, dim)."""
    for p in range(xi.shape[0]):
        shape_functions(axes, corners, xi[p], phi[p], derivative[p])


class MovingQuads:
    """Linear functions on a grid of cells that deform with their nodes (fulfils `Basis`)."""

    constant_values = True  # and with them the consistent mass matrix: it is assembled once

    def __init__(self, box: Box, particles: int) -> None:
        self.box: Box | None = box  # until the nodes move
        self.nodes = box.nodes()
        self.corners = 2**box.dimension
        self.axes = (0.0,) * box.dimension
        self.cells = _cell_nodes(box)
        self.handle = Stencils.empty(particles, self.corners, box.dimension)
        self.handle.size[:] = self.corners
        self._derivative = np.zeros_like(self.handle.grad_phi)
        self._located = False

    def evaluate(self, x: np.ndarray) -> Stencils:
        cell, xi = self._find(x)
        stored = Stencils.empty(len(x), self.corners, len(self.axes))
        derivative = np.zeros_like(stored.grad_phi)
        stored.size[:] = self.corners
        self._store(stored, derivative, cell, xi)
        return stored

    def _store(
        self, stored: Stencils, derivative: np.ndarray, cell: np.ndarray, xi: np.ndarray
    ) -> None:
        stored.index[:] = self.cells[cell]
        fill_parametric(self.axes, self.corners, xi, stored.phi, derivative)
        self._push(stored, derivative)

    def _push(self, stored: Stencils, derivative: np.ndarray) -> None:
        bad = push_gradients(self.axes, self.nodes, stored.index, derivative, stored.grad_phi)
        if bad >= 0:
            raise BrokeDown(f"the cell of particle {bad} is turned inside out")

    def _find(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Cell and parametric coordinates: by division, or by Newton's method in each cell that could hold a point."""
        if self.box is not None:
            place = (x - np.array(self.box.lower)) / self.box.spacing
            number = np.clip(np.floor(place).astype(np.int64), 0, np.array(self.box.cells) - 1)
            if np.all(np.abs(place - number - 0.5) <= 0.5 + 1e-9):
                return np.ravel_multi_index(tuple(number.T), self.box.cells), place - number
        corners = self.nodes[self.cells]
        low, high = corners.min(axis=1), corners.max(axis=1)
        cell, xi = np.zeros(len(x), dtype=np.int64), np.zeros((len(x), len(self.axes)))
        slack = 1e-12 * (high - low).max()
        for p, point in enumerate(x):
            for c in np.flatnonzero(
                np.all((low - slack <= point) & (point <= high + slack), axis=1)
            ):
                xi[p] = invert_map(self.axes, corners[c], point)
                if np.all(np.abs(xi[p] - 0.5) <= 0.5 + 1e-9):
                    cell[p] = c
                    break
            else:
                raise BrokeDown(f"point {p} at {point} m is outside all cells")
        return cell, xi

    def locate(self, x: np.ndarray) -> None:
        if not self._located:
            cell, xi = self._find(x)
            self._store(self.handle, self._derivative, cell, xi)
            self._located = True
        else:
            self._push(self.handle, self._derivative)

    def first_outside(self, x: np.ndarray) -> int:
        """Particles move with their cells and cannot leave them; a lost one is not a number."""
        lost = np.flatnonzero(~np.isfinite(x).all(axis=1))
        return int(lost[0]) if len(lost) else -1

    def move(self, displacement: np.ndarray) -> None:
        self.box = None
        self.nodes += displacement


@kernel
def invert_map(axes, corners, point):  # type: ignore[no-untyped-def]
    """Parametric coordinates of `point` in the cell with these corners, shape (2^dim, dim), by Newton's method."""
    dim, n = len(axes), corners.shape[0]
    xi = np.full(dim, 0.5)
    phi, derivative = np.empty(n), np.empty((n, dim))
    jacobian, inverse_jacobian = np.empty((dim, dim)), np.empty((dim, dim))
    for _ in range(30):
        shape_functions(axes, n, xi, phi, derivative)
        residual = point - phi @ corners
        jacobian[:] = corners.T @ derivative
        if determinant(axes, jacobian) == 0.0:
            break
        inverse(axes, jacobian, inverse_jacobian)
        step = inverse_jacobian @ residual
        xi += step
        if np.abs(step).max() < 1e-15:
            break
    return xi


def _cell_nodes(box: Box) -> np.ndarray:
    """Node numbers of each cell, shape (cells, 2^dim), corners as bits of their number, last axis fastest."""
    shape = tuple(n + 1 for n in box.cells)
    numbers = np.arange(int(np.prod(shape))).reshape(shape)
    parts = []
    for corner in np.ndindex(*(2,) * box.dimension):
        parts.append(
            numbers[tuple(slice(c, c + n) for c, n in zip(corner, box.cells, strict=True))].ravel()
        )
    return np.stack(parts, axis=1)
