"""A process that outlives a command which was killed, and ends what a launcher has started.

A launcher's workers notice by themselves that their command is gone, but not before their first run
has come. This file runs as a program of its own, with a pipe from the command: `DONE` on it means
that all is well; an end without it means that the command is dead, and all processes that carry the
mark in their environment are killed.
"""

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

MARK = "MPMBENCH_COMMAND"  # variable of the environment that a launcher's workers inherit
DONE = b"done"
ROUNDS, PAUSE = 10, 0.1  # it looks so often, with so many seconds between, for processes that start


@contextmanager
def guarded(mark: str) -> Iterator[None]:
    """Within, whatever inherits the environment of this process is killed if this process is."""
    command = [sys.executable, "-P", __file__, mark]
    guard = subprocess.Popen(command, stdin=subprocess.PIPE, start_new_session=True)
    os.environ[MARK] = mark
    try:
        yield
    finally:
        del os.environ[MARK]
        guard.communicate(DONE)


def main(mark: str) -> None:
    """Wait for the command to end."""
    if sys.stdin.buffer.read() == DONE:
        return
    import psutil

    for _ in range(ROUNDS):
        for process in psutil.process_iter():
            try:
                if process.environ().get(MARK) == mark:
                    process.kill()
            except psutil.Error:  # it has just ended, or is another user's
                continue
        time.sleep(PAUSE)


if __name__ == "__main__":
    main(sys.argv[1])
