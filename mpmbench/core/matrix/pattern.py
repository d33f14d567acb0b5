"""Which nodes enter the system, in which order, and which pairs of them share a particle."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import reverse_cuthill_mckee

from mpmbench.core.compiled import compiled


@dataclass(frozen=True)
class Pattern:
    """The active nodes (A of them) and the blocks of a matrix, while particles keep their nodes.

    Attributes
    ----------
    active : ndarray of int
        Node number of each row of blocks, shape (A,).
    row : ndarray of int
        Row of each node, -1 for nodes that no point sees, shape (N,).
    start, column : ndarray of int
        Row r owns the blocks ``start[r] : start[r + 1]``, in the columns of `column`, ascending.
    slot : ndarray of int
        Block to which node pair (k, l) of point p contributes, shape (points, K, K); -1 for those
        above the diagonal when only the lower half is stored, anything beyond the nodes of p.
    band : int
        Largest distance of a block from the diagonal, in rows of blocks.
    lower : bool
        Only blocks on and below the diagonal are stored (symmetric tangents).
    """

    active: np.ndarray
    row: np.ndarray
    start: np.ndarray
    column: np.ndarray
    slot: np.ndarray
    band: int
    lower: bool

    @property
    def block_row(self) -> np.ndarray:
        """Row of each block, shape (blocks,)."""
        return np.repeat(np.arange(len(self.active)), np.diff(self.start))

    @property
    def diagonal(self) -> np.ndarray:
        """Block on the diagonal of each row, shape (A,)."""
        return np.flatnonzero(self.block_row == self.column)


def build_pattern(
    size: np.ndarray,
    index: np.ndarray,
    nodes: np.ndarray,
    lower: bool,
    before: Pattern | None = None,
) -> Pattern:
    """Pattern of the points whose nodes are ``index[p, :size[p]]``.

    Parameters
    ----------
    size, index : ndarray of int
        Shapes (points,) and (points, K).
    nodes : ndarray
        Node positions [m], shape (N, dim): rows are numbered along the longest side of the active
        nodes, or by reverse Cuthill-McKee where that makes the band narrower.
    lower : bool
        Store the lower half only.
    before : Pattern or None
        One that is not needed any more, whose `slot` is written over where it has the right shape: in
        space it is the largest array of a run, and fresh memory costs more than what is written there.
    """
    used = np.zeros(len(nodes), dtype=np.bool_)
    mark_used(size, index, used)
    active = np.flatnonzero(used)
    extent = np.ptp(nodes[active], axis=0)
    # ties are broken by the other coordinates, shortest side fastest; rounding hides the noise of
    # moved nodes
    step = 1e-9 * max(float(extent.max()), 1e-300)
    order = np.lexsort([np.round(nodes[active, d] / step) for d in np.argsort(extent)])
    active = active[order]
    graph = _connections(size, index, active, len(nodes), lower)
    if graph.band > 3 * len(active) ** (1.0 - 1.0 / nodes.shape[1]):
        full = _connections(size, index, active, len(nodes), False) if lower else graph
        matrix = csr_matrix((np.ones(len(full.column), np.int8), full.column, full.start))
        order = reverse_cuthill_mckee(matrix, True)
        other = _connections(size, index, active[order], len(nodes), lower)
        graph = other if other.band < graph.band else graph
    shape = (*index.shape, index.shape[1])
    slot = None if before is None else before.slot
    if slot is None or slot.shape != shape:
        slot = np.empty(shape, dtype=np.int32)
    find_slots(size, index, lower, *graph[2:], slot)
    return Pattern(graph.active, graph.row, graph.start, graph.column, slot, graph.band, lower)


class Connections(NamedTuple):
    """As in `Pattern`, and the points of each row."""

    band: int
    active: np.ndarray
    row: np.ndarray
    first: np.ndarray
    member: np.ndarray
    start: np.ndarray
    column: np.ndarray


def _connections(
    size: np.ndarray, index: np.ndarray, active: np.ndarray, nodes: int, lower: bool
) -> Connections:
    row = np.full(nodes, -1, dtype=np.int64)
    row[active] = np.arange(len(active))
    first, member = points_of_rows(size, index, row, len(active))
    start = np.zeros(len(active) + 1, dtype=np.int64)
    column = np.zeros(0, dtype=np.int64)
    connect(size, index, row, first, member, lower, start, column, False)
    np.cumsum(start, out=start)
    column = np.zeros(start[-1], dtype=np.int64)
    connect(size, index, row, first, member, lower, start, column, True)
    from_diagonal = np.repeat(np.arange(len(active)), np.diff(start)) - column
    band = int(np.abs(from_diagonal).max(initial=0))
    return Connections(band, active, row, first, member, start, column)


@compiled
def mark_used(size, index, used):
    """Set `used`, shape (N,), at the nodes that some point sees."""
    for p in range(size.shape[0]):
        for k in range(size[p]):
            used[index[p, k]] = True


@compiled
def points_of_rows(size, index, row, rows):
    """The points of each row, ``member[first[r] : first[r + 1]]``, as ``p K + k``."""
    first = np.zeros(rows + 2, np.int64)
    for p in range(size.shape[0]):
        for k in range(size[p]):
            first[row[index[p, k]] + 2] += 1
    for r in range(1, rows + 2):
        first[r] += first[r - 1]
    member = np.zeros(first[rows + 1], np.int64)
    for p in range(size.shape[0]):
        for k in range(size[p]):
            r = row[index[p, k]]
            member[first[r + 1]] = p * index.shape[1] + k
            first[r + 1] += 1
    return first, member


@compiled
def connect(size, index, row, first, member, lower, start, column, write):
    """Count the blocks of each row in ``start[r + 1]``, or write their sorted columns."""
    seen = np.full(start.shape[0], -1, np.int64)
    for r in range(start.shape[0] - 1):
        found = 0
        for m in range(first[r], first[r + 1]):
            p = member[m] // index.shape[1]
            for k in range(size[p]):
                c = row[index[p, k]]
                if seen[c] != r and (c <= r or not lower):
                    seen[c] = r
                    if write:
                        column[start[r] + found] = c
                    found += 1
        if write:
            column[start[r] : start[r] + found].sort()
        else:
            start[r + 1] = found


@compiled
def find_slots(size, index, lower, row, first, member, start, column, slot):
    """Fill `slot` for the nodes of each point; what lies beyond them is never read.

    Points that count for nothing here, as massless ones, have nodes elsewhere: theirs are all -1.
    """
    for p in range(size.shape[0]):
        if size[p] == 0:
            slot[p] = -1
    place = np.full(start.shape[0], -1, np.int64)
    for r in range(start.shape[0] - 1):
        for s in range(start[r], start[r + 1]):
            place[column[s]] = s
        for m in range(first[r], first[r + 1]):
            p, k = member[m] // index.shape[1], member[m] % index.shape[1]
            for n in range(size[p]):
                c = row[index[p, n]]
                slot[p, k, n] = place[c] if c <= r or not lower else -1
