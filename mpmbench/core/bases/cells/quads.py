"""Linear functions on cells whose corners move one by one: segments, quads, hexahedra.

The parametric coordinates xi of a particle are its state, not a function of x: they are found once
and never change while particle and nodes move with the same functions. Values are then constant and
only gradients follow the nodes.
"""

from typing import ClassVar

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from mpmbench.core.bases import StoredBasis
from mpmbench.core.bases.handle import Stencils
from mpmbench.core.compiled import compiled, matrix
from mpmbench.core.compiled.algebra import determinant, inverse, transform_rows
from mpmbench.core.errors import BrokeDown
from mpmbench.core.geometry import Box, Geometry


@compiled
def shape_functions(axes, xi, phi, derivative):
    """Values and derivatives by xi of the 2^dim linear functions at points xi in [0, 1]^dim.

    Corners are the bits of the number of a function.
    """
    last = len(axes) - 1
    for p in range(xi.shape[0]):
        for k in range(phi.shape[1]):
            phi[p, k] = 1.0
            for d in range(len(axes)):
                bit = (k >> (last - d)) & 1
                phi[p, k] *= xi[p, d] if bit else 1.0 - xi[p, d]
                derivative[p, k, d] = 1.0 if bit else -1.0
                for e in range(len(axes)):
                    if e != d:
                        bit = (k >> (last - e)) & 1
                        derivative[p, k, d] *= xi[p, e] if bit else 1.0 - xi[p, e]


@compiled
def push_gradients(axes, nodes, index, derivative, grad_phi):
    """Gradients by x from those by xi: ``J^-T dphi/dxi`` with ``J = sum_i x_i (x) dphi_i/dxi``.

    Returns the number of the first point whose cell is turned inside out, -1 if there is none.
    """
    jacobian, inverse_jacobian = matrix(axes, axes), matrix(axes, axes)
    dim = len(axes)
    for p in range(index.shape[0]):
        jacobian[:] = 0.0
        for k in range(index.shape[1]):
            for a in range(dim):
                for b in range(dim):
                    jacobian[a, b] += nodes[index[p, k], a] * derivative[p, k, b]
        if not determinant(axes, jacobian) > 0.0:
            return p
        inverse(axes, jacobian, inverse_jacobian)
        transform_rows(axes, derivative, p, inverse_jacobian, grad_phi)
    return -1


class MovingCells(StoredBasis):
    """Linear functions on cells that deform with their nodes, and carry their particles along.

    A subclass says by `_attach` where points are in their cells.
    """

    constant_values = True
    cell_name: ClassVar[str] = "cell"

    def __init__(self, nodes: np.ndarray, particles: int, functions: int) -> None:
        self.nodes = np.array(nodes, dtype=float)
        self.axes = (0.0,) * self.nodes.shape[1]
        self.handle = Stencils.empty(particles, functions, len(self.axes))
        self._derivative: np.ndarray | None = None  # of the functions by the places in the cells

    def _attach(self, x: np.ndarray, stored: Stencils) -> np.ndarray:
        """Store nodes and values at points `x`; returns the derivatives by places in the cells."""
        raise NotImplementedError

    def _push(self, stored: Stencils, derivative: np.ndarray) -> Stencils:
        bad = push_gradients(self.axes, self.nodes, stored.index, derivative, stored.grad_phi)
        if bad >= 0:
            raise BrokeDown(f"the {self.cell_name} of particle {bad} is turned inside out")
        return stored

    def _fill(self, x: np.ndarray, stored: Stencils) -> Stencils:
        return self._push(stored, self._attach(x, stored))

    def locate(self, x: np.ndarray) -> None:
        """Find the cells of the particles once; from then on only gradients change."""
        if self._derivative is None:
            self._derivative = self._attach(x, self.handle)
        self._push(self.handle, self._derivative)

    def move(self, displacement: np.ndarray) -> None:
        self.nodes += displacement


class MovingQuads(MovingCells):
    """Linear functions on the cells of a grid, straight or bent, whose corners move one by one."""

    def __init__(self, grid: Geometry, particles: int) -> None:
        dimension = grid.dimension
        super().__init__(grid.points, particles, 2**dimension)
        self.box = grid if isinstance(grid, Box) else None  # until the nodes move
        # nodes of each cell, shape (cells, 2^dim); corners are bits, the last axis lowest
        assert grid.cells is not None
        numbers = np.arange(len(self.nodes)).reshape([n + 1 for n in grid.cells])
        self.cells = sliding_window_view(numbers, (2,) * dimension).reshape(-1, 2**dimension)

    def _attach(self, x: np.ndarray, stored: Stencils) -> np.ndarray:
        cell, xi = self._find(x)
        derivative = np.zeros_like(stored.grad_phi)
        stored.size[:] = stored.width
        stored.index[:] = self.cells[cell]
        shape_functions(self.axes, xi, stored.phi, derivative)
        return derivative

    def _find(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Cells of points and where in them: by division, or by Newton's method in likely ones."""
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
            near = np.all((low - slack <= point) & (point <= high + slack), axis=1)
            for c in np.flatnonzero(near):
                xi[p] = invert_map(self.axes, corners[c], point)
                if np.all(np.abs(xi[p] - 0.5) <= 0.5 + 1e-9):
                    cell[p] = c
                    break
            else:
                raise BrokeDown(f"point {p} at {point} m is outside all cells")
        return cell, xi

    def move(self, displacement: np.ndarray) -> None:
        self.box = None
        super().move(displacement)


@compiled
def invert_map(axes, corners, point):
    """Parametric coordinates of `point` in the cell with these corners, shape (2^dim, dim)."""
    dim, n = len(axes), corners.shape[0]
    xi = np.full((1, dim), 0.5)
    phi, derivative = np.empty((1, n)), np.empty((1, n, dim))
    jacobian, inverse_jacobian = np.empty((dim, dim)), np.empty((dim, dim))
    for _ in range(30):
        shape_functions(axes, xi, phi, derivative)
        residual = point - phi[0] @ corners
        jacobian[:] = corners.T @ derivative[0]
        if determinant(axes, jacobian) == 0.0:
            break
        inverse(axes, jacobian, inverse_jacobian)
        step = inverse_jacobian @ residual
        xi[0] += step
        if np.abs(step).max() < 1e-15:
            break
    return xi[0]
