"""What the user sees of runs: a summary, lines, a table of failures, a progress bar."""

import math
import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from mpmbench.results.differences import differences, sentences, settings_of
from mpmbench.results.quantities import ZERO_FIELD, of_interest, own
from mpmbench.runs.sweep.execute import Record
from mpmbench.runs.sweep.plan import Plan
from mpmbench.say import BELOW, in_lines, one_line, with_reason
from mpmbench.settings.files import here

SHOW_PROGRESS_AFTER = 1.5  # seconds
ERRORS = ("displacement", "velocity", "stress")


def summary(record: Record, total_seconds: float) -> str:
    """A few lines about a single run."""
    scalars = record.scalars
    reason = one_line(record.reason)
    lines = in_lines(f"{record.name}: {record.outcome}" + (f", {reason}" if reason else ""), BELOW)
    for name in ERRORS:
        text = _quantity(scalars, f"error_{name}_rms")
        if text:
            relative, _ = scalars.get(f"error_{name}_relative", (0.0, ""))
            text += of_the_field(relative)
            lines.append(f"  {name} error".ljust(28) + text)
    asked = [(name.replace("_", " "), name) for name in own(scalars)]
    more = (("energy drift", "energy_drift"), ("steps", "steps"), ("time reached", "time_reached"))
    for label, name in (*asked, *more):
        text = _quantity(scalars, name)
        if text and not (name == "time_reached" and record.status == "ok"):
            lines.append(f"  {label} ".ljust(28) + text)
    times = (("solver", "solver_time"), ("compiling", "compile_time"))
    spent = [f"{word} {scalars[name][0]:.3g} s" for word, name in times if name in scalars]
    lines.append("  seconds".ljust(28) + ", ".join([*spent, f"total {total_seconds:.3g} s"]))
    lines.append("  result".ljust(28) + (one_line(record.unwritten) or shorten(record.file)))
    if record.has_traceback and not record.unwritten:
        lines.append("  traceback".ljust(28) + traceback_of(record))
    return "\n".join(lines)


def of_the_field(relative: float) -> str:
    """An error relative to the exact field; where that is zero up to round-off, only this is said."""
    if not relative:
        return ""
    zero = not relative < ZERO_FIELD
    return "  (the exact field is zero)" if zero else f"  ({relative:.3g} of the field)"


def line(record: Record, number: int, total: int, settings: str = "") -> str:
    """One line about a run of a sweep with its displacement error, or below it why it has none.

    `settings` are those that tell it from runs of the same name.
    """
    width = len(str(total))
    error = first_number(record)
    start = (
        f"[{number:{width}}/{total}] {record.outcome:<2}  {record.name:<42} {record.seconds:6.3g} s"
    )
    said = ": ".join(filter(None, (settings, record.unwritten or record.reason or error)))
    return "\n".join(with_reason(start, said))


def first_number(record: Record) -> str:
    """The displacement error, or where the problem knows none its first quantity of interest."""
    for name in ("error_displacement_rms", *of_interest(record.scalars)):
        value, unit = record.scalars.get(name, (math.nan, ""))
        if not math.isnan(value):
            words = "" if name.startswith("error_displacement") else f"{name.replace('_', ' ')} "
            return f"{words}{value:.3g} {unit if unit != '1' else ''}".rstrip()
    return ""


def failures(records: list[Record]) -> str:
    """A table of the runs that failed, with their reasons."""
    rows = [f"{len(records)} of the runs failed:" if len(records) > 1 else "One run failed:"]
    for record in records:
        reason = "; ".join(part for part in (record.reason, record.unwritten) if part)
        rows += with_reason(f"  {record.outcome:<13} {record.name}", reason)
    traced = [record for record in records if record.has_traceback and not record.unwritten]
    if traced:
        rows.append(f"where each was raised is in its file: {traceback_of(traced[0])}, for example")
    return "\n".join(rows)


def traceback_of(record: Record) -> str:
    """The command that prints the traceback of a run that crashed."""
    return f"`python -m mpmbench status {shorten(record.file)}`"


def plan_line(plan: Plan) -> str:
    """What a sweep is going to do."""
    parts = [f"{len(plan.to_run)} to run"]
    if plan.finished:
        parts.append(f"{len(plan.finished)} finished before")
    if plan.not_applicable:
        parts.append(f"{len(plan.not_applicable)} not applicable")
    return f"{len(plan.cells())} runs: {', '.join(parts)}; results in {shorten(plan.folder)}"


def comparison(plan: Plan) -> str:
    """In what the methods of a sweep differ besides its axes, and what would make them equal."""
    runs = [settings_of(cell.config) for cell in (*plan.to_run, *plan.finished)]
    found = sentences(differences(runs), {})
    if not found:
        return ""
    lines = [line for one in found for line in in_lines(one, "    ", "  ")]
    return "\n".join(["Curves will differ in more than what is swept:", *lines])


def shorten(path: str) -> str:
    """A path relative to here when it lies below."""
    try:
        return str(Path(path).relative_to(here()))
    except ValueError:
        return path


def on_terminal() -> bool:
    """Whether somebody is looking at a terminal that can do more than print lines."""
    return sys.stdout.isatty() and os.environ.get("TERM") != "dumb"


@contextmanager
def progress_bar(name: str, shown: bool = True) -> Iterator[Callable[[float, float], None] | None]:
    """A function that draws a bar after a while, or None when nobody is looking."""
    if not shown or not on_terminal():
        yield None
        return
    started = time.monotonic()
    bar: Any = None
    task: Any = None

    def show(fraction: float, simulation_time: float) -> None:
        nonlocal bar, task
        if bar is None and time.monotonic() - started > SHOW_PROGRESS_AFTER:
            from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

            columns = (
                TextColumn("{task.description}"),
                BarColumn(),
                TextColumn("t = {task.fields[reached]:.4g} s"),
            )
            bar = Progress(*columns, TimeRemainingColumn(), transient=True)
            bar.start()
            task = bar.add_task(name, total=1.0, reached=0.0)
        if bar is not None:
            bar.update(task, completed=fraction, reached=simulation_time)

    try:
        yield show
    finally:
        if bar is not None:
            bar.stop()


def _quantity(scalars: dict[str, Any], name: str) -> str:
    value, units = scalars.get(name, (math.nan, ""))
    if math.isnan(value):
        return ""
    return f"{value:.6g}" + (f" {units}" if units not in ("1", "") else "")
