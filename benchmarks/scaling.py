"""Speed of whole steps by the clock on the wall, on one thread and two, for each method in 2D and 3D."""

from collections.abc import Callable
from statistics import median
from time import perf_counter

import numpy as np

from mpmbench.core.compiled import threads
from mpmbench.core.guards import guard
from mpmbench.core.implicit.step import prepare
from mpmbench.core.simulation import Solution, Watch
from mpmbench.core.state import State

from .goals import measured
from .implicit import build, equations_of
from .measure import REPEATS, bare

THREADS = (1, 2)
TURN = 0.2  # [s] of calls in a turn
PLATE = ("problem=plate_axis_aligned", "problem.body_force=false", "resolution=128")
BLOCK = ("problem=rigid_motion", "problem.dimension=3", "particles_per_cell=8", "time_step=1e-4")
COARSE, FINE = (*BLOCK, "resolution=11"), (*BLOCK, "resolution=21")  # 34^3 and 64^3 nodes

# What runs, its settings, and how its step is called.
EXPLICIT = (
    ("mpm linear", (*PLATE, "method=mpm", "basis=linear")),
    ("mpm bspline", (*PLATE, "method=mpm", "basis=bspline")),
    ("mpm bspline consistent", (*PLATE, "method=mpm", "basis=bspline", "method.mass=consistent")),
    ("unified bspline lumped", (*PLATE, "method=unified", "basis=bspline", "method.mass=lumped")),
    ("otm lme lumped", (*PLATE, "method=otm", "basis=lme", "method.mass=lumped")),
    ("otm maxent lumped", (*PLATE, "method=otm", "basis=maxent", "method.mass=lumped")),
    ("mpm mls", (*PLATE, "method=mpm", "basis=mls")),
    ("mpm linear, 3D", (*FINE, "method=mpm", "basis=linear")),
    ("mpm bspline, 3D", (*FINE, "method=mpm", "basis=bspline")),
    ("otm lme lumped, 3D", (*COARSE, "method=otm", "basis=lme", "method.mass=lumped")),
)
IMPLICIT = (
    ("implicit mpm", ("problem=cantilever_self_weight", "method=implicit_mpm", "resolution=128")),
    ("gmm lme", ("problem=cantilever_self_weight", "method=gmm", "basis=lme", "resolution=128")),
    ("gmm mls", ("problem=cantilever_self_weight", "method=gmm", "basis=mls", "resolution=128")),
)
USERS = (
    ("plate, linear, no body force", (*PLATE[:2], "resolution=256", "basis=linear"), "goal 1.1"),
    (
        "plate, quadratic, no body force",
        (*PLATE[:2], "resolution=256", "basis=bspline"),
        "goal 1.1",
    ),
    ("plate, linear", (PLATE[0], "resolution=256", "basis=linear"), "goal 1.3"),
    ("plate, quadratic", (PLATE[0], "resolution=256", "basis=bspline"), "goal 1.3"),
)


def by_the_clock(tasks: dict[int, Callable[[], object]]) -> dict[int, float]:
    """Seconds per call for each number of threads: medians of rounds in which each has its turn."""
    calls = {}
    for n, task in tasks.items():
        threads.use(n)
        task()
        start = perf_counter()
        task()
        calls[n] = max(1, round(TURN / max(perf_counter() - start, 1e-7)))
    found: dict[int, list[float]] = {n: [] for n in tasks}
    for _ in range(REPEATS):
        for n, task in tasks.items():
            threads.use(n)
            start = perf_counter()
            for _ in range(calls[n]):
                task()
            found[n].append((perf_counter() - start) / calls[n])
    threads.use(1)
    return {n: median(times) for n, times in found.items()}


def line(name: str, task: Callable[[], object], count: int, unit: float = 1e9) -> float:
    """Print what a task takes per item on one thread and two; how many times faster two are."""
    seconds = by_the_clock(dict.fromkeys(THREADS, task))
    one, two = (seconds[n] / count * unit for n in THREADS)
    print(f"{name:34} {count:9} {one:9.2f} {two:9.2f} {one / two:6.2f}")
    return one / two


def stepping(s: State, dt: float = 1e-6) -> Callable[[], None]:
    """A task that does one step."""

    def task() -> None:
        s.time_step = dt
        s.choices.step(s, dt)

    return task


def scaling() -> None:
    """Steps and their parts on one thread and two."""
    print("\nWhole steps by the clock, ns per particle (goal: two threads 1.8)")
    print(f"{'method':34} {'particles':>9} {'1 thread':>9} {'2':>9} {'ratio':>6}")
    faster = []
    for name, overrides in EXPLICIT:
        s = build(*overrides)
        faster.append(line(name, stepping(s), len(s.particles.x)))
    measured("two threads over one, the slowest explicit step", min(faster))
    measured("two threads over one, the fastest explicit step", max(faster))
    implicit = []
    print("\nParts of an implicit step by the clock, ms (the factorisation is serial: same bits)")
    print(f"{'part':34} {'':>9} {'1 thread':>9} {'2':>9} {'ratio':>6}")
    for name, overrides in IMPLICIT:
        s = build(*overrides)
        equations, du = equations_of(s), np.zeros_like(s.nodes.v)
        residual = equations.residual(du)
        assert residual is not None
        for what, task in (
            ("functions", lambda s=s: prepare(s)),  # type: ignore[misc]
            ("assembly", lambda e=equations, du=du: e.residual(du)),  # type: ignore[misc]
        ):
            implicit.append(line(f"{name}: {what}", task, 1, 1e3))
        line(
            f"{name}: factorisation",
            lambda e=equations, du=du, r=residual: e.correction(du, r),  # type: ignore[misc]
            1,
            1e3,
        )
    measured("two threads over one, implicit functions and assembly", min(implicit))


def users() -> None:
    """What a user's run takes over the bare step: with guards, samples and the count of crossings."""
    print(
        "\nA user's step, guarded and counted, over the bare step without a body force, one thread"
    )
    print(f"{'run':34} {'bare ns':>9} {'user ns':>9} {'ratio':>6}")
    threads.use(1)
    for name, overrides, goal in USERS:
        unguarded = bare(build(*(*PLATE[:2], *overrides[-2:])))
        s = build(*overrides)
        watch = Watch(s, Solution(), 1.0, [])

        def guarded(s: State = s, watch: Watch = watch) -> None:
            watch.before_step(1e-6)
            s.choices.step(s, 1e-6)
            guard(s)
            watch.count_crossings()

        tasks: dict[int, Callable[[], object]] = {0: stepping(unguarded), 1: guarded}
        times: dict[int, list[float]] = {0: [], 1: []}
        for task in tasks.values():
            task()
        for _ in range(2 * REPEATS):
            for k, task in tasks.items():
                start = perf_counter()
                task()
                task()
                times[k].append((perf_counter() - start) / (2 * len(s.particles.x)) * 1e9)
        plain, user = median(times[0]), median(times[1])
        print(f"{name:34} {plain:9.1f} {user:9.1f} {user / plain:6.2f} {goal}")
        which = "linear" if "linear" in name else "quadratic"
        row = (
            "user's step over the bare one"
            if "no body" in name
            else "the same with the plate's body force"
        )
        measured(f"{row}, {which}", user / plain)


def sizes() -> None:
    """How cost and memory grow from 33 to 1025 nodes a side."""
    print("\nMPM on the plate, 16 particles per cell, one thread (goal: exponent 1.02, 400 bytes)")
    print(f"{'basis':10} {'nodes a side':>12} {'ns':>7} {'bytes a particle':>17}")
    exponents = []
    for basis in ("linear", "bspline"):
        found = []
        for cells in (32, 128, 512, 1024):
            s = build(*PLATE[:2], f"basis={basis}", f"resolution={cells}")
            count = len(s.particles.x)
            seconds = by_the_clock({1: stepping(s)})[1]
            found.append((count, seconds))
            print(
                f"{basis:10} {cells + 1:12} {seconds / count * 1e9:7.1f} {stored(s) / count:17.0f}"
            )
        (n0, t0), (n1, t1) = found[0], found[-1]
        exponents.append(np.log(t1 / t0) / np.log(n1 / n0))
        print(f"{basis:10} exponent {exponents[-1]:.3f}")
        measured("memory in 2D, a particle", stored(s) / count)
    measured("growth of cost with particles, exponent", max(exponents))


def stored(s: State) -> int:
    """Bytes of all arrays that a state keeps, each piece of memory once."""
    blocks: dict[int, int] = {}
    seen, waiting = set(), [s]
    while waiting:
        one = waiting.pop()
        if id(one) in seen:
            continue
        seen.add(id(one))
        if isinstance(one, np.ndarray):
            whole = one
            while isinstance(whole.base, np.ndarray):
                whole = whole.base
            blocks[id(whole)] = whole.nbytes
        elif isinstance(one, dict):
            waiting += one.values()
        elif isinstance(one, list | tuple):
            waiting += one
        elif type(one).__module__.startswith("mpmbench"):
            waiting += vars(one).values() if hasattr(one, "__dict__") else []
    return sum(blocks.values())
