"""What a compiled kernel asks of shape functions, and the answers of stored values.

A handle is a NamedTuple with the field ``axes``, a tuple with one float per dimension (the length
matters, not the entries), and ``width``, a field or property: the largest number of functions at
any point. A kernel reads, for any basis and any dimension::

    work, grad_phi = scratch(phi), vector(phi.axes)
    for p in range(start, stop):
        at = locate(phi, x, p, work)
        for k in range(count(phi, at)):
            i = index(phi, at, k)
            phi_i = value(phi, at, k, work, grad_phi)

Each of these functions is a question, and a file answers it for its class of handles under
``@implements(question, Handle)`` (`compiled`). An answer cannot allocate. Every handle must answer
`locate`, `count`, `index` and `value`; the others answer themselves as they stand here, unless a
handle knows better. On grids, `grid.product` answers them all from the functions along one axis.

The steps of explicit methods take particles in batches (`compiled.rows`): `locate_batch` says how
many of the next ones make one, and `spread` and `interpolate` go from those that follow each other
in one cell to its nodes and back.
"""

from typing import Any, NamedTuple

import numpy as np

from mpmbench.core.compiled import (
    answers_by_default,
    compiled,
    implements,
    inlined,
    matrix,
    vector,
)
from mpmbench.core.compiled.algebra import divide_by
from mpmbench.core.compiled.rows import LANES, add_multiple, fill_row, set_multiple

# Of the largest (x_i - x)^2: directions in which D is less have no affine part that nodes could see.
FLAT = 1e-10


@answers_by_default
def scratch(phi):
    """Working memory of one kernel call, as a tuple of arrays; none by default.

    It must be a tuple even of one array: compiled code cannot return an array that it made.
    """
    return ()


def locate(phi: Any, x: np.ndarray, p: int, work: Any) -> int:
    """Prepare the functions at point `p` of `x`, shape (n, dim).

    Points with the same answer, such as the number of a grid cell, must have the same nodes.
    """
    raise NotImplementedError


def count(phi: Any, at: int) -> int:
    """Number of functions that may be non-zero at the point."""
    raise NotImplementedError


def index(phi: Any, at: int, k: int) -> int:
    """Node number of the `k`-th function at the point."""
    raise NotImplementedError


def value(phi: Any, at: int, k: int, work: Any, grad_phi: np.ndarray) -> float:
    """Value of the `k`-th function at the point located last; writes its gradient [1/m]."""
    raise NotImplementedError


@answers_by_default
def room(phi):
    """Working memory of a kernel that works on batches of points, as a tuple of arrays."""
    return scratch(phi)


@answers_by_default
def locate_batch(phi, x, first, most, at, work):
    """Locate points of `x` from `first` on, at most ``most <= len(BATCH)``; returns how many.

    What `locate` answers for the b-th of them is written to ``at[b]``.
    """
    at[0] = locate(phi, x, first, work)
    return 1


@answers_by_default
def spread(phi, at, start, n, work, values, lanes, columns, sums, marks):
    """Add what n points of a batch from `start` on, all `at` one place, give to the rows of `sums`, shape (N, lanes).

    For ``c < dim``, ``sums[i, c] += sum_e columns[c dim + e, b] d phi_i / d x_e``; for all ``c <
    len(values)``, ``sums[i, dim + c] += columns[dim^2 + c, b] phi_i``. All these nodes get a mark.
    """
    dim = len(phi.axes)
    grad_phi, rows = vector(phi.axes), matrix((0.0, *phi.axes), lanes)
    folded = matrix((0.0,), lanes)
    for r in range(1 + dim):
        fill_row(lanes, rows, r, 0.0)
    for b in range(start, start + n):
        for c in range(len(values)):
            rows[0, dim + c] = columns[dim * dim + c, b]
        for d in range(dim):
            for e in range(dim):
                rows[1 + e, d] = columns[d * dim + e, b]
        for k in range(count(phi, at)):
            i = index(phi, at, k)
            set_multiple(lanes, folded, 0, value(phi, at, k, work, grad_phi), rows, 0)
            for e in range(dim):
                add_multiple(lanes, folded, 0, grad_phi[e], rows, 1 + e)
            add_multiple(lanes, sums, i, 1.0, folded, 0)
            marks[i] = 1


@answers_by_default
def interpolate(phi, at, start, n, work, nodes, fields):
    """Write what the nodes' v and a are at n points of a batch from `start` on, all `at` one place, to `fields`.

    Its rows are v_d, ``dim + d`` for a_d, and ``(2 + d) dim + e`` for ``d v_d / d x_e``.
    """
    dim = len(phi.axes)
    grad_phi = vector(phi.axes)
    sums = matrix((0.0, *phi.axes), LANES)
    for b in range(start, start + n):
        for r in range(1 + dim):
            fill_row(LANES, sums, r, 0.0)
        for k in range(count(phi, at)):
            i = index(phi, at, k)
            add_multiple(LANES, sums, 0, value(phi, at, k, work, grad_phi), nodes.both, i)
            for e in range(dim):
                add_multiple(LANES, sums, 1 + e, grad_phi[e], nodes.both, i)
        for d in range(dim):
            fields[d, b], fields[dim + d, b] = sums[0, d], sums[0, dim + d]
            for e in range(dim):
                fields[(2 + d) * dim + e, b] = sums[1 + e, d]


class Affine(NamedTuple):
    """The affine parts of the fields around particles.

    Attributes
    ----------
    affine : ndarray
        One matrix per particle, shape (P, dim, dim): A, or ``B = A D``.
    among, nodes : ndarray
        Places of the particles among those of the nodes [m], shapes (P, dim) and (N, dim).
    moments : bool
        It is B, with ``D = sum_i phi_i (x_i - x) (x) (x_i - x)``.
    """

    affine: np.ndarray
    among: np.ndarray
    nodes: np.ndarray
    moments: bool


@answers_by_default
def take_affine(phi, at, p, n, work, part, v_i):
    """Write ``sum_i phi_i v_i (x) (x_i - x)`` of n particles from `p` on to ``part.affine``.

    They are all `at` one place, and are those of the last call of `interpolate`.
    """
    for q in range(p, p + n):
        take_one(phi, at, q, work, part, v_i)


@inlined
def take_one(phi, at, q, work, part, v_i):
    """The same for the particle `q`, which was located last."""
    dim, grad_phi = len(phi.axes), vector(phi.axes)
    for d in range(dim):
        for e in range(dim):
            part.affine[q, d, e] = 0.0
    for k in range(count(phi, at)):
        phi_i = value(phi, at, k, work, grad_phi)
        i = index(phi, at, k)
        for e in range(dim):
            moment = phi_i * (part.nodes[i, e] - part.among[q, e])
            for d in range(dim):
                part.affine[q, d, e] += v_i[i, d] * moment


@answers_by_default
def spread_affine(phi, at, p, n, work, part, m, column, sums):
    """Add ``m phi_i A (x_i - x)`` of n particles from `p` on to the columns from `column` on of `sums`.

    They are all `at` one place, and are those of the last call of `spread`.
    """
    for q in range(p, p + n):
        spread_one(phi, at, q, work, part, m, column, sums)


@inlined
def spread_one(phi, at, q, work, part, m, column, sums):
    """The same for the particle `q`, which was located last."""
    dim = len(phi.axes)
    grad_phi, arm = vector(phi.axes), vector(phi.axes)
    A, D = matrix(phi.axes, phi.axes), matrix(phi.axes, phi.axes)
    for d in range(dim):
        for e in range(dim):
            A[d, e], D[d, e] = m[q] * part.affine[q, d, e], 0.0
    if part.moments:
        farthest = 0.0
        for k in range(count(phi, at)):
            phi_i = value(phi, at, k, work, grad_phi)
            i = index(phi, at, k)
            for d in range(dim):
                arm[d] = part.nodes[i, d] - part.among[q, d]
                farthest = max(farthest, arm[d] * arm[d])
            for d in range(dim):
                for e in range(d + 1):
                    D[d, e] += phi_i * arm[d] * arm[e]
        divide_by(phi.axes, D, FLAT * farthest, A)
    for k in range(count(phi, at)):
        phi_i = value(phi, at, k, work, grad_phi)
        i = index(phi, at, k)
        for d in range(dim):
            for e in range(dim):
                arm_e = part.nodes[i, e] - part.among[q, e]
                sums[i, column + d] += phi_i * A[d, e] * arm_e


@answers_by_default
def add_pairs(phi, at, start, p, n, work, functions, m, phi_p, pairs):
    """Add ``m phi_k phi_l`` for ``l <= k``, pair after pair, of n points of a batch from `start` on.

    They are the particles from `p` on, of the masses `m`, and all `at` one place; `phi_p` is room for
    the functions at one.
    """
    grad_phi = vector(phi.axes)
    for b in range(n):
        pair = 0
        for k in range(count(phi, at)):
            phi_p[k] = value(phi, at, k, work, grad_phi)
            for j in range(k + 1):
                pairs[pair // len(LANES), pair % len(LANES)] += m[p + b] * phi_p[k] * phi_p[j]
                pair += 1


@answers_by_default
def place(phi, columns, i, k, j, n):
    """Place of column j in row i of a matrix whose rows have the ascending `columns`, shape (N, K).

    i and j are the k-th and n-th functions at a point. Returns -1 where there is no such column.
    """
    low, high = 0, columns.shape[1]
    while low < high:  # unused places repeat a column beyond all others
        middle = (low + high) // 2
        if columns[i, middle] < j:
            low = middle + 1
        else:
            high = middle
    return low if low < columns.shape[1] and columns[i, low] == j else -1


class Stencils(NamedTuple):
    """Stored shape functions of n points.

    Attributes
    ----------
    axes : tuple of float
        As many entries as there are dimensions (values unused; the length is known to the
        compiler).
    size : ndarray of int
        Number of functions at each point, shape (n,).
    index : ndarray of int
        Node numbers, shape (n, K); entries from ``size[p]`` on are meaningless.
    phi : ndarray
        Values, shape (n, K).
    grad_phi : ndarray
        Gradients [1/m], shape (n, K, dim).
    """

    axes: tuple[float, ...]
    size: np.ndarray
    index: np.ndarray  # type: ignore[assignment]
    phi: np.ndarray
    grad_phi: np.ndarray

    @property
    def width(self) -> int:
        """Largest number of functions at any point."""
        return int(self.index.shape[1])

    @classmethod
    def empty(cls, points: int, width: int, dimension: int) -> "Stencils":
        """Room for `points` points with up to `width` functions each."""
        return cls(
            (0.0,) * dimension,
            np.zeros(points, dtype=np.int64),
            np.zeros((points, width), dtype=np.int64),
            np.zeros((points, width)),
            np.zeros((points, width, dimension)),
        )

    def matrix(self, nodes: int) -> np.ndarray:
        """Dense values phi[p, i], shape (n, nodes); for tests and plots."""
        return self._dense(self.phi, nodes)

    def gradient_matrix(self, nodes: int) -> np.ndarray:
        """Dense gradients grad_phi[p, i, d], shape (n, nodes, dim); for tests and plots."""
        return self._dense(self.grad_phi, nodes)

    def _dense(self, values: np.ndarray, nodes: int) -> np.ndarray:
        dense = np.zeros((len(values), nodes, *values.shape[2:]))
        for p, n in enumerate(self.size):
            np.add.at(dense[p], self.index[p, :n], values[p, :n])
        return dense


@implements(locate, Stencils)
def _locate(phi, x, p, work):
    return p


@implements(locate_batch, Stencils)
def _locate_batch(phi, x, first, most, at, work):
    for b in range(most):
        at[b] = first + b
    return most


@implements(count, Stencils)
def _count(phi, at):
    return phi.size[at]


@implements(index, Stencils)
def _index(phi, at, k):
    return phi.index[at, k]


@implements(value, Stencils)
def _value(phi, at, k, work, grad_phi):
    for d in range(len(phi.axes)):
        grad_phi[d] = phi.grad_phi[at, k, d]
    return phi.phi[at, k]


@compiled
def fill(phi, x, size, nodes, values, gradients):
    """Store the functions of any handle at points x, shape (n, dim), in arrays of `Stencils`."""
    work, grad_phi = scratch(phi), vector(phi.axes)
    for p in range(x.shape[0]):
        at = locate(phi, x, p, work)
        size[p] = count(phi, at)
        for k in range(size[p]):
            nodes[p, k] = index(phi, at, k)
            values[p, k] = value(phi, at, k, work, grad_phi)
            for d in range(len(phi.axes)):
                gradients[p, k, d] = grad_phi[d]
