"""Nodal fields, and the passes of an explicit step over the nodes that points see.

A grid with room for a body that moves has many nodes that nothing sees, and no pass walks over them:
whatever they had is zero since they were seen last, but the velocities of nodes that keep them.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from mpmbench.core.compiled import lean, threads
from mpmbench.core.compiled.rows import LANES


class NodeArrays(NamedTuple):
    """Velocities and accelerations of `Nodes`, as compiled loops take them, and both in rows of a vector's length."""

    v: np.ndarray
    a: np.ndarray
    both: np.ndarray


@dataclass
class Nodes:
    """Nodal sums and fields; shapes (N,) and (N, dim).

    Attributes
    ----------
    m : ndarray
        Lumped masses [kg].
    q : ndarray
        Momentum [kg m/s].
    f_internal, f_external, f : ndarray
        Forces [N], and their sum.
    a, v, v_old : ndarray
        Accelerations [m/s^2], new velocities and those before the step [m/s].
    v_last : ndarray
        Velocities with which nodes strained the particles last [m/s]; `v_old` with what transfers
        did since is another one.
    new : ndarray
        Nodes that no particle saw then, shape (N, 1) of bool.
    keep_velocities : bool
        Nodes that nothing sees any more keep their velocities, which are zero otherwise.
    seen : ndarray of int
        Numbers of the nodes that points see, ascending; all of them until the first sums.
    """

    m: np.ndarray
    q: np.ndarray
    f_internal: np.ndarray
    f_external: np.ndarray
    f: np.ndarray
    a: np.ndarray
    v: np.ndarray
    v_old: np.ndarray
    v_last: np.ndarray
    new: np.ndarray
    keep_velocities: bool = False
    seen: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        self._any = np.zeros(-(-len(self.m) // 8), dtype=np.uint64)  # marks in any row
        self._both = np.zeros((0, len(LANES)))
        self._lists = [np.zeros(len(self.m) + 1, dtype=np.int64) for _ in range(2)]
        self.seen = np.arange(len(self.m))

    @property
    def arrays(self) -> NodeArrays:
        """What particles take from the nodes; rows of both are empty until they were asked for."""
        return NodeArrays(self.v, self.a, self._both)

    @property
    def in_rows(self) -> NodeArrays:
        """The same with rows of velocity and acceleration, which the default of `interpolate` takes."""
        if not len(self._both):
            self._both = np.zeros((len(self.m), len(LANES)))
        over(join, self.seen, self.v, self.a, self._both)
        return self.arrays

    @classmethod
    def zeros(cls, nodes: int, dimension: int) -> "Nodes":
        fields = [np.zeros((nodes, dimension)) for _ in range(8)]
        return cls(np.zeros(nodes), *fields, new=np.ones((nodes, 1), dtype=np.bool_))  # type: ignore[misc, arg-type]

    def look(self, marks: np.ndarray) -> None:
        """Find the nodes that are seen, by their marks, shape (rows, N) or longer; the others have nothing any more."""
        self._lists.reverse()  # the last one is still needed
        before, now = self.seen, self._lists[0]
        self.seen = now[
            : list_marked(marks.view(np.uint64), self._any, self._any.view(np.uint8), now)
        ]
        leave(
            before,
            self._any.view(np.uint8),
            self.keep_velocities,
            self.m,
            *self._vectors(),
            self.new,
        )

    def _vectors(self) -> tuple[np.ndarray, ...]:
        """All that is zero where nothing is seen, and velocities."""
        return self.q, self.f_internal, self.f_external, self.f, self.a, self.v


def over(kernel: Callable[..., Any], seen: np.ndarray, *arguments: Any) -> list[Any]:
    """What ``kernel(seen, *arguments, start, stop)`` returns for each part of the nodes that are seen."""
    return threads.run(lambda _, start, stop: kernel(seen, *arguments, start, stop), len(seen))


@lean
def list_marked(words, of_any, mark, numbers):
    """Write the numbers of the nodes that have a mark in any row, ascending; returns how many.

    `words` are the marks, eight at a time, and so is `of_any`, where those of any row are written, whose
    bytes are `mark`.
    """
    found = 0
    for w in range(of_any.shape[0]):
        some = np.uint64(0)
        for c in range(words.shape[0]):
            some |= words[c, w]
        of_any[w] = some
        if some != 0:
            for i in range(8 * w, 8 * w + 8):
                if mark[i] != 0:
                    numbers[found] = i
                    found += 1
    return found


@lean
def leave(before, mark, keep_velocities, m, q, f_internal, f_external, f, a, v, new):
    """Set to zero what nodes had that were seen `before` and have no mark now."""
    for n in range(before.shape[0]):
        i = before[n]
        if mark[i] != 0:
            continue
        m[i], new[i, 0] = 0.0, True
        for d in range(q.shape[1]):
            q[i, d] = f_internal[i, d] = f_external[i, d] = f[i, d] = a[i, d] = 0.0
            if not keep_velocities:
                v[i, d] = 0.0


@lean
def hold_fixed(seen, fixed, at_rest, dt, v_old, v, a, start, stop):
    """Accelerations that take fixed components to their velocities, zero where all are `at_rest`, within the step."""
    for n in range(start, stop):
        i = seen[n]
        for d in range(v.shape[1]):
            if fixed[i, d]:
                if at_rest:
                    v[i, d] = 0.0
                a[i, d] = (v[i, d] - v_old[i, d]) / dt


@lean
def accelerate(seen, fixed, drag, dt, f, v_old, v_last, new, v, a, start, stop):
    """``v = v_old + dt a``; returns the power ``f . v_last``, where new nodes strained with `v_old`."""
    power = 0.0
    for n in range(start, stop):
        i = seen[n]
        for d in range(v.shape[1]):
            if drag > 0.0 and not fixed[i, d]:
                a[i, d] -= drag * v_old[i, d]
            v[i, d] = v_old[i, d] + dt * a[i, d]
            if new[i, 0]:
                v_last[i, d] = v_old[i, d]
            power += f[i, d] * v_last[i, d]
    return power


@lean
def note_strains(seen, share, before, f_internal, v, v_last, new, start, stop):
    """Keep the velocities that strain the particles for a `share` of the step; returns ``f_internal . v``.

    `before` is the rest of the step in which they were strained already, with what is in `v_last`, or 0.
    """
    power = 0.0
    for n in range(start, stop):
        i = seen[n]
        for d in range(v.shape[1]):
            power += f_internal[i, d] * v[i, d]
            if before == 0.0:
                v_last[i, d] = share * v[i, d]
            else:
                v_last[i, d] = share * v[i, d] + (before * v[i, d] if new[i, 0] else v_last[i, d])
        new[i, 0] = False
    return power


@lean
def scalar_product(seen, f, v, start, stop):
    """``f . v``."""
    total = 0.0
    for n in range(start, stop):
        i = seen[n]
        for d in range(v.shape[1]):
            total += f[i, d] * v[i, d]
    return total


@lean
def add_multiple_of(seen, base, factor, change, out, start, stop):
    """``out = base + factor change``."""
    for n in range(start, stop):
        i = seen[n]
        for d in range(out.shape[1]):
            out[i, d] = base[i, d] + factor * change[i, d]


@lean
def copy(seen, source, out, start, stop):
    """``out = source``."""
    for n in range(start, stop):
        for d in range(out.shape[1]):
            out[seen[n], d] = source[seen[n], d]


@lean
def join(seen, v, a, both, start, stop):
    """Write v and, behind it, a to each row."""
    dim = v.shape[1]
    for n in range(start, stop):
        i = seen[n]
        for d in range(dim):
            both[i, d], both[i, dim + d] = v[i, d], a[i, d]
