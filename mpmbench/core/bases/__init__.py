"""Shape functions: one file per basis. What a basis owes to the rest of the program is written down here.

A plug-in is a dataclass of its settings, registered with ``@register("basis", name)``, whose
``build`` returns an object that fulfils `Basis`. A basis on a cloud keeps `Stencils` (stored
values); a basis on a grid brings a handle of its own with the four compiled functions of
`handle.py`, so that nothing is stored per particle.
"""

from dataclasses import dataclass
from typing import Any, ClassVar, Protocol

import numpy as np

from mpmbench.core.bases.handle import Stencils
from mpmbench.core.geometry import Geometry


@dataclass(frozen=True)
class Promises:
    """What a basis claims about itself; the invariant suite tests each claim in both directions.

    Attributes
    ----------
    dimensions : tuple of int
        Where the basis exists.
    partition_of_unity : bool
        ``sum_i phi_i(x) = 1``.
    linear_completeness : bool
        ``sum_i x_i phi_i(x) = x`` with `Basis.nodes` as ``x_i``.
    non_negative : bool
    kronecker : {"everywhere", "hull", "none"}
        ``phi_i(x_j) = delta_ij`` at all nodes; or only that interior functions vanish on the hull;
        or neither.
    continuous_gradient : bool
        The gradient has no jumps inside the domain.
    gradient_on_hull : bool
        The gradient is finite and exact on the boundary of the convex hull.
    extrapolates : bool
        Functions exist outside the nodes too; then no particle is ever lost.
    grid : bool
        Needs a `Box` (tensor products); otherwise any node set will do.
    """

    dimensions: tuple[int, ...] = (1, 2, 3)
    partition_of_unity: bool = True
    linear_completeness: bool = True
    non_negative: bool = True
    kronecker: str = "none"
    continuous_gradient: bool = True
    gradient_on_hull: bool = True
    extrapolates: bool = False
    grid: bool = False


class Basis(Protocol):
    """A set of shape functions on a set of nodes, which may move."""

    nodes: np.ndarray  # positions of the degrees of freedom x_i [m], shape (N, dim)
    handle: Any  # the NamedTuple that compiled kernels take; its arrays are updated in place by locate and move

    def evaluate(self, x: np.ndarray) -> Stencils:
        """Values and gradients at any points `x` [m], shape (n, dim), in arrays of their own.

        Raises `BrokeDown` when a point has no functions, `NotConverged` when an iteration fails.
        """
        ...

    def locate(self, x: np.ndarray) -> None:
        """Make `handle` valid for the particles at `x` [m], shape (P, dim), without allocating."""
        ...

    def first_outside(self, x: np.ndarray) -> int:
        """Number of the first particle outside the domain of the basis, -1 when all are inside."""
        ...

    def move(self, displacement: np.ndarray) -> None:
        """Move the nodes by the coefficients `displacement` [m], shape (N, dim)."""
        ...


class BasisSettings(Protocol):
    """The registered dataclass: its fields are the keys of ``conf/basis/<name>.yaml``, checked in ``__post_init__``."""

    promises: ClassVar[Promises]

    def build(self, geometry: Geometry, particles: int, moving: bool) -> Basis:
        """The basis on `geometry`, with room for `particles` particles; `moving` when its nodes will move."""
        ...
