"""Compiling before a run: the first one of all does so on two processors, since compiling takes one thread.

Half of the time goes into what particles give to the nodes. While that is compiled here, a process
forked from this one compiles what they take from them, and leaves it in the cache of kernels.
"""

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from mpmbench.core.loads import constrain
from mpmbench.core.loops.explicit import Explicit, strains, total_force, update_particles
from mpmbench.core.simulation import Solution, Watch, simulate
from mpmbench.core.state import State
from mpmbench.core.transfer.carry import g2p


def compile_kernels(
    build: Callable[[], State],
    time_step: float | Callable[[State], float],
    end_time: float,
    threads: int,
) -> None:
    """Compile what a run needs, by a step of a state that is built for that, outside the time of the run.

    Only a process of one thread can be forked.
    """
    warm = build()
    first = time_step(warm) if callable(time_step) else time_step
    if threads == 1 and isinstance(warm.choices, Explicit) and is_first_of_all():
        warm.basis.locate(warm.particles.x)
        with beside(lambda: take_from_nodes(warm, first)):
            total_force(warm)
            warm.mass.assemble(warm.basis, warm.particles, warm.nodes.m, warm.nodes.seen)
        warm = build()
    simulate(warm, first, min(first, end_time))


def take_from_nodes(s: State, dt: float) -> None:
    """What a step does after its sums over particles, and a sample; what comes out does not matter."""
    update_particles(s, 0.0, velocity=True, strain=True, position=True)
    strains(s, dt)
    constrain(s, dt)
    s.mass.solve(s.nodes.q, s.nodes.v_old)
    Watch(s, Solution(), dt, []).sample()


def is_first_of_all() -> bool:
    """Whether no kernel that takes from nodes was ever compiled, and there is a processor to spare."""
    folder, kernel = os.environ.get("NUMBA_CACHE_DIR"), g2p.py_func.__qualname__
    if not folder or sys.platform != "linux" or len(os.sched_getaffinity(0)) < 2:
        return False
    return not any(Path(folder).glob(f"*/*.{kernel}-*.nbi"))


@contextmanager
def beside(task: Callable[[], object]) -> Iterator[None]:
    """Do a task in a process of its own meanwhile; what it fails to do is not missed."""
    child = os.fork()
    if child == 0:
        try:
            task()
        finally:
            os._exit(0)
    try:
        yield
    finally:
        os.waitpid(child, 0)
