"""Run one configuration in a child process, so that it leaves a result file whatever happens."""

import os
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any

from mpmbench.results.identity import result_path
from mpmbench.results.provenance import attributes
from mpmbench.runs.process import isolation
from mpmbench.runs.process.exclusive import turn
from mpmbench.runs.sweep.interrupts import uninterrupted
from mpmbench.settings.schema import BadInput

SUCCESS = ("ok", "not_applicable")
INTERRUPTED = "stopped by the user or the system"


@dataclass
class Record:
    """How one run ended."""

    name: str
    status: str
    reason: str
    file: str
    scalars: dict[str, tuple[float, str]] = field(default_factory=dict)  # value and units
    seconds: float = 0.0
    unwritten: str = ""
    # Of the repeats that had the machine to themselves (`mpmbench.results.timings`).
    timings: dict[str, list[float]] = field(default_factory=dict)
    has_traceback: bool = False  # as an attribute of its file

    @property
    def solver_times(self) -> list[float]:
        """Wall-clock times [s] of these repeats."""
        return self.timings.get("solver_times", [])

    @property
    def failed(self) -> bool:
        """Whether the run gives no complete result, although it should."""
        return self.status not in SUCCESS or bool(self.unwritten)

    @property
    def outcome(self) -> str:
        """Its status, unless the result is lost."""
        return "not written" if self.unwritten else self.status


def limits_of(config: dict[str, Any]) -> dict[str, Any]:
    """The limits of a run, with the memory of this machine [MiB] where none was given."""
    of_machine = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") / 2**20
    return {**config["limits"], "memory": config["limits"]["memory"] or of_machine}


def check(cells: list[tuple[dict[str, Any], str]]) -> list[dict[str, Any]]:
    """Have a child judge configurations, each with the reason why it does not apply, if known.

    Raises
    ------
    BadInput
        For a value out of range, or a run that needs more memory than there is.
    """
    if not cells:
        return []
    requests = [(config, reason, str(result_path(config))) for config, reason in cells]
    first = cells[0][0]
    try:
        answers = isolation.processes.ask("check", requests, limits=limits_of(first))
    except isolation.Ended as end:
        sentence = f"the configuration could not be checked: {end.reason}"
        raise BadInput(sentence, exit_code=1) from None
    for (config, _), answer in zip(cells, answers, strict=True):
        if answer["bad"]:
            raise BadInput(answer["bad"])
        allowed = limits_of(config)["memory"]
        if answer["memory"] > allowed:
            what = "limits.memory" if config["limits"]["memory"] else "this machine's memory"
            raise BadInput(
                f"resolution = {config['resolution']} with {config['particles_per_cell']} particles per cell needs "
                f"about {answer['memory'] / 1024:.4g} GiB, more than {what} of {allowed / 1024:.4g} GiB"
            )
    check_folder(result_path(first).parent)
    return list(answers)


def applying(combinations: Sequence[Sequence[str]]) -> list[tuple[dict[str, Any], str]]:
    """Configuration of each combination, and why it does not apply, if so; nothing runs.

    The process that runs are forked from loads its libraries meanwhile. Raises `BadInput` when a
    combination is wrong.
    """
    isolation.processes.warm_up()
    from mpmbench.runs.hydra.compose import compose_many

    cells = compose_many(combinations)
    answers = check(cells)
    return [
        (config, answer["not_applicable"])
        for (config, _), answer in zip(cells, answers, strict=True)
    ]


def check_folder(folder: Path, what: str = "output_dir:") -> None:
    """Raise `BadInput` about `what` when nothing can be written to `folder`."""
    existing = folder
    while not existing.exists() and existing != existing.parent:
        existing = existing.parent
    if not existing.is_dir():
        raise BadInput(f"{what} {existing} is not a folder")
    if not os.access(existing, os.W_OK | os.X_OK):
        raise BadInput(f"{what} {existing} is not writable")


def run(
    config: dict[str, Any],
    on_progress: Callable[[float, float], None] | None = None,
    alone: bool = False,
    on_start: Callable[[], None] = lambda: None,
    earlier: Mapping[str, list[float]] = MappingProxyType({}),
) -> Record:
    """Run one case; a failure of any kind is a record with a reason, and a file.

    One that is `alone` waits until no other run uses the machine, and keeps the others waiting.
    `on_start` is called when it is this run's turn, `on_progress` with the fraction done and the
    simulated time [s]. The file gets the median of the solver's time and of those of `earlier`
    repeats. An interrupted run is recorded before it raises `KeyboardInterrupt`.
    """
    target = result_path(config)
    limits = limits_of(config)
    with turn(alone) as began:
        on_start()
        known = attributes(config) | {"timing_context": "exclusive" if alone else "shared"}
        started = time.perf_counter()
        try:
            request = ("run", config, known, str(target), began, dict(earlier))
            answer = isolation.processes.ask(*request, limits=limits, on_progress=on_progress)
            return _record(target, answer, started)
        except isolation.Ended as end:
            known |= {"status": end.status, "reason": end.reason}
            return leave_record(config, known, started, end)
        except KeyboardInterrupt:
            known |= {"status": "interrupted", "reason": INTERRUPTED}
            with uninterrupted():
                leave_record(config, known, started)
            raise


def leave_record(
    config: dict[str, Any],
    known: dict[str, Any],
    started: float | None = None,
    end: isolation.Ended | None = None,
) -> Record:
    """Write the file of a run that could not do it itself, or that does not apply.

    Its attributes are `known`, ``status`` and ``reason`` among them. It `started`, if ever, at a
    time of `time.perf_counter`, and its process came to an `end`, if that is why.
    """
    target = result_path(config)
    scalars = {}
    if started is not None:
        scalars["wall_time"] = (time.perf_counter() - started, "s", "wall-clock time of the run")
        reached = end.time_reached if end else 0.0
        scalars["time_reached"] = (reached, "s", "simulated time reached, as far as is known")
    if end is not None and end.solver_time > 0.0:
        text = "wall-clock time from the start of the solver to its end"
        scalars["solver_time"] = (end.solver_time, "s", text)
    request = ("record", known, scalars, str(target))
    try:
        answer = isolation.processes.ask(*request, limits=limits_of(config))
    except isolation.Ended as end:
        answer = {key: known[key] for key in ("status", "reason")} | {"unwritten": end.reason}
    return _record(target, answer, time.perf_counter() if started is None else started)


def _record(target: Path, answer: dict[str, Any], started: float) -> Record:
    seconds = time.perf_counter() - started
    return Record(target.stem, file=str(target), seconds=seconds, **answer)
