"""Particles in space as a picture that a person reads: seen from a side, far ones first, cut open by leaving some out.

Small functions on arrays of positions and values, for any page or animation: `mirrored` completes
a part between planes of symmetry, a mask cuts, and `draw` paints.
"""

from collections.abc import Iterable
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import EllipseCollection, PathCollection
from matplotlib.colors import Colormap

FARTHEST = 0.6  # brightness of the particle that is farthest away; the nearest has 1
OVERLAP = 1.25  # diameter of a dot over the edge of a cube with the particle's volume


def mirrored(x: np.ndarray, axes: Iterable[int], *fields: np.ndarray) -> tuple[np.ndarray, ...]:
    """Positions, shape (n, 3), and fields with their mirror images across the planes ``x_axis = 0``."""
    for axis in axes:
        image = x.copy()
        image[:, axis] *= -1.0
        x, fields = np.concatenate([x, image]), tuple(np.concatenate([f, f]) for f in fields)
    return x, *fields


def seen_from(x: np.ndarray, up: int, azimuth: float, elevation: float) -> np.ndarray:
    """Coordinates to the right, upwards, and towards the eye, shape (n, 3), without perspective.

    Parameters
    ----------
    x : ndarray
        Positions, shape (n, 3).
    up : int
        Axis that points upwards in the picture.
    azimuth, elevation : float
        Of the eye [degrees]: in the plane of the two other axes, from the first of them to the second;
        and above it.
    """
    first, second = x[:, (up + 1) % 3], x[:, (up + 2) % 3]
    turn, rise = np.radians([azimuth, elevation])
    right = -np.sin(turn) * first + np.cos(turn) * second
    near = np.cos(turn) * first + np.sin(turn) * second
    top = np.cos(rise) * x[:, up] - np.sin(rise) * near
    return np.column_stack([right, top, np.cos(rise) * near + np.sin(rise) * x[:, up]])


def draw(
    axes: Axes,
    x: np.ndarray,
    values: np.ndarray,
    size: np.ndarray,
    cmap: Colormap,
    limits: tuple[float, float],
    up: int = 0,
    azimuth: float = 45.0,
    elevation: float = 20.0,
) -> Any:
    """Paint particles as round dots in the colour of their value, darker the farther they are.

    Parameters
    ----------
    x, values, size : ndarray
        Positions, shape (n, 3), values and edges of cubes with the particles' volumes, shape (n,).
    limits : tuple of float
        Values at the ends of the colour map.

    Returns
    -------
    EllipseCollection
        With the norm and colour map that a colour bar needs.
    """
    place = seen_from(x, up, azimuth, elevation)
    order = np.argsort(place[:, 2], kind="stable")
    place, values, size = place[order], values[order], OVERLAP * size[order]
    span = max(float(np.ptp(place[:, 2])), 1e-300)
    bright = FARTHEST + (1.0 - FARTHEST) * (place[:, 2] - place[0, 2]) / span
    share = np.clip((values - limits[0]) / max(limits[1] - limits[0], 1e-300), 0.0, 1.0)
    colours = cmap(share)
    colours[:, :3] *= bright[:, None]
    dots = EllipseCollection(
        size,
        size,
        np.zeros(len(size)),
        units="xy",
        offsets=place[:, :2],
        offset_transform=axes.transData,
        facecolors=colours,
        edgecolors=colours * (0.75, 0.75, 0.75, 1.0),
        linewidths=0.15,
        rasterized=True,
    )
    dots.set(cmap=cmap, clim=limits)
    axes.add_collection(dots)
    margin = 0.5 * size.max()
    low, high = place[:, :2].min(axis=0) - margin, place[:, :2].max(axis=0) + margin
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
    axes.set_axis_off()
    return dots


def draw_meridian(
    axes: Axes, x: np.ndarray, values: np.ndarray, limits: tuple[float, float]
) -> PathCollection:
    """Paint particles by their distance from the first axis and their height, to both sides, the largest on top.

    Parameters
    ----------
    x, values : ndarray
        Positions, shape (n, 3), and values, shape (n,).
    limits : tuple of float
        Values at the ends of the colour map.
    """
    order = np.argsort(values)
    radius, height = np.hypot(x[order, 1], x[order, 2]), x[order, 0]
    dots = axes.scatter(
        np.concatenate([-radius, radius]), np.tile(height, 2), c=np.tile(values[order], 2), s=1.5, lw=0.0,
        cmap="viridis", vmin=limits[0], vmax=limits[1], rasterized=True,
    )  # fmt: skip
    axes.set_aspect("equal")
    return dots
