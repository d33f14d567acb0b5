"""Printing may fail: what is printed is lost, and nothing else."""

import io
import os
import subprocess
import sys

import pytest

from mpmbench.core.registry import PACKAGE
from mpmbench.runs.streams import Forgiving, forgiving
from tests.runs.conftest import waited
from tests.support import slow_if

FULL = (
    "mpmbench: standard output cannot be written: no space left on device; what is computed is kept"
)
SWEEP = "-m resolution=4,5 end_time=1e-4 report=false"


def test_a_full_standard_output_loses_no_run(command, folder, monkeypatch, capfd):
    with open("/dev/full", "w") as full:
        monkeypatch.setattr(sys, "stdout", full)
        outcome = command(*SWEEP.split())
    assert outcome.code == 0 and outcome.err == f"{FULL}\n"
    assert len(list(folder.rglob("*.nc"))) == 2


@pytest.mark.parametrize(
    "end", [slow_if(True, ">&-"), "| head -n 1", slow_if(True, "2>&- >&- <&-")]
)
def test_a_standard_output_that_is_closed_loses_no_run(folder, end):
    line = f"{sys.executable} -m mpmbench {SWEEP} {end}"
    environment = {**os.environ, "PYTHONPATH": str(PACKAGE.parent)}
    outcome = subprocess.run(["sh", "-c", line], env=environment, capture_output=True, text=True)
    assert (outcome.returncode, outcome.stderr) == (0, "")
    assert outcome.stdout.count("\n") == (1 if "head" in end else 0)
    # the shell does not wait for all of a pipe
    assert waited(lambda: len(list(folder.rglob("*.nc"))) == 2, 60)


def test_what_an_encoding_lacks_is_written_as_its_code():
    stream = io.TextIOWrapper(io.BytesIO(), "ascii")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "stdout", stream)
        with forgiving():
            print("fünf")
    assert stream.buffer.getvalue() == b"f\\xfcnf\n"
    assert sys.stdout is not stream


def test_a_stream_that_was_closed_takes_anything():
    stream, complaints = io.StringIO(), io.StringIO()
    stream.close()
    forgiven = Forgiving(stream, complaints)
    assert forgiven.write("lost") == 4
    forgiven.flush()
    assert complaints.getvalue() == ""
