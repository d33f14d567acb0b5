"""Taylor least squares: fields in the cells instead of their values at particles (Wobbes et al. 2019).

In a cell with centre x_c and sides h a density f is ``sum_k a_k psi_k`` with the Taylor functions

    1,    t_d = (x - x_c)_d / h_d,    t_d^2 / 2 - 1/24,    t_d t_e,

all but the first of which have the mean zero. So a_0 is the total of the particles in the cell over its
volume, ``sum_p V_p f_p / V``, and mass, momentum and the integral of the stress stay what they are,
cell by cell, whatever the other a_k are: those of least squares, ``min sum_p (f_p - sum_k a_k
psi_k(x_p))^2``. Nodal sums then run over Gauss points, which are exact for the product with a
spline. Density, momentum, body force and stress are such f: ``m/V``, ``m v/V``, ``m b/V``, ``sigma``.

A cell whose particles have less or more volume than it by a share of 1 - `filled`, that holds too few
of them or them in a line, or whose density would be negative at a Gauss point, keeps its particles:
plain sums. Such cells are counted. With too much volume, since the conserved total of a cell into
which a row of particles has just come is far from what they say, and what crosses is felt as in
plain sums and more: on the plate of `plate_axis_aligned` errors double where such cells count as full.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from mpmbench.core.bases.grid.spline import TensorSpline
from mpmbench.core.compiled import inlined, lean
from mpmbench.core.geometry import Box, tensor_points
from mpmbench.core.particles import ParticleArrays, Particles

FLAT = 1e-5  # mean square of a function, without those before it, where particles do not tell it (1/720 in a full cell)


class Cells(NamedTuple):
    """The cells, and room to work in.

    Attributes
    ----------
    lower, spacing : ndarray
        First corner and sides of a cell [m], shape (dim,).
    count : ndarray of int
        Cells along each axis.
    cell, order, first : ndarray of int
        Cell of each particle, the particles cell by cell, and where each cell begins among them.
    t, weight, psi : ndarray
        Gauss points from the centre in sides of a cell, shape (G, dim), their parts of its volume, and
        the functions there but the first, shape (G, K).
    normal, sums, right, mean, here, density : ndarray
        Matrix, sums of the functions, right-hand sides, a_0, functions with a place behind them, and
        densities of a cell.
    """

    lower: np.ndarray
    spacing: np.ndarray
    count: np.ndarray  # type: ignore[assignment]
    cell: np.ndarray
    order: np.ndarray
    first: np.ndarray
    t: np.ndarray
    weight: np.ndarray
    psi: np.ndarray
    normal: np.ndarray
    sums: np.ndarray
    right: np.ndarray
    mean: np.ndarray
    here: np.ndarray
    density: np.ndarray


@inlined
def taylor(t, psi):
    """Write the functions at t but the first: as many as `psi` is long."""
    dim, k = t.shape[0], t.shape[0]
    for d in range(dim):
        psi[d] = t[d]
    if psi.shape[0] > dim:
        for d in range(dim):
            psi[k] = 0.5 * t[d] * t[d] - 1.0 / 24.0
            k += 1
            for e in range(d):
                psi[k] = t[d] * t[e]
                k += 1


@inlined
def cell_volume(cells):
    """Volume of a cell [m^dim]."""
    volume = 1.0
    for d in range(cells.spacing.shape[0]):
        volume *= cells.spacing[d]
    return volume


@lean
def sort(cells, x):
    """Sort the particles by their cells."""
    for c in range(cells.first.shape[0]):
        cells.first[c] = 0
    for p in range(x.shape[0]):
        c = 0
        for d in range(x.shape[1]):
            place = int((x[p, d] - cells.lower[d]) / cells.spacing[d])
            c = c * cells.count[d] + min(max(place, 0), cells.count[d] - 1)
        cells.cell[p] = c
        cells.first[c + 1] += 1
    for c in range(cells.first.shape[0] - 1):
        cells.first[c + 1] += cells.first[c]
    for p in range(x.shape[0] - 1, -1, -1):  # from the ends of cells to their beginnings
        c = cells.cell[p]
        cells.first[c + 1] -= 1
        cells.order[cells.first[c + 1]] = p
    for c in range(cells.first.shape[0] - 1):
        cells.first[c] = cells.first[c + 1]
    cells.first[cells.first.shape[0] - 1] = x.shape[0]


@inlined
def place_in_cell(cells, x, c, t):
    """Coordinates of a point from the centre of cell c, in sides of a cell."""
    for d in range(x.shape[0] - 1, -1, -1):
        t[d] = (x[d] - cells.lower[d]) / cells.spacing[d] - c % cells.count[d] - 0.5
        c //= cells.count[d]


@inlined
def fit(cells, p, c, filled):
    """Write a_0 to `mean` and the other coefficients to `right`; whether the cell can be reconstructed.

    Returns its number of particles with mass too.
    """
    dim, functions, fields = p.x.shape[1], cells.right.shape[0], cells.right.shape[1]
    for j in range(fields):
        cells.mean[j] = 0.0
    for k in range(functions):
        cells.sums[k] = 0.0
        for i in range(k + 1):
            cells.normal[k, i] = 0.0
        for j in range(fields):
            cells.right[k, j] = 0.0
    solid, V, f, psi, t = 0, 0.0, cells.density, cells.here[:-dim], cells.here[-dim:]
    for o in range(cells.first[c], cells.first[c + 1]):
        q = cells.order[o]
        if p.V[q] == 0.0:
            continue
        solid += 1
        V += p.V[q]
        rho = p.m[q] / p.V[q]
        f[0] = rho
        for d in range(dim):
            f[1 + d], f[1 + dim + d] = rho * p.v[q, d], rho * p.b[q, d]
            for e in range(dim):
                f[1 + 2 * dim + d * dim + e] = p.sigma[q, d, e]
        place_in_cell(cells, p.x[q], c, t)
        taylor(t, psi)
        for j in range(fields):
            cells.mean[j] += p.V[q] * f[j]
        for k in range(functions):
            cells.sums[k] += psi[k]
            for i in range(k + 1):
                cells.normal[k, i] += psi[k] * psi[i]
            for j in range(fields):
                cells.right[k, j] += psi[k] * f[j]
    volume = cell_volume(cells)
    if solid <= functions or abs(V - volume) > (1.0 - filled) * volume:
        return False, solid
    for j in range(fields):
        cells.mean[j] /= volume
        for k in range(functions):
            cells.right[k, j] -= cells.sums[k] * cells.mean[j]
    return solve(cells.normal, cells.right, FLAT * solid), solid


@inlined
def solve(A, b, least):
    """Solve ``A x = b`` in place, with the lower half of a symmetric A; False where a pivot is `least` or less."""
    n = A.shape[0]
    for k in range(n):
        for i in range(k):
            A[k, k] -= A[k, i] * A[k, i] * A[i, i]
        if not A[k, k] > least:
            return False
        for m in range(k + 1, n):
            for i in range(k):
                A[m, k] -= A[m, i] * A[k, i] * A[i, i]
            A[m, k] /= A[k, k]
    for j in range(b.shape[1]):
        for k in range(n):
            for i in range(k):
                b[k, j] -= A[k, i] * b[i, j]
        for k in range(n - 1, -1, -1):
            b[k, j] /= A[k, k]
            for i in range(k + 1, n):
                b[k, j] -= A[i, k] * b[i, j]
    return True


@lean
def reconstruct(cells, p, filled, out):
    """Write what nodal sums run over to `out`.

    Returns the number of these points, of cells with particles, and of those whose particles stay.
    """
    dim = p.x.shape[1]
    n = occupied = plain = 0
    volume = cell_volume(cells)
    for c in range(cells.first.shape[0] - 1):
        if cells.first[c] == cells.first[c + 1]:
            continue
        fitted, solid = fit(cells, p, c, filled)
        for g in range(cells.weight.shape[0] if fitted else 0):
            f = cells.density
            for j in range(f.shape[0]):
                f[j] = cells.mean[j]
                for k in range(cells.psi.shape[1]):
                    f[j] += cells.right[k, j] * cells.psi[g, k]
            if not f[0] > 0.0:
                n -= g
                fitted = False
                break
            out.V[n] = cells.weight[g] * volume
            out.m[n] = f[0] * out.V[n]
            rest = c
            for d in range(dim - 1, -1, -1):
                place = rest % cells.count[d] + 0.5 + cells.t[g, d]
                out.x[n, d] = cells.lower[d] + place * cells.spacing[d]
                rest //= cells.count[d]
                out.v[n, d], out.b[n, d] = f[1 + d] / f[0], f[1 + dim + d] / f[0]
                for e in range(dim):
                    out.sigma[n, d, e] = f[1 + 2 * dim + d * dim + e]
            n += 1
        occupied += solid > 0
        if fitted:
            continue
        plain += solid > 0
        for o in range(cells.first[c], cells.first[c + 1]):
            q = cells.order[o]
            out.m[n], out.V[n] = p.m[q], p.V[q]
            for d in range(dim):
                out.x[n, d], out.v[n, d], out.b[n, d] = p.x[q, d], p.v[q, d], p.b[q, d]
                for e in range(dim):
                    out.sigma[n, d, e] = p.sigma[q, d, e]
            n += 1
    return n, occupied, plain


class ReconstructedSpline(TensorSpline):
    """B-splines whose nodal sums run over Gauss points of reconstructed fields.

    Parameters
    ----------
    box : Box
    degree : int
        Of the splines.
    particles : int
    order : int
        Degree of the reconstruction, 1 or 2.
    filled : float
        Share of a cell that its particles fill at least, and as little may they have too much.
    """

    def __init__(self, box: Box, degree: int, particles: int, order: int, filled: float) -> None:
        super().__init__(box, degree)
        dim, self.filled = box.dimension, filled
        functions = dim if order == 1 else dim + dim * (dim + 1) // 2
        along = (degree + order) // 2 + 1  # exact to the degree 2 along - 1
        place, weight = np.polynomial.legendre.leggauss(along)
        t = tensor_points([0.5 * place] * dim)
        share = np.prod(tensor_points([0.5 * weight] * dim), axis=1)
        psi, fields = np.zeros((len(t), functions)), 1 + 2 * dim + dim * dim
        for g, point in enumerate(t):
            taylor.py_func(point, psi[g])  # a few points: not worth a compilation
        cells = int(np.prod(box.cells))
        self._cells = Cells(
            np.array(box.lower),
            box.spacing,
            np.array(box.cells),
            np.zeros(particles, dtype=np.int64),
            np.zeros(particles, dtype=np.int64),
            np.zeros(cells + 1, dtype=np.int64),
            *(t, share, psi),
            np.zeros((functions, functions)),
            np.zeros(functions),
            np.zeros((functions, fields)),
            np.zeros(fields),
            np.zeros(functions + dim),
            np.zeros(fields),
        )
        most = min(cells, particles // (functions + 1))
        self.stand_ins = particles + most * len(t)
        self._points = Particles.at_rest(np.zeros((self.stand_ins, dim)), 0.0, 0.0).arrays  # type: ignore[arg-type]
        self._counts = np.zeros(2)

    def sources(
        self, p: ParticleArrays, body_force: Callable[..., Any]
    ) -> tuple[ParticleArrays, Callable[..., Any]]:
        """Gauss points of the cells that can be reconstructed, and the particles of the others."""
        body_force(0, len(p.x))
        sort(self._cells, p.x)
        n, *counts = reconstruct(self._cells, p, self.filled, self._points)
        self._counts += counts
        return ParticleArrays(*(array[:n] for array in self._points)), lambda *_: None

    def statistics(self) -> dict[str, tuple[float, str, str]]:
        occupied, plain = self._counts
        says = "share of the cells with particles whose particles were summed as they are"
        return {"plain_cells": (float(plain / max(occupied, 1.0)), "1", says)}
