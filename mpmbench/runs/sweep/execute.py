"""Run one configuration in a child process, so that it leaves a result file whatever happens."""

import os
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any

from mpmbench.results.identity import result_path
from mpmbench.results.provenance import attributes
from mpmbench.runs.interrupts import uninterrupted
from mpmbench.runs.process import isolation
from mpmbench.runs.process.exclusive import turn
from mpmbench.settings.schema import BadInput

SUCCESS = ("ok", "not_applicable")
INTERRUPTED = "stopped by the user or the system"
LONGEST_PART = 255  # bytes of the name of a folder
UNCHECKED = {"bad": "", "not_applicable": "", "memory": 0.0, "earlier": None, "damage": ""}


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
    """The limits of a run, with the memory of this machine [MiB] where no less was given."""
    of_machine = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") / 2**20
    given = config["limits"]["memory"]
    return {**config["limits"], "memory": min(given or of_machine, of_machine)}


def check(cells: list[tuple[dict[str, Any], str]]) -> list[dict[str, Any]]:
    """Have a child judge configurations, each with the reason why it does not apply, if known.

    The answer on one at which the child ended has that end as ``unchecked``.

    Raises
    ------
    BadInput
        For a value out of range, or a run that needs more memory than there is.
    """
    requests = [(config, reason, str(result_path(config))) for config, reason in cells]
    for config, _ in cells[:1]:  # digests are kept; the server loads its libraries meanwhile
        with suppress(Exception):  # a broken plug-in, of which the child tells in words
            attributes(config)
    answers: list[dict[str, Any]] = []
    while len(answers) < len(cells):
        left, limits = requests[len(answers) :], limits_of(cells[len(answers)][0])
        try:
            isolation.processes.ask("check", left, limits=limits, on_part=answers.append)
        except isolation.NotStarted as end:
            raise BadInput(f"nothing can be checked: {end.reason}", exit_code=1) from None
        except isolation.Ended as end:
            answers[len(answers) : len(cells)] = [UNCHECKED | {"unchecked": end}]
    for (config, _), answer in zip(cells, answers, strict=True):
        if answer["bad"]:
            raise BadInput(answer["bad"])
        allowed = limits_of(config)["memory"]
        if answer["memory"] > allowed:
            given = config["limits"]["memory"] == allowed
            what = "limits.memory" if given else "this machine's memory"
            raise BadInput(
                f"resolution = {config['resolution']} with {config['particles_per_cell']} particles per cell needs "
                f"about {answer['memory'] / 1024:.4g} GiB, more than {what} of {allowed / 1024:.4g} GiB"
            )
    for folder in {result_path(config).parent for config, _ in cells}:
        check_folder(folder)
    return answers


def applying(combinations: Sequence[Sequence[str]]) -> list[tuple[dict[str, Any], str]]:
    """Configuration of each combination, and why it does not apply, if so; nothing runs.

    The process that runs are forked from loads its libraries meanwhile. Raises `BadInput` when a
    combination is wrong.
    """
    isolation.processes.warm_up()
    from mpmbench.runs.hydra.compose import compose_many

    cells = compose_many(combinations)
    reasons = reasons_against(cells)
    return [(config, reason) for (config, _), reason in zip(cells, reasons, strict=True)]


def reasons_against(cells: list[tuple[dict[str, Any], str]]) -> list[str]:
    """Why each configuration does not apply, if so, as `check` finds it.

    Raises `BadInput` for one that cannot be checked, too.
    """
    answers = check(cells)
    for (config, _), answer in zip(cells, answers, strict=True):
        if "unchecked" in answer:
            why = f"the configuration could not be checked: {answer['unchecked'].reason}"
            raise BadInput(f"{result_path(config).stem}: {why}", exit_code=1)
    return [answer["not_applicable"] for answer in answers]


def check_folder(folder: Path, what: str = "output_dir:") -> None:
    """Raise `BadInput` about `what` when nothing can be written to `folder`."""
    encoding, existing = sys.getfilesystemencoding(), folder
    try:
        str(folder).encode(encoding)  # netCDF does so
    except UnicodeEncodeError:
        hint = "call it otherwise, or set LC_ALL=C.UTF-8"
        raise BadInput(f"{what} {str(folder)!a} has no name in {encoding}; {hint}") from None
    if any(len(part.encode()) > LONGEST_PART for part in folder.parts):
        raise BadInput(f"{what} file name too long: at most {LONGEST_PART} bytes are allowed")
    try:
        while not is_there(existing):
            existing = existing.parent
        existing.stat()
    except OSError as error:
        link = " is a link:" if isinstance(error, FileNotFoundError) else ":"
        raise BadInput(f"{what} {existing}{link} {str(error.strerror).lower()}") from None
    if not existing.is_dir():
        raise BadInput(f"{what} {existing} is not a folder")
    if not os.access(existing, os.W_OK | os.X_OK):
        raise BadInput(f"{what} {existing} is not writable")


def is_there(path: Path) -> bool:
    """Whether there is a file, folder or link; raises `OSError` for what cannot be one."""
    try:
        path.lstat()
    except (FileNotFoundError, NotADirectoryError):
        return False
    return True


def run(
    config: dict[str, Any],
    on_progress: Callable[[float, float], None] | None = None,
    alone: bool = False,
    on_start: Callable[[], None] = lambda: None,
    earlier: Mapping[str, list[float]] = MappingProxyType({}),
    before: Path | None = None,
) -> Record:
    """Run one case; a failure of any kind is a record with a reason, and a file.

    One that is `alone` waits until no other run uses the machine, and keeps the others waiting.
    `on_start` is called when it is this run's turn, `on_progress` with the fraction done and the
    simulated time [s]. The file gets the median of the solver's time and of those of `earlier`
    repeats. The run goes on from the end of the one in the file `before`, if that is given. An
    interrupted run is recorded before it raises `KeyboardInterrupt`.
    """
    target = result_path(config)
    limits = limits_of(config)
    with turn(alone) as began:
        on_start()
        known = attributes(config) | {"timing_context": "exclusive" if alone else "shared"}
        if before is not None:
            known |= {"continued_from": before.name}
        started = time.perf_counter()
        try:
            earliest = "" if before is None else str(before)
            request = ("run", config, known, str(target), began, dict(earlier), earliest)
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
