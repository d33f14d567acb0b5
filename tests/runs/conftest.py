import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import psutil
import pytest

from mpmbench.cli import main

PLUGINS = Path(__file__).parents[1] / "plugins"
MARK = "MPMBENCH_TESTS"  # in the environment of whatever these tests start
os.environ[MARK] = str(os.getpid())
STAYING = (
    "mpmbench.runs.process.server",
    "mpmbench/results/apart.py",
    "resource_tracker",
)  # children of the tests' own process that serve all of them
_started: "list[subprocess.Popen[str]]" = []


@dataclass
class Outcome:
    code: int
    out: str
    err: str


@pytest.fixture
def folder(tmp_path, monkeypatch) -> Path:
    """An empty working folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture(autouse=True, scope="package")
def _same_plugins() -> Iterator[None]:
    """The same plug-ins for all tests: with others, the process that forks runs would be started anew."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("MPMBENCH_PLUGINS", str(PLUGINS))
        yield


@pytest.fixture
def plugins(monkeypatch) -> None:
    """Problems with built-in faults are known."""
    monkeypatch.setenv("MPMBENCH_PLUGINS", str(PLUGINS))


def without_report(arguments: Sequence[str]) -> list[str]:
    """A sweep that says nothing of its report writes none: it would take longer than its runs."""
    sweeps = "-m" in arguments and "status" not in arguments
    said = any(word.startswith("report=") for word in arguments)
    return [*arguments, *(["report=false"] if sweeps and not said else [])]


@pytest.fixture
def command(folder, capfd) -> Callable[..., Outcome]:
    """The command line, in this process (its cases still run in children)."""

    def run(*arguments: str) -> Outcome:
        capfd.readouterr()
        code = main(without_report(arguments))
        return Outcome(code, *capfd.readouterr())

    return run


def start(*arguments: str) -> "subprocess.Popen[str]":
    """The command line as a program of its own, in a session of its own: what it does to its group stays there.

    It heeds Ctrl-C even when the tests run in the background of a shell, which makes them ignore
    it.
    """
    words = [sys.executable, "-m", "mpmbench", *without_report(arguments)]
    process = subprocess.Popen(
        words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        start_new_session=True, preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )  # fmt: skip
    _started.append(process)
    return process


@pytest.fixture(autouse=True)
def _end_commands() -> Iterator[None]:
    """Kill what a test that failed has not awaited."""
    yield
    while _started:
        process = _started.pop()
        process.kill()
        process.wait()
        process.stdout.close()
        process.stderr.close()


@pytest.fixture(autouse=True, scope="module")
def _no_process_is_left() -> Iterator[None]:
    """Whatever the tests of a file have started is gone at its end."""
    yield
    assert waited(lambda: not left_over(), 5), left_over()


def left_over() -> list[str]:
    """Processes with our mark that are none of those that stay."""
    own = {process.pid for process in psutil.Process().children(recursive=True)} | {os.getpid()}
    found = []
    for pid in marked(MARK, str(os.getpid())):
        try:
            words = " ".join(psutil.Process(pid).cmdline())
        except psutil.Error:
            continue
        if pid != os.getpid() and not (pid in own and any(name in words for name in STAYING)):
            found.append(f"{pid}: {words}")
    return found


def marked(key: str, value: str) -> list[int]:
    """Processes with this in the environment that they were started with."""
    found = []
    for process in psutil.process_iter():
        try:
            if process.environ().get(key) == value:
                found.append(process.pid)
        except psutil.Error:
            continue
    return found


def waited(happened: Callable[[], bool], seconds: float) -> bool:
    """Whether something happened within some time."""
    deadline = time.monotonic() + seconds
    while not happened() and time.monotonic() < deadline:
        time.sleep(0.05)
    return happened()
