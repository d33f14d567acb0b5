"""The nodes around a point and their priors, for the maximum-entropy functions of `max_entropy`."""

import math
from typing import NamedTuple

import numpy as np

from mpmbench.core.bases.clouds.search import Buckets, cell_of
from mpmbench.core.bases.entropy.locality import Metric, gather_near
from mpmbench.core.compiled import kernel
from mpmbench.core.compiled.exponentials import LANES, exponentiate, lean

CUBIC_SPLINE, QUARTIC_SPLINE, GAUSSIAN = 0, 1, 2


class NodeCloud(NamedTuple):
    """What the kernels know of nodes and priors.

    Attributes
    ----------
    axes : tuple of float
        One entry per dimension (values unused).
    nodes : ndarray
        Positions [m], shape (N, dim).
    square, inverse_square : ndarray
        Squares of the radii of the supports d_i [m2] and one over them [1/m2], shape (N,).
    buckets : Buckets
        Which supports reach which cells.
    prior : int
        CUBIC_SPLINE, QUARTIC_SPLINE or GAUSSIAN.
    rim_exponent : float
        The Gaussian at the rim of its support is exp(-rim_exponent).
    spacing : float
        Nodal spacing h as a fraction of the support's radius.
    tolerance : float
        Largest residual ``|sum_i phi_i dx_i| / h``.
    line_search : bool
        Shorten Newton steps that do not lessen log Z; without it the iteration is the undamped one
        of Li (2009).
    max_iterations : int
    """

    axes: tuple[float, ...]
    nodes: np.ndarray
    square: np.ndarray
    inverse_square: np.ndarray
    buckets: Buckets
    prior: int
    rim_exponent: float
    spacing: float
    tolerance: float
    line_search: bool
    max_iterations: int
    metric: Metric


class Work(NamedTuple):
    """Working memory for one point; rows are padded with zeros to whole lanes of vector instructions.

    Attributes
    ----------
    offset, distance : ndarray
        x_i - x and its square for all candidates, shapes (dim, K) and (K,).
    number, inverse_square, rr, dx : ndarray
        Node numbers, 1/d_i^2, (|x_i - x| / d_i)^2 and x_i - x of the nodes whose supports cover the
        point.
    w, g, e : ndarray
        Priors, their slopes, and exp(-lambda . dx_i) of the same nodes, shape (K,).
    """

    offset: np.ndarray
    distance: np.ndarray
    number: np.ndarray
    inverse_square: np.ndarray
    rr: np.ndarray
    dx: np.ndarray
    w: np.ndarray
    g: np.ndarray
    e: np.ndarray


@kernel
def make_work(cloud):  # type: ignore[no-untyped-def]
    """Room for the longest list of candidates; for all nodes where a search visits many cells."""
    width = cloud.nodes.shape[0] if cloud.metric.growth.shape[0] > 0 else 1
    first = cloud.buckets.first
    for c in range(first.shape[0] - 1):
        width = max(width, first[c + 1] - first[c])
    width = (width // LANES + 1) * LANES
    dimension = len(cloud.axes)
    return Work(
        np.zeros((dimension, width)),
        np.zeros(width),
        np.zeros(width, np.int64),
        np.zeros(width),
        np.zeros(width),
        np.zeros((dimension, width)),
        np.zeros(width),
        np.zeros(width),
        np.zeros(width),
    )


@lean
def gather(cloud, x, p, row, work):  # type: ignore[no-untyped-def]
    """Number of nodes whose supports cover point `p` of `x`, and the largest of these supports.

    With a metric, that of its entry `row`, and ``xi_i = S^-1 (x_i - x)`` takes the place of ``x_i -
    x``.
    """
    if cloud.metric.growth.shape[0] > 0:
        radius = math.sqrt(cloud.square[0]) * cloud.metric.growth[row]
        return gather_near(cloud, x, p, row, radius, work), radius
    cell = cell_of(cloud.buckets, len(cloud.axes), x, p)
    first = cloud.buckets.first[cell]
    candidates = cloud.buckets.first[cell + 1] - first
    entry = cloud.buckets.entry[first:]
    for c in range(candidates):
        square = 0.0
        for d in range(len(cloud.axes)):
            difference = cloud.nodes[entry[c], d] - x[p, d]
            work.offset[d, c] = difference
            square += difference * difference
        work.distance[c] = square
    found = 0
    largest = 0.0
    for c in range(
        candidates
    ):  # no branches: each is written, and the next overwrites it if it does not count
        i = entry[c]
        work.number[found] = i
        work.inverse_square[found] = cloud.inverse_square[i]
        work.rr[found] = work.distance[c] * cloud.inverse_square[i]
        for d in range(len(cloud.axes)):
            work.dx[d, found] = work.offset[d, c]
        covers = work.distance[c] < cloud.square[i]
        largest = max(largest, cloud.square[i] if covers else 0.0)
        found += covers
    for k in range(found, (found + LANES - 1) // LANES * LANES):
        work.inverse_square[k] = work.rr[k] = 0.0
        for d in range(len(cloud.axes)):
            work.dx[d, k] = 0.0
    return found, math.sqrt(largest)


@lean
def weigh(cloud, found, row, work):  # type: ignore[no-untyped-def]
    """Priors w_i and their slopes g_i at distance r = |dx_i| / d_i (Wobbes 2020, Eqs. 87-90)."""
    w, g, rr, inverse_square = work.w, work.g, work.rr, work.inverse_square
    padded = (found + LANES - 1) // LANES * LANES
    if cloud.prior == CUBIC_SPLINE:
        for k in range(padded):
            r = math.sqrt(rr[k])
            rest = 1.0 - r
            inner = r <= 0.5
            w[k] = 2.0 / 3.0 - 4.0 * rr[k] * rest if inner else 4.0 / 3.0 * rest * rest * rest
            g[k] = inverse_square[k] * (
                12.0 * r - 8.0 if inner else -4.0 * rest * rest / max(r, 0.5)
            )
    elif cloud.prior == QUARTIC_SPLINE:
        for k in range(padded):
            r = math.sqrt(rr[k])
            w[k] = 1.0 - rr[k] * (6.0 - 8.0 * r + 3.0 * rr[k])
            g[k] = -12.0 * inverse_square[k] * (1.0 - r) * (1.0 - r)
    else:  # a Gaussian less its tangent at the rim in r^2, so that value and slope vanish there
        a = cloud.rim_exponent
        if cloud.metric.growth.shape[0] > 0:
            a *= cloud.metric.growth[row] ** 2
        rim = math.exp(-a)
        for k in range(padded):
            w[k] = -a * rr[k]
        exponentiate(w, padded)
        for k in range(padded):
            bell = w[k]
            w[k] = bell - rim * (1.0 + a * (1.0 - rr[k]))
            g[k] = -2.0 * a * inverse_square[k] * (bell - rim)
