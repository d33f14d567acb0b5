"""Where nodes and particles come from: boxes of equal cells, and clouds of nodes with or without simplices."""

from dataclasses import dataclass

import numpy as np


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

    def nodes(self) -> np.ndarray:
        """Cell corners [m], shape (N, dim), last axis fastest."""
        return tensor_points(self.breaks())


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
    """

    nodes: np.ndarray
    simplices: np.ndarray | None = None
    spacing: float | None = None

    @property
    def dimension(self) -> int:
        return int(self.nodes.shape[1])


Geometry = Box | Cloud


def tensor_points(axes: list[np.ndarray]) -> np.ndarray:
    """All combinations of the coordinates along each axis, shape (N, dim), last axis fastest."""
    return np.stack([part.ravel() for part in np.meshgrid(*axes, indexing="ij")], axis=1)
