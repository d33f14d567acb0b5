"""Benchmarks: one file per problem.

A file goes in a fixed order: equations and source, parameters, geometry, initial and boundary
conditions, exact solution, quantities of interest.

A plug-in is a dataclass of its parameters, registered with ``@register("problem", name)``, that
derives from `Problem`. One of several bodies gives them as `bodies`. A field ``random_seed: int = 0``
declares that the problem is random; it is no key, but takes the value of the key ``seed``.
"""

from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np

from mpmbench.core.bodies import Part
from mpmbench.core.choices import Choices
from mpmbench.core.geometry import Geometry
from mpmbench.core.materials import Material
from mpmbench.core.particles import Particles, per_axis
from mpmbench.core.setting import Settings
from mpmbench.core.simulation import Solution
from mpmbench.core.state import Loads, State

Fields = dict[str, np.ndarray]


class Problem(Settings):
    """Base of all problems: what most of them share. A problem overrides what it needs.

    Attributes
    ----------
    dimension : int
    reference_length : float
        Length [m] that `resolution` divides into cells.
    samples : int
        Number of instants at which history is kept.
    touches_fixed_nodes : bool
        The fixed nodes are not the body's: it meets them on its way.
    still : bool
        Nothing moves, as with ``method=evaluate``.
    bends : bool
        Lines of material along the axes do not stay straight and parallel.
    initial_acceleration : str
        ``balance``: the loop starts with ``M a(0) = f(0)``. Anything else: with the accelerations
        that `prepare` has set, or none, and velocities at t = 0 are taken for those at -dt/2.
    known_early : tuple of str
        Numbers among `quantities` that a run which fails has too: largest values, and instants that
        were reached. Its other numbers belong to an end that it has not seen, and are left out.
    """

    dimension: ClassVar[int]
    reference_length: ClassVar[float]
    samples: ClassVar[int] = 200
    known_early: ClassVar[tuple[str, ...]] = ()
    touches_fixed_nodes: ClassVar[bool] = False
    still: ClassVar[bool] = False
    bends: ClassVar[bool] = False
    initial_acceleration: ClassVar[str] = "balance"

    def suited_to(self, choices: Choices) -> "Problem":
        """The problem with what it chooses by the method: checks and all that follows are asked of it."""
        return self

    def check(self, material: Material, choices: Choices, basis: str, resolution: int) -> None:
        """Raise `NotApplicable` when this combination cannot be run, `BadSetting` when a key is out of range."""

    def check_particles(self, particles_per_cell: int) -> None:
        """Raise `BadSetting` unless cells can hold that many particles: powers of whole numbers, on boxes."""
        per_axis(particles_per_cell, self.dimension)

    def nodes(self, resolution: int, choices: Choices) -> Geometry:
        """Where the nodes start: the whole domain for fixed nodes, the body for moving ones."""
        raise NotImplementedError

    def seed(self, resolution: int, particles_per_cell: int) -> tuple[np.ndarray, np.ndarray]:
        """Initial particle positions [m], shape (P, dim), and volumes [m^dim], shape (P,)."""
        raise NotImplementedError

    def bodies(self, resolution: int, particles_per_cell: int) -> tuple[Part, ...]:
        """Several bodies, each with its mesh, particles and velocity; a problem with one has none here."""
        return ()

    def materials(self, material: Material) -> tuple[Material, ...]:
        """What each of several bodies is made of; none: all of the material of the run."""
        return ()

    def place(self, X: np.ndarray, resolution: int, choices: Choices) -> np.ndarray:
        """Where the particles that `seed` made start, shape (P, dim), if that depends on the method."""
        return X

    def tracers(self) -> np.ndarray:
        """Massless points that are carried along, shape (n, dim); point loads act on the first of them."""
        return np.zeros((0, self.dimension))

    def fixed(self, x: np.ndarray) -> np.ndarray:
        """Constrained components of nodes at x, shape (N, dim) of bool."""
        return np.zeros(x.shape, dtype=bool)

    def velocity(self, X: np.ndarray, material: Material) -> np.ndarray:
        """Initial velocity [m/s] at X, shape (n, dim)."""
        return np.zeros_like(X)

    def loads(self, material: Material) -> Loads:
        """Body force, point loads and prescribed motion."""
        return Loads()

    def prepare(self, particles: Particles, material: Material) -> None:
        """Change the initial state of the particles (deformation, stress, history) where it is not at rest."""

    def initial_displacement(self, material: Material) -> Callable[[np.ndarray], np.ndarray] | None:
        """Displacement [m] as a function of X of a body that is deformed from the start; `prepare` does the particles.

        `nodes`, `fixed`, `velocity` and the prescribed motion then speak of the reference
        configuration.
        """
        return None

    def start(self, state: State, dt: float) -> None:
        """Change velocities, which live half a step before positions, when the first step is known."""

    def adaptive_step(self, state: State) -> Callable[[State], float] | None:
        """A time step [s] as a function of the state, for problems whose stable step changes."""
        return None

    def exact(self, X: np.ndarray, t: float, material: Material) -> Fields:
        """Exact ``displacement``, ``velocity`` and ``stress`` at initial positions X and time t; may be partial."""
        return {}

    def alternative(self, X: np.ndarray, t: float, material: Material) -> Fields:
        """A second reference that is reported beside the exact one."""
        return {}

    def observe(self, state: State) -> dict[str, Any]:
        """Time series of the problem's own, by name: numbers or arrays that join the history when it is sampled."""
        return {}

    def quantities(self, solution: Solution, material: Material) -> dict[str, tuple[Any, ...]]:
        """Quantities of interest: name -> (value or time series, unit, long name), and dimensions of other arrays."""
        return {}

    def temporal_floor(
        self, dt: float, t: float, X: np.ndarray, material: Material
    ) -> float | None:
        """RMS displacement error [m] of the time integration alone, where it is known exactly."""
        return None
