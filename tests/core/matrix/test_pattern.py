"""Which nodes share a point, and where the blocks of their pairs are."""

import numpy as np
import pytest

from mpmbench.core.matrix.pattern import Pattern, build_pattern

NODES = np.array([[x, y] for x in range(4) for y in range(3)], dtype=float)
INDEX = np.array([[0, 1, 3, 4], [4, 5, 7, 8], [9, 10, 6, 7], [2, 0, 0, 0]])
SIZE = np.array([4, 4, 3, 0])  # the last point counts for nothing


def pairs(pattern: Pattern, size: np.ndarray, index: np.ndarray) -> set[tuple[int, int]]:
    """The pairs of nodes that have a block, as `slot` says; blocks agree with rows and columns."""
    seen = set()
    for p, own in enumerate(size):
        for k in range(own):
            for n in range(own):
                i, j, s = index[p, k], index[p, n], pattern.slot[p, k, n]
                above = pattern.row[j] > pattern.row[i]
                assert (s == -1) == (pattern.lower and above)
                if s >= 0:
                    assert pattern.active[pattern.block_row[s]] == i
                    assert pattern.active[pattern.column[s]] == j
                    seen.add((int(i), int(j)))
    return seen


@pytest.mark.parametrize("lower", (True, False))
def test_each_pair_of_nodes_at_a_point_has_its_block(lower: bool) -> None:
    pattern = build_pattern(SIZE, INDEX, NODES, lower)
    assert len(pairs(pattern, SIZE, INDEX)) == len(pattern.column)
    assert sorted(pattern.active) == [0, 1, 3, 4, 5, 6, 7, 8, 9, 10]
    assert pattern.band == np.abs(pattern.block_row - pattern.column).max()
    assert (pattern.slot[3] == -1).all()


def test_memory_of_the_pattern_before_is_written_over() -> None:
    """Where the shape is the same; whatever was in it, what is read is right."""
    before = build_pattern(SIZE, INDEX, NODES, True)
    before.slot[:] = 7
    size, index = SIZE[::-1].copy(), INDEX[::-1].copy()
    after = build_pattern(size, index, NODES, True, before)
    assert after.slot is before.slot
    assert len(pairs(after, size, index)) == len(after.column)
    assert (after.slot[0] == -1).all()
    assert build_pattern(size[1:], index[1:], NODES, True, after).slot is not after.slot
