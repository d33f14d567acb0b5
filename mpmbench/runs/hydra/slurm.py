"""Jobs of SLURM: how they are watched where it keeps no accounts, and cancelled when the command ends."""

import io
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, suppress
from typing import Any

from submitit.slurm.slurm import SlurmExecutor, SlurmInfoWatcher, SlurmJob

# What `sacct` would print. The queue shows a job for some minutes after its end.
QUEUE = (
    "echo 'JobID|State|NodeList'; squeue --me --array --noheader --states=all --format='%i|%T|%N'"
)
LOOK_AT_LEAST_EVERY = 60  # seconds


class QueueWatcher(SlurmInfoWatcher):  # type: ignore[misc]
    """Reads the states of jobs off the queue; a job that is there no more has ended."""

    def _make_command(self) -> list[str] | None:
        return ["sh", "-c", QUEUE] if self._registered - self._finished else None

    def read_info(self, string: bytes | str) -> dict[str, dict[str, str]]:
        found: dict[str, dict[str, str]] = super().read_info(string)
        ended = {job: {"State": "COMPLETED"} for job in self._registered if job not in found}
        return ended | found


def watch_without_accounts() -> None:
    """Let submitit ask the queue where `sacct` cannot answer: each of its looks would be a warning."""
    try:
        asked = subprocess.run(["sacct", "--noheader"], capture_output=True, timeout=60)
    except (OSError, subprocess.TimeoutExpired):  # no SLURM here, of which submitit tells
        return
    if asked.returncode:
        SlurmJob.watcher = QueueWatcher(delay_s=LOOK_AT_LEAST_EVERY)


@contextmanager
def jobs() -> Iterator[None]:
    """Around jobs: they are watched, cancelled when the command ends, and SLURM says things once.

    What `sbatch` complains of stands in the error that submitit raises, and is not printed besides.
    """
    submit = SlurmExecutor._submit_command

    def silently(executor: SlurmExecutor, command: str) -> Any:
        with redirect_stderr(io.StringIO()):
            return submit(executor, command)

    watch_without_accounts()
    SlurmExecutor._submit_command = silently  # type: ignore
    try:
        yield
    finally:
        SlurmExecutor._submit_command = submit  # type: ignore
        cancel_jobs()


def cancel_jobs() -> None:
    """Cancel what this process has submitted and what has not ended: it would wait in the queue for nothing."""
    watcher = SlurmJob.watcher
    left = {job.partition("_")[0] for job in watcher._registered - watcher._finished}
    if left:
        with suppress(OSError, subprocess.TimeoutExpired):
            subprocess.run(["scancel", "--quiet", *left], capture_output=True, timeout=60)
