"""Which process does a run, where several want the same one: a locked file beside its result.

The system releases a lock when its holder dies, on network disks too. Where there are no locks, a
run may be done twice: its file is whole all the same.
"""

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, Any

from mpmbench.results.identity import code_digests, code_hash, result_path
from mpmbench.results.timings import UNITS
from mpmbench.runs.process import isolation
from mpmbench.runs.process.locks import LocksRefused, locked, say_refused
from mpmbench.runs.sweep import execute
from mpmbench.runs.sweep.plan import stamp_of, state_of
from mpmbench.say import say

LOOK_EVERY = 0.05  # seconds
SAY_AFTER = 2.0  # seconds of waiting before it is said
TWICE = "processes that want the same runs may each do them"


def run_once(
    config: dict[str, Any], stamp: Any, *options: Any, wait: bool = True, **more: Any
) -> execute.Record | None:
    """As `execute.run`, unless another process has done the run since its file had the `stamp`.

    None when another process is doing it, and nobody wants to `wait`.
    """
    with claimed(result_path(config), wait) as ours:
        if not ours:
            return None
        changed = stamp_of(result_path(config)) not in (None, stamp)
        done = record_of(config) if changed else None
        return done or execute.run(config, *options, **more)


def record_of(config: dict[str, Any]) -> execute.Record | None:
    """Record of the result that there is of a run; None when it would have to be run again."""
    target = result_path(config)
    try:
        request = ("read", str(target))
        found = isolation.processes.ask(*request, limits=execute.limits_of(config))
    except isolation.Ended:
        return None
    if found is None:
        return None
    attributes, scalars = found
    code = code_hash(code_digests(config))
    if state_of(attributes, config, code) in ("missing", "stale"):
        return None
    timings = {name: attributes[name] for name in UNITS if attributes["solver_times"]}
    how = (attributes["status"], attributes["reason"])
    traced = "traceback" in attributes
    return execute.Record(
        target.stem, *how, str(target), scalars, timings=timings, has_traceback=traced
    )


def mark_of(target: Path) -> Path:
    """The file that is locked while a run is done that leaves `target`."""
    return target.with_name(f".{target.stem}.lock")


@contextmanager
def claimed(target: Path, wait: bool = True) -> Iterator[bool]:
    """Within, no other process does the run that leaves `target`; False when one does.

    With `wait`, it is waited for.
    """
    mark = mark_of(target)
    file, began, said = take(mark), time.monotonic(), False
    while file is None and wait:
        if not said and time.monotonic() - began > SAY_AFTER:
            said = True
            say(f"waiting for another process that does {target.stem}", error=True)
        time.sleep(LOOK_EVERY)
        file = take(mark)
    try:
        yield file is not None
    finally:
        if file is not None:
            release(mark, file)


def take(mark: Path) -> IO[str] | None:
    """The locked file, or None when another process has it.

    Where nothing can be written or locked this is an unlocked one.
    """
    try:
        mark.parent.mkdir(parents=True, exist_ok=True)
        file = mark.open("a")
    except OSError:  # which the run itself will say
        return Path(os.devnull).open("a")
    try:
        if locked(file) and is_the_same(file, mark):
            return file
    except LocksRefused:
        say_refused(mark.parent, TWICE)
        return file
    file.close()
    return None


def is_the_same(file: IO[str], mark: Path) -> bool:
    """Whether an open file is still the one of this name: its holder removes it at the end."""
    try:
        return os.path.samestat(os.fstat(file.fileno()), mark.stat())
    except FileNotFoundError:
        return False


def release(mark: Path, file: IO[str]) -> None:
    """Remove the file, then its lock."""
    if file.name != os.devnull:
        with suppress(OSError):
            mark.unlink()
    file.close()


def remove_leftovers(folder: Path) -> None:
    """Remove what processes have left that were killed."""
    for mark in folder.glob(".*.lock"):
        file = take(mark)
        if file is not None:
            release(mark, file)
