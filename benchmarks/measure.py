"""Medians of interleaved repeats, in CPU time: what else runs on the machine then counts as little as it can."""

from collections.abc import Callable, Mapping
from statistics import median
from time import perf_counter, process_time

from mpmbench import case
from mpmbench.core.state import State
from mpmbench.core.transfer.parts import NOTHING
from mpmbench.runs.hydra import compose

REPEATS = 5


def interleaved(
    tasks: Mapping[str, Callable[[], object]], seconds: float = 0.3
) -> dict[str, float]:
    """CPU seconds per call of each task: medians of `REPEATS` rounds in which every task has its turn.

    Each task is called once before, so that nothing compiles while it is timed; a turn lasts about
    `seconds`.
    """
    calls = {}
    for name, task in tasks.items():
        task()
        start = perf_counter()
        task()
        calls[name] = max(1, round(seconds / max(perf_counter() - start, 1e-7)))
    times: dict[str, list[float]] = {name: [] for name in tasks}
    for _ in range(REPEATS):
        for name, task in tasks.items():
            start = process_time()
            for _ in range(calls[name]):
                task()
            times[name].append((process_time() - start) / calls[name])
    return {name: median(values) for name, values in times.items()}


def plate(basis: str, cells: int, mass: str = "lumped", **changes: object) -> State:
    """The state of MPM on the plate without body force, 16 particles per cell unless changed; nobody watches it."""
    overrides = [
        "problem=plate_axis_aligned",
        "problem.body_force=false",
        f"basis={basis}",
        f"resolution={cells}",
    ]
    overrides += [f"method.mass={mass}"] + [f"{key}={value}" for key, value in changes.items()]
    (config, _), *_ = compose.compose_many([overrides])
    return bare(case.build(case.read(config)))


def bare(state: State) -> State:
    """The same state, whose steps do not look at the particles for guards and counts."""
    state.watched = NOTHING
    return state
