"""Particles (material points): plain arrays, and where they start."""

from collections import namedtuple
from dataclasses import dataclass, field
from functools import cached_property
from operator import attrgetter

import numpy as np

from mpmbench.core.errors import require, require_option
from mpmbench.core.geometry import Box, tensor_points

# Nodal mass [kg] where points see a node but give it nothing: not zero, and of no weight anywhere.
SEEN = 1e-300
FINITE = 1e300  # [m^dim]; no volume is larger
# Names that a run's result and snapshots have for themselves.
RESULT_NAMES = (
    *("time", "x", "v", "F", "sigma", "V", "state"),
    *("position", "displacement", "velocity", "stress", "volume", "particle", "snapshot"),
    "deformation_gradient",
    *("L", "pressure", "von_mises", "plastic_strain", "temperature"),
)


@dataclass(frozen=True)
class ParticleData:
    """Declaration of an array that a transfer, a material or a basis keeps per particle.

    Parameters
    ----------
    axes : tuple
        Shape of one particle's part, with ``"dim"`` for the number of dimensions.
    unit : str
    says : str
        What it is, in a few words.
    """

    axes: tuple[str | int, ...]
    unit: str
    says: str

    def shape(self, dimension: int) -> tuple[int, ...]:
        """The shape in so many dimensions."""
        return tuple(dimension if axis == "dim" else int(axis) for axis in self.axes)


def particle_data(*owners: object) -> dict[str, ParticleData]:
    """What transfer, material and basis declare as ``particle_data``, by name.

    Raises
    ------
    ValueError
        When a name is taken.
    """
    found: dict[str, ParticleData] = {}
    for owner in owners:
        for name, declared in getattr(owner, "particle_data", {}).items():
            if name in found or name in RESULT_NAMES:
                raise ValueError(f"particle_data of {type(owner).__name__}: {name} is taken")
            found[name] = declared
    return found


# The arrays of `Particles` that are updated in every step, as compiled loops take them.
ParticleArrays = namedtuple("ParticleArrays", "x v F L sigma V0 V m state a b")
_values = attrgetter(*ParticleArrays._fields)


@dataclass
class Particles:
    """State of P particles; the last `tracers` of them have no mass and no volume and are only carried along.

    Attributes
    ----------
    X, x : ndarray
        Initial and current positions [m], shape (P, dim).
    v : ndarray
        Velocities [m/s], shape (P, dim), at ``t - dt/2`` (leapfrog).
    F : ndarray
        Deformation gradients, shape (P, dim, dim).
    L : ndarray
        Velocity gradients [1/s], shape (P, dim, dim); without rows where the material does not ask
        for them.
    sigma : ndarray
        Cauchy stresses [Pa], shape (P, dim, dim).
    V0, V, m : ndarray
        Initial and current volumes [m^dim] and masses [kg per unit of the missing dimensions],
        shape (P,).
    b : ndarray
        Body force per unit mass [N/kg], shape (P, dim).
    state : ndarray
        History variables of the material, shape (P, n).
    tracers : int
        Number of massless points at the end of all arrays.
    a : ndarray
        Accelerations [m/s^2], shape (P, dim), which implicit methods need for their next step;
        others write them when `State.keep_accelerations` asks for it.
    data : dict of ndarray
        What the transfer, the material and the basis keep besides, shapes (P, ...), by name.
    declared : dict of ParticleData
        What these arrays are.
    """

    X: np.ndarray
    x: np.ndarray
    v: np.ndarray
    F: np.ndarray
    L: np.ndarray
    sigma: np.ndarray
    V0: np.ndarray
    V: np.ndarray
    m: np.ndarray
    b: np.ndarray
    state: np.ndarray
    tracers: int = 0
    a: np.ndarray = field(default_factory=lambda: np.zeros((0, 1)))
    data: dict[str, np.ndarray] = field(default_factory=dict)
    declared: dict[str, ParticleData] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if len(self.a) == 0:
            self.a = np.zeros_like(self.v)

    @classmethod
    def at_rest(
        cls,
        X: np.ndarray,
        V0: np.ndarray,
        density: float,
        tracers: np.ndarray | None = None,
        history: int = 0,
        rate: bool = False,
    ) -> "Particles":
        """Undeformed particles at X, shape (P, dim), with volumes V0, and massless tracers behind them."""
        points = np.vstack([X, tracers]) if tracers is not None and len(tracers) else np.array(X)
        n, dim = points.shape
        extra = n - len(X)
        X_, x, v, F, L, sigma, V0_, V, m, b, state = one_block(
            *((n, dim),) * 3,
            (n, dim, dim),
            (n if rate else 0, dim, dim),
            (n, dim, dim),
            *((n,),) * 3,
            (n, dim),
            (n, history),
        )
        arrays = cls(X_, x, v, F, L, sigma, V0_, V, m, b, state, extra)
        arrays.X[:], arrays.x[:] = points, points
        arrays.F[:] = np.eye(dim)
        arrays.V0[: len(X)], arrays.V[: len(X)] = V0, V0
        arrays.m[:] = density * arrays.V0
        return arrays

    def keep(self, declared: dict[str, ParticleData]) -> None:
        """Allocate further arrays, filled with zeros."""
        self.declared = declared
        n, dim = self.x.shape
        self.data = {name: np.zeros((n, *one.shape(dim))) for name, one in declared.items()}

    @property
    def arrays(self) -> ParticleArrays:
        return ParticleArrays(*_values(self))

    @property
    def dimension(self) -> int:
        return int(self.x.shape[1])

    @cached_property
    def heaviest(self) -> float:
        """The largest mass [kg]; masses do not change."""
        return float(self.m.max(initial=0.0))

    @property
    def material(self) -> slice:
        """The particles that carry mass."""
        return slice(0, len(self.x) - self.tracers)


def one_block(*shapes: tuple[int, ...]) -> list[np.ndarray]:
    """Arrays of zeros that lie in one piece of memory.

    The system backs a large piece with large pages; arrays of a few megabytes each would cost a
    third of the speed.
    """
    sizes = [int(np.prod(shape)) for shape in shapes]
    block = np.zeros(sum(sizes))
    parts = np.split(block, np.cumsum(sizes)[:-1])
    return [part.reshape(shape) for part, shape in zip(parts, shapes, strict=True)]


def per_axis(particles_per_cell: int, dimension: int) -> int:
    """Number of particles along each axis of a cell.

    Raises
    ------
    BadSetting
        When the total is not the power ``dimension`` of a whole number.
    """
    n = round(particles_per_cell ** (1.0 / dimension))
    allowed = {
        1: "a whole number >= 1",
        2: "a square number such as 4, 9, 16",
        3: "a cube number such as 8, 27",
    }
    require(
        n >= 1 and n**dimension == particles_per_cell,
        "particles_per_cell",
        particles_per_cell,
        allowed[dimension],
    )
    return n


def seed_cells(
    box: Box, particles_per_cell: int, layout: str = "midpoint"
) -> tuple[np.ndarray, np.ndarray]:
    """Particles in each cell of a box, cell by cell.

    Parameters
    ----------
    box : Box
    particles_per_cell : int
        Total per cell: 16 is 4 x 4 in 2D.
    layout : {"midpoint", "gauss"}
        Midpoints of equal sub-cells, or Gauss points with their weights as volumes.

    Returns
    -------
    X : ndarray
        Positions [m], shape (P, dim).
    V0 : ndarray
        Volumes [m^dim], shape (P,).
    """
    require_option("particle_layout", layout, ("midpoint", "gauss"))
    n = per_axis(particles_per_cell, box.dimension)
    if layout == "gauss":
        abscissae, weight = np.polynomial.legendre.leggauss(n)
        local, weight = (abscissae + 1.0) / 2.0, weight / 2.0
    else:
        local, weight = (np.arange(n) + 0.5) / n, np.full(n, 1.0 / n)
    dim = box.dimension
    corners = tensor_points([breaks[:-1] for breaks in box.breaks()])
    offsets = tensor_points([local] * dim) * box.spacing
    weights = np.prod(tensor_points([weight] * dim), axis=1) * np.prod(box.spacing)
    X = (corners[:, None, :] + offsets[None, :, :]).reshape(-1, dim)
    return X, np.tile(weights, len(corners))
