"""What is seen of a sweep while it runs."""

import os
import pty
import re
import subprocess
import sys
from pathlib import Path

import pytest

from mpmbench.runs.sweep import live
from mpmbench.runs.sweep.execute import Record
from mpmbench.runs.sweep.ledger import opened
from mpmbench.runs.sweep.plan import Cell, Plan

COLOUR = re.compile(r"\x1b\[[0-9;]*[1-9][0-9;]*m")


def cell(resolution: int, work: float) -> Cell:
    config = {name: {"name": name} for name in ("method", "basis", "problem")}
    config |= {"resolution": resolution, "output_dir": "results", "campaign": "live"}
    return Cell(config, work=work)


def test_totals_and_what_may_be_left(capsys, monkeypatch):
    """One of three runs is done, which was a quarter of the work; another is half done."""
    cells = [cell(8, 1.0), cell(16, 2.0), cell(32, 1.0)]
    with opened() as ledger:
        view = live.View(ledger)
        view.plan, view.began = Plan(to_run=cells), 100.0
        monkeypatch.setattr(live.time, "monotonic", lambda: 110.0)
        assert view.status({}) == "0 of 3 done, 0 running, 0 failed, 10 s so far"
        ledger.started(cells[1].name, 0.5)
        ledger.note(Record(cells[0].name, "diverged", "it blew up", ""))
        view._look()
        assert capsys.readouterr().out.startswith(f"[1/3] diverged  {cells[0].name}")
        lines = view.status(ledger.running()).splitlines()
    assert lines[0] == "1 of 3 done, 1 running, 1 failed, about 10 s left"
    assert lines[1].split() == [cells[1].name, "50%", "0", "s"]


def test_a_full_disk_still_takes_the_records_of_what_has_ended(monkeypatch):
    def full(path, text):
        if (path.parent / "reserve").exists():
            raise OSError(28, "No space left on device")
        return written(path, text)

    written = Path.write_text
    with opened() as ledger:
        monkeypatch.setattr(Path, "write_text", full)
        ledger.started("one")
        ledger.note(Record("one", "ok", "", ""))
        assert list(ledger.records()) == ["one"]


@pytest.mark.parametrize(
    ("seconds", "text"), [(-1, "0 s"), (42.4, "42 s"), (240, "4 min"), (7500, "2 h 5 min")]
)
def test_durations(seconds, text):
    assert live.duration(seconds) == text


def on_a_terminal(*more: str, **environment: str) -> str:
    """Output of a sweep with one failure whose output is a terminal."""
    main, other = pty.openpty()
    arguments = ["-m", "problem=failing_bar", "problem.fault=slow,not_finite", "limits.time=30"]
    process = subprocess.Popen(
        [sys.executable, "-m", "mpmbench", *arguments, *more],
        stdout=other, env={**os.environ, "TERM": "xterm-256color", "COLUMNS": "200", **environment},
    )  # fmt: skip
    os.close(other)
    output = b""
    while True:
        try:
            chunk = os.read(main, 4096)
        except OSError:  # how Linux ends a terminal
            break
        output += chunk
    os.close(main)
    assert process.wait() == 1
    return output.decode()


@pytest.mark.slow
def test_a_terminal_shows_what_runs_and_no_colour_is_respected(folder, plugins):
    shown = on_a_terminal()
    assert "1 running" in shown and "0 of 2 done" in shown
    assert re.search(r"mpm-linear-failing_bar-n4-\w{8} +\d+%", shown)
    assert re.search(r"\[2/2\] \w+", shown)
    assert COLOUR.search(shown)
    again = on_a_terminal("rerun=all", NO_COLOR="1")
    assert "1 running" in again and re.search(r"\[2/2\] \w+", again) and not COLOUR.search(again)


def test_without_a_terminal_there_are_plain_lines(command, plugins):
    out = command("-m", "problem=failing_bar", "problem.fault=none,slow").out
    assert "\x1b" not in out
    assert [line.split()[1] for line in out.splitlines() if line.startswith("[")] == ["ok", "ok"]


def test_another_command_leaves_one_alone_that_was_interrupted_and_writes_its_last_records(
    tmp_path,
):
    with opened(tmp_path) as ledger:
        ledger.abandon()
        assert ledger.owner_is_gone() and not ledger.is_leftover()
        with opened(tmp_path):
            assert ledger.folder.exists()
