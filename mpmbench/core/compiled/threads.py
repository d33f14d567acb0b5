"""Work on particles in chunks, on one thread or several, with the same bits for any number of threads.

The division into chunks depends on the number of particles only, and each chunk adds to sums of its
own, which are added up in a fixed order. Kernels release the interpreter's lock, so plain threads
serve: nothing is compiled twice.
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from math import prod
from typing import Any

import numpy as np
from numpy.typing import DTypeLike

SMALLEST_CHUNK = 8192  # particles; below twice that there is one chunk
FEW = 1024  # particles that are worth a chunk where each takes a microsecond
MOST_CHUNKS = 8
PAGE = 4096  # bytes
_pool: ThreadPoolExecutor | None = None
_others = 0  # threads besides the one that calls


def use(threads: int) -> None:
    """Set the number of threads for all that follows in this process."""
    global _others, _pool
    if _pool is not None:
        _pool.shutdown()
    _others = threads - 1
    _pool = ThreadPoolExecutor(_others) if _others else None


def chunks(particles: int, smallest: int | None = None) -> list[tuple[int, int]]:
    """Ranges of particles, which do not depend on the number of threads."""
    n = min(MOST_CHUNKS, max(1, particles // (smallest or SMALLEST_CHUNK)))
    bounds = [particles * c // n for c in range(n + 1)]
    return list(pairwise(bounds))


def apart(particles: int, *shape: int, dtype: DTypeLike = float) -> np.ndarray:
    """Zeros of the given shape for each chunk of so many particles, shape (chunks, *shape).

    Two chunks have no page in common, and so no cache line, for which their threads would wait.
    """
    n, rows = prod(shape), len(chunks(particles))
    padded = np.zeros((rows, n + PAGE // np.dtype(dtype).itemsize), dtype)
    return padded[:, :n].reshape(rows, *shape)


def run(
    task: Callable[[int, int, int], Any], particles: int, smallest: int | None = None
) -> list[Any]:
    """Call ``task(chunk, start, stop)`` for every chunk, and give what each returned.

    With less than two of the `smallest` chunks there is one.
    """
    if particles < 2 * (smallest or SMALLEST_CHUNK):
        return [task(0, 0, particles)]
    parts = [(c, *part) for c, part in enumerate(chunks(particles, smallest))]
    return each(lambda c: task(*parts[c]), len(parts))


def each(task: Callable[[int], Any], count: int, size: float = np.inf) -> list[Any]:
    """Call ``task(k)`` for every ``k < count``, and give what each returned.

    All work on `size` numbers; few are not worth a thread. An exception in a task is raised here.
    """
    if size < 2 * SMALLEST_CHUNK or _pool is None:
        return [task(k) for k in range(count)]
    results, left = [None] * count, iter(range(count))

    def work() -> None:
        for k in left:  # each is taken by one thread
            results[k] = task(k)

    helpers = [_pool.submit(work) for _ in range(min(_others, count - 1))]
    try:
        work()
    finally:
        for helper in helpers:
            helper.result()
    return results


def first(found: list[int]) -> int:
    """The first number of a list that is not negative, else -1."""
    return next((number for number in found if number >= 0), -1)
