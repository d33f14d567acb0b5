"""What the order of particles costs: after many crossings those that follow each other are in different cells."""

from collections.abc import Callable
from dataclasses import fields
from time import process_time

import numpy as np

from mpmbench import case
from mpmbench.case.build import step_size
from mpmbench.core.bases.grid.product import count_crossings
from mpmbench.core.compiled import threads
from mpmbench.core.simulation import simulate
from mpmbench.core.state import State
from mpmbench.runs.hydra import compose

from .implicit import equations_of
from .measure import bare, interleaved
from .scaling import stepping

VORTEX = ("problem=generalized_vortex", "method=mpm", "resolution=16", "particles_per_cell=16")
CASES = (
    ("vortex, GIMP", (*VORTEX, "basis=gimp")),
    ("vortex, quadratic splines", (*VORTEX, "basis=bspline")),
    ("soil column, assembly", ("problem=soil_column", "method=implicit_mpm")),
)
LITTLE = 1e-9  # of a time step, in which nothing moves


def sorting() -> None:
    """A step at the start of a run, at its end, and then in the order of the cells; what sorting takes."""
    print(
        "\nOrder of particles: CPU ns per particle and step at the start, at the end, and sorted there"
    )
    print(
        f"{'case':28} {'particles':>9} {'elsewhere':>9} {'start':>8} {'end':>8} {'sorted':>8} "
        f"{'end/sorted':>10} {'a sort':>8} {'pays after':>12}"
    )
    threads.use(1)
    for name, overrides in CASES:
        (config, reason), *_ = compose.compose_many([list(overrides)])
        assert not reason, reason
        plugins = case.read(config)
        s = bare(case.build(plugins))
        count, dt = len(s.particles.x), step_size(config, plugins, s)
        small = LITTLE * (dt(s) if callable(dt) else dt)
        before = places(s)
        fresh = nanoseconds(work(s, small), count)
        s = bare(case.build(plugins))
        assert simulate(s, dt, float(config["end_time"])).status == "ok"
        changed = np.mean(places(s) != before)
        late = nanoseconds(work(s, small), count)
        start = process_time()
        sort_by_cell(s)
        once = (process_time() - start) / count * 1e9
        ordered = nanoseconds(work(s, small), count)
        pays = f"{once / (late - ordered):6.1f} steps" if late > ordered else "never"
        print(
            f"{name:28} {count:9} {changed:9.2f} {fresh:8.1f} {late:8.1f} {ordered:8.1f} "
            f"{late / ordered:10.2f} {once:8.1f} {pays:>12}"
        )


def nanoseconds(task: Callable[[], object], count: int) -> float:
    """CPU ns per particle of one call."""
    return interleaved({"task": task})["task"] / count * 1e9


def work(s: State, dt: float) -> Callable[[], object]:
    """A step, or, of an implicit method, its functions and the assembly of its equations."""
    if not s.choices.implicit:
        return stepping(s, dt)

    return lambda: equations_of(s).residual(np.zeros_like(s.nodes.v))


def places(s: State) -> np.ndarray:
    """Numbers of the cells of all particles, shape (P,)."""
    s.basis.locate(s.particles.x)
    cells = np.full(len(s.particles.x), -1, dtype=np.int64)
    count_crossings(s.basis.handle, s.particles.x, cells, 0, len(cells))
    return cells


def sort_by_cell(s: State) -> None:
    """Put all that is known of the particles into the order of their cells; tracers stay behind."""
    p, solid = s.particles, s.particles.material
    order = np.argsort(places(s)[solid], kind="stable")
    arrays = [getattr(p, one.name) for one in fields(p)]
    for array in (*arrays, *p.data.values()):
        if isinstance(array, np.ndarray) and len(array) == len(p.x):
            array[solid] = array[solid][order]
