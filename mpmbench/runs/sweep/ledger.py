"""A temporary folder with which the processes of one command tell each other of runs.

Hydra's launchers hand back nothing before the last run has ended, and nothing at all when a worker
dies. A folder works under each of them, on a cluster too when it lies on a shared disk. It is the
folder ``hydra.sweep.dir``.
"""

import json
import os
import shutil
import socket
import tempfile
import threading
import time
from collections.abc import Callable, Container, Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict
from pathlib import Path
from typing import Any

from mpmbench.runs.sweep.execute import Record

PREFIX = "mpmbench-sweep-"
RESERVE = 2**18  # bytes kept free for the records of runs that end on a full disk
LOOK_EVERY = 0.25  # seconds between two looks of a worker at the process that started it


class Ledger:
    """One such folder."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def note(self, record: Record) -> None:
        """Leave the record of a run."""
        self._place(f"{record.name}.done", asdict(record))
        self.forget_start(record.name)

    def started(self, name: str, fraction: float = 0.0) -> None:
        """Mark that a run has started, or how far it is; a full disk is no reason to end it."""
        with suppress(OSError):
            self._place(f"{name}.running", {"fraction": fraction})

    def ended(self, known: Container[str] = ()) -> list[str]:
        """Names of the runs that have ended, in this order, without those that are `known`."""
        names = (Path(file.name) for file in os.scandir(self.folder) if file.name[0] != ".")
        new = (file for file in names if file.suffix == ".done" and file.stem not in known)
        files = sorted((self.folder / file for file in new), key=lambda one: one.stat().st_mtime_ns)
        return [file.stem for file in files]

    def record(self, name: str) -> Record:
        """Record of a run that has ended."""
        return Record(**json.loads((self.folder / f"{name}.done").read_text()))

    def records(self) -> dict[str, Record]:
        """Records by the names of the runs, in the order in which these ended."""
        return {name: self.record(name) for name in self.ended()}

    def running(self) -> dict[str, float]:
        """Fraction done of each run that has started and not ended."""
        found = {}
        for file in sorted(self.folder.glob("*.running")):
            with suppress(OSError, ValueError):  # it has just ended
                found[file.stem] = float(json.loads(file.read_text())["fraction"])
        return found

    def keep_config(self, name: str, config: dict[str, Any], stamp: Any) -> None:
        """Leave the configuration of a run, and its file's stamp, for the process that will do it."""
        self._place(f"{name}.config", [config, stamp])

    def config(self, name: str) -> tuple[dict[str, Any], Any]:
        """Configuration of a run, and the stamp of its file when it was planned."""
        config, stamp = json.loads((self.folder / f"{name}.config").read_text())
        return config, stamp

    def request_stop(self) -> None:
        """Ask all workers to start no further run."""
        (self.folder / "stop").touch()

    def abandon(self) -> None:
        """Ask all workers to end at once."""
        (self.folder / "abandon").touch()

    def may_start(self) -> bool:
        """Whether no worker has been asked to stop."""
        return not any((self.folder / word).exists() for word in ("stop", "abandon"))

    def owner(self) -> dict[str, Any]:
        """``pid``, ``host`` and ``birth`` of the process that made this folder; empty if it is gone."""
        try:
            return dict(json.loads((self.folder / "owner").read_text()))
        except (OSError, ValueError):
            return {}

    def forget_start(self, name: str) -> None:
        """Take back that a run has started."""
        (self.folder / f"{name}.running").unlink(missing_ok=True)

    def owner_is_gone(self) -> bool:
        """Whether the command that made this folder has ended or given up."""
        return (self.folder / "abandon").exists() or self.is_leftover()

    def is_leftover(self) -> bool:
        """Whether the command that made this folder has ended."""
        owner = self.owner()
        if not owner:
            return True
        return owner["host"] == socket.gethostname() and birth(owner["pid"]) != owner["birth"]

    def _place(self, name: str, content: Any) -> None:
        unfinished = self.folder / f".{name}.{os.getpid()}"
        try:
            unfinished.write_text(json.dumps(content))
        except OSError:
            (self.folder / "reserve").unlink(missing_ok=True)  # the disk is full
            unfinished.write_text(json.dumps(content))
        unfinished.replace(self.folder / name)


def birth(pid: int) -> str:
    """What tells a process from a later one of the same number; empty when there is none."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
        return "" if fields[0] == "Z" else fields[19]
    except OSError:
        if Path("/proc/self").exists():
            return ""
    try:
        os.kill(pid, 0)
        return "alive"
    except OSError:
        return ""


def is_own(folder: Path) -> bool:
    """Whether a folder is of this user: others may leave whatever they want in a temporary one."""
    try:
        return folder.lstat().st_uid == os.getuid() and not folder.is_symlink()
    except FileNotFoundError:
        return False


@contextmanager
def opened(parent: Path | None = None) -> Iterator[Ledger]:
    """A new ledger below `parent` (default: the system's temporary folder), removed at the end.

    Those of commands that were killed are removed as well.
    """
    place = parent or Path(tempfile.gettempdir())
    for leftover in place.glob(f"{PREFIX}*"):
        if not is_own(leftover):
            continue
        if not (leftover / "owner").exists() and time.time() - leftover.stat().st_mtime < 60:
            continue  # somebody is making it
        if Ledger(leftover).is_leftover():
            shutil.rmtree(leftover, ignore_errors=True)
    folder = Path(tempfile.mkdtemp(prefix=PREFIX, dir=parent)).absolute()
    ledger = Ledger(folder)
    try:
        (folder / "reserve").write_bytes(bytes(RESERVE))
    except OSError as error:
        shutil.rmtree(folder, ignore_errors=True)
        raise OSError(error.errno, error.strerror, str(place)) from None
    pid = os.getpid()
    ledger._place("owner", {"pid": pid, "host": socket.gethostname(), "birth": birth(pid)})
    try:
        yield ledger
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def follow_owner(ledger: Ledger, end: Callable[[], None]) -> None:
    """In a worker: call `end` and exit as soon as the command that started it is gone."""
    name = f"owner of {ledger.folder}"
    followed = any(thread.name == name for thread in threading.enumerate())
    if followed or ledger.owner().get("pid") == os.getpid():
        return

    def watch() -> None:
        while not ledger.owner_is_gone():
            time.sleep(LOOK_EVERY)
        end()
        os._exit(1)

    threading.Thread(target=watch, name=name, daemon=True).start()
