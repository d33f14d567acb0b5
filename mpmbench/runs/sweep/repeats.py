"""Repeats of runs that are timed with ``timing=exclusive``."""

from collections.abc import Callable, Sequence
from typing import Any

from mpmbench.results.identity import result_path
from mpmbench.runs.sweep import execute
from mpmbench.runs.sweep.execute import Record
from mpmbench.runs.sweep.plan import timed_enough


def repeat_timings(
    configs: Sequence[dict[str, Any]],
    records: dict[str, Record],
    on_round: Callable[[int, int], None] = lambda due, number: None,
    on_record: Callable[[Record], None] = lambda record: None,
) -> None:
    """Run again, in turn, what is timed exclusively, until it has been often enough.

    Parameters
    ----------
    configs : sequence of dict
        What has been run.
    records : dict
        Records by the names of the runs; those of repeated ones are replaced.
    on_round : callable
        Called before each round with the number of runs that are due, and that of the round.
    on_record : callable
        Called with each new record.
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
        on_round(len(due), min(len(record.solver_times) for _, record in due) + 1)
        for config, record in due:
            again = execute.run(config, alone=True, solver_times=record.solver_times)
            again.seconds = record.seconds
            records[again.name] = again
            on_record(again)
