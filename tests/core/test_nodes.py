"""Passes over the nodes that points see: which these are, and that the others have nothing."""

import numpy as np
import pytest

from mpmbench import case
from mpmbench.core.nodes import Nodes, find_marked, stretches
from tests.core.support import compose


def numbers(seen: list[np.ndarray]) -> list[int]:
    """The nodes of all stretches, in their order."""
    return [i for part in seen for start, stop in part.tolist() for i in range(start, stop)]


@pytest.mark.parametrize("rows", (1, 3))
@pytest.mark.parametrize("share", (0.02, 0.5, 0.98, 1.0))
@pytest.mark.parametrize("nodes", (201, 208))
def test_marked_nodes_are_found_in_their_order(rows: int, share: float, nodes: int) -> None:
    rng = np.random.default_rng(rows)
    marks = (rng.random((rows, 208)) < share).astype(np.uint8)
    marks[:, nodes:] = 0  # what is behind the nodes fills the last eight
    marks[-1, nodes - 1] = 1
    found, of_any = np.zeros((2, 52, 2), dtype=np.int64), np.zeros(26, dtype=np.uint64)
    words, mark = marks.view(np.uint64), of_any.view(np.uint8)
    parts = [
        room[: find_marked(words, *part, of_any, mark, room)]
        for part, room in zip(((0, 11), (11, 26)), found, strict=True)
    ]
    marked = marks[:, :nodes].any(axis=0)
    assert numbers(parts) == numbers(stretches(marked)) == np.flatnonzero(marked).tolist()
    for part in parts:
        assert (part[:, 0] < part[:, 1]).all() and (part[1:, 0] > part[:-1, 1]).all()


@pytest.mark.parametrize("keeps", (True, False))
def test_nodes_that_are_left_have_nothing(keeps: bool) -> None:
    nodes = Nodes.zeros(16, 2)
    nodes.keep_velocities = keeps
    marks = np.zeros((2, 16), dtype=np.uint8)
    for seen in ([0, 3, 9], [3, 10]):
        marks[:] = 0
        marks[0, seen[:1]] = marks[1, seen[1:]] = 1
        nodes.look(marks)
        assert numbers(nodes.seen) == seen
        if 10 in seen:  # what is seen again has what it had
            assert nodes.m[3] == 1.0 and (nodes.v[3] == 1.0).all() and not nodes.new[3]
        for field in (
            nodes.m,
            nodes.q,
            nodes.f_internal,
            nodes.f_external,
            nodes.f,
            nodes.a,
            nodes.v,
        ):
            field[seen] = 1.0
        nodes.new[seen] = False
    left = [0, 9]
    for field in (nodes.m, nodes.q, nodes.f_internal, nodes.f_external, nodes.f, nodes.a):
        assert not field[left].any() and (field[[3, 10]] == 1.0).all()
    assert (nodes.v[left] == (1.0 if keeps else 0.0)).all() and (nodes.v[3] == 1.0).all()
    assert np.flatnonzero(~nodes.new[:, 0]).tolist() == [3, 10]


@pytest.mark.parametrize("update", ("usl", "musl"))
def test_what_flies_leaves_nothing_behind(update: str) -> None:
    """Two disks on their way through the grid: all but the nodes that particles see is at rest and without mass."""
    changes = {"resolution": 6, "method__stress_update": update}
    s = case.build(case.read(compose("colliding_disks", "mpm", "linear", **changes)))
    n, visited = s.nodes, np.zeros(len(s.fixed), dtype=bool)
    for _ in range(30):
        stored = s.basis.evaluate(s.particles.x)  # before the step moves them
        s.time_step = 0.05
        s.choices.step(s, 0.05)
        now = np.unique(
            np.concatenate([i[:k] for i, k in zip(stored.index, stored.size, strict=True)])
        )
        assert numbers(n.seen) == now.tolist()
        visited[now] = True
        others = np.setdiff1d(np.arange(len(n.m)), now)
        for field in (n.m, n.q, n.f, n.f_internal, n.f_external, n.a, n.v):
            assert not field[others].any()
        assert n.new[others].all() and not n.new[now].any()
    assert np.count_nonzero(visited) > len(now) + 4
