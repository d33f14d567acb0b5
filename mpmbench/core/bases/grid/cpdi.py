"""Convected particle domains (Sadeghirad, Brannon and Burghardt 2011): parallelograms that F carries along.

Half the sides of a particle's domain are ``r_k = F R_k`` with R_k those of its first box. On the
domain the functions are the multilinear ones between its corners, so that their averages are

    phi_i = 2^-dim sum_c N_i(x_c),    grad phi_i = A^-T 2^-dim sum_c s_c N_i(x_c)

with hats N_i at the corners ``x_c = x + A s_c``, ``A = (r_1, r_2, ..)`` and signs s_c: Eqs. 25 and 26
of the paper. These gradients are not the derivatives of the values, but they are exact for linear
fields, whatever F is. Neighbours of an affine deformation keep their common corners, however far it
goes: there is no fracture that the grid makes.

At the edge hats go on straight, as in `gimp`, since corners pass it by round-off and errors of F. A
corner more than a cell outside ends the run.
"""

from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np

from mpmbench.core.bases import BasisSettings, Promises, StoredBasis
from mpmbench.core.bases.grid.gimp import POINT, USUAL
from mpmbench.core.bases.handle import Stencils
from mpmbench.core.choices import Choices
from mpmbench.core.compiled import inlined, lean, matrix, threads, vector
from mpmbench.core.compiled.algebra import inverse
from mpmbench.core.errors import BrokeDown, NotApplicable
from mpmbench.core.geometry import Box, Geometry
from mpmbench.core.geometry.outside import first_outside_box
from mpmbench.core.particles import Particles
from mpmbench.core.registry import register


class CornerGrid(NamedTuple):
    """The grid whose hats are taken at corners of domains."""

    axes: tuple[float, ...]  # inverse cell sizes [1/m]
    lower: np.ndarray  # its first corner [m], shape (dim,)
    cells: np.ndarray  # along each axis


@inlined
def corner_hats(grid, corner, weight, slope, p, found, stored):
    """Add ``weight N_i`` and ``slope N_i`` at the `corner` [m] of domain p to its functions, so far `found`.

    Returns the number of functions; -1 where the corner is more than a cell outside.
    """
    dim, first, place = len(grid.axes), 0, vector(grid.axes)
    for d in range(dim):
        at = (corner[d] - grid.lower[d]) * grid.axes[d]
        if not -1.0 <= at <= grid.cells[d] + 1.0:
            return -1
        cell = min(max(int(at), 0), grid.cells[d] - 1)
        place[d] = at - cell
        first = first * (grid.cells[d] + 1) + cell
    for k in range(1 << dim):
        i, stride, hat = first, 1, 1.0
        for d in range(dim - 1, -1, -1):
            if (k >> d) & 1:
                i += stride
                hat *= place[d]
            else:
                hat *= 1.0 - place[d]
            stride *= grid.cells[d] + 1
        n = 0
        while n < found and stored.index[p, n] != i:
            n += 1
        if n == found:
            stored.index[p, n], stored.phi[p, n] = i, 0.0
            for e in range(dim):
                stored.grad_phi[p, n, e] = 0.0
            found += 1
        stored.phi[p, n] += weight * hat
        for e in range(dim):
            stored.grad_phi[p, n, e] += slope[e] * hat
    return found


@lean
def average_hats(grid, x, F, initial, stored, start, stop):
    """Store the functions of points start to stop; returns one that has lost its domain, else -1.

    `initial` holds half the sides of the first boxes [m], shape (n, dim).
    """
    dim = len(grid.axes)
    corners = 1 << dim
    A, inverse_A = matrix(grid.axes, grid.axes), matrix(grid.axes, grid.axes)
    corner, slope = vector(grid.axes), vector(grid.axes)
    for p in range(start, stop):
        for d in range(dim):
            for e in range(dim):
                A[d, e] = F[p, d, e] * initial[p, e]
        if not inverse(grid.axes, A, inverse_A) > 0.0:
            return p
        found = 0
        for c in range(corners):
            for d in range(dim):
                corner[d], slope[d] = x[p, d], 0.0
                for e in range(dim):
                    sign = 2.0 * ((c >> e) & 1) - 1.0
                    corner[d] += A[d, e] * sign
                    slope[d] += inverse_A[e, d] * sign / corners
            found = corner_hats(grid, corner, 1.0 / corners, slope, p, found, stored)
            if found < 0:
                return p
        stored.size[p] = found
    return -1


class ConvectedDomains(StoredBasis):
    """Averages of hats over the parallelograms of the particles that it follows."""

    def __init__(self, box: Box, particles: int) -> None:
        self.nodes, dim = box.points, box.dimension
        self.lower, self.upper = np.array(box.lower), np.array(box.upper)
        self._spacing = box.spacing
        axes = tuple(1.0 / h for h in box.spacing.tolist())
        self._grid = CornerGrid(axes, self.lower, np.array(box.cells))
        self._usual = USUAL * box.spacing
        self._particles: Particles | None = None
        self._initial = np.tile(self._usual, (particles, 1))
        self.handle = Stencils.empty(particles, 4**dim, dim)

    def follow(self, particles: Particles) -> None:
        """Domains begin as boxes as large as the particles, with the proportions of a cell."""
        self._particles, dim = particles, particles.dimension
        share = 0.5 * (particles.V0 / np.prod(self._spacing)) ** (1.0 / dim)
        self._usual = float(np.median(share[particles.material])) * self._spacing
        self._initial = np.maximum(share, POINT)[:, None] * self._spacing  # tracers are points

    def first_outside(self, x: np.ndarray) -> int:
        return first_outside_box(x, self.lower, self.upper)

    def locate(self, x: np.ndarray) -> None:
        F = self._undeformed(len(x)) if self._particles is None else self._particles.F
        self._average(x, F, self._initial, self.handle)

    def evaluate(self, x: np.ndarray) -> Stencils:
        """At the followed particles with their domains, at any other points with an undeformed one."""
        if self._particles is not None and x is self._particles.x:
            return self.evaluate_particles(x, np.arange(len(x)))
        F, initial = self._undeformed(len(x)), np.tile(self._usual, (len(x), 1))
        return self._average(x, F, initial, Stencils.empty(len(x), self.handle.width, x.shape[1]))

    def evaluate_particles(self, x: np.ndarray, numbers: np.ndarray) -> Stencils:
        if self._particles is None:
            return self.evaluate(x[numbers])
        stored = Stencils.empty(len(numbers), self.handle.width, x.shape[1])
        F, initial = self._particles.F[numbers], self._initial[numbers]
        return self._average(x[numbers], F, initial, stored)

    def _undeformed(self, points: int) -> np.ndarray:
        dim = len(self._spacing)
        return np.broadcast_to(np.eye(dim), (points, dim, dim)).copy()

    def _average(
        self, x: np.ndarray, F: np.ndarray, initial: np.ndarray, stored: Stencils
    ) -> Stencils:
        return self._all(x, average_hats, F, initial, stored)

    def _all(self, x: np.ndarray, average: Any, *arrays: Any) -> Stencils:
        """Call a kernel on all points, and end the run where it finds one that is lost."""
        if (outside := self.first_outside(x)) >= 0:
            raise BrokeDown(f"point {outside} at {x[outside]} m is outside the grid")

        def part(c: int, *ends: int) -> int:
            return int(average(self._grid, x, *arrays, *ends))

        if (lost := threads.first(threads.run(part, len(x)))) >= 0:
            raise BrokeDown(
                f"the domain of particle {lost} has no volume or reaches more than a cell out of the grid"
            )
        stored: Stencils = arrays[-1]
        return stored


@register("basis", "cpdi")
@dataclass(frozen=True)
class Cpdi(BasisSettings):
    """Hats averaged over parallelograms that F carries along, Sadeghirad, Brannon and Burghardt 2011."""

    promises: ClassVar[Promises] = Promises(
        kronecker="hull", derivative=False, grid=True, moves=False
    )

    def check(self, choices: Choices, touches_fixed_nodes: bool) -> None:
        """Refuse implicit methods: a corner that only touches a cell gives its nodes no stiffness."""
        if choices.implicit:
            raise NotApplicable(
                "convected domains are for explicit methods: where a corner of a particle only touches a cell, the "
                "nodes there have no stiffness, and the matrix of Newton's iteration is singular"
            )

    def build(self, geometry: Geometry, particles: int, moving: bool) -> ConvectedDomains:
        if not isinstance(geometry, Box):
            raise NotApplicable("cpdi needs a grid: this problem has an unstructured set of nodes")
        return ConvectedDomains(geometry, particles)
