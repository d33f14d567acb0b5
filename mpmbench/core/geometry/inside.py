"""Which points lie within a closed surface, convex or not: by parity of the facets that a ray meets."""

import numpy as np

from mpmbench.core.compiled import compiled


def inside_surface(points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Whether points, shape (n, dim), lie within closed surfaces, in 2D or 3D; shape (n,).

    Their facets, shape (T, dim, dim), may be in any order and run either way. A ray along the first
    axis meets a facet at the lower ends of its projection but not at the upper ones, so that one
    through an edge or a corner counts once; on which side a point of the surface itself is, rounding
    decides.
    """
    found = np.zeros(len(points), dtype=np.bool_)
    if len(points) and len(corners):
        axes = (0.0,) * points.shape[1]
        lower, upper = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
        _mark_inside(axes, points, corners, lower, upper, found)
    return found


@compiled
def _mark_inside(axes, points, corners, lower, upper, found):
    for n in range(points.shape[0]):
        near = True
        for d in range(len(axes)):
            near = near and lower[d] <= points[n, d] <= upper[d]
        if not near:
            continue
        for f in range(corners.shape[0]):
            if len(axes) == 2:
                meets = _ahead(corners[f, 0], corners[f, 1], points[n], 1, 0)
            else:
                meets = _pierces(corners[f], points[n])
            found[n] ^= meets


@compiled
def _ahead(a, b, x, up, along):
    """Whether a segment projected on two axes is met by the ray from x along one, at its place on the other.

    From its lower end, so that both facets at an edge find the same.
    """
    if (a[up] > x[up]) == (b[up] > x[up]):
        return False
    low, high = (a, b) if a[up] < b[up] else (b, a)
    rise = (high[along] - low[along]) / (high[up] - low[up])
    return x[along] < low[along] + rise * (x[up] - low[up])


@compiled
def _pierces(corner, x):
    """Whether the ray from x along the first axis meets a triangle, which its foot on the other axes lies in."""
    within = False
    for k in range(3):
        within ^= _ahead(corner[k], corner[(k + 1) % 3], x, 2, 1)
    if not within:
        return False
    a, b, c = corner[0], corner[1], corner[2]
    u1, u2, w1, w2 = b[1] - a[1], b[2] - a[2], c[1] - a[1], c[2] - a[2]
    area = u1 * w2 - u2 * w1
    if area == 0.0:  # rounding has found a foot in a triangle along the ray
        return x[0] < (a[0] + b[0] + c[0]) / 3.0
    r1, r2 = x[1] - a[1], x[2] - a[2]
    first, second = (r1 * w2 - r2 * w1) / area, (u1 * r2 - u2 * r1) / area
    return x[0] < a[0] + first * (b[0] - a[0]) + second * (c[0] - a[0])
