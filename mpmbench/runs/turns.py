"""Whose turn it is on this machine: runs that are timed wait until no other run of this user is under way.

Two locked files: a run holds the first while it waits, so that an exclusive one is not overtaken for ever, and the
second while it computes, shared or alone. The system releases them when a process dies.
"""

import fcntl
import os
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import IO

PATIENCE = 2.0  # seconds of waiting before it is said


@contextmanager
def turn(alone: bool) -> Iterator[None]:
    """Wait until the machine is free: of all other runs when `alone`, else of runs that are."""
    folder = Path(tempfile.gettempdir(), f"mpmbench-{os.getuid()}")
    folder.mkdir(exist_ok=True)
    with open(folder / "waiting", "w") as gate, open(folder / "computing", "w") as machine:
        announcement = threading.Timer(PATIENCE, _say)
        announcement.start()
        try:
            fcntl.flock(gate, fcntl.LOCK_EX)
            fcntl.flock(machine, fcntl.LOCK_EX if alone else fcntl.LOCK_SH)
            fcntl.flock(gate, fcntl.LOCK_UN)
        finally:
            announcement.cancel()
        yield


@contextmanager
def slot(folder: Path, number: int) -> Iterator[None]:
    """Wait until fewer than `number` processes hold a slot in `folder`: for a launcher that starts all jobs at once."""
    with ExitStack() as stack:
        files = [stack.enter_context(open(folder / f"slot{k}", "w")) for k in range(number)]
        while not any(_locked(file) for file in files):
            time.sleep(0.05)
        yield


def _locked(file: IO[str]) -> bool:
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        return True
    except BlockingIOError:
        return False


def _say() -> None:
    print("waiting for other runs of mpmbench on this machine (timing=exclusive)", file=sys.stderr, flush=True)
