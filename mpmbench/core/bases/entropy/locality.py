"""Which nodes count at a point, and by which distance.

Either those whose supports cover the point, by plain distance; or, where locality follows the
deformation, every point measures in a metric of its own (Li 2009, section 2.2.3). With ``xi_i =
S^-1 (x_i - x)`` its functions are those of the undeformed configuration: nodes count when ``|xi_i|
< R`` and weigh ``exp(-gamma |xi_i|^2 / h^2)``. S is the point's deformation gradient (`convected`)
or the isotropic part of it (`volume`). Gradients take S as constant near the point.
"""

import math
from functools import partial
from typing import NamedTuple

import numpy as np

from mpmbench.core.bases.clouds.search import Buckets, cell_along
from mpmbench.core.bases.entropy.priors import Formulation
from mpmbench.core.compiled import compiled, inlined, lean, matrix
from mpmbench.core.compiled.algebra import determinant, inverse
from mpmbench.core.compiled.exponentials import LANES, whole_lanes


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

    box: np.ndarray  # first and last cell along each axis whose nodes are listed, shape (3, 2)
    listed: np.ndarray  # how many these candidates are, shape (1,)
    extremes: np.ndarray  # largest and smallest 1 / d_i^2 of them, shape (2,)
    candidate: np.ndarray  # their numbers, shape (K,)
    place: np.ndarray  # x_i, shape (dim, K)
    inverse: np.ndarray  # 1 / d_i^2
    offset: np.ndarray  # xi_i, shape (dim, K)
    ratio: np.ndarray  # (|xi_i| / d_i)^2
    near: np.ndarray  # which of them count
    # Of the nodes that count at the point:
    number: np.ndarray
    inverse_square: np.ndarray  # 1 / d_i^2
    rr: np.ndarray  # (|xi_i| / d_i)^2
    dx: np.ndarray  # xi_i, shape (dim, K)
    w: np.ndarray  # priors
    g: np.ndarray  # their slopes
    e: np.ndarray  # exp(-lambda . dx_i)
    held: np.ndarray  # numbers and values of functions on the hull, shapes (K,)
    value: np.ndarray


def allocate(dimension: int, most: int) -> Work:
    """Working memory for points with at most so many candidates."""
    width = (most + LANES) // LANES * LANES
    whole, real = partial(np.zeros, width, np.int64), partial(np.zeros, width)
    rows = partial(np.zeros, (dimension, width))
    return Work(
        *(np.full((3, 2), -1), np.zeros(1, np.int64), np.zeros(2)),
        *(whole(), rows(), real(), rows(), real(), whole()),
        *(whole(), real(), real(), rows(), real(), real(), real()),
        *(whole(), real()),
    )


def longest_list(cloud: NodeCloud) -> int:
    """Most candidates of a point: all nodes where a search visits many cells."""
    if len(cloud.metric.growth):
        return len(cloud.nodes)
    return int(np.diff(cloud.buckets.first).max(initial=1))


@lean
def pad(axes, found, work):
    """Zeros behind the nodes that were found, up to whole lanes."""
    for k in range(found, whole_lanes(found)):
        work.inverse_square[k] = work.rr[k] = 0.0
        for d in range(len(axes)):
            work.dx[d, k] = 0.0


@compiled
def convect(axes, F, volume, metric):
    """Fill `metric` with S = F, shape (n, dim, dim), or with ``S = J^(1/dim) I`` by `volume`.

    Returns a bound of all stretches of F and of their inverses: the largest norm of both; 1 by `volume`.
    """
    pull, most = matrix(axes, axes), 1.0
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
        whole, inverse_whole = 0.0, 0.0
        for d in range(len(axes)):
            square = 0.0
            for e in range(len(axes)):
                metric.pull[p, d, e] = pull[d, e]
                square += F[p, d, e] * F[p, d, e]
                inverse_whole += pull[d, e] * pull[d, e]
            metric.half[p, d] = np.sqrt(square)
            whole += square
        most = max(most, whole, inverse_whole)
    return np.sqrt(most)


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
def gather(cloud, x, row, work, pull):
    """Number of nodes that count at a point x, and the radius of the largest support [m].

    Writes what they are and S^-1, that of the metric `row` or of plain distances, to `pull`.
    """
    axes, metric = cloud.form.axes, cloud.metric
    growth = 1.0
    for d in range(len(axes)):
        for e in range(len(axes)):
            pull[d, e] = 1.0 if d == e else 0.0
    if metric.growth.shape[0] > 0:
        growth = metric.growth[row]
        for d in range(len(axes)):
            for e in range(len(axes)):
                pull[d, e] = metric.pull[row, d, e]
    list_candidates(cloud, x, row, growth, work)
    shrink, candidates = 1.0 / (growth * growth), work.listed[0]
    for c in range(candidates):
        square = 0.0
        for d in range(len(axes)):
            xi = 0.0
            for e in range(len(axes)):
                xi += pull[d, e] * (work.place[e, c] - x[e])
            work.offset[d, c] = xi
            square += xi * xi
        work.ratio[c] = square * (work.inverse[c] * shrink)
    found = 0
    for c in range(candidates):  # no branches: each is written, the next overwrites what is out
        work.near[found] = c
        found += work.ratio[c] < 1.0
    for k in range(found):
        c = work.near[k]
        work.number[k] = work.candidate[c]
        work.inverse_square[k] = work.inverse[c] * shrink
        work.rr[k] = work.ratio[c]
        for d in range(len(axes)):
            work.dx[d, k] = work.offset[d, c]
    pad(axes, found, work)
    least = work.extremes[0]
    if least != work.extremes[1]:
        for k in range(found):
            least = min(least, work.inverse[work.near[k]])
    return found, growth / math.sqrt(least)


@lean
def list_candidates(cloud, x, row, growth, work):
    """List the nodes of all cells that the support of a point may reach, unless it is done already.

    Where distances are plain, its cell has a list of the nodes whose supports reach that; otherwise
    cells have the nodes in them, and all cells count that the box around ``|xi| < R`` meets.
    """
    dim, buckets, box = len(cloud.form.axes), cloud.buckets, work.box
    radius = growth * math.sqrt(cloud.square[0])
    same = True
    for d in range(3):
        first = last = np.int64(0)
        if d < dim:
            reach = radius * cloud.metric.half[row, d] if cloud.metric.half.shape[0] > 0 else 0.0
            first = cell_along(buckets, d, x[d] - reach)
            last = cell_along(buckets, d, x[d] + reach)
        same = same and box[d, 0] == first and box[d, 1] == last
        box[d, 0], box[d, 1] = first, last
    if same:  # often as for the point before
        return
    listed, largest, smallest = 0, 0.0, np.inf
    for a in range(box[0, 0], box[0, 1] + 1):
        for b in range(box[1, 0], box[1, 1] + 1):
            cell = (a * buckets.cells[1] + b) * buckets.cells[2]
            for c in range(buckets.first[cell + box[2, 0]], buckets.first[cell + box[2, 1] + 1]):
                i = buckets.entry[c]
                inverse = cloud.inverse_square[i]
                work.candidate[listed], work.inverse[listed] = i, inverse
                largest, smallest = max(largest, inverse), min(smallest, inverse)
                for d in range(dim):
                    work.place[d, listed] = cloud.nodes[i, d]
                listed += 1
    work.listed[0], work.extremes[0], work.extremes[1] = listed, largest, smallest
