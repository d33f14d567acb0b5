"""Surfaces of triangulated bodies: their points and facets, and what lies inside."""

from dataclasses import dataclass

import numpy as np

from mpmbench.core.geometry import Cloud


@dataclass(frozen=True)
class Surface:
    """Points on the surfaces of bodies, and the facets between them.

    Attributes
    ----------
    row : ndarray of int
        Where each point stands among nodes or particles, shape (S,).
    body : ndarray of int
        Whose it is, shape (S,).
    facet : ndarray of int
        Points of each facet, shape (T, dim), so that the normal points outwards: segments with the
        body on their left, triangles counter-clockwise seen from outside.
    area : ndarray
        Share of each point in the surface at the start [m^(dim - 1)], shape (S,).
    on_nodes : bool
        Rows are those of nodes, which move with the body.
    """

    row: np.ndarray
    body: np.ndarray
    facet: np.ndarray
    area: np.ndarray
    on_nodes: bool = True

    @classmethod
    def none(cls) -> "Surface":
        """That of a body of which none is known."""
        empty = np.zeros(0, dtype=np.int64)
        return cls(empty, empty, np.zeros((0, 2), dtype=np.int64), np.zeros(0))

    def distance(self, points: np.ndarray, places: np.ndarray) -> np.ndarray:
        """Distances of points, shape (n, dim), from the nearest facet [m], shape (n,).

        `places` are those of the rows [m].
        """
        corners = places[self.row][self.facet]
        return np.array([facet_distance(point, corners).min() for point in points])


def surface_of(mesh: Cloud) -> Surface:
    """The boundary of a triangulation: faces that belong to one simplex only.

    Rows are node numbers; the body is 0.
    """
    assert mesh.simplices is not None
    simplices, dim = mesh.simplices, mesh.dimension
    faces = np.vstack([np.delete(simplices, k, axis=1) for k in range(dim + 1)])
    opposite = np.concatenate([simplices[:, k] for k in range(dim + 1)])
    _, place, times = np.unique(
        np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True
    )
    place = np.sort(place[times == 1])
    faces, opposite = faces[place], opposite[place]
    normal, _ = facet_normals(mesh.nodes[faces])
    inwards = np.sum(normal * (mesh.nodes[opposite] - mesh.nodes[faces[:, 0]]), axis=1) > 0.0
    faces[inwards] = faces[inwards][:, ::-1]
    row, facet = np.unique(faces, return_inverse=True)
    facet = facet.reshape(faces.shape)
    _, size = facet_normals(mesh.nodes[faces])
    area = np.bincount(facet.ravel(), np.repeat(size / dim, dim), len(row))
    return Surface(row, np.zeros(len(row), dtype=np.int64), facet, area)


def joined(surfaces: list[Surface], first: list[int], on_nodes: bool) -> Surface:
    """The surfaces of all bodies as one; `first` is where the rows of each begin."""
    points = np.cumsum([0, *(len(one.row) for one in surfaces)])
    return Surface(
        np.concatenate([one.row + start for one, start in zip(surfaces, first, strict=True)]),
        np.concatenate([np.full(len(one.row), b) for b, one in enumerate(surfaces)]),
        np.vstack([one.facet + start for one, start in zip(surfaces, points, strict=False)]),
        np.concatenate([one.area for one in surfaces]),
        on_nodes,
    )


def facet_normals(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Unit normals and sizes [m^(dim - 1)] of facets, shape (T, dim, dim): corners are rows."""
    if corners.shape[2] == 2:
        along = corners[:, 1] - corners[:, 0]
        normal = np.stack([along[:, 1], -along[:, 0]], axis=1)
        size = np.linalg.norm(normal, axis=1)
        return normal / size[:, None], size
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    size = np.linalg.norm(normal, axis=1)
    return normal / size[:, None], 0.5 * size


def facet_distance(point: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Distances of a point from facets, shape (T, dim, dim): exact for segments, in space that of their planes.

    In space corners count instead where the foot of the perpendicular is outside the triangle.
    """
    start, edges = corners[:, 0], corners[:, 1:] - corners[:, :1]
    gram = edges @ edges.transpose(0, 2, 1)
    local = np.linalg.solve(gram, (edges @ (point - start)[:, :, None]))[:, :, 0]
    if corners.shape[2] == 2:
        local = np.clip(local, 0.0, 1.0)
    foot = start + np.einsum("tk,tkd->td", local, edges)
    near = np.linalg.norm(point - foot, axis=1)
    outside = (local < 0.0).any(axis=1) | (local.sum(axis=1) > 1.0)
    to_corners = np.linalg.norm(point - corners, axis=2).min(axis=1)
    return np.where(outside, to_corners, near)


def inside_mesh(points: np.ndarray, mesh: Cloud) -> np.ndarray:
    """Whether points, shape (n, dim), lie in one of the simplices, their faces included, shape (n,)."""
    assert mesh.simplices is not None
    corners = mesh.nodes[mesh.simplices]
    inverse = np.linalg.inv((corners[:, 1:] - corners[:, :1]).transpose(0, 2, 1))
    found = np.zeros(len(points), dtype=bool)
    lower, upper = mesh.nodes.min(axis=0), mesh.nodes.max(axis=0)
    for n in np.flatnonzero(((points >= lower) & (points <= upper)).all(axis=1)):
        local = np.einsum("sab,sb->sa", inverse, points[n] - corners[:, 0])
        found[n] = ((local >= 0.0).all(axis=1) & (local.sum(axis=1) <= 1.0)).any()
    return found
