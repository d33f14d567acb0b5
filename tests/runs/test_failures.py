"""Faults of every kind are contained, named in the run's own file, and leave the other runs alone."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import netCDF4
import pytest

from mpmbench.runs import result
from tests.runs.conftest import PLUGINS, start

FAULTS = {  # fault -> status, part of the reason
    "raise": ("crashed", "ZeroDivisionError: a fault in a plug-in (failing_bar.py, line "),
    "not_finite": ("diverged", "not finite"),
    "negative_volume": ("broke_down", "volume"),
    "lost_basis": ("broke_down", "lost its basis"),
    "hang": ("timeout", "stopped at limits.time = 2.5 s"),
    "segfault": ("crashed", "ended by SIGSEGV"),
    "killed": ("crashed", "ended by SIGKILL"),
    "exit": ("crashed", "exit code 3"),
    "memory": ("out_of_memory", "stopped at limits.memory = 500 MiB"),
    "not_converged": ("not_converged", "the residual stays at 0.5"),
}
SWEEP = ("-m", "problem=failing_bar", "limits.time=2.5", "limits.memory=500", "campaign=faults")


def by_fault(folder: Path) -> dict[str, tuple[Path, dict]]:
    files = list((folder / "results" / "faults").glob("*.nc"))
    attributes = {file: result.read_attributes(file) for file in files}
    assert None not in attributes.values()
    return {json.loads(found["config"])["problem"]["fault"]: (file, found) for file, found in attributes.items()}


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    """One sweep over all faults, with a healthy run first and last."""
    folder = tmp_path_factory.mktemp("swept")
    faults = f"problem.fault=none,{','.join(FAULTS)},not_applicable,slow"
    outcome = subprocess.run(
        [sys.executable, "-m", "mpmbench", *SWEEP, faults],
        cwd=folder, env={**os.environ, "MPMBENCH_PLUGINS": str(PLUGINS)}, capture_output=True, text=True,
    )  # fmt: skip
    return folder, outcome


@pytest.mark.parametrize("fault", FAULTS)
def test_each_fault_has_a_file_with_its_name(swept, fault):
    status, reason = FAULTS[fault]
    _, attributes = by_fault(swept[0])[fault]
    assert attributes["status"] == status
    assert reason in attributes["reason"]
    assert attributes["config_hash"] and attributes["code_hash"] and attributes["host"] and attributes["schema_version"]


def test_the_others_finish_and_the_failed_ones_are_listed(swept):
    folder, outcome = swept
    assert outcome.returncode == 1
    found = by_fault(folder)
    assert {fault for fault, (_, attributes) in found.items() if attributes["status"] == "ok"} == {"none", "slow"}
    assert found["not_applicable"][1]["status"] == "not_applicable"
    assert f"{len(FAULTS)} of the runs failed" in outcome.stdout
    table = outcome.stdout.split("of the runs failed")[1]
    for status, reason in FAULTS.values():
        assert status in table and reason in table
    assert "Traceback" not in outcome.stderr


def test_a_run_that_was_stopped_keeps_what_is_known(swept):
    with netCDF4.Dataset(by_fault(swept[0])["hang"][0]) as file:
        assert 2.4 < float(file["wall_time"][...]) < 30
    with netCDF4.Dataset(by_fault(swept[0])["not_converged"][0]) as file:
        assert float(file["time_reached"][...]) == pytest.approx(2e-4, abs=2e-5)
        assert file["kinetic_energy"].shape[0] > 1


def test_nothing_but_results_is_left(swept):
    folder, _ = swept
    assert [path.name for path in folder.iterdir()] == ["results"]
    assert all(path.suffix == ".nc" and not path.name.startswith(".") for path in (folder / "results/faults").iterdir())


def test_the_same_command_runs_only_what_has_no_lasting_result(swept, command, plugins, folder):
    """Crashes are tried again, since they may have been the machine's doing; numerical failures stay as they are."""
    before = {fault: file.stat().st_mtime_ns for fault, (file, _) in by_fault(swept[0]).items()}
    again = command(
        *SWEEP, f"output_dir={swept[0]}/results", "problem.fault=none,not_finite,raise,hang,memory,not_applicable"
    )
    changed = {fault for fault, (file, _) in by_fault(swept[0]).items() if file.stat().st_mtime_ns != before[fault]}
    assert changed == {"raise"}
    assert again.code == 1
    assert "1 to run, 4 finished before, 1 not applicable" in again.out
    assert "4 of the runs failed" in again.out


def test_a_raised_limit_or_rerun_failed_tries_again(command, plugins, folder):
    arguments = ("-m", "problem=failing_bar", "problem.fault=slow")
    assert command(*arguments, "limits.time=0.2").code == 1
    assert "1 finished before" in command(*arguments, "limits.time=0.2").out
    healed = command(*arguments, "limits.time=20")
    assert (healed.code, "1 to run" in healed.out) == (0, True)
    assert command("-m", "problem=failing_bar", "problem.fault=not_finite").code == 1
    assert "0 to run" in command("-m", "problem=failing_bar", "problem.fault=not_finite").out
    assert "1 to run" in command("-m", "problem=failing_bar", "problem.fault=not_finite", "rerun=failed").out


def test_a_run_killed_once_heals_with_the_same_command(command, plugins, folder, tmp_path):
    arguments = ("-m", "problem=failing_bar", "problem.fault=once", f"problem.flag_file={tmp_path / 'flag'}")
    assert command(*arguments).code == 1
    assert command(*arguments).code == 0


def test_a_hang_while_compiling_ends_at_its_own_limit(command, plugins, folder):
    outcome = command("problem=failing_bar", "problem.fault=hang_in_setup", "limits.setup=4")
    assert outcome.code == 1
    assert "stopped at limits.setup = 4 s, before the solver had started" in outcome.out


def test_an_unstable_time_step_leaves_a_file_with_step_and_time(command, folder):
    outcome = command("method=mpm", "resolution=64", "time_step=0.02", "end_time=2")
    assert outcome.code == 1
    (file,) = folder.glob("results/default/*.nc")
    attributes = result.read_attributes(file)
    assert attributes["status"] in ("diverged", "broke_down")
    assert "step " in attributes["reason"] and "t = " in attributes["reason"]
    assert attributes["reason"] in outcome.out


def test_on_error_stop_leaves_the_rest_undone(command, plugins, folder):
    outcome = command("-m", "problem=failing_bar", "problem.fault=not_finite,none", "on_error=stop", "campaign=faults")
    assert outcome.code == 1
    assert set(by_fault(folder)) == {"not_finite"}


@pytest.mark.parametrize("sent", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_sweep_is_completed_by_the_same_command(folder, plugins, command, sent):
    arguments = ("-m", "problem=failing_bar", "problem.fault=none,slow,raise", "end_time=0.002", "campaign=faults")
    process = start(*arguments, start_new_session=True)
    assert process.stdout.readline().startswith("3 runs: 3 to run")
    assert process.stdout.readline().startswith("[1/3] ok")
    time.sleep(0.5)
    os.killpg(process.pid, sent)
    _, errors = process.communicate(timeout=20)
    assert process.returncode == 1
    assert errors.strip() == "mpmbench: interrupted; the same command completes what is missing"
    found = by_fault(folder)
    assert {fault: attributes["status"] for fault, (_, attributes) in found.items()} == {
        "none": "ok",
        "slow": "interrupted",
    }
    untouched = found["none"][0].stat().st_mtime_ns
    again = command(*arguments[:2], "problem.fault=none,slow", *arguments[3:])
    assert again.code == 0
    assert by_fault(folder)["slow"][1]["status"] == "ok"
    assert by_fault(folder)["none"][0].stat().st_mtime_ns == untouched


def children_of(session: str) -> list[str]:
    import psutil

    marked = []
    for process in psutil.process_iter():
        try:
            if process.environ().get("MPMBENCH_TEST") == session:
                marked.append(f"{process.pid} {' '.join(process.cmdline())}")
        except psutil.Error:
            continue
    return marked


def test_no_process_is_left_when_the_parent_is_killed(folder, plugins, monkeypatch):
    monkeypatch.setenv("MPMBENCH_TEST", str(folder))
    process = start("-m", "problem=failing_bar", "problem.fault=hang", start_new_session=True)
    process.stdout.readline()
    time.sleep(1.5)
    assert len(children_of(str(folder))) >= 3  # the command, the server and the child that hangs
    process.kill()
    process.wait()
    deadline = time.monotonic() + 5
    while children_of(str(folder)) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert children_of(str(folder)) == []
