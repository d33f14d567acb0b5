"""Dual domain material point method (Zhang, Ma and Giguere 2011): hats with a second, continuous gradient.

Each node averages the gradients of its neighbours' hats over its own volume, and hats carry the
averages to the points: ``grad~ phi_i(x) = sum_j phi_j(x) (1/V_j) int phi_j grad phi_i`` with ``V_j =
int phi_j`` over all cells of the grid, filled or not. The gradient of force and strain is ``alpha
grad phi_i + (1 - alpha) grad~ phi_i``, where alpha, a product of ``4 t (1 - t)`` over the axes with
t from 0 to 1 in a cell, vanishes on all faces: a particle that crosses one feels no jump. For
every alpha gradients add up to zero and are exact for linear fields, as far as the edge.
"""

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np

from mpmbench.core.bases import BasisSettings, Promises
from mpmbench.core.bases.grid.product import ANSWERS, GridBasis, product_fields
from mpmbench.core.bases.handle import count, index, locate, place, scratch, value
from mpmbench.core.choices import Choices
from mpmbench.core.compiled import implements, matrix, vector
from mpmbench.core.errors import NotApplicable
from mpmbench.core.geometry import Box, Geometry
from mpmbench.core.registry import register
from mpmbench.core.setting import setting

REACH = 4  # nodes along an axis: those of a cell and the next on either side


class DualGrid(NamedTuple):
    """What kernels see; the first four fields are `product_fields`."""

    axes: tuple[float, ...]
    order: tuple[float, ...]
    lanes: tuple[float, ...]
    shape: np.ndarray
    lower: np.ndarray  # the first corner [m], shape (dim,)
    alpha: float  # weight of the hats' own gradient in the middle of a cell

    @property
    def width(self) -> int:
        """Number of functions at a point."""
        return int(len(self.order) ** len(self.axes))


@implements(scratch, DualGrid)
def _scratch(grid):
    """Along each axis: hats and their slopes, averages of hats and of slopes; and alpha."""
    first, second = matrix(grid.axes, grid.lanes), matrix(grid.axes, grid.lanes)
    third, fourth = matrix(grid.axes, grid.lanes), matrix(grid.axes, grid.lanes)
    return first, second, third, fourth, vector((0.0,))


@implements(locate, DualGrid)
def _locate(grid, x, p, work):
    phi, slope, mean_phi, mean_slope, alpha = work
    first, alpha[0] = 0, grid.alpha
    for d in range(len(grid.axes)):
        nodes, inverse_h = grid.shape[d], grid.axes[d]
        coordinate = (x[p, d] - grid.lower[d]) * inverse_h
        cell = min(max(int(coordinate), 0), nodes - 2)
        t = coordinate - cell
        start = min(max(cell - 1, 0), nodes - len(grid.order))
        for a in range(len(grid.order)):
            phi[d, a] = slope[d, a] = mean_phi[d, a] = mean_slope[d, a] = 0.0
        a = cell - start
        phi[d, a], phi[d, a + 1] = 1.0 - t, t
        slope[d, a], slope[d, a + 1] = -inverse_h, inverse_h
        for j in range(a, a + 2):
            left, right = start + j > 0, start + j < nodes - 1
            share = phi[d, j] * 2.0 / (left + right)  # phi_j h / V_j
            # in each of its cells, of size h: int phi_j phi_j = h/3, int phi_j phi_i = h/6, and
            # int phi_j phi_i' = +-1/2
            mean_phi[d, j] += share * (left + right) / 3.0
            if left:
                mean_phi[d, j - 1] += share / 6.0
                mean_slope[d, j - 1] -= 0.5 * share * inverse_h
                mean_slope[d, j] += 0.5 * share * inverse_h
            if right:
                mean_phi[d, j + 1] += share / 6.0
                mean_slope[d, j + 1] += 0.5 * share * inverse_h
                mean_slope[d, j] -= 0.5 * share * inverse_h
        alpha[0] *= 4.0 * t * (1.0 - t)
        first = first * nodes + start
    return first


@implements(value, DualGrid)
def _value(grid, at, k, work, grad_phi):
    phi, slope, mean_phi, mean_slope, alpha = work
    dim, order = len(grid.axes), len(grid.order)
    total, own, averaged = 1.0, vector(grid.axes), vector(grid.axes)
    for e in range(dim):
        own[e], averaged[e] = alpha[0], 1.0 - alpha[0]
    for d in range(dim - 1, -1, -1):
        a = k % order
        k //= order
        total *= phi[d, a]
        for e in range(dim):
            own[e] *= slope[d, a] if e == d else phi[d, a]
            averaged[e] *= mean_slope[d, a] if e == d else mean_phi[d, a]
    for e in range(dim):
        grad_phi[e] = own[e] + averaged[e]
    return total


for question in (count, index, place):
    implements(question, DualGrid)(ANSWERS[question])


@register("basis", "ddmp")
@dataclass(frozen=True)
class DualDomain(BasisSettings):
    """Hats with the continuous gradients of dual domain MPM, Zhang, Ma and Giguere 2011."""

    alpha: float = setting(
        0.5,
        "weight of the hats' own gradient in the middle of a cell",
        unit="-",
        above=0.0,
        most=1.0,
    )
    promises: ClassVar[Promises] = Promises(
        kronecker="everywhere", derivative=False, grid=True, moves=False
    )

    def check(self, choices: Choices, touches_fixed_nodes: bool) -> None:
        """Refuse implicit methods: nodes next to the body are strained and have no mass."""
        if choices.implicit:
            raise NotApplicable(
                "ddmp is for explicit methods: its gradients reach nodes without mass, which keep "
                "Newton's iteration from its tolerance"
            )

    def build(self, geometry: Geometry, particles: int, moving: bool) -> GridBasis:
        if not isinstance(geometry, Box):
            raise NotApplicable("ddmp needs a grid: this problem has an unstructured set of nodes")
        if min(geometry.cells) < REACH - 1:
            raise NotApplicable(
                f"ddmp needs {REACH - 1} or more cells along each axis, given {min(geometry.cells)}"
            )
        fields = product_fields(geometry, REACH, 1)
        handle = DualGrid(**fields, lower=np.array(geometry.lower), alpha=self.alpha)
        return GridBasis(geometry, handle, geometry.points)
