"""Rings about the origin: particles on circles or on a lattice, and triangulated nodes."""

import itertools
import math

import numpy as np

from mpmbench.core.errors import require_option
from mpmbench.core.geometry import Box, Cloud

SEEDINGS = ("polar", "cartesian")


def seed_ring(
    inner: float, outer: float, cells: int, per_axis: int, seeding: str
) -> tuple[np.ndarray, np.ndarray]:
    """Particles of a ring: on concentric circles, or those of a lattice whose middles are in the ring.

    Those in one of the square cells that are as wide as `ring_grid` has them follow each other, since
    kernels add them to the nodes of their cell together.

    Parameters
    ----------
    inner, outer : float
        Radii [m].
    cells, per_axis : int
        Cells across the ring, and circles in each; a lattice has the same spacing.
    seeding : {"polar", "cartesian"}
        The volumes of circles are parts of that of the ring and add up to it exactly. The rim of a
        lattice is a stair-case.

    Returns
    -------
    X : ndarray
        Positions [m], shape (P, 2).
    V0 : ndarray
        Volumes [m^2], shape (P,).
    """
    require_option("seeding", seeding, SEEDINGS)
    circles = cells * per_axis
    spacing = (outer - inner) / circles
    if seeding == "cartesian":
        along = math.ceil(outer / spacing)
        places = (np.arange(-along, along) + 0.5) * spacing
        X = np.stack([part.ravel() for part in np.meshgrid(places, places, indexing="ij")], axis=1)
        radius = np.hypot(*X.T)
        X = X[(radius > inner) & (radius < outer)]
        return X[by_cells(X, per_axis * spacing)], np.full(len(X), spacing**2)
    edges = np.linspace(inner, outer, circles + 1)
    parts, volumes = [], []
    for r1, r2 in itertools.pairwise(edges):
        count = max(1, round(math.pi * (r1 + r2) / spacing))
        angle = 2.0 * math.pi * (np.arange(count) + 0.5) / count
        parts.append(0.5 * (r1 + r2) * np.stack([np.cos(angle), np.sin(angle)], axis=1))
        volumes.append(np.full(count, math.pi * (r2**2 - r1**2) / count))
    X, V0 = np.concatenate(parts), np.concatenate(volumes)
    order = by_cells(X, per_axis * spacing)
    return X[order], V0[order]


def by_cells(X: np.ndarray, width: float) -> np.ndarray:
    """Order of points in the plane, shape (P, 2), by square cells around the origin, row by row; shape (P,)."""
    column, row = np.floor(X / width).T
    return np.lexsort((row, column))


def ring_grid(half: float, outer: float, inner: float, cells: int) -> Box:
    """Square grid from -half to half [m] whose cells have the size of those across the ring."""
    along = round(2.0 * half * cells / (outer - inner))
    return Box((-half, -half), (half, half), (along, along))


def ring_cloud(inner: float, outer: float, cells: int) -> Cloud:
    """Nodes on ``cells + 1`` circles, as many on each, and the triangles between them."""
    spacing = (outer - inner) / cells
    count = 2 * round(math.pi * (inner + outer) / (2.0 * spacing))
    radii = np.linspace(inner, outer, cells + 1)
    angle = 2.0 * math.pi * np.arange(count) / count
    nodes = (radii[:, None, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)).reshape(-1, 2)
    ring, sector = np.meshgrid(np.arange(cells), np.arange(count), indexing="ij")
    a, b = ring * count + sector, ring * count + (sector + 1) % count
    c, d = a + count, b + count
    flip = ((ring + sector) % 2 == 1)[..., None]  # as on a chessboard: no direction is preferred
    quads = np.where(
        flip, np.stack([a, c, d, a, d, b], axis=-1), np.stack([a, c, b, c, d, b], axis=-1)
    )
    return Cloud(nodes, quads.reshape(-1, 3), spacing)
