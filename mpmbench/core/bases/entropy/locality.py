"""Which nodes count at a point, and by which distance.

Either those whose supports cover the point, by plain distance; or, where locality follows the
deformation, every point measures in a metric of its own (Li 2009, section 2.2.3). With ``xi_i =
S^-1 (x_i - x)`` its functions are those of the undeformed configuration: nodes count when ``|xi_i|
< R`` and weigh ``exp(-gamma |xi_i|^2 / h^2)``. S is the point's deformation gradient (`convected`)
or the isotropic part of it (`volume`). Gradients take S as constant near the point.
"""

import math
from typing import NamedTuple

import numpy as np

from mpmbench.core.bases.clouds.search import Buckets, cell_along, cell_of
from mpmbench.core.bases.entropy.priors import Formulation
from mpmbench.core.compiled import compiled, inlined, lean, matrix, vector
from mpmbench.core.compiled.algebra import determinant, inverse
from mpmbench.core.compiled.exponentials import whole_lanes


class Metric(NamedTuple):
    """What search and functions need of n points; of none where distances are plain."""

    pull: np.ndarray  # S^-1, shape (n, dim, dim)
    half: np.ndarray  # half the extent of ``|xi| < 1`` along each axis, shape (n, dim)
    growth: np.ndarray  # factor by which a point's search radius has been enlarged, shape (n,)

    @classmethod
    def identity(cls, points: int, dimension: int) -> "Metric":
        """Plain distance."""
        return cls(
            np.tile(np.eye(dimension), (points, 1, 1)),
            np.ones((points, dimension)),
            np.ones(points),
        )


class NodeCloud(NamedTuple):
    """Nodes, the functions that they have, and their supports."""

    form: Formulation
    nodes: np.ndarray  # positions [m], shape (N, dim)
    square: np.ndarray  # d_i^2, of the radii of the supports [m2], shape (N,)
    inverse_square: np.ndarray  # 1 / d_i^2 [1/m2], shape (N,)
    buckets: Buckets  # which supports reach which cells
    metric: Metric  # of the points, where locality follows the deformation


class Work(NamedTuple):
    """Working memory for one point; rows are padded with zeros to a multiple of LANES."""

    cell: np.ndarray  # number of the cell whose candidates these are, and their number, shape (2,)
    candidate: np.ndarray  # their numbers, shape (K,)
    place: np.ndarray  # x_i, shape (dim, K)
    square: np.ndarray  # d_i^2
    distance: np.ndarray  # (x_i - x)^2
    near: np.ndarray  # which of them count
    # Of the nodes whose supports cover the point:
    number: np.ndarray
    inverse_square: np.ndarray  # 1 / d_i^2
    rr: np.ndarray  # (|x_i - x| / d_i)^2
    dx: np.ndarray  # x_i - x, shape (dim, K)
    w: np.ndarray  # priors
    g: np.ndarray  # their slopes
    e: np.ndarray  # exp(-lambda . dx_i)


@compiled
def allocate(axes, most):
    """Working memory for points with at most so many candidates."""
    width = whole_lanes(most + 1)
    return Work(
        np.full(2, -1),
        np.zeros(width, np.int64),
        np.zeros((len(axes), width)),
        np.zeros(width),
        np.zeros(width),
        np.zeros(width, np.int64),
        np.zeros(width, np.int64),
        np.zeros(width),
        np.zeros(width),
        np.zeros((len(axes), width)),
        np.zeros(width),
        np.zeros(width),
        np.zeros(width),
    )


@compiled
def make_work(cloud):
    """Room for the longest list of candidates; for all nodes where a search visits many cells."""
    most = cloud.nodes.shape[0] if cloud.metric.growth.shape[0] > 0 else 1
    first = cloud.buckets.first
    for c in range(first.shape[0] - 1):
        most = max(most, first[c + 1] - first[c])
    return allocate(cloud.form.axes, most)


@lean
def pad(axes, found, work):
    """Zeros behind the nodes that were found, up to whole lanes."""
    for k in range(found, whole_lanes(found)):
        work.inverse_square[k] = work.rr[k] = 0.0
        for d in range(len(axes)):
            work.dx[d, k] = 0.0


@compiled
def convect(axes, F, volume, metric):
    """Fill `metric` with S = F, shape (n, dim, dim), or with ``S = J^(1/dim) I`` by `volume`."""
    pull = matrix(axes, axes)
    for p in range(F.shape[0]):
        metric.growth[p] = 1.0
        if volume:
            scale = determinant(axes, F[p]) ** (1.0 / len(axes))
            for d in range(len(axes)):
                metric.half[p, d] = scale
                for e in range(len(axes)):
                    metric.pull[p, d, e] = 1.0 / scale if d == e else 0.0
            continue
        inverse(axes, F[p], pull)
        for d in range(len(axes)):
            square = 0.0
            for e in range(len(axes)):
                metric.pull[p, d, e] = pull[d, e]
                square += F[p, d, e] * F[p, d, e]
            metric.half[p, d] = np.sqrt(square)


def clip(F: np.ndarray, limit: float, metric: Metric) -> None:
    """Keep the stretches of S, taken symmetric, between 1/limit and limit, as those of F exceed it."""
    norm = np.sqrt(np.sum(F**2, axis=(1, 2)))
    inverse_norm = np.sqrt(np.sum(metric.pull**2, axis=(1, 2)))
    suspect = np.flatnonzero((norm > limit) | (inverse_norm > limit))
    if suspect.size == 0:
        return
    square, axes = np.linalg.eigh(F[suspect] @ F[suspect].transpose(0, 2, 1))
    stretch = np.clip(np.sqrt(square), 1.0 / limit, limit)
    metric.pull[suspect] = (axes / stretch[:, None, :]) @ axes.transpose(0, 2, 1)
    metric.half[suspect] = np.sqrt(np.sum((axes * stretch[:, None, :]) ** 2, axis=2))


@compiled
def grade(axes, scale, metric):
    """Let nodes have been spaced by `scale`, shape (n, dim), along the axes before all: S becomes S diag(scale)."""
    S = matrix(axes, axes)
    for p in range(scale.shape[0]):
        inverse(axes, metric.pull[p], S)
        for d in range(len(axes)):
            square = 0.0
            for e in range(len(axes)):
                square += (S[d, e] * scale[p, e]) ** 2
                metric.pull[p, d, e] /= scale[p, d]
            metric.half[p, d] = np.sqrt(square)


@inlined
def gather(cloud, x, p, row, work):
    """Number of nodes that count at point `p` of `x`, and the radius of the largest support [m]."""
    axes = cloud.form.axes
    if cloud.metric.growth.shape[0] > 0:
        radius = math.sqrt(cloud.square[0]) * cloud.metric.growth[row]
        return gather_near(cloud, x, p, row, radius, work), radius
    cell = cell_of(cloud.buckets, len(axes), x, p)
    if cell != work.cell[0]:  # often the same as that of the point before
        list_candidates(cloud, cell, work)
    candidates = work.cell[1]
    for c in range(candidates):
        square = 0.0
        for d in range(len(axes)):
            difference = work.place[d, c] - x[p, d]
            square += difference * difference
        work.distance[c] = square
    found = 0
    for c in range(candidates):  # no branches: each is written, the next overwrites what is out
        work.near[found] = c
        found += work.distance[c] < work.square[c]
    largest = 0.0
    for k in range(found):
        c = work.near[k]
        i = work.candidate[c]
        work.number[k] = i
        work.inverse_square[k] = cloud.inverse_square[i]
        work.rr[k] = work.distance[c] * work.inverse_square[k]
        for d in range(len(axes)):
            work.dx[d, k] = work.place[d, c] - x[p, d]
        largest = max(largest, work.square[c])
    pad(axes, found, work)
    return found, math.sqrt(largest)


@lean
def list_candidates(cloud, cell, work):
    """Copy what a search needs of the nodes that reach a cell."""
    first, end = cloud.buckets.first[cell], cloud.buckets.first[cell + 1]
    work.cell[0], work.cell[1] = cell, end - first
    for c in range(end - first):
        i = cloud.buckets.entry[first + c]
        work.candidate[c], work.square[c] = i, cloud.square[i]
        for d in range(len(cloud.form.axes)):
            work.place[d, c] = cloud.nodes[i, d]


@lean
def corner(cloud, x, p, row, radius):
    """Cells along each axis where the box around ``|xi_i| < radius`` ends; begins, for -radius."""
    dim, half = len(cloud.form.axes), cloud.metric.half
    return (
        cell_along(cloud.buckets, 0, x[p, 0] + radius * half[row, 0]),
        cell_along(cloud.buckets, 1, x[p, 1] + radius * half[row, 1]) if dim > 1 else 0,
        cell_along(cloud.buckets, 2, x[p, 2] + radius * half[row, 2]) if dim > 2 else 0,
    )


@lean
def gather_near(cloud, x, p, row, radius, work):
    """Number of nodes with ``|xi_i| < radius`` in the metric `row`; their xi_i go to `work.dx`.

    Cells hold each node once, as it has no support of its own here.
    """
    dim = len(cloud.form.axes)
    buckets, metric = cloud.buckets, cloud.metric
    low, high = corner(cloud, x, p, row, -radius), corner(cloud, x, p, row, radius)
    square, inverse_square = radius * radius, 1.0 / (radius * radius)
    found = 0
    for a in range(low[0], high[0] + 1):
        for b in range(low[1], high[1] + 1):
            cell = (a * buckets.cells[1] + b) * buckets.cells[2]
            for c in range(buckets.first[cell + low[2]], buckets.first[cell + high[2] + 1]):
                i = buckets.entry[c]
                distance = 0.0
                for d in range(dim):
                    xi = 0.0
                    for e in range(dim):
                        xi += metric.pull[row, d, e] * (cloud.nodes[i, e] - x[p, e])
                    work.dx[d, found] = xi
                    distance += xi * xi
                work.number[found] = i
                work.inverse_square[found] = inverse_square
                work.rr[found] = distance * inverse_square
                found += distance < square
    pad(cloud.form.axes, found, work)
    return found


@inlined
def push(cloud, row, found, grad_phi):
    """Gradients with respect to x from those with respect to xi: ``grad phi = S^-T dphi/dxi``."""
    axes, pull = cloud.form.axes, cloud.metric.pull
    by_xi = vector(axes)
    for k in range(found):
        for d in range(len(axes)):
            by_xi[d] = grad_phi[row, k, d]
        for d in range(len(axes)):
            total = pull[row, 0, d] * by_xi[0]
            for e in range(1, len(axes)):
                total += pull[row, e, d] * by_xi[e]
            grad_phi[row, k, d] = total
