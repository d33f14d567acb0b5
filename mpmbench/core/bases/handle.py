"""What a compiled kernel asks of shape functions, and the version of it for stored values.

A kernel reads, for any basis and any dimension::

    work = scratch(basis)
    grad_phi = vector(basis.axes)
    for p in range(x.shape[0]):
        at = locate(basis, x, p, work)
        for k in range(count(basis, at)):
            i, phi = node(basis, at, k, work, grad_phi)
"""

from typing import Any, NamedTuple

import numpy as np

from mpmbench.core.compiled import implements


def scratch(basis: Any) -> Any:
    """Working memory of one kernel call."""
    raise NotImplementedError


def locate(basis: Any, x: np.ndarray, p: int, work: Any) -> int:
    """Prepare the functions at point `p` of `x`; returns what `count` and `node` need to find them again."""
    raise NotImplementedError


def count(basis: Any, at: int) -> int:
    """Number of functions that may be non-zero at the point."""
    raise NotImplementedError


def node(basis: Any, at: int, k: int, work: Any, grad_phi: np.ndarray) -> tuple[int, float]:
    """Node number and value of the `k`-th function at the point; its gradient is written to `grad_phi`."""
    raise NotImplementedError


class Stencils(NamedTuple):
    """Stored shape functions of n points.

    Attributes
    ----------
    axes : tuple of float
        As many entries as there are dimensions (values unused; the length is known to the compiler).
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
    index: np.ndarray
    phi: np.ndarray
    grad_phi: np.ndarray

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
def _(basis):  # type: ignore[no-untyped-def]
    return 0


@implements(locate, Stencils)
def _(basis, x, p, work):  # type: ignore[no-untyped-def]
    return p


@implements(count, Stencils)
def _(basis, at):  # type: ignore[no-untyped-def]
    return basis.size[at]


@implements(node, Stencils)
def _(basis, at, k, work, grad_phi):  # type: ignore[no-untyped-def]
    for d in range(len(basis.axes)):
        grad_phi[d] = basis.grad_phi[at, k, d]
    return basis.index[at, k], basis.phi[at, k]
