"""Voronoi cells of points in a convex body: all that is nearer to a point than to the others, and in the body.

Each cell is the body's outline, cut by the bisectors between its point and its neighbours, the nearest
first, until the next one is farther away than twice the farthest corner.
"""

from typing import NamedTuple

import numpy as np

from mpmbench.core.compiled import compiled
from mpmbench.core.geometry import search_tree

NEIGHBOURS = 16  # that are looked up at first; twice as many where they do not close every cell


class Cells(NamedTuple):
    """Cells of n points.

    Attributes
    ----------
    corners : ndarray
        Counter-clockwise [m], shape (n, K, 2), the last one repeated; ends of the segments on a line,
        shape (n, 2, 1).
    areas : ndarray
        Outward vectors [m^(dim - 1)], shape (n, K, dim): ``sum_k f(corner_k) area_k`` is the integral
        of ``f n`` over the faces by the trapezoidal rule, which is exact for linear f.
    volumes : ndarray
        [m^dim], shape (n,).
    """

    corners: np.ndarray
    areas: np.ndarray
    volumes: np.ndarray


def outline(nodes: np.ndarray) -> np.ndarray:
    """Corners of the convex hull of nodes, counter-clockwise, shape (K, 2), or the ends of a line, shape (2, 1)."""
    if nodes.shape[1] == 1:
        return np.array([nodes.min(axis=0), nodes.max(axis=0)])
    from scipy.spatial import ConvexHull  # slow to import

    return np.ascontiguousarray(nodes[ConvexHull(nodes).vertices])


def voronoi_cells(points: np.ndarray, body: np.ndarray) -> Cells:
    """Cells of points [m], shape (n, dim), in a convex body given by its `outline`, on lines and in planes."""
    if points.shape[1] == 1:
        corners = _segments(points[:, 0], body[:, 0])
        areas = np.tile([[-1.0], [1.0]], (len(points), 1, 1))
    else:
        corners = _polygons(points, body)
        along = np.roll(corners, -1, axis=1) - np.roll(corners, 1, axis=1)
        areas = 0.5 * np.stack([along[:, :, 1], -along[:, :, 0]], axis=2)
    volumes = (
        np.einsum("nkd,nkd->n", corners, areas) / points.shape[1]
    )  # the divergence of x is dim
    return Cells(corners, areas, volumes)


def _segments(x: np.ndarray, ends: np.ndarray) -> np.ndarray:
    order = np.argsort(x)
    faces = np.concatenate([ends[:1], 0.5 * (x[order][1:] + x[order][:-1]), ends[1:]])
    corners = np.empty((len(x), 2, 1))
    corners[order, 0, 0], corners[order, 1, 0] = faces[:-1], faces[1:]
    return corners


def _polygons(points: np.ndarray, body: np.ndarray) -> np.ndarray:
    count, tree = min(NEIGHBOURS, len(points)), search_tree(points)
    while True:
        near = tree.query(points, k=count)[1].reshape(len(points), -1)
        corners = np.empty((len(points), len(body) + count, 2))
        if cut(points, near, body, corners) or count == len(points):
            return corners
        count = min(2 * count, len(points))


@compiled
def cut(points, near, body, corners):
    """Write the corners of each cell, the last one repeated; whether all of them are closed by these neighbours."""
    closed = True
    new = np.empty(corners.shape[1:])
    for p in range(points.shape[0]):
        cell, n = corners[p], body.shape[0]
        cell[:n] = body
        last = True  # the outline alone may be the cell
        for k in range(1, near.shape[1]):
            reach = 0.0
            for c in range(n):
                reach = max(
                    reach, (cell[c, 0] - points[p, 0]) ** 2 + (cell[c, 1] - points[p, 1]) ** 2
                )
            away = points[near[p, k]] - points[p]
            last = away[0] ** 2 + away[1] ** 2 < 4.0 * reach
            if not last:
                break
            n = halve(cell, n, points[p] + 0.5 * away, away, new)
        closed = closed and not last
        cell[n:] = cell[n - 1]
    return closed


@compiled
def halve(cell, n, middle, away, new):
    """Keep the part of a polygon of n corners with ``(x - middle) . away <= 0``; returns its number of corners."""
    kept = 0
    for c in range(n):
        a, b = cell[c], cell[(c + 1) % n]
        beyond_a = (a[0] - middle[0]) * away[0] + (a[1] - middle[1]) * away[1]
        beyond_b = (b[0] - middle[0]) * away[0] + (b[1] - middle[1]) * away[1]
        if beyond_a <= 0.0:
            new[kept] = a
            kept += 1
        if (beyond_a < 0.0 < beyond_b) or (beyond_b < 0.0 < beyond_a):
            new[kept] = a + (b - a) * (beyond_a / (beyond_a - beyond_b))
            kept += 1
    cell[:kept] = new[:kept]
    return kept
