"""One run, or a sweep, from arguments to exit code: plan, runs, timings, failures, report."""

import os
import time
from collections import deque
from collections.abc import Sequence
from contextlib import nullcontext
from functools import partial
from pathlib import Path
from typing import Any

from mpmbench.results.identity import result_path
from mpmbench.results.provenance import attributes
from mpmbench.runs.hydra import compose
from mpmbench.runs.hydra.launch import launch
from mpmbench.runs.interrupts import terminated_like_interrupted, uninterrupted
from mpmbench.runs.process import environment, isolation
from mpmbench.runs.process.exclusive import slot
from mpmbench.runs.process.watchdog import guarded
from mpmbench.runs.streams import forgiving
from mpmbench.runs.sweep import display, execute, launchers, live, reporting
from mpmbench.runs.sweep.claims import claimed, record_of, remove_leftovers, run_once
from mpmbench.runs.sweep.execute import Record
from mpmbench.runs.sweep.ledger import Ledger, follow_owner, opened
from mpmbench.runs.sweep.plan import (
    Plan,
    make_plan,
    record_inapplicable,
    record_unchecked,
    stamp_of,
    timed_enough,
)
from mpmbench.say import BELOW, in_lines, say
from mpmbench.settings.arguments import value_of
from mpmbench.settings.schema import BadInput

MARK_EVERY = 0.5  # seconds between two marks of how far a run is


def run_one(pairs: Sequence[str], started: float) -> int:
    """Run what the arguments say, whether it has been run before or not; returns the exit code.

    `started` is when the command began, on the clock of `time.perf_counter`. Raises `BadInput` when
    the arguments are wrong, or do not go together.
    """
    ((config, reason),) = execute.applying([pairs])
    if reason:
        raise BadInput(f"this combination does not apply: {reason}")
    target = result_path(config)
    with (
        forgiving(),
        terminated_like_interrupted(),
        display.progress_bar(target.stem) as progress,
    ):
        alone = config["timing"] == "exclusive"
        record = run_once(config, stamp_of(target), progress, alone)
        assert record is not None
        records = {record.name: record}
        repeat_timings([config], records)
    record = records[record.name]
    say(*display.summary(record, time.perf_counter() - started).splitlines())
    asked = reporting.is_wanted(config, sweep=False)
    reported = reporting.build(Path(record.file).parent) if asked else True
    return 0 if reported and not record.failed else 1


class Session:
    """One sweep, from the ``key=value`` of a command line; its `plan` is made when it runs."""

    def __init__(self, pairs: Sequence[str]) -> None:
        self.pairs = list(pairs)
        self.launcher = value_of("hydra/launcher", self.pairs)
        self.plan = Plan()

    @property
    def parallel(self) -> bool:
        """Whether a launcher runs the cells."""
        return self.launcher not in launchers.SEQUENTIAL

    def run(self) -> int:
        """Run what is missing; returns the exit code.

        Raises `BadInput` when any cell is wrong, before anything has run, and `KeyboardInterrupt`
        after the runs under way have been recorded.
        """
        interrupted = False
        with (
            forgiving(),
            terminated_like_interrupted(),
            opened(launchers.shared_folder(self.launcher, self.pairs)) as ledger,
            guarded(str(ledger.folder)) if self.parallel else nullcontext(),
        ):
            view = live.View(ledger)
            try:
                self.plan = make_plan(compose.compose_sweep(self.pairs))
                launchers.check(self.launcher, self.plan)
                view.begin(self.plan)
                if self.plan.folder:
                    remove_leftovers(Path(self.plan.folder))
                record_inapplicable(self.plan)
                for record in record_unchecked(self.plan):
                    ledger.note(record)
                self.run_cells(ledger)
                view.end()
                configs = [cell.config for cell in self.plan.to_run]
                repeat_timings(configs, ledger.records(), ledger)
            except KeyboardInterrupt:
                interrupted = True
                ledger.abandon()
                launchers.end_workers(self.launcher)
                self.close_open_runs(ledger, "interrupted", execute.INTERRUPTED)
            finally:
                view.end()
            records = list(ledger.records().values())
        good = self.conclude(records, interrupted)
        if interrupted:
            raise KeyboardInterrupt
        if any(reporting.is_wanted(cell.config, sweep=True) for cell in self.plan.cells()):
            good = reporting.build(Path(self.plan.folder), only_when_older=not records) and good
        return 0 if good else 1

    def run_cells(self, ledger: Ledger) -> None:
        """Run what is to be run, here one after the other or under the launcher."""
        if self.parallel and self.plan.to_run:
            environment.make_known(os.environ)
            launchers.warm_up(self.plan)
            for cell in self.plan.to_run:
                ledger.keep_config(cell.name, cell.config, cell.stamp)
            with environment.importing_nothing_from_here():
                self.launch(ledger)
            launchers.end_workers(self.launcher)
            return
        left, skipped = deque(self.plan.to_run), 0
        while left and ledger.may_start():
            cell = left.popleft()
            alone = cell.config["timing"] == "exclusive"
            if run_cell(ledger, cell.config, cell.stamp, alone, wait=skipped > len(left)):
                skipped = 0
            else:  # another process is doing it
                left.append(cell)
                skipped += 1

    def launch(self, ledger: Ledger) -> None:
        """Let the launcher run the cells; what a dying worker takes down with it is launched again.

        Which run was to blame is not known, so that only one that was under way at two deaths
        counts as crashed. Raises `BadInput` when the launcher does not work at all.
        """
        suspects: set[str] = set()
        run_it = partial(run_job, ledger.folder, self.launcher)
        while True:
            ended = ledger.ended()
            left = [cell.name for cell in self.plan.to_run if cell.name not in ended]
            if not left or not ledger.may_start():
                return
            try:
                workers = launchers.workers_for(self.plan)
                return launch(self.pairs, run_it, left, ledger.folder, workers)
            except (BadInput, KeyboardInterrupt):
                raise
            except Exception as error:
                running = set(ledger.running())
                for name in running - suspects:
                    ledger.forget_start(name)
                reason = "the launcher's process that ran it was killed, twice"
                self.close_open_runs(ledger, "crashed", reason)
                progress = ledger.ended() != ended or running - suspects
                suspects |= running
                if not progress:
                    text = " ".join(f"{type(error).__name__}: {error}".split())
                    sentence = f"hydra/launcher={self.launcher} failed: {text}"
                    raise BadInput(sentence, exit_code=1) from None

    def close_open_runs(self, ledger: Ledger, status: str, reason: str) -> None:
        """Leave a record for every run that has started, and that nobody else will end."""
        open_runs = ledger.running()
        for cell in self.plan.to_run:
            if cell.name not in open_runs or cell.name in ledger.records():
                continue
            since = (ledger.folder / f"{cell.name}.running").stat().st_mtime
            file = result_path(cell.config)
            if file.exists() and file.stat().st_mtime > since:
                continue  # it was killed between its result and its record
            known = attributes(cell.config) | {"status": status, "reason": reason}
            with uninterrupted():
                ledger.note(execute.leave_record(cell.config, known, time.perf_counter()))

    def conclude(self, records: list[Record], interrupted: bool) -> bool:
        """Say what failed and what was left out; whether nothing failed."""
        failed = [record for record in records if record.failed] + self.plan.failed_before()
        for cell in self.plan.not_applicable:
            say(*in_lines(f"not applicable: {cell.name}: {cell.not_applicable}", BELOW))
        if failed:
            say(*display.failures(failed).splitlines())
        left = len(self.plan.to_run) + len(self.plan.unchecked) - len(records)
        if left and not interrupted:
            say(f"{left} runs were not started, since one failed (on_error=stop)")
        return not failed


def run_job(folder: Path, launcher: str, name: str) -> None:
    """In a process of a launcher: run the cell of this name."""
    ledger = Ledger(folder)
    follow_owner(ledger, isolation.processes.close)
    if not ledger.may_start():
        return
    config, stamp = ledger.config(name)
    side_by_side = max(1, (os.cpu_count() or 1) // config["threads"])
    crowded = launcher == "submitit_local"  # it starts all jobs at once
    with slot(folder, side_by_side) if crowded else nullcontext():
        run_cell(ledger, config, stamp)


def run_cell(
    ledger: Ledger, config: dict[str, Any], stamp: Any, alone: bool = False, wait: bool = True
) -> bool:
    """Run one cell, with marks of how far it is, and leave its record.

    False when another process is doing it, and is not to be waited for.
    """
    name = result_path(config).stem
    marked = time.monotonic()

    def mark(fraction: float, simulation_time: float) -> None:
        nonlocal marked
        if time.monotonic() - marked > MARK_EVERY:
            marked = time.monotonic()
            ledger.started(name, fraction)

    begin = partial(ledger.started, name)
    record = run_once(config, stamp, mark, alone, on_start=begin, wait=wait)
    if record is None:
        return False
    ledger.note(record)
    if record.failed and config["on_error"] == "stop":
        ledger.request_stop()
    return True


def repeat_timings(
    configs: Sequence[dict[str, Any]], records: dict[str, Record], ledger: Ledger | None = None
) -> None:
    """Run again, in turn, what is timed exclusively, until it has been often enough.

    A new record replaces the one of its name. In a sweep, which has a ledger, each round is
    announced and each record noted. Each round has a process of its own, so that rounds are
    independent of one another as far as they can be.
    """
    timed = [config for config in configs if config["timing"] == "exclusive"]
    # others may come in between, and that timing does not count
    for _ in range(max((2 * config["repeats"] for config in timed), default=0)):
        due = [
            (config, record)
            for config in timed
            if (record := records.get(result_path(config).stem)) is not None
            and record.status == "ok"
            and not record.unwritten
            and not timed_enough(record.solver_times, config)
        ]
        if not due:
            return
        number = min(len(record.solver_times) for _, record in due) + 1
        if ledger is not None:
            say(f"timing {len(due)} runs in turn, round {number}")
        # what its place in memory does to a process is drawn anew
        isolation.processes.renew()
        for config, record in due:
            with claimed(result_path(config)):
                known = record_of(config)  # another process may have timed it too
                if known is None or len(known.solver_times) <= len(record.solver_times):
                    known = record
                again = known
                if not timed_enough(known.solver_times, config):
                    again = execute.run(config, alone=True, earlier=known.timings)
            again.seconds = record.seconds
            records[again.name] = again
            if ledger is not None:
                ledger.note(again)
