"""Whose turn it is on this machine: runs that are timed wait until no other is under way.

Two locked files: a run holds the first while it waits, so that an exclusive one is not overtaken
for ever, and the second while it computes, shared or alone. The system releases them when a process
dies. A run that is not timed waits for a while only, since the other may have been suspended; it
then leaves a mark, and that timing does not count.
"""

import fcntl
import os
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from functools import cache
from pathlib import Path
from typing import IO

from mpmbench.results.private import private_folder
from mpmbench.runs.process.locks import LocksRefused, locked, say_refused
from mpmbench.say import say
from mpmbench.settings.schema import BadInput

SAY_AFTER = 2.0  # seconds of waiting before it is said
WAIT_FOR_TIMED = 60.0  # seconds that a run which is not timed waits
LOOK_EVERY = 0.02  # seconds


def folder() -> Path:
    """Where the locks are: for each user of each machine.

    Raises
    ------
    BadInput
        When another user has taken this place; who owns the locks decides whose turn it is.
    """
    temporary = tempfile.gettempdir()
    runtime = Path(os.environ.get("XDG_RUNTIME_DIR") or temporary)
    place = (runtime if runtime.is_dir() else Path(temporary)) / f"mpmbench-{os.getuid()}"
    try:
        return private_folder(place)
    except PermissionError as error:
        what = f"the locks by which runs take turns cannot lie in {place}"
        why = f"it {str(error.strerror).lower()}"
        raise BadInput(f"{what}: {why}; name another folder in XDG_RUNTIME_DIR") from None


@contextmanager
def turn(alone: bool) -> Iterator[float]:
    """Wait until the machine is free: of all other runs when `alone`, else of runs that are.

    Yields when it came, for `undisturbed_since`.
    """
    place = folder()
    began = time.monotonic()
    patience = float("inf") if alone else WAIT_FOR_TIMED
    with open(place / "waiting", "a") as gate, open(place / "computing", "a") as machine:
        try:
            wait_for(gate, fcntl.LOCK_EX, began, patience)
            if not wait_for(machine, fcntl.LOCK_EX if alone else fcntl.LOCK_SH, began, patience):
                (place / "intruded").touch()
            fcntl.flock(gate, fcntl.LOCK_UN)
            turn_came = time.time()
        except LocksRefused:
            say_refused(place, "runs do not wait for one another, and no timing counts")
            (place / "intruded").touch()
            turn_came = 0.0  # before any mark
        yield turn_came


def undisturbed_since(started: float) -> bool:
    """Whether no other run has come in since the turn of a run that is alone began."""
    mark = folder() / "intruded"
    return not mark.exists() or mark.stat().st_mtime < started


def wait_for(file: IO[str], kind: int, began: float, patience: float) -> bool:
    """Lock a file; says so, once, when that takes long, and gives up in the end."""
    while not locked(file, kind):
        waited = time.monotonic() - began
        if waited > patience:
            return False
        if waited > SAY_AFTER:
            say_why()
        time.sleep(LOOK_EVERY)
    return True


@cache
def say_why() -> None:
    """Say, once in the life of this process, what it waits for."""
    text = "waiting for other runs of mpmbench on this machine (timing=exclusive)"
    say(text, error=True)


@contextmanager
def slot(place: Path, number: int) -> Iterator[None]:
    """Wait until fewer than `number` processes hold a slot in a folder."""
    with ExitStack() as stack:
        files = [stack.enter_context((place / f"slot{k}").open("w")) for k in range(number)]
        try:
            while not any(locked(file) for file in files):
                time.sleep(LOOK_EVERY)
        except LocksRefused:
            say_refused(place, "all runs start at once")
        yield
