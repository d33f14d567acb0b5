"""Shape functions: one file per basis. What a basis owes to the rest of the program stands here.

A plug-in is a dataclass of its settings, derived from `BasisSettings` and registered with
``@register("basis", name)``. Its ``build`` returns a `Basis`: a `StoredBasis`, whose functions at
the particles are stored in `Stencils`, or one with a handle of its own, which answers the questions
of `handle.py` in compiled code, so that nothing is stored per particle.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from mpmbench.core.bases.handle import Stencils
from mpmbench.core.choices import Choices
from mpmbench.core.errors import NotApplicable
from mpmbench.core.geometry import Geometry
from mpmbench.core.particles import ParticleArrays, ParticleData, Particles
from mpmbench.core.setting import Settings


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
    derivative : bool
        The gradient is the derivative of the values.
    gradient_on_hull : bool
        The gradient is finite and exact on the boundary of the convex hull.
    extrapolates : bool
        Functions exist outside the nodes too; particles are lost only where the nodes are fixed.
    grid : bool
        Needs a `Box` (tensor products); otherwise any node set will do.
    moves : bool
        The nodes can move; otherwise methods with moving nodes are refused.
    bends : bool
        Nodes that move follow any motion, and not only one that keeps lines along the axes straight
        and parallel.
    """

    dimensions: tuple[int, ...] = (1, 2, 3)
    partition_of_unity: bool = True
    linear_completeness: bool = True
    non_negative: bool = True
    kronecker: str = "none"
    continuous_gradient: bool = True
    derivative: bool = True
    gradient_on_hull: bool = True
    extrapolates: bool = False
    grid: bool = False
    moves: bool = True
    bends: bool = True


class Basis:
    """A set of shape functions on a set of nodes, which may move.

    Attributes
    ----------
    nodes : ndarray
        Positions x_i of the degrees of freedom [m], shape (N, dim).
    handle : NamedTuple
        What compiled kernels take (`handle.py`). It is read anew after every `locate`.
    constant_values : bool
        Values at the particles never change, and with them the consistent mass matrix, which is
        then assembled once.
    stand_ins : int
        Most points that take the place of the particles in nodal sums (`sources`), 0 where none do.
    """

    nodes: np.ndarray
    handle: Any
    constant_values: bool = False
    stand_ins: int = 0

    def follow(self, particles: Particles) -> None:
        """Learn, once and before the first step, which particles the functions are for.

        Their arrays (volumes, deformation gradients) are updated in place: a basis that depends on
        them keeps `particles` and reads them at each `locate`.
        """

    def evaluate(self, x: np.ndarray) -> Stencils:
        """Values and gradients at any points `x` [m], shape (n, dim), in arrays of their own.

        Raises `BrokeDown` when a point has no functions, `NotConverged` when an iteration fails.
        """
        raise NotImplementedError

    def evaluate_particles(self, x: np.ndarray, numbers: np.ndarray) -> Stencils:
        """Values and gradients at ``x[numbers]``, for these of the particles that the basis follows.

        They are those at any points, unless functions depend on the domain of a particle.
        """
        return self.evaluate(x[numbers])

    def locate(self, x: np.ndarray) -> None:
        """Make `handle` valid for the particles at `x` [m], shape (P, dim).

        Its arrays are written in place. Only when a particle has more functions than ever before
        does `handle` become a new, wider one. Where functions are evaluated on the fly, nothing is
        to be done.
        """

    def first_outside(self, x: np.ndarray) -> int:
        """Number of the first particle that has no functions, -1 when there is none.

        By default functions exist everywhere, and only a position that is no number has none.
        """
        lost = np.flatnonzero(~np.isfinite(x).all(axis=1))
        return int(lost[0]) if len(lost) else -1

    def carry(self, v: np.ndarray, dt: float) -> None:
        """Carry along what the functions are made of besides nodes, in a step `dt` [s] with nodal velocities [m/s].

        `v` has the shape (N, dim); positions and deformations of particles are new already.
        """

    def sources(
        self, p: ParticleArrays, body_force: Callable[..., Any]
    ) -> tuple[ParticleArrays, Callable[..., Any]]:
        """What sums of mass, momentum and forces on the nodes run over: the particles, unless points stand for them.

        ``body_force(start, stop)`` writes the body force of some particles; what is returned beside the
        points does so for them.
        """
        return p, body_force

    def move(self, displacement: np.ndarray) -> None:
        """Move the nodes by the coefficients `displacement` [m], shape (N, dim)."""
        raise NotApplicable(f"the nodes of {type(self).__name__} cannot move")

    def statistics(self) -> dict[str, tuple[float, str, str]]:
        """What the basis has to say about a run: name -> (value, unit, long name)."""
        return {}


class StoredBasis(Basis):
    """A basis whose functions at the particles are stored, once evaluated.

    A subclass allocates `handle` (`Stencils.empty`) and writes `_fill`.
    """

    handle: Stencils

    def _fill(self, x: np.ndarray, stored: Stencils) -> Stencils:
        """Write the functions at points `x`, shape (n, dim), to `stored` or to wider ones.

        Returns the stencils that were written.
        """
        raise NotImplementedError

    def evaluate(self, x: np.ndarray) -> Stencils:
        return self._fill(x, Stencils.empty(len(x), self.handle.width, x.shape[1]))

    def locate(self, x: np.ndarray) -> None:
        self.handle = self._fill(x, self.handle)


@dataclass(frozen=True)
class BasisSettings(Settings):
    """Base class of the registered dataclasses, whose settings are the keys of the basis.

    Attributes
    ----------
    promises : Promises
    background_grid : bool
        The basis lives on cells that can carry ghost stiffness.
    particle_data : dict of ParticleData
        Arrays that the basis keeps per particle, by name; they are in ``particles.data``.
    """

    promises: ClassVar[Promises]
    background_grid: ClassVar[bool] = False
    particle_data: ClassVar[dict[str, ParticleData]] = {}

    def check(self, choices: Choices, touches_fixed_nodes: bool) -> None:
        """Raise `NotApplicable` for a method that makes no sense with this basis.

        `touches_fixed_nodes` says that material of the problem may reach nodes that are held though
        it did not touch them at the start.
        """

    @property
    def stands_in(self) -> bool:
        """Whether other points may take the place of particles in nodal sums (`Basis.sources`)."""
        return False

    def suited_to(self, choices: Choices) -> "BasisSettings":
        """These settings where they mean something for a method, and what holds in their place."""
        return self

    def build(self, geometry: Geometry, particles: int, moving: bool) -> Basis:
        """The basis on `geometry` for so many particles; `moving` when its nodes will move."""
        raise NotImplementedError
