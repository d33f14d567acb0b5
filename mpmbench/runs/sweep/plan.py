"""All cells of a sweep before one runs: what is wrong, does not apply, is finished."""

import json
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from mpmbench.results.identity import code_hash, config_hash, digests_of_many, result_path
from mpmbench.results.provenance import attributes
from mpmbench.runs.process.isolation import Ended
from mpmbench.runs.sweep import execute
from mpmbench.settings.trees import dotted
from mpmbench.settings.words import in_yaml

# The same code would fail the same way again; whatever else failed may have been the machine's or
# the user's doing.
LASTING = ("ok", "diverged", "broke_down", "not_converged", "not_applicable")
INCOMPLETE = ("missing", "stale", "untimed", "damaged")
RERUN = {
    "missing": INCOMPLETE,
    "failed": (*INCOMPLETE, "failed"),
    "all": (*INCOMPLETE, "failed", "fresh"),
}
LONG_ENOUGH = 20.0  # seconds of timed solving, after which a run is not repeated


@dataclass
class Cell:
    """One combination of a sweep."""

    config: dict[str, Any]
    not_applicable: str = ""
    earlier: dict[str, Any] | None = None  # attributes of the file of an earlier run
    damage: str = ""  # what is wrong with that file, if it is not as it was written
    work: float = 1.0  # estimated, in units that only comparison gives a meaning
    state: str = "missing"  # or stale, untimed, damaged, failed, fresh: what its file is worth now
    stamp: Any = None  # of its file when it was planned
    unchecked: Ended | None = None  # how the process came to its end that should check it

    @property
    def name(self) -> str:
        """Name of its file."""
        return result_path(self.config).stem


@dataclass
class Plan:
    """What a sweep will do."""

    to_run: list[Cell] = field(default_factory=list)
    finished: list[Cell] = field(default_factory=list)
    not_applicable: list[Cell] = field(default_factory=list)
    unchecked: list[Cell] = field(default_factory=list)
    folder: str = ""

    def failed_before(self) -> list[execute.Record]:
        """Records of the finished cells whose runs gave no result."""
        found = []
        for cell in self.finished:
            path, earlier = result_path(cell.config), cell.earlier
            if earlier and earlier["status"] not in execute.SUCCESS:
                how = (earlier["status"], earlier["reason"])
                found.append(execute.Record(path.stem, *how, str(path)))
        return found

    def cells(self) -> list[Cell]:
        """All cells."""
        return [*self.to_run, *self.finished, *self.not_applicable, *self.unchecked]

    def told_apart(self) -> dict[str, str]:
        """By name, the settings of a cell that vary among those whose names differ in their ends only."""
        alike: dict[str, list[Cell]] = {}
        for cell in self.cells():
            alike.setdefault(cell.name.rpartition("-")[0], []).append(cell)
        found = {}
        for cells in alike.values():
            settings = [dotted(cell.config) for cell in cells]
            keys = [
                key for key, one in settings[0].items() if any(s.get(key) != one for s in settings)
            ]
            for cell, own in zip(cells, settings, strict=True):
                found[cell.name] = " ".join(f"{key}={in_yaml(own.get(key))}" for key in keys)
        return found


def make_plan(combinations: Iterable[tuple[dict[str, Any], str]]) -> Plan:
    """Check every cell, and sort the cells by what is to be done with them.

    Each is given with the reason why it does not apply, if so. Raises `BadInput` when any is wrong.
    """
    cells: dict[str, Cell] = {}
    for config, reason in combinations:
        cells.setdefault(config_hash(config), Cell(config, reason))
    for cell in cells.values():  # before its file is read: what comes after is another's work
        cell.stamp = stamp_of(result_path(cell.config))
    answers = execute.check([(cell.config, cell.not_applicable) for cell in cells.values()])
    plan, digests = Plan(), digests_of_many()
    for cell, answer in zip(cells.values(), answers, strict=True):
        cell.not_applicable, cell.earlier = answer["not_applicable"], answer["earlier"]
        cell.damage = answer["damage"]
        cell.unchecked = answer.get("unchecked")
        if cell.unchecked is not None:
            plan.unchecked.append(cell)
            continue
        cell.work = answer["memory"] * steps_of(cell.config)
        if cell.not_applicable:
            plan.not_applicable.append(cell)
            continue
        cell.state = state_of(cell.earlier, cell.config, code_hash(digests(cell.config)))
        if cell.damage:
            cell.state = "damaged"
        run_it = cell.state in RERUN[cell.config["rerun"]]
        (plan.to_run if run_it else plan.finished).append(cell)
    if cells:
        plan.folder = str(result_path(next(iter(cells.values())).config).parent)
    return plan


def stamp_of(file: Path) -> list[int] | None:
    """What changes when a result is written anew; None when there is none."""
    try:
        stat = file.stat()
    except OSError:
        return None
    return [stat.st_ino, stat.st_size, stat.st_mtime_ns]


def steps_of(config: dict[str, Any]) -> float:
    """Number of time steps; that of a step at the stability limit grows with the resolution."""
    step = config["time_step"]
    return float(config["resolution"] if step == "auto" else config["end_time"] / step)


def state_of(earlier: dict[str, Any] | None, config: dict[str, Any], code: str) -> str:
    """What the file of an earlier run is worth: missing, stale, untimed, failed or fresh.

    A run that was interrupted or crashed counts as missing, one that reached a limit as long as the
    limit was lower.
    """
    if earlier is None or earlier["config_hash"] != config_hash(config):
        return "missing"
    if earlier.get("code_hash") != code:
        return "stale"
    status = earlier["status"]
    if status == "timeout" or status == "out_of_memory":
        before = json.loads(earlier["config"])["limits"]
        now = config["limits"]
        raised = any((now.get(key) or 2**60) > (before[key] or 2**60) for key in before)
        return "missing" if raised else "failed"
    if status not in LASTING:
        return "missing"
    timed = config["timing"] != "exclusive" or timed_enough(earlier["solver_times"], config)
    if status == "ok" and not timed:
        return "untimed"
    return "fresh" if status in execute.SUCCESS else "failed"


def timed_enough(solver_times: list[float], config: dict[str, Any]) -> bool:
    """Whether a run has been timed as often as is wanted, or for long enough."""
    return len(solver_times) >= config.get("repeats", 1) or sum(solver_times) > LONG_ENOUGH


def record_unchecked(plan: Plan) -> list[execute.Record]:
    """Records of the cells at which a check came to no end; a file only where there is none."""
    records = []
    for cell in plan.unchecked:
        assert cell.unchecked is not None
        path, status = result_path(cell.config), cell.unchecked.status
        reason = f"while it was checked: {cell.unchecked.reason}"
        record = execute.Record(path.stem, status, reason, str(path))
        if not path.exists():
            verdict = {"status": status, "reason": reason}
            record = execute.leave_record(cell.config, attributes(cell.config) | verdict)
        records.append(record)
    return records


def record_inapplicable(plan: Plan) -> None:
    """Leave a file for each cell that does not apply, with the reason."""
    for cell in plan.not_applicable:
        verdict = {"status": "not_applicable", "reason": cell.not_applicable}
        if not verdict.items() <= (cell.earlier or {}).items():
            execute.leave_record(cell.config, attributes(cell.config) | verdict)
