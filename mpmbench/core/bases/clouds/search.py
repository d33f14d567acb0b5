"""Which nodes can be seen from a point: cells list, ascending, every node that reaches them.

A point reads one list and is done, whatever the sizes of the supports; the order of the neighbours,
and so every sum over them, does not depend on how the nodes were found.
"""

import math
from typing import NamedTuple

import numpy as np

from mpmbench.core.compiled import compiled, lean
from mpmbench.core.geometry import search_tree
from mpmbench.core.geometry.outside import extent


class Buckets(NamedTuple):
    """Cells over the bounding box of the nodes; unused axes have one cell."""

    cells: np.ndarray  # number of cells along each axis, shape (3,)
    lower: np.ndarray  # corner of the first cell [m], shape (3,)
    size: np.ndarray  # edges of a cell [m], shape (3,)
    inverse_size: np.ndarray  # one over them [1/m]
    first: np.ndarray  # cell c owns ``entry[first[c] : first[c + 1]]``
    entry: np.ndarray  # node numbers, ascending in every cell


@lean
def cell_along(buckets, d, coordinate):
    """Number of the cell along axis `d`; points outside (or NaN) belong to one at the end."""
    position = (coordinate - buckets.lower[d]) * buckets.inverse_size[d]
    if not position > 0.0:
        return 0
    last = buckets.cells[d] - 1
    return last if position >= last else int(position)


@lean
def cell_of(buckets, dimension, x, p):
    """Number of the cell of point `p` of `x`, shape (n, dim)."""
    cell = 0
    for d in range(3):
        along = cell_along(buckets, d, x[p, d]) if d < dimension else 0
        cell = cell * buckets.cells[d] + along
    return cell


@lean
def list_near(buckets, nodes, x, radius, start, stop, stored):
    """List in `stored` the nodes closer than `radius` [m], that of all supports, to points ``start <= p < stop``.

    Returns the largest and the smallest number of nodes at a point. They are listed if there is room
    for one more.
    """
    most, least, room = 0, nodes.shape[0], stored.index.shape[1] - 1
    for p in range(start, stop):
        cell, found = cell_of(buckets, len(stored.axes), x, p), 0
        for c in range(buckets.first[cell], buckets.first[cell + 1]):
            i, distance = buckets.entry[c], 0.0
            for d in range(len(stored.axes)):
                difference = nodes[i, d] - x[p, d]
                distance += difference * difference
            stored.index[p, min(found, room)] = i  # the next overwrites what is out
            found += math.sqrt(distance) < radius
        stored.size[p] = found
        most, least = max(most, found), min(least, found)
    return most, least


@lean
def _visit(buckets, nodes, support, low, high, gap, write):
    """Walk over all cells that each support reaches: count in ``first[c + 1]``, or write entries.

    Counting before writing costs a second walk and spares every guess about the lengths of the
    lists. `low`, `high` and `gap` are working memory of three entries.
    """
    low[:] = 0
    high[:] = 0
    margin = 1.0 + 1e-9  # rounding must not drop a node whose support just touches a cell
    for i in range(nodes.shape[0]):
        reach = support[i] * margin
        for d in range(nodes.shape[1]):
            low[d] = cell_along(buckets, d, nodes[i, d] - reach)
            high[d] = cell_along(buckets, d, nodes[i, d] + reach)
        for a in range(low[0], high[0] + 1):
            for b in range(low[1], high[1] + 1):
                for c in range(low[2], high[2] + 1):
                    distance = 0.0
                    for d in range(nodes.shape[1]):
                        place = a if d == 0 else (b if d == 1 else c)
                        left = buckets.lower[d] + place * buckets.size[d]
                        gap[d] = max(left - nodes[i, d], nodes[i, d] - left - buckets.size[d], 0.0)
                        distance += gap[d] * gap[d]
                    # a node without support is in its own cell
                    if distance <= reach * reach or reach == 0.0:
                        cell = (a * buckets.cells[1] + b) * buckets.cells[2] + c
                        if write:
                            buckets.entry[buckets.first[cell]] = i
                            buckets.first[cell] += 1
                        else:
                            buckets.first[cell + 1] += 1


def fill_buckets(buckets: Buckets, nodes: np.ndarray, support: np.ndarray) -> Buckets:
    """List again which supports reach which cells, after nodes or supports have changed.

    The number of cells stays, their size follows the bounding box of the nodes. Everything is
    written in place, unless longer lists are needed.
    """
    dimension = nodes.shape[1]
    lower, upper = extent(nodes)
    buckets.lower[:dimension] = lower
    cells = (upper - lower) / buckets.cells[:dimension]
    buckets.size[:dimension] = np.where(cells > 0.0, cells, 1.0)
    buckets.inverse_size[:] = 1.0 / buckets.size
    buckets.first[:] = 0
    work = np.zeros(3, dtype=np.int64), np.zeros(3, dtype=np.int64), np.zeros(3)
    _visit(buckets, nodes, support, *work, False)
    np.cumsum(buckets.first, out=buckets.first)
    if buckets.first[-1] > len(buckets.entry):
        buckets = buckets._replace(
            entry=np.zeros(int(1.25 * buckets.first[-1]) + 16, dtype=np.int32)
        )
    _visit(buckets, nodes, support, *work, True)
    buckets.first[1:] = buckets.first[:-1].copy()  # writing has advanced each start to the next
    buckets.first[0] = 0
    return buckets


@compiled
def still_listed(nodes, listed, support, reach):
    """Whether lists made for the radii `reach` of nodes at `listed` [m] hold those for `support` where they are now.

    A node may have moved by so much, and a point be so far outside the box that was around them.
    """
    drift, spare = 0.0, np.inf
    for i in range(nodes.shape[0]):
        square = 0.0
        for d in range(nodes.shape[1]):
            square += (nodes[i, d] - listed[i, d]) ** 2
        drift, spare = max(drift, square), min(spare, reach[i] - support[i])
    return 2.0 * math.sqrt(drift) <= spare


def make_buckets(nodes: np.ndarray, support: np.ndarray, local: bool) -> Buckets:
    """About as many cells as nodes, or a single one that lists them all (`local` false)."""
    dimension = nodes.shape[1]
    cells = np.ones(3, dtype=np.int64)
    if local:
        whole = np.ptp(nodes, axis=0)
        used = whole > 0.0
        edge = (np.prod(whole[used]) / len(nodes)) ** (1.0 / max(used.sum(), 1))
        wanted = np.where(used, np.maximum(whole / edge if edge > 0.0 else 1.0, 1.0), 1.0)
        cells[:dimension] = np.minimum(wanted, len(nodes)).astype(np.int64)
    buckets = Buckets(
        cells=cells,
        lower=np.zeros(3),
        size=np.ones(3),
        inverse_size=np.ones(3),
        first=np.zeros(int(cells.prod()) + 1, dtype=np.int64),
        entry=np.zeros(0, dtype=np.int32),
    )
    return fill_buckets(buckets, nodes, support)


def nearest_distances(nodes: np.ndarray) -> np.ndarray:
    """Distance from each node to the nearest one [m], shape (N,): zeta_i of Wobbes 2020, Eq. 88."""
    distances, _ = search_tree(nodes).query(nodes, k=2)
    return np.asarray(distances)[:, 1]
