"""Where nodes and particles come from: boxes of equal cells, and clouds of nodes."""

import math
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from mpmbench.core.errors import BadSetting, require

if TYPE_CHECKING:
    from scipy.spatial import cKDTree


@dataclass(frozen=True)
class Box:
    """An axis-aligned box divided into equal cells.

    Parameters
    ----------
    lower, upper : tuple of float
        Corners [m], one entry per dimension.
    cells : tuple of int
        Number of cells along each axis.
    """

    lower: tuple[float, ...]
    upper: tuple[float, ...]
    cells: tuple[int, ...]

    @property
    def dimension(self) -> int:
        return len(self.cells)

    @property
    def spacing(self) -> np.ndarray:
        """Cell sizes [m], shape (dim,)."""
        return (np.array(self.upper) - np.array(self.lower)) / np.array(self.cells)

    def breaks(self) -> list[np.ndarray]:
        """Cell boundaries along each axis [m]."""
        return [
            np.linspace(a, b, n + 1)
            for a, b, n in zip(self.lower, self.upper, self.cells, strict=True)
        ]

    @cached_property
    def points(self) -> np.ndarray:
        """Nodes, which are the cell corners: positions [m], shape (N, dim), last axis fastest."""
        points = tensor_points(self.breaks())
        points.setflags(write=False)
        return points

    def nodes(self) -> np.ndarray:
        """A copy of `points`: the name that plug-ins of version 0.1 use."""
        return self.points.copy()

    @property
    def nodal_spacing(self) -> float:
        """Largest cell size [m]."""
        return float(self.spacing.max())


@dataclass(frozen=True)
class Cloud:
    """Nodes anywhere, with the simplices of a triangulation where there is one.

    Parameters
    ----------
    nodes : ndarray
        Positions [m], shape (N, dim).
    simplices : ndarray of int or None
        Node numbers of each simplex, shape (S, dim + 1).
    spacing : float or None
        Typical distance between neighbours [m], where the maker of the cloud knows it.
    cells : tuple of int or None
        The nodes are the corners of a bent grid of so many cells, the last axis fastest.
    graded : ndarray or None
        Distances between neighbours along each axis around each node [m], shape (N, dim), where they
        vary; the spacing is the smallest then.
    """

    nodes: np.ndarray
    simplices: np.ndarray | None = None
    spacing: float | None = None
    cells: tuple[int, ...] | None = None
    graded: np.ndarray | None = None

    @property
    def dimension(self) -> int:
        return int(self.nodes.shape[1])

    @property
    def points(self) -> np.ndarray:
        """Positions of the nodes [m], shape (N, dim), as those of a `Box`."""
        return self.nodes

    @cached_property
    def nodal_spacing(self) -> float:
        """Typical distance between neighbouring nodes [m].

        What the maker of the cloud says, else the edge of N^(1/dim) - 1 cells along each axis of a
        cube with the volume of the cloud (of its simplices, else of its hull), which is the mean
        spacing on a line.

        Raises
        ------
        BadSetting
            When the nodes have no volume.
        """
        if self.spacing is not None:
            return self.spacing
        if self.simplices is not None:
            volume = float(simplex_volumes(self.nodes, self.simplices).sum())
        else:
            volume = hull_volume(self.nodes)
        if not volume > 0.0:
            raise BadSetting("nodes", len(self.nodes), "a cloud of nodes with a volume")
        along = len(self.nodes) ** (1.0 / self.dimension)
        return volume ** (1.0 / self.dimension) / (along - 1.0)


Geometry = Box | Cloud


def divided(length: float, height: float, resolution: int) -> Box:
    """A rectangle from the origin, `length` by `height` [m], with `resolution` square cells along it.

    Raises
    ------
    BadSetting
        When no whole number of such cells fills its height.
    """
    ratio = Fraction(height / length).limit_denominator(1000)
    fits = ratio > 0 and abs(float(ratio) * length - height) <= 1e-9 * height
    allowed = f"a multiple of {ratio.denominator} (whole cells over a height of {height:g} m)"
    if not fits:
        allowed = (
            f"a height that is a simple fraction of the length, not {height:g} of {length:g} m,"
        )
    require(fits and resolution % ratio.denominator == 0, "resolution", resolution, allowed)
    return Box((0.0, 0.0), (length, height), (resolution, int(ratio * resolution)))


def tensor_points(axes: list[np.ndarray]) -> np.ndarray:
    """All combinations of the coordinates along each axis, shape (N, dim), last axis fastest."""
    return np.stack([part.ravel() for part in np.meshgrid(*axes, indexing="ij")], axis=1)


def simplex_volumes(nodes: np.ndarray, simplices: np.ndarray) -> np.ndarray:
    """Volumes of simplices [m^dim], shape (S,)."""
    corners = nodes[simplices]
    return np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])) / math.factorial(nodes.shape[1])


def search_tree(points: np.ndarray) -> "cKDTree":
    """A tree to search points [m] in, shape (N, dim)."""
    from scipy.spatial import cKDTree  # takes longer to import than all else here

    return cKDTree(points)


def hull_volume(nodes: np.ndarray) -> float:
    """Volume of the convex hull of nodes [m^dim]: 0 where they lie on a line or plane."""
    from scipy.spatial import ConvexHull, QhullError

    if nodes.shape[1] == 1:
        return float(np.ptp(nodes))
    try:
        return float(ConvexHull(nodes).volume)
    except QhullError:
        return 0.0
