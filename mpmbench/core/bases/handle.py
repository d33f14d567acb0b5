"""What a compiled kernel asks of shape functions, and the version of it for stored values.

A kernel reads, for any basis and any dimension::

    work, grad_phi = scratch(phi), vector(phi.axes)
    for p in range(start, stop):
        at = locate(phi, x, p, work)
        for k in range(count(phi, at)):
            i = index(phi, at, k)
            phi_i = value(phi, at, k, work, grad_phi)

or, for several sums at once, `spread` and `interpolate`.
"""

from typing import Any, NamedTuple

import numpy as np

from mpmbench.core.compiled import implements
from mpmbench.core.compiled.rows import add_multiple


def scratch(phi: Any) -> Any:
    """Working memory of one kernel call."""
    raise NotImplementedError


def locate(phi: Any, x: np.ndarray, p: int, work: Any) -> int:
    """Prepare the functions at point `p` of `x`; points with the same answer have the same nodes (a grid cell)."""
    raise NotImplementedError


def count(phi: Any, at: int) -> int:
    """Number of functions that may be non-zero at the point."""
    raise NotImplementedError


def index(phi: Any, at: int, k: int) -> int:
    """Node number of the `k`-th function at the point."""
    raise NotImplementedError


def value(phi: Any, at: int, k: int, work: Any, grad_phi: np.ndarray) -> float:
    """Value of the `k`-th function at the point located last; its gradient [1/m] is written to `grad_phi`."""
    raise NotImplementedError


def spread(phi: Any, at: int, work: Any, lanes: Any, columns: np.ndarray, cell: np.ndarray) -> None:
    """Add ``phi_k columns[0] + sum_d (d phi_k / d x_d) columns[1 + d]`` to ``cell[k]`` for all functions k.

    `columns` has dim + 1 rows, and all rows are as long as the tuple `lanes`.
    """
    raise NotImplementedError


def interpolate(
    phi: Any, at: int, work: Any, lanes: Any, cell: np.ndarray, sums: np.ndarray
) -> None:
    """Write ``sum_k phi_k cell[k]`` to ``sums[0]`` and ``sum_k (d phi_k / d x_d) cell[k]`` to ``sums[1 + d]``."""
    raise NotImplementedError


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
        dense = np.zeros((len(self.size), nodes))
        for p, n in enumerate(self.size):
            np.add.at(dense[p], self.index[p, :n], self.phi[p, :n])
        return dense

    def gradient_matrix(self, nodes: int) -> np.ndarray:
        """Dense gradients grad_phi[p, i, d], shape (n, nodes, dim); for tests and plots."""
        dense = np.zeros((len(self.size), nodes, len(self.axes)))
        for p, n in enumerate(self.size):
            np.add.at(dense[p], self.index[p, :n], self.grad_phi[p, :n])
        return dense


@implements(scratch, Stencils)
def _scratch(phi):  # type: ignore[no-untyped-def]
    return 0


@implements(locate, Stencils)
def _locate(phi, x, p, work):  # type: ignore[no-untyped-def]
    return p


@implements(count, Stencils)
def _count(phi, at):  # type: ignore[no-untyped-def]
    return phi.size[at]


@implements(index, Stencils)
def _index(phi, at, k):  # type: ignore[no-untyped-def]
    return phi.index[at, k]


@implements(value, Stencils)
def _value(phi, at, k, work, grad_phi):  # type: ignore[no-untyped-def]
    for d in range(len(phi.axes)):
        grad_phi[d] = phi.grad_phi[at, k, d]
    return phi.phi[at, k]


@implements(spread, Stencils)
def _spread(phi, at, work, lanes, columns, cell):  # type: ignore[no-untyped-def]
    for k in range(phi.size[at]):
        add_multiple(lanes, cell, k, phi.phi[at, k], columns, 0)
        for d in range(len(phi.axes)):
            add_multiple(lanes, cell, k, phi.grad_phi[at, k, d], columns, 1 + d)


@implements(interpolate, Stencils)
def _interpolate(phi, at, work, lanes, cell, sums):  # type: ignore[no-untyped-def]
    for r in range(1 + len(phi.axes)):
        for c in range(len(lanes)):
            sums[r, c] = 0.0
    for k in range(phi.size[at]):
        add_multiple(lanes, sums, 0, phi.phi[at, k], cell, k)
        for d in range(len(phi.axes)):
            add_multiple(lanes, sums, 1 + d, phi.grad_phi[at, k, d], cell, k)
