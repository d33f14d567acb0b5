"""Locks on files, which the system releases when a process dies; some network disks have none."""

import errno
import fcntl
from functools import cache
from pathlib import Path
from typing import IO

from mpmbench.say import say

REFUSALS = (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP, errno.ENOTSUP, errno.EINVAL)


class LocksRefused(Exception):
    """The system, or the disk, has no locks."""


def locked(file: IO[str], kind: int = fcntl.LOCK_EX) -> bool:
    """Whether a file could be locked at once; raises `LocksRefused` where none ever can."""
    try:
        fcntl.flock(file, kind | fcntl.LOCK_NB)
        return True
    except BlockingIOError:
        return False
    except OSError as error:
        if error.errno in REFUSALS:
            raise LocksRefused from None
        raise


@cache
def say_refused(folder: Path, consequence: str) -> None:
    """Say, once in the life of this process, that files in a folder cannot be locked."""
    say(f"mpmbench: {folder} has no locks for files: {consequence}", error=True)
