"""A grid with a field for each body: copies of its functions, of which a particle sees those of its body.

The copies stand one behind the other along the first axis, so that all sums over products serve
them as they are.
"""

from typing import Any, NamedTuple

import numpy as np

from mpmbench.core.bases.grid.product import GridBasis, line, product
from mpmbench.core.compiled import implemented
from mpmbench.core.errors import NotApplicable
from mpmbench.core.particles import Particles


class Fields(NamedTuple):
    """Handle of the copies of a grid; see `product_fields` for the first four."""

    axes: tuple[float, ...]
    order: tuple[float, ...]
    lanes: tuple[float, ...]
    shape: np.ndarray
    grid: Any  # handle of one copy
    body: np.ndarray  # copy that each particle sees, shape (P,)
    apart: int  # functions of a copy along the first axis


@product(Fields)
def _line(fields, x, p, d, phi, slope):
    first = line(fields.grid, x, p, d, phi, slope)
    if d == 0:
        first += fields.apart * fields.body[p]
    return first


class FieldsBasis(GridBasis):
    """Copies of a basis on a grid, one for each body; `evaluate` takes the first particles in their order.

    Parameters
    ----------
    basis : GridBasis
        One copy.
    body : ndarray of int
        Body of each particle and tracer, shape (P,).
    copies : int
    """

    def __init__(self, basis: GridBasis, body: np.ndarray, copies: int) -> None:
        if basis.stand_ins:
            raise NotApplicable(
                "nodes for each body need sums over its particles: basis.reconstruction=none"
            )
        if not implemented(line, type(basis.handle)):
            raise NotApplicable(
                "nodes for each body need functions that are products along the axes, gradients too: "
                "take contact=shared"
            )
        self.basis, self.lower, self.upper = basis, basis.lower, basis.upper
        self.nodes = np.tile(basis.nodes, (copies, 1))
        grid = basis.handle
        shape = grid.shape.copy()
        apart = int(shape[0])
        shape[0] *= copies
        self.handle = Fields(grid.axes, grid.order, grid.lanes, shape, grid, body, apart)

    def follow(self, particles: Particles) -> None:
        self.basis.follow(particles)

    def locate(self, x: np.ndarray) -> None:
        self.basis.locate(x)
        self.handle = self.handle._replace(grid=self.basis.handle)
