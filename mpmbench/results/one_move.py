"""Files that are whole or not there, whoever is stopped while writing them."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def in_one_move(path: Path) -> Iterator[Path]:
    """A temporary file that takes the place of `path` once it is written, and is gone otherwise."""
    path.parent.mkdir(parents=True, exist_ok=True)
    remove_leftovers(path)
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        yield temporary
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


def remove_leftovers(path: Path) -> None:
    """Remove temporary files of processes that were killed while they wrote this file."""
    for leftover in path.parent.glob(f".{path.name}.*.tmp"):
        writer = leftover.name.split(".")[-2]
        if not (writer.isdigit() and Path("/proc", writer).exists()):
            leftover.unlink(missing_ok=True)
