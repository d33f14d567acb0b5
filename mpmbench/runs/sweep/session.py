"""A sweep from its arguments to its exit code: plan, runs, timings, failures, report."""

import os
import time
from collections.abc import Sequence
from contextlib import nullcontext
from functools import partial
from pathlib import Path
from typing import Any

from mpmbench.results.identity import result_path
from mpmbench.results.provenance import attributes
from mpmbench.runs.hydra import compose
from mpmbench.runs.hydra.launch import launch
from mpmbench.runs.process import environment, isolation
from mpmbench.runs.process.exclusive import slot
from mpmbench.runs.process.watchdog import guarded
from mpmbench.runs.sweep import display, execute, launchers, live, reporting
from mpmbench.runs.sweep.execute import Record
from mpmbench.runs.sweep.interrupts import terminated_like_interrupted, uninterrupted
from mpmbench.runs.sweep.ledger import Ledger, follow_owner, opened
from mpmbench.runs.sweep.plan import Plan, make_plan, record_inapplicable
from mpmbench.runs.sweep.repeats import repeat_timings
from mpmbench.settings.schema import BadInput

MARK_EVERY = 0.5  # seconds between two marks of how far a run is


class Session:
    """One sweep.

    Parameters
    ----------
    pairs : sequence of str
        The ``key=value`` of the command line.

    Attributes
    ----------
    plan : Plan
        What there was to do, once `run` has begun.
    """

    def __init__(self, pairs: Sequence[str]) -> None:
        self.pairs = list(pairs)
        self.launcher = launchers.chosen(self.pairs)
        self.plan = Plan()

    @property
    def parallel(self) -> bool:
        """Whether a launcher runs the cells."""
        return self.launcher not in launchers.SEQUENTIAL

    def run(self) -> int:
        """Run what is missing; returns the exit code.

        Raises
        ------
        BadInput
            When any cell is wrong; nothing has run then.
        KeyboardInterrupt
            After the runs under way have been recorded.
        """
        interrupted = False
        with (
            terminated_like_interrupted(),
            opened(launchers.shared_folder(self.pairs)) as ledger,
            guarded(str(ledger.folder)) if self.parallel else nullcontext(),
        ):
            view = live.View(ledger)
            try:
                self.plan = make_plan(compose.compose_sweep(self.pairs))
                launchers.check(self.launcher, self.plan)
                view.begin(self.plan)
                record_inapplicable(self.plan)
                self.run_cells(ledger)
                view.end()
                self.repeat_timings(ledger)
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
        if self.plan.wants_report:
            good = reporting.build(Path(self.plan.folder), only_when_older=not records) and good
        return 0 if good else 1

    def run_cells(self, ledger: Ledger) -> None:
        """Run what is to be run, here one after the other or under the launcher."""
        if self.parallel and self.plan.to_run:
            environment.make_known(os.environ)
            launchers.warm_up(self.plan)
            for cell in self.plan.to_run:
                ledger.keep_config(cell.name, cell.config)
            self.launch(ledger)
            launchers.end_workers(self.launcher)
            return
        for cell in self.plan.to_run:
            if ledger.may_start():
                run_cell(ledger, cell.config, alone=cell.config["timing"] == "exclusive")

    def launch(self, ledger: Ledger) -> None:
        """Let the launcher run the cells; what a dying worker takes down with it is launched again.

        Which run was to blame is not known, so that only one that was under way at two deaths
        counts as crashed.

        Raises
        ------
        BadInput
            When the launcher does not work at all.
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

    def repeat_timings(self, ledger: Ledger) -> None:
        """Time again what is timed exclusively, and say so."""

        def announce(due: int, number: int) -> None:
            print(f"timing {due} runs in turn, round {number}", flush=True)

        configs = [cell.config for cell in self.plan.to_run]
        repeat_timings(configs, ledger.records(), announce, ledger.note)

    def conclude(self, records: list[Record], interrupted: bool) -> bool:
        """Say what failed and what was left out; whether nothing failed."""
        failed = [record for record in records if record.failed] + self.plan.failed_before()
        for cell in self.plan.not_applicable:
            print(f"not applicable: {cell.name}: {cell.not_applicable}")
        if failed:
            print(display.failures(failed))
        left = len(self.plan.to_run) - len(records)
        if left and not interrupted:
            print(f"{left} runs were not started, since one failed (on_error=stop)")
        return not failed


def run_job(folder: Path, launcher: str, name: str) -> None:
    """In a process of a launcher: run the cell of this name."""
    ledger = Ledger(folder)
    follow_owner(ledger, isolation.processes.close)
    if not ledger.may_start():
        return
    config = ledger.config(name)
    processors = os.cpu_count() or 1
    crowded = launcher == "submitit_local"  # it starts all jobs at once
    place = slot(folder, max(1, processors // config["threads"])) if crowded else nullcontext()
    with place:
        run_cell(ledger, config)


def run_cell(ledger: Ledger, config: dict[str, Any], alone: bool = False) -> None:
    """Run one cell, with marks of how far it is, and leave its record."""
    name = result_path(config).stem
    marked = time.monotonic()

    def mark(fraction: float, simulation_time: float) -> None:
        nonlocal marked
        if time.monotonic() - marked > MARK_EVERY:
            marked = time.monotonic()
            ledger.started(name, fraction)

    record = execute.run(config, mark, alone, on_start=lambda: ledger.started(name))
    ledger.note(record)
    if record.failed and config["on_error"] == "stop":
        ledger.request_stop()
