"""One run from its arguments to its exit code."""

import time
from collections.abc import Sequence
from pathlib import Path

from mpmbench.results.identity import result_path
from mpmbench.runs.sweep import display, execute, reporting
from mpmbench.runs.sweep.interrupts import terminated_like_interrupted
from mpmbench.runs.sweep.repeats import repeat_timings
from mpmbench.settings.schema import BadInput


def run(pairs: Sequence[str], started: float) -> int:
    """Run what the arguments say, whether it has been run before or not; returns the exit code.

    Parameters
    ----------
    started : float
        When the command began, on the clock of `time.perf_counter`.

    Raises
    ------
    BadInput
        When the arguments are wrong, or do not go together.
    """
    ((config, reason),) = execute.applying([pairs])
    if reason:
        raise BadInput(f"this combination does not apply: {reason}")
    name = result_path(config).stem
    with terminated_like_interrupted(), display.progress_bar(name) as progress:
        alone = config["timing"] == "exclusive"
        records = {name: execute.run(config, progress, alone)}
        repeat_timings([config], records)
    record = records[name]
    print(display.summary(record, time.perf_counter() - started))
    reported = reporting.build(Path(record.file).parent) if config["report"] else True
    return 0 if reported and not record.failed else 1
