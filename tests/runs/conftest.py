import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

from mpmbench.cli import main

PLUGINS = Path(__file__).parents[1] / "plugins"


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


@pytest.fixture
def plugins(monkeypatch) -> None:
    """Problems with built-in faults are known."""
    monkeypatch.setenv("MPMBENCH_PLUGINS", str(PLUGINS))


@pytest.fixture
def command(folder, capfd) -> Callable[..., Outcome]:
    """The command line, in this process (its cases still run in children)."""

    def run(*arguments: str) -> Outcome:
        capfd.readouterr()
        code = main(list(arguments))
        return Outcome(code, *capfd.readouterr())

    return run


def start(*arguments: str, **options) -> "subprocess.Popen[str]":
    """The command line as a program of its own."""
    command = [sys.executable, "-m", "mpmbench", *arguments]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options)
