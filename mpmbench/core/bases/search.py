"""Which nodes can be seen from a point: cells that list, in ascending order, every node whose support reaches them.

A point reads one list and is done, whatever the sizes of the supports; the order of the neighbours, and so every sum
over them, does not depend on how the nodes were found.
"""

from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from mpmbench.core.compiled import kernel


class Buckets(NamedTuple):
    """Cells over the bounding box of the nodes; unused axes have one cell.

    Attributes
    ----------
    cells : ndarray of int
        Number of cells along each axis, shape (3,).
    lower, size : ndarray
        Corner of the first cell and edges of a cell [m], shape (3,).
    first : ndarray of int
        Cell c owns ``entry[first[c] : first[c + 1]]``, shape (number of cells + 1,).
    entry : ndarray of int
        Node numbers, ascending in every cell.
    """

    cells: np.ndarray
    lower: np.ndarray
    size: np.ndarray
    first: np.ndarray
    entry: np.ndarray


@kernel
def cell_along(buckets, d, coordinate):  # type: ignore[no-untyped-def]
    """Number of the cell along axis `d`; points outside (or not a number) belong to a cell at the end."""
    position = (coordinate - buckets.lower[d]) / buckets.size[d]
    if not position > 0.0:
        return 0
    last = buckets.cells[d] - 1
    return last if position >= last else int(position)


@kernel
def cell_of(buckets, x, p):  # type: ignore[no-untyped-def]
    """Number of the cell of point `p` of `x`, shape (n, dim)."""
    c = 0
    for d in range(x.shape[1]):
        c = c * buckets.cells[d] + cell_along(buckets, d, x[p, d])
    for d in range(x.shape[1], 3):
        c = c * buckets.cells[d]
    return c


@kernel
def _visit(buckets, nodes, support, write):  # type: ignore[no-untyped-def]
    """Walk over all cells that each support reaches: count them in ``first[c + 1]``, or write the entries.

    Counting before writing costs a second walk and spares every guess about the lengths of the lists.
    """
    low = np.zeros(3, np.int64)
    high = np.zeros(3, np.int64)
    gap = np.zeros(3)
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
                    if distance <= reach * reach:
                        cell = (a * buckets.cells[1] + b) * buckets.cells[2] + c
                        if write:
                            buckets.entry[buckets.first[cell]] = i
                            buckets.first[cell] += 1
                        else:
                            buckets.first[cell + 1] += 1


@kernel
def _shift(first):  # type: ignore[no-untyped-def]
    """Undo the advance of the starts that writing leaves behind."""
    for c in range(first.shape[0] - 1, 0, -1):
        first[c] = first[c - 1]
    first[0] = 0


def fill_buckets(buckets: Buckets, nodes: np.ndarray, support: np.ndarray) -> Buckets:
    """List again which supports reach which cells, after nodes or supports have changed.

    Parameters
    ----------
    buckets : Buckets
        Filled in place; its number of cells stays, their size follows the bounding box of the nodes.
    nodes, support : ndarray
        Positions [m], shape (N, dim), and radii of the supports [m], shape (N,).

    Returns
    -------
    Buckets
        The same one, or one with longer lists where they no longer fit.
    """
    dimension = nodes.shape[1]
    buckets.lower[:dimension] = nodes.min(axis=0)
    extent = nodes.max(axis=0) - buckets.lower[:dimension]
    buckets.size[:dimension] = np.where(extent > 0.0, extent / buckets.cells[:dimension], 1.0)
    buckets.first[:] = 0
    _visit(buckets, nodes, support, False)
    np.cumsum(buckets.first, out=buckets.first)
    if buckets.first[-1] > len(buckets.entry):
        buckets = buckets._replace(entry=np.zeros(int(1.25 * buckets.first[-1]) + 16, dtype=np.int32))
    _visit(buckets, nodes, support, True)
    _shift(buckets.first)
    return buckets


def make_buckets(nodes: np.ndarray, support: np.ndarray, local: bool) -> Buckets:
    """Cells about as many as nodes, or a single cell that lists them all (`local` false: no search)."""
    dimension = nodes.shape[1]
    cells = np.ones(3, dtype=np.int64)
    if local:
        extent = np.ptp(nodes, axis=0)
        used = extent > 0.0
        edge = (np.prod(extent[used]) / len(nodes)) ** (1.0 / max(used.sum(), 1))
        wanted = np.where(used, np.maximum(extent / edge if edge > 0.0 else 1.0, 1.0), 1.0)
        cells[:dimension] = np.minimum(wanted, len(nodes)).astype(np.int64)
    buckets = Buckets(cells, np.zeros(3), np.ones(3), np.zeros(int(cells.prod()) + 1, np.int64), np.zeros(0, np.int32))
    return fill_buckets(buckets, nodes, support)


def nearest_distances(nodes: np.ndarray) -> np.ndarray:
    """Distance from each node to its nearest neighbour [m], shape (N,); the zeta_i of Wobbes 2020, Eq. 88."""
    return np.asarray(cKDTree(nodes).query(nodes, k=2)[0][:, 1])
