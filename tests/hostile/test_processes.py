"""Plug-ins that misbehave and processes that are killed: each has a name, and nothing is lost."""

import json
import os
import subprocess
import sys

import psutil
import pytest

from mpmbench.results import netcdf
from tests.runs.conftest import PLUGINS
from tests.runs.test_chaos import check_completed, disturb, undisturbed

__all__ = ["undisturbed"]  # a fixture

HARMLESS = ("none", "slow", "held", "not_applicable", "once")
OUTCOMES = {  # statuses of faults that are not simply crashes
    "not_finite": "diverged",
    "negative_volume": "broke_down",
    "lost_basis": "broke_down",
    "hang": "timeout",
    "hang_in_setup": "timeout",
    "hang_in_check": "timeout",
    "children": "timeout",
    "memory": "out_of_memory",
    "memory_of_child": "out_of_memory",
    "not_converged": "not_converged",
}


def faults() -> list[str]:
    """All that the plug-in of the tests can do wrong in a sweep that goes on."""
    sys.path.insert(0, str(PLUGINS))
    from failing_bar import FAULTS

    return [fault for fault in FAULTS if fault not in (*HARMLESS, "exit_in_check")]


@pytest.mark.slow
def test_plug_ins_that_misbehave(tmp_path, counts):
    asked = faults()
    assert len(asked) >= 24
    flag = tmp_path / "pids"
    words = [f"problem.fault=none,{','.join(asked)}", f"problem.flag_file={flag}"]
    limits = ["limits.time=10", "limits.setup=60", "limits.memory=700", "campaign=faults"]
    outcome = subprocess.run(
        [sys.executable, "-m", "mpmbench", "-m", "problem=failing_bar", *words, *limits],
        cwd=tmp_path,
        env={**os.environ, "MPMBENCH_PLUGINS": str(PLUGINS)},
        capture_output=True,
        text=True,
    )
    found = [netcdf.read_attributes(file) for file in tmp_path.glob("results/faults/*.nc")]
    by_fault = {json.loads(one["config"])["problem"]["fault"]: one for one in found if one}
    wrong = [
        fault
        for fault in asked
        if fault not in by_fault
        or by_fault[fault]["status"] != OUTCOMES.get(fault, "crashed")
        or not by_fault[fault]["reason"].isprintable()
    ]
    print(wrong, outcome.stdout, outcome.stderr)
    counts("plug-ins that misbehave: named otherwise than they should", 0, len(wrong))
    counts("plug-ins that misbehave: healthy runs lost", 0, int(by_fault["none"]["status"] != "ok"))
    tracebacks = outcome.stdout.count("Traceback") + outcome.stderr.count("Traceback")
    counts("plug-ins that misbehave: tracebacks of the command", 0, tracebacks)
    left = sum(psutil.pid_exists(int(pid)) for pid in flag.read_text().split())
    counts("plug-ins that misbehave: processes left", 0, left)


@pytest.mark.slow
def test_kills(tmp_path, undisturbed, monkeypatch, counts):
    killed = disturb(tmp_path, undisturbed, 100, 5, monkeypatch)
    check_completed(tmp_path, undisturbed)
    counts("kills, after which nothing is lost or differs", 100, sum(killed.values()))
