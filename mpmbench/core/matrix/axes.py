"""The mass along each axis of a grid, whose product is nearly the whole mass: for conjugate gradients.

Where functions are products and particles fill lines of cells alike, ``M_ij`` is the product over
the axes of ``A_e = sum over all other axes of M``, but for a factor. Elsewhere ``S A S``, scaled to
the diagonal of M, is as good a guess as a Gauss-Seidel sweep. Components that are held on a whole
line of nodes leave A too.
"""

from typing import NamedTuple

import numpy as np

from mpmbench.core.compiled import compiled, inlined, lean, threads
from mpmbench.core.matrix.conjugate_gradients import MOST_ITERATIONS, TOLERANCE

SMALLEST_PIVOT = 1e-10  # of its diagonal entry: with less the particles on a line do not suffice


class Axes(NamedTuple):
    """Factors of the mass along each axis; a row of M holds the pairs in the order of `offset`."""

    shape: np.ndarray  # nodes along each axis, shape (dim,)
    offset: np.ndarray  # of a pair along each axis, shape (pairs, dim)
    along: np.ndarray  # A_e, its lower half: [axis, i, i - j], shape (dim, longest, reach + 1)
    # [component, axis, i, k]: one over the pivot for k = 0, else L(i, i - k)
    factor: np.ndarray
    held: np.ndarray  # lines without a free node, shape (components, dim, longest)
    scale: np.ndarray  # 1 / S, shape (N,)

    @classmethod
    def empty(cls, shape: np.ndarray, order: int, components: int) -> "Axes":
        """Room for the factors on a grid where `order` functions along an axis meet at a point."""
        dim, longest = len(shape), int(shape.max())
        digits = np.indices((2 * order - 1,) * dim).reshape(dim, -1).T
        along = np.zeros((dim, longest, order))
        factor = np.zeros((components, *along.shape))
        held = np.zeros((components, dim, longest), dtype=np.bool_)
        offset = np.ascontiguousarray(digits - (order - 1))
        return cls(shape, offset, along, factor, held, np.zeros(int(shape.prod())))


@inlined
def step_on(shape, place):
    """The next node of the grid, the last axis fastest."""
    for e in range(shape.shape[0] - 1, -1, -1):
        place[e] += 1
        if place[e] < shape[e]:
            return
        place[e] = 0


def factorised(axes: Axes, values: np.ndarray, diagonal: np.ndarray, free: np.ndarray) -> bool:
    """Sum the mass along each axis, and factorise it; returns False where that is impossible."""
    threads.each(lambda e: sum_along(axes, e, values), len(axes.shape), len(values))
    return bool(factorise_axes(axes, values, diagonal, free))


@compiled
def sum_along(axes, e, values):
    """Sum the mass along the axis e."""
    place, A = np.zeros(len(axes.shape), np.int64), axes.along[e]
    A[:] = 0.0
    for r in range(values.shape[0]):
        for k in range(values.shape[1]):
            if axes.offset[k, e] <= 0:
                A[place[e], -axes.offset[k, e]] += values[r, k]
        step_on(axes.shape, place)


@compiled
def factorise_axes(axes, values, diagonal, free):
    """Factorise what is summed along the axes; returns False where that is impossible."""
    place = np.zeros(len(axes.shape), np.int64)
    dim, reach = len(place), axes.along.shape[2] - 1
    axes.held[:] = True
    for r in range(values.shape[0]):
        product = 1.0
        for e in range(dim):
            product *= axes.along[e, place[e], 0]
        mass = values[r, diagonal[r]]
        axes.scale[r] = np.sqrt(product / mass) if mass > 0.0 else 0.0
        for c in range(free.shape[1]):
            if free[r, c]:
                for e in range(dim):
                    axes.held[c, e, place[e]] = False
        step_on(axes.shape, place)
    for c in range(free.shape[1]):
        for e in range(dim):
            A, L, held = axes.along[e], axes.factor[c, e], axes.held[c, e]
            for i in range(axes.shape[e]):
                for k in range(min(i, reach), -1, -1):
                    j, total = i - k, A[i, k]
                    for n in range(max(0, i - reach), j):
                        total -= L[i, i - n] * L[j, j - n] / L[n, 0] if j - n <= reach else 0.0
                    if held[i] or held[j]:
                        L[i, k] = 1.0 if k == 0 else 0.0
                    elif k > 0:
                        L[i, k] = total * L[j, 0]
                    elif total > SMALLEST_PIVOT * A[i, 0]:
                        L[i, 0] = 1.0 / total
                    else:
                        return False
    return True


@lean
def solve_axes(axes, c, free, r, z):
    """``z = (S A S)^-1 r`` of component c where it is free, zero elsewhere, shape (N,)."""
    n, reach = r.shape[0], axes.along.shape[2] - 1
    for i in range(n):
        z[i] = r[i] * axes.scale[i] if free[i, c] else 0.0
    outer = 1
    for e in range(axes.shape.shape[0]):
        L, length = axes.factor[c, e], axes.shape[e]
        inner = n // (outer * length)  # nodes from one to the next along the axis
        for o in range(outer):
            first = o * length * inner
            for i in range(length):
                row = first + i * inner
                for k in range(1, min(i, reach) + 1):
                    known = L[i, k]
                    for j in range(row, row + inner):
                        z[j] -= known * z[j - k * inner]
            for i in range(length - 1, -1, -1):
                row = first + i * inner
                known = L[i, 0]
                for j in range(row, row + inner):
                    z[j] *= known
                for k in range(1, min(length - 1 - i, reach) + 1):
                    known = L[i + k, k]
                    for j in range(row, row + inner):
                        z[j] -= known * z[j + k * inner]
        outer *= length
    for i in range(n):
        z[i] *= axes.scale[i] if free[i, c] else 0.0


@lean
def product(columns, values, a, out):
    """``out = M a``, shape (N,)."""
    for i in range(a.shape[0]):
        total = 0.0
        for k in range(columns.shape[1]):
            total += values[i, k] * a[columns[i, k]]
        out[i] = total


@lean
def conjugate_gradients_by_axes(c, axes, columns, values, free, rhs, out, r, z, w, s):
    """As `conjugate_gradients` for the component c alone, with the product over the axes in place of the sweep."""
    n, at_rest = rhs.shape[0], True
    for i in range(n):
        s[i], w[i] = 0.0 if free[i, c] else out[i, c], 0.0
        at_rest &= s[i] == 0.0
    if not at_rest:  # most of what is held is so at zero
        product(columns, values, s, w)
    for i in range(n):
        r[i], s[i] = rhs[i, c] - w[i] if free[i, c] else 0.0, 0.0
        if free[i, c]:
            out[i, c] = 0.0
    goal, before = 0.0, 0.0
    for iteration in range(MOST_ITERATIONS):
        solve_axes(axes, c, free, r, z)
        rz = 0.0
        for i in range(n):
            rz += r[i] * z[i]
        if iteration == 0:
            goal = TOLERANCE**2 * rz
        if rz <= goal:
            return iteration
        for i in range(n):
            s[i] = z[i] + (rz / before if before > 0.0 else 0.0) * s[i]
        before = rz
        product(columns, values, s, w)
        curvature = 0.0
        for i in range(n):
            curvature += s[i] * w[i]
        if not curvature > 0.0:
            return -1
        for i in range(n):
            if free[i, c]:
                out[i, c] += rz / curvature * s[i]
                r[i] -= rz / curvature * w[i]
    return -1
