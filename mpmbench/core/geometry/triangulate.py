"""Triangulated sets of nodes: jittered lines and strips, cylinders, and particles in them."""

import math

import numpy as np

from mpmbench.core.errors import BadSetting
from mpmbench.core.geometry import Cloud, hull_volume, simplex_volumes

# nodes on circles of radius 0, h, 2 h, 3 h and 4 h: 57 nodes and 98 triangles
RINGS = (1, 8, 16, 18, 14)


def barycentres(cloud: Cloud) -> tuple[np.ndarray, np.ndarray]:
    """One particle per simplex: positions [m], shape (S, dim), and volumes [m^dim], shape (S,)."""
    assert cloud.simplices is not None
    return cloud.nodes[cloud.simplices].mean(axis=1), simplex_volumes(cloud.nodes, cloud.simplices)


# Barycentric coordinates of the Gauss points of a triangle.
RULES = {1: np.full((1, 3), 1.0 / 3.0), 3: np.full((3, 3), 1.0 / 6.0) + 0.5 * np.eye(3)}


def in_columns(X: np.ndarray, V0: np.ndarray, width: float) -> tuple[np.ndarray, np.ndarray]:
    """Points and their volumes in columns along the first axis, so wide [m], and in these from below.

    Points in one cell of a grid then follow each other, however far all have moved along that axis:
    their sums are taken together.
    """
    order = np.lexsort([X[:, 0], *np.floor(X[:, :0:-1] / width).T])
    return X[order], V0[order]


def check_points(points: int) -> None:
    """Raise `BadSetting` unless there is a rule with that many points of a triangle."""
    if points not in RULES:
        raise BadSetting("particles_per_cell", points, "1 or 3 (points per triangle)")


def seed_triangles(
    nodes: np.ndarray, triangles: np.ndarray, points: int
) -> tuple[np.ndarray, np.ndarray]:
    """One or three Gauss points per triangle: positions [m], shape (T points, 2), volumes [m^2].

    Raises
    ------
    BadSetting
        For another number of points.
    """
    check_points(points)
    X = np.einsum("gk,tkd->tgd", RULES[points], nodes[triangles]).reshape(-1, 2)
    return X, np.repeat(simplex_volumes(nodes, triangles) / points, points)


def ring_mesh(radius: float, rings: int, sectors: int = 6) -> tuple[np.ndarray, np.ndarray]:
    """Nodes on rings around the origin, `sectors` k on the k-th, and the triangles between them.

    Returns
    -------
    nodes : ndarray
        Positions [m], shape (1 + sectors rings (rings + 1) / 2, 2).
    triangles : ndarray of int
        Shape (sectors rings^2, 3).
    """
    nodes, triangles = [np.zeros((1, 2))], []
    first = [0]
    for k in range(1, rings + 1):
        angle = 2.0 * math.pi * np.arange(sectors * k) / (sectors * k)
        first.append(first[-1] + (1 if k == 1 else sectors * (k - 1)))
        nodes.append(radius * k / rings * np.stack([np.cos(angle), np.sin(angle)], axis=1))
        inner, outer = max(sectors * (k - 1), 1), sectors * k
        for sector in range(sectors):
            for i in range(k):
                a = first[k] + (sector * k + i) % outer
                b = first[k] + (sector * k + i + 1) % outer
                c = first[k - 1] + (sector * (k - 1) + i) % inner
                triangles.append((a, b, c))
                if i < k - 1:
                    d = first[k - 1] + (sector * (k - 1) + i + 1) % inner
                    triangles.append((c, b, d))
    return np.vstack(nodes), np.array(triangles, dtype=np.int64)


def first_quadrant(nodes: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The part of a triangulation of the plane in x, y >= 0, whose axes it must not cross."""
    kept = triangles[(nodes[triangles].mean(axis=1) > 0.0).all(axis=1)]
    used, number = np.unique(kept, return_inverse=True)
    corners = nodes[used]
    return np.where(np.abs(corners) < 1e-12 * np.abs(nodes).max(), 0.0, corners), number.reshape(
        -1, 3
    )


def triangulation(nodes: np.ndarray, volume: float | None) -> np.ndarray:
    """Delaunay simplices of nodes that fill a convex body of known volume [m^dim], or their hull.

    Nodes on a face of a regular set make slivers without volume: they are dropped, and the others
    must add up.

    Raises
    ------
    BadSetting
        When the simplices do not fill the body.
    """
    from scipy.spatial import Delaunay  # slow to import

    if nodes.shape[1] == 1:
        order = np.argsort(nodes[:, 0])
        simplices: np.ndarray = np.stack([order[:-1], order[1:]], axis=1)
    else:
        simplices = Delaunay(nodes).simplices
    size = simplex_volumes(nodes, simplices)
    simplices = simplices[size > 1e-9 * size.mean()]
    filled = simplex_volumes(nodes, simplices).sum()
    if volume is None:
        volume = hull_volume(nodes)
    if not abs(filled - volume) <= 1e-9 * volume:
        raise BadSetting(
            "nodes", len(nodes), f"a set whose simplices fill {volume:.6g} m^{nodes.shape[1]}"
        )
    return np.asarray(simplices, dtype=np.int64)


def jittered(
    nodes: np.ndarray, spacing: float, share: float, held: np.ndarray, seed: int
) -> np.ndarray:
    """Nodes displaced by up to `share` of the spacing [m] along each axis, unless `held`."""
    shift = np.random.default_rng(seed).uniform(-share * spacing, share * spacing, nodes.shape)
    return nodes + np.where(held, 0.0, shift)


def extruded(section: Cloud, levels: np.ndarray) -> Cloud:
    """Prisms over a triangulated cross-section, each split into three tetrahedra that fit together.

    The section is in the plane of x_2 and x_3; `levels` are x_1 of layers of nodes [m], ascending.
    """
    assert section.simplices is not None
    count = len(section.nodes)
    nodes = np.concatenate([np.column_stack([np.full(count, x), section.nodes]) for x in levels])
    # by number: a shared face is cut along the same diagonal
    prism = np.sort(section.simplices, axis=1)
    prism = np.concatenate([prism, prism + count], axis=1)
    prism = np.concatenate([prism[:, [0, 1, 2, 5]], prism[:, [0, 1, 4, 5]], prism[:, [0, 3, 4, 5]]])
    simplices = np.concatenate([prism + count * layer for layer in range(len(levels) - 1)])
    graded = None
    if section.graded is not None:
        along = np.repeat(local_steps(levels), count)
        graded = np.column_stack([along, np.tile(section.graded, (len(levels), 1))])
    return Cloud(nodes, simplices, section.spacing, graded=graded)


def local_steps(levels: np.ndarray) -> np.ndarray:
    """The shorter of both distances to the neighbours of each of ascending numbers, shape (n,).

    With the longer one, supports where spacings grow would reach far into where they are small.
    """
    steps = np.diff(levels)
    return np.minimum(np.append(steps, np.inf), np.insert(steps, 0, np.inf))


def graded_levels(end: float, even: float, step: float, growth: float) -> np.ndarray:
    """Ascending numbers from 0 to `end`: equal steps of at most `step` at least up to `even`, then growing ones.

    Steps grow by a factor of at most `growth`, which is what makes the last number the end.
    """
    if even >= end - step or growth == 1.0:
        return np.linspace(0.0, end, math.ceil(end / step - 1e-9) + 1)
    equal = np.arange(math.ceil(even / step - 1e-9) + 1) * step
    rest, count = end - equal[-1], 1
    while step * sum(growth**k for k in range(1, count + 1)) < rest:
        count += 1
    low, high = 1.0, growth
    for _ in range(100):
        middle = 0.5 * (low + high)
        short = step * sum(middle**k for k in range(1, count + 1)) < rest
        low, high = (middle, high) if short else (low, middle)
    further = equal[-1] + step * np.cumsum(high ** np.arange(1, count + 1))
    return np.concatenate([equal, further[:-1], [end]])


def graded_disc(radii: np.ndarray, fewest: int) -> Cloud:
    """A quarter of a disc, x, y >= 0, on circles with the given radii, ascending from 0 [m].

    The k-th circle has 2 k parts as long as steps are equal, which makes these about as long as they
    are wide; outside it has fewer, but at least `fewest`, so that they stay so.
    """
    shape = 0.5 * math.pi / 2.0  # of a part with as many as 2 k
    nodes, sizes = [np.zeros((1, 2))], [radii[1]]
    for k, radius in enumerate(radii[1:].tolist(), start=1):
        step = radius - float(radii[k - 1])
        parts = min(2 * k, max(fewest, round(0.5 * math.pi * radius / (shape * step))))
        angle = 0.5 * math.pi * np.arange(parts + 1) / parts
        circle = radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        circle[0, 1] = circle[-1, 0] = 0.0
        nodes.append(circle)
        sizes += [max(float(local_steps(radii)[k]), 0.5 * math.pi * radius / parts)] * (parts + 1)
    places = np.vstack(nodes)
    graded = np.repeat(np.array(sizes)[:, None], 2, axis=1)
    return Cloud(places, triangulation(places, None), float(radii[1]), graded=graded)


def quarter_ball(radius: float, cells: int) -> Cloud:
    """The quarter x_2, x_3 >= 0 of a ball around the origin, with as many cells along its radius.

    Shells of a cylinder, each as high as it is wide, become shells of the ball. Its faces are flat:
    it is a little larger than the ball, so that both have the same volume.
    """
    section = Cloud(*first_quadrant(*ring_mesh(radius, cells, 8)), spacing=radius / cells)
    upper = extruded(section, np.linspace(0.0, radius, cells + 1))
    across = np.hypot(upper.nodes[:, 1], upper.nodes[:, 2])
    length = np.hypot(across, upper.nodes[:, 0])
    shell = np.maximum(across, upper.nodes[:, 0])
    share = np.divide(shell, length, out=np.zeros_like(shell), where=length > 0.0)
    nodes = upper.nodes * share[:, None]
    assert upper.simplices is not None
    equator = len(section.nodes)  # these nodes are those of both halves
    lower = np.where(upper.simplices < equator, upper.simplices, upper.simplices + len(nodes))
    both = np.concatenate([nodes, nodes * np.array([-1.0, 1.0, 1.0])])
    used, number = np.unique(np.concatenate([upper.simplices, lower]), return_inverse=True)
    simplices, places = number.reshape(-1, 4), both[used]
    flat = simplex_volumes(places, simplices).sum() / (math.pi / 3.0 * radius**3)
    return Cloud(places / flat ** (1.0 / 3.0), simplices, radius / cells)


def all_quarters(quarter: Cloud) -> Cloud:
    """A body around the first axis from its quarter in x_2, x_3 >= 0, which is mirrored twice."""
    nodes, simplices, graded = quarter.nodes, quarter.simplices, quarter.graded
    assert simplices is not None
    for axis in (1, 2):
        inside = np.flatnonzero(nodes[:, axis] > 0.0)
        number = np.arange(len(nodes))
        number[inside] = len(nodes) + np.arange(len(inside))
        mirrored = nodes[inside].copy()
        mirrored[:, axis] *= -1.0
        nodes = np.concatenate([nodes, mirrored])
        simplices = np.concatenate([simplices, number[simplices]])
        if graded is not None:
            graded = np.concatenate([graded, graded[inside]])
    return Cloud(nodes, simplices, quarter.spacing, graded=graded)


def disc(radius: float) -> Cloud:
    """57 nodes on concentric circles, 98 triangles; the spacing is a quarter of the radius [m]."""
    spacing = radius / (len(RINGS) - 1)
    points = []
    for ring, count in enumerate(RINGS):
        angle = 2.0 * np.pi * (np.arange(count) + 0.5 * (ring % 2)) / count
        points.append(ring * spacing * np.column_stack([np.cos(angle), np.sin(angle)]))
    nodes = np.concatenate(points)
    return Cloud(nodes, triangulation(nodes, None), spacing)


def nodal_volumes(cloud: Cloud) -> np.ndarray:
    """Volume [m^dim] of each node, shape (N,): equal shares of the simplices around it."""
    assert cloud.simplices is not None
    share = simplex_volumes(cloud.nodes, cloud.simplices) / cloud.simplices.shape[1]
    return np.bincount(
        cloud.simplices.ravel(), np.repeat(share, cloud.simplices.shape[1]), len(cloud.nodes)
    )


def irregular_line(length: float, cells: int, irregularity: float, seed: int) -> Cloud:
    """Nodes on a line, all but the ends displaced by up to so many spacings, with segments."""
    spacing = length / cells
    nodes = np.linspace(0.0, length, cells + 1)[:, None]
    ends = np.zeros(nodes.shape, dtype=bool)
    ends[[0, -1]] = True
    if irregularity > 0.0:
        nodes = jittered(nodes, spacing, irregularity, ends, seed)
    return Cloud(nodes, triangulation(nodes, length), spacing)


def seed_segments(cloud: Cloud, particles_per_cell: int) -> tuple[np.ndarray, np.ndarray]:
    """Midpoints of equal parts of the segments of a line: positions (P, 1), volumes (P,) [m]."""
    nodes = np.sort(cloud.nodes[:, 0])
    edges = np.diff(nodes)
    local = (np.arange(particles_per_cell) + 0.5) / particles_per_cell
    X = (nodes[:-1, None] + edges[:, None] * local).reshape(-1, 1)
    return X, np.repeat(edges / particles_per_cell, particles_per_cell)


def unit_square(cells: int, crossed: bool) -> tuple[np.ndarray, np.ndarray]:
    """Nodes of the unit square, shape (N, 2), and its triangles: two to a cell, or four around its middle."""
    side = np.arange(cells + 1) / cells
    nodes = np.stack([part.ravel() for part in np.meshgrid(side, side, indexing="ij")], axis=1)
    numbers = np.arange(len(nodes)).reshape(cells + 1, cells + 1)
    a, b = numbers[:-1, :-1].ravel(), numbers[1:, :-1].ravel()
    c, d = numbers[1:, 1:].ravel(), numbers[:-1, 1:].ravel()
    if crossed:
        middle = len(nodes) + np.arange(cells * cells)
        centres = 0.25 * (nodes[a] + nodes[b] + nodes[c] + nodes[d])
        pairs = ((a, b), (b, c), (c, d), (d, a))
        triangles = [np.stack([*pair, middle], axis=1) for pair in pairs]
        return np.vstack([nodes, centres]), np.vstack(triangles)
    return nodes, np.vstack([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


def annulus(inner: float, outer: float, rings: int) -> tuple[np.ndarray, np.ndarray]:
    """Nodes on circles from one radius to another [m], shape (N, 2), and two triangles to a cell between them.

    Cells are about as long along the middle circle as they are wide.
    """
    around = round(math.pi * (inner + outer) / (outer - inner) * rings)
    angle = 2.0 * math.pi * np.arange(around) / around
    radius = np.linspace(inner, outer, rings + 1)
    nodes = np.stack(
        [np.outer(radius, np.cos(angle)).ravel(), np.outer(radius, np.sin(angle)).ravel()], axis=1
    )
    numbers = np.arange(len(nodes)).reshape(rings + 1, around)
    a, b = numbers[:-1], numbers[1:]
    c, d = np.roll(b, -1, axis=1), np.roll(a, -1, axis=1)
    halves = (np.stack([a, b, c], axis=2), np.stack([a, c, d], axis=2))
    return nodes, np.vstack([half.reshape(-1, 3) for half in halves])
