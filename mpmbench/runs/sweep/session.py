"""One command from its arguments to its exit code: a run or a sweep, its timings, its failures and its report."""

import os
import signal
import time
from contextlib import nullcontext
from pathlib import Path
from typing import Any

from mpmbench.results.identity import result_path
from mpmbench.results.provenance import attributes
from mpmbench.runs.hydra import compose
from mpmbench.runs.process import isolation
from mpmbench.runs.process.exclusive import slot
from mpmbench.runs.process.watchdog import guarded
from mpmbench.runs.sweep import display, execute, launchers, live, reporting
from mpmbench.runs.sweep.ledger import Ledger, follow_owner, opened
from mpmbench.runs.sweep.plan import timed_enough
from mpmbench.settings import resolve
from mpmbench.settings.schema import BadInput

MARK_EVERY = 0.5  # seconds between two marks of how far a run is


def run(flags: list[str], pairs: list[str], started: float) -> int:
    """Run what the arguments say; returns the exit code.

    Parameters
    ----------
    started : float
        When the command began, on the clock of `time.perf_counter`.
    """
    sweeping = compose.sweeping
    parallel = launchers.chosen(pairs) not in launchers.SEQUENTIAL
    with (
        TerminatedLikeInterrupted(),
        opened(launchers.shared_folder(pairs)) as ledger,
        guarded(str(ledger.folder)) if parallel else nullcontext(),
    ):
        view = live.View(ledger)
        sweeping.plan, sweeping.single, sweeping.announce, sweeping.done = (
            None,
            None,
            view.begin,
            ledger.ended,
        )
        interrupted = False
        try:
            launch(flags, pairs, ledger)
            launchers.end_workers(launchers.chosen(pairs))
            view.end()
            repeat_timings(ledger)
        except KeyboardInterrupt:
            interrupted = True
            ledger.say("abandon")
            launchers.end_workers(launchers.chosen(pairs))
            close_open_runs(ledger, "interrupted", execute.INTERRUPTED)
        finally:
            view.end()
        ledger.raise_refusal()
        records, plan = list(ledger.records().values()), sweeping.plan
        stopped = ledger.said("stop")
    if plan is None and records:
        print(display.summary(records[0], time.perf_counter() - started))
    failed = [record for record in records if record.failed]
    if plan is not None:
        failed += plan.failed_before()
        for cell in plan.not_applicable:
            print(f"not applicable: {cell.name}: {cell.not_applicable}")
        if failed:
            print(display.failures(failed))
        if stopped and len(records) < len(plan.to_run):
            print(
                f"{len(plan.to_run) - len(records)} runs were not started, since one failed (on_error=stop)"
            )
    if interrupted:
        raise KeyboardInterrupt
    folder = Path(plan.folder) if plan else Path(records[0].file).parent if records else None
    wanted = plan.wants_report if plan else "report=true" in pairs and bool(records)
    reported = reporting.build(folder, only_when_older=not records) if wanted and folder else True
    return 0 if not failed and reported else 1


def launch(flags: list[str], pairs: list[str], ledger: Ledger) -> None:
    """Let Hydra run everything; what a dying worker of a launcher takes down with it is launched again.

    Which run was to blame is not known, so that only one that was under way at two deaths counts as
    crashed.

    Raises
    ------
    BadInput
        When the launcher does not work at all.
    """
    suspects: set[str] = set()
    while True:
        ended = ledger.ended()
        try:
            return compose.call_hydra(run_case, flags, pairs, ledger.folder)
        except (BadInput, KeyboardInterrupt):
            raise
        except Exception as error:
            if of_interruption(error):
                raise KeyboardInterrupt from None
            if compose.sweeping.plan is None or launchers.chosen(pairs) in launchers.SEQUENTIAL:
                raise
            running = set(ledger.running())
            for name in running - suspects:
                ledger.forget_start(name)
            close_open_runs(
                ledger, "crashed", "the launcher's process that ran it was killed, twice"
            )
            progress = ledger.ended() != ended or running - suspects
            suspects |= running
            if not progress:
                text = " ".join(f"{type(error).__name__}: {error}".split())
                raise BadInput(
                    f"hydra/launcher={launchers.chosen(pairs)} failed: {text}", exit_code=1
                ) from None


def of_interruption(error: BaseException | None) -> bool:
    """Whether it came up while an interruption was on its way: what it left half done may fail to be cleaned up."""
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__context__
    return error is not None


def close_open_runs(ledger: Ledger, status: str, reason: str) -> None:
    """Leave a record for every run of a sweep that has started and not ended, of which nobody else will."""
    plan = compose.sweeping.plan
    open_runs = ledger.running()
    for cell in plan.to_run if plan else []:
        if cell.name not in open_runs or cell.name in ledger.records():
            continue
        since = (ledger.folder / f"{cell.name}.running").stat().st_mtime
        file = result_path(cell.config)
        if (
            file.exists() and file.stat().st_mtime > since
        ):  # it was killed between its result and its record
            continue
        known = attributes(cell.config) | {"status": status, "reason": reason}
        with execute.uninterrupted():
            ledger.note(execute.leave_record(cell.config, known, time.perf_counter()))


def repeat_timings(ledger: Ledger) -> None:
    """Run again, one at a time and in turn, what is timed with ``timing=exclusive``, until it has been often enough."""
    plan = compose.sweeping.plan
    single = [compose.sweeping.single] if compose.sweeping.single else []
    configs = [cell.config for cell in plan.to_run] if plan else single
    most = max(
        (2 * config["repeats"] for config in configs), default=0
    )  # others may come in between
    for _ in range(most):
        records = ledger.records()
        due = [
            (config, record)
            for config in configs
            if (record := records.get(result_path(config).stem)) is not None
            and config["timing"] == "exclusive"
            and record.status == "ok"
            and not record.unwritten
            and not timed_enough(record.solver_times, config)
        ]
        if not due:
            return
        if plan:
            done = min(len(record.solver_times) for _, record in due)
            print(f"timing {len(due)} runs in turn, round {done + 1}", flush=True)
        for config, record in due:
            again = execute.run(config, alone=True, solver_times=record.solver_times)
            again.seconds = record.seconds
            ledger.note(again)


def run_case(config: Any) -> None:
    """Hydra's task: run one composed configuration and leave a record of it, or of what is wrong with it."""
    from hydra.core.hydra_config import HydraConfig

    hydra: Any = HydraConfig.get()
    ledger = Ledger(Path(hydra.sweep.dir))
    try:
        run_composed(config, hydra, ledger)
    except BadInput as error:  # Hydra would print a line of its own about an exception
        ledger.refuse(error)


def run_composed(config: Any, hydra: Any, ledger: Ledger) -> None:
    """As `run_case`; raises `BadInput`."""
    single = hydra.mode is None or hydra.mode.name == "RUN"
    sequential = single or launchers.name_of(hydra) in launchers.SEQUENTIAL
    if not sequential:
        follow_owner(ledger, isolation.processes.close)
    if ledger.said("stop") or ledger.said("abandon"):
        return
    resolved, reason = resolve.resolve(config, hydra)
    if single:
        compose.sweeping.single = resolved
        answer = execute.check([(resolved, reason)])[0]
        if answer["not_applicable"]:
            raise BadInput(f"this combination does not apply: {answer['not_applicable']}")
    name = result_path(resolved).stem
    marked = time.monotonic()

    def mark(fraction: float, simulation_time: float) -> None:
        nonlocal marked
        if progress is not None:
            progress(fraction, simulation_time)
        if time.monotonic() - marked > MARK_EVERY:
            marked = time.monotonic()
            ledger.started(name, fraction)

    crowded = launchers.name_of(hydra) == "submitit_local" and not single
    place = (
        slot(ledger.folder, max(1, (os.cpu_count() or 1) // resolved["threads"]))
        if crowded
        else nullcontext()
    )
    alone = sequential and resolved["timing"] == "exclusive"
    with place, display.progress_bar(name, shown=single) as progress:
        record = execute.run(resolved, mark, alone, on_start=lambda: ledger.started(name))
    ledger.note(record)
    if record.failed and resolved["on_error"] == "stop":
        ledger.say("stop")


class TerminatedLikeInterrupted:
    """While active, a request to terminate ends the running case as Ctrl-C does, with its record."""

    def __enter__(self) -> None:
        def interrupt(number: int, frame: Any) -> None:
            raise KeyboardInterrupt

        self.before = signal.signal(signal.SIGTERM, interrupt)

    def __exit__(self, *error: object) -> None:
        signal.signal(signal.SIGTERM, self.before)
