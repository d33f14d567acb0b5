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

FULL = np.uint64(0x0101010101010101)  # eight marks that are all set


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
    axes : tuple of float
        As many zeros as there are dimensions, over which loops unroll.
    seen : list of ndarray of int
        Stretches of numbers of nodes that points see, ``start <= i < stop`` in rows, shape (n, 2), in one
        array for each part of the nodes; all nodes until the first sums.
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
    axes: tuple[float, ...] = field(init=False)
    seen: list[np.ndarray] = field(init=False)

    def __post_init__(self) -> None:
        self.axes = (0.0,) * self.v.shape[1]
        words = -(-len(self.m) // 8)  # eight marks each
        self._any = np.zeros(words, dtype=np.uint64)  # marks in any row
        self._both = np.zeros((0, len(LANES)))
        self._parts = threads.chunks(words, threads.SMALLEST_CHUNK // 8)
        rooms = [np.zeros((4 * (stop - start), 2), dtype=np.int64) for start, stop in self._parts]
        self._rooms = [(room, room.copy()) for room in rooms]
        self.seen = stretches(np.ones(len(self.m), dtype=np.bool_))

    @property
    def arrays(self) -> NodeArrays:
        """What particles take from the nodes; rows of both are empty until they were asked for."""
        return NodeArrays(self.v, self.a, self._both)

    @property
    def in_rows(self) -> NodeArrays:
        """The same with rows of velocity and acceleration, which the default of `interpolate` takes."""
        if not len(self._both):
            self._both = np.zeros((len(self.m), len(LANES)))
        over(join, self.seen, self.axes, self.v, self.a, self._both)
        return self.arrays

    @classmethod
    def zeros(cls, nodes: int, dimension: int) -> "Nodes":
        fields = [np.zeros((nodes, dimension)) for _ in range(8)]
        return cls(np.zeros(nodes), *fields, new=np.ones((nodes, 1), dtype=np.bool_))  # type: ignore[misc, arg-type]

    def look(self, marks: np.ndarray) -> None:
        """Find the nodes that are seen, by their marks, shape (rows, N) or longer; the others have nothing any more."""
        words, of_any, mark = marks.view(np.uint64), self._any, self._any.view(np.uint8)
        seen, vectors = [], (self.q, self.f_internal, self.f_external, self.f, self.a, self.v)
        self._rooms = [room[::-1] for room in self._rooms]  # the last one is still needed
        for part, (room, _) in zip(self._parts, self._rooms, strict=True):
            seen.append(room[: find_marked(words, *part, of_any, mark, room)])
        for before in self.seen:
            leave(before, self.axes, mark, self.keep_velocities, self.m, *vectors, self.new)
        self.seen = seen


def over(kernel: Callable[..., Any], seen: list[np.ndarray], *arguments: Any) -> list[Any]:
    """What ``kernel(stretches, *arguments)`` returns for each part of the nodes that are seen."""
    return threads.each(lambda c: kernel(seen[c], *arguments), len(seen))


def stretches(marked: np.ndarray) -> list[np.ndarray]:
    """Stretches of the nodes that are `marked`, shape (N,) of bool, in one part."""
    return [np.flatnonzero(np.diff(marked, prepend=False, append=False)).reshape(-1, 2)]


@lean
def find_marked(words, first, last, of_any, mark, found):
    """Write the stretches of nodes that have a mark in any row, shape (n, 2); returns how many.

    `words` are the marks, eight at a time, and so is `of_any`, where those of any row are written, whose
    bytes are `mark`; this is done for the words `first` to `last`.
    """
    n, inside = 0, False
    for w in range(first, last):
        some = np.uint64(0)
        for c in range(words.shape[0]):
            some |= words[c, w]
        of_any[w] = some
        if some == (FULL if inside else np.uint64(0)):
            continue
        for i in range(8 * w, 8 * w + 8):
            if (mark[i] != 0) != inside:
                found[n, 1 if inside else 0] = i
                n += 1 if inside else 0
                inside = not inside
    if inside:
        found[n, 1] = 8 * last
        n += 1
    return n


@lean
def leave(before, axes, mark, keep_velocities, m, q, f_internal, f_external, f, a, v, new):
    """Set to zero what nodes had that were seen `before` and have no mark now."""
    for n in range(before.shape[0]):
        for i in range(before[n, 0], before[n, 1]):
            if mark[i] != 0:
                continue
            m[i], new[i, 0] = 0.0, True
            for d in range(len(axes)):
                q[i, d] = f_internal[i, d] = f_external[i, d] = f[i, d] = a[i, d] = 0.0
                if not keep_velocities:
                    v[i, d] = 0.0


@lean
def hold_fixed(held, axes, m, fixed, at_rest, dt, v_old, v, a):
    """Accelerations that take fixed components to their velocities, zero where all are `at_rest`, within the step.

    Nodes that are `held` have some; those without mass are not seen.
    """
    for n in range(held.shape[0]):
        i = held[n]
        for d in range(len(axes)):
            if fixed[i, d] and m[i] != 0.0:
                if at_rest:
                    v[i, d] = 0.0
                a[i, d] = (v[i, d] - v_old[i, d]) / dt


@lean
def accelerate(seen, axes, fixed, drag, dt, f, v_old, v_last, new, v, a):
    """``v = v_old + dt a``; returns the power ``f . v_last``, where new nodes strained with `v_old`."""
    power = 0.0
    for n in range(seen.shape[0]):
        for i in range(seen[n, 0], seen[n, 1]):
            own = 0.0
            for d in range(len(axes)):
                if drag > 0.0 and not fixed[i, d]:
                    a[i, d] -= drag * v_old[i, d]
                v[i, d] = v_old[i, d] + dt * a[i, d]
                if new[i, 0]:
                    v_last[i, d] = v_old[i, d]
                own += f[i, d] * v_last[i, d]
            power += own
    return power


@lean
def note_strains(seen, axes, share, before, f_internal, v, v_last, new):
    """Keep the velocities that strain the particles for a `share` of the step; returns ``f_internal . v``.

    `before` is the rest of the step in which they were strained already, with what is in `v_last`, or 0.
    """
    power = 0.0
    for n in range(seen.shape[0]):
        for i in range(seen[n, 0], seen[n, 1]):
            own = 0.0
            for d in range(len(axes)):
                own += f_internal[i, d] * v[i, d]
                if before == 0.0:
                    v_last[i, d] = share * v[i, d]
                else:
                    first = before * v[i, d] if new[i, 0] else v_last[i, d]
                    v_last[i, d] = share * v[i, d] + first
            power += own
            new[i, 0] = False
    return power


@lean
def scalar_product(seen, axes, f, v):
    """``f . v``."""
    total = 0.0
    for n in range(seen.shape[0]):
        for i in range(seen[n, 0], seen[n, 1]):
            own = 0.0
            for d in range(len(axes)):
                own += f[i, d] * v[i, d]
            total += own
    return total


@lean
def add_multiple_of(seen, axes, base, factor, change, out):
    """``out = base + factor change``."""
    for n in range(seen.shape[0]):
        for i in range(seen[n, 0], seen[n, 1]):
            for d in range(len(axes)):
                out[i, d] = base[i, d] + factor * change[i, d]


@lean
def copy(seen, axes, source, out):
    """``out = source``."""
    for n in range(seen.shape[0]):
        for i in range(seen[n, 0], seen[n, 1]):
            for d in range(len(axes)):
                out[i, d] = source[i, d]


@lean
def join(seen, axes, v, a, both):
    """Write v and, behind it, a to each row."""
    for n in range(seen.shape[0]):
        for i in range(seen[n, 0], seen[n, 1]):
            for d in range(len(axes)):
                both[i, d], both[i, len(axes) + d] = v[i, d], a[i, d]
