"""How busy the machine is with other work: counted without our own, and unknown rather than invented."""

import math
import subprocess
import sys
import time
from pathlib import Path

import pytest

from mpmbench.runs.process import load

A = load.Reading(time=0.0, total=0.0, busy=0.0, stolen=0.0, own=0.0)


def after(seconds, total, busy=0.0, stolen=0.0, own=0.0):
    return load.Reading(seconds, total, busy, stolen, own)


def test_our_own_work_is_no_load_and_that_of_others_is(monkeypatch):
    monkeypatch.setattr(load.os, "cpu_count", lambda: 4)
    found = load.load_between(A, after(10.0, total=40.0, busy=25.0, stolen=5.0, own=10.0))
    assert found == {"load_by_others": 1.5, "steal": 0.5}
    assert load.load_between(A, after(10.0, 40.0, busy=9.9, own=10.0))["load_by_others"] == 0.0


@pytest.mark.parametrize(
    "readings",
    [
        (None, after(10.0, 40.0)),
        (A, None),
        (A, after(10.0, total=0.0)),  # a container that hides the times of the machine
        (A, after(10.0, total=80.0)),  # one that tells those of more processors
        (A, after(0.001, total=0.0)),  # less than the kernel's unit
    ],
)
def test_what_the_system_does_not_tell_is_unknown(readings, monkeypatch):
    monkeypatch.setattr(load.os, "cpu_count", lambda: 4)
    assert all(math.isnan(value) for value in load.load_between(*readings).values())


def test_elsewhere_than_on_linux_nothing_is_read(monkeypatch):
    monkeypatch.setattr(load.Path, "read_text", lambda self: Path("/nowhere").read_bytes())
    assert load.reading() is None


@pytest.mark.skipif(not Path("/proc/stat").exists(), reason="needs Linux")
def test_the_work_of_another_process_is_seen():
    """A process of this test is a child, not a parent, and counts as another one."""
    work = "import time\nt = time.perf_counter()\nwhile time.perf_counter() - t < 20: pass"
    other = subprocess.Popen([sys.executable, "-c", work])
    try:
        before = load.reading()
        time.sleep(0.3)
        after = load.reading()
    finally:
        other.kill()
        other.wait()
    assert before is not None and after is not None
    assert after.own - before.own < 0.1
    assert load.load_between(before, after)["load_by_others"] > 0.1
