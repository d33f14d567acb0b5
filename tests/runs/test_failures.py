"""Faults of every kind are contained, named in the run's own file, and leave the other runs alone."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import netCDF4
import psutil
import pytest

from mpmbench.results import netcdf
from tests.runs.conftest import PLUGINS, marked, start, waited, without_report
from tests.support import slow_if

FAULTS = {  # fault -> status, part of the reason
    "raise": ("crashed", "ZeroDivisionError: a fault in a plug-in (failing_bar.py, line "),
    "not_finite": ("diverged", "not finite"),
    "negative_volume": ("broke_down", "volume"),
    "lost_basis": ("broke_down", "lost its basis"),
    "hang": ("timeout", "stopped at limits.time = 4 s"),
    "segfault": ("crashed", "ended by SIGSEGV"),
    "killed": ("crashed", "ended by SIGKILL"),
    "exit": ("crashed", "SystemExit: 3 (failing_bar.py, line "),
    "garbage": ("crashed", "something else wrote to the pipe of the process"),
    "no_text": ("crashed", "NoText: its text cannot be had: RuntimeError (failing_bar.py, line "),
    "own_status": ("crashed", "odd: in its own words"),
    "no_variable": ("crashed", "its result fits into no file: "),
    "memory": ("out_of_memory", "stopped at limits.memory = 400 MiB"),
    "not_converged": ("not_converged", "the residual stays at 0.5"),
}
PARALLEL = ("joblib", "submitit_local")
HANGS = 300.0  # seconds after which what should have happened never will
SWEEP = ("-m", "problem=failing_bar", "limits.time=4", "limits.memory=400", "campaign=faults")


def by_fault(folder: Path) -> dict[str, tuple[Path, dict]]:
    files = list((folder / "results" / "faults").glob("*.nc"))
    attributes = {file: netcdf.read_attributes(file) for file in files}
    assert None not in attributes.values()
    return {
        json.loads(found["config"])["problem"]["fault"]: (file, found)
        for file, found in attributes.items()
    }


def needs(launcher: str) -> None:
    """Skip the test when this launcher is not installed."""
    if launcher != "basic":
        pytest.importorskip("submitit" if "submitit" in launcher else "joblib")


@pytest.fixture(
    scope="module",
    params=["basic", *(pytest.param(name, marks=pytest.mark.slow) for name in PARALLEL)],
)
def swept(request, tmp_path_factory):
    """One sweep over all faults under each launcher, with a healthy run first and last, and no report of it."""
    needs(request.param)
    folder = tmp_path_factory.mktemp(request.param)
    faults = f"problem.fault=none,{','.join(FAULTS)},not_applicable,slow"
    words = without_report((*SWEEP, faults, f"hydra/launcher={request.param}"))
    outcome = subprocess.run(
        [sys.executable, "-m", "mpmbench", *words],
        cwd=folder, env={**os.environ, "MPMBENCH_PLUGINS": str(PLUGINS)}, capture_output=True, text=True,
    )  # fmt: skip
    return folder, outcome


@pytest.mark.parametrize("fault", FAULTS)
def test_each_fault_has_a_file_with_its_name(swept, fault):
    status, reason = FAULTS[fault]
    _, attributes = by_fault(swept[0])[fault]
    assert attributes["status"] == status
    assert reason in attributes["reason"]
    assert (
        attributes["config_hash"]
        and attributes["code_hash"]
        and attributes["host"]
        and attributes["schema_version"]
    )


def test_the_others_finish_and_the_failed_ones_are_listed(swept):
    folder, outcome = swept
    assert outcome.returncode == 1
    found = by_fault(folder)
    assert {fault for fault, (_, attributes) in found.items() if attributes["status"] == "ok"} == {
        "none",
        "slow",
    }
    assert found["not_applicable"][1]["status"] == "not_applicable"
    assert f"{len(FAULTS)} of the runs failed" in outcome.stdout
    table = outcome.stdout.split("of the runs failed")[1]
    for status, reason in FAULTS.values():
        assert status in table and reason in table
    assert "Traceback" not in outcome.stderr


def test_a_hang_ends_within_a_second_of_its_limit(swept):
    """The limit counts from the start of the solver; set-up and compiling have one of their own."""
    with netCDF4.Dataset(by_fault(swept[0])["hang"][0]) as file:
        stopped = float(file["solver_time"][...])
    assert 4.0 <= stopped < 5.0


def test_a_run_that_was_stopped_keeps_what_is_known(swept):
    with netCDF4.Dataset(by_fault(swept[0])["hang"][0]) as file:
        assert 3.9 < float(file["wall_time"][...]) < 30
    with netCDF4.Dataset(by_fault(swept[0])["not_converged"][0]) as file:
        assert float(file["time_reached"][...]) == pytest.approx(2e-4, abs=2e-5)
        assert file["kinetic_energy"].shape[0] > 1


def test_nothing_but_results_is_left(swept):
    folder, _ = swept
    assert [path.name for path in folder.iterdir()] == ["results"]
    left = (folder / "results/faults").iterdir()
    assert all(path.suffix == ".nc" and not path.name.startswith(".") for path in left)


def test_the_same_command_runs_only_what_has_no_lasting_result(swept, command, plugins, folder):
    """Crashes are tried again, since they may have been the machine's doing; numerical failures stay as they are."""
    before = {fault: file.stat().st_mtime_ns for fault, (file, _) in by_fault(swept[0]).items()}
    again = command(
        *SWEEP,
        f"output_dir={swept[0]}/results",
        "problem.fault=none,not_finite,raise,hang,memory,not_applicable",
    )
    changed = {
        fault
        for fault, (file, _) in by_fault(swept[0]).items()
        if file.stat().st_mtime_ns != before[fault]
    }
    assert changed == {"raise"}
    assert again.code == 1
    assert "1 to run, 4 finished before, 1 not applicable" in again.out
    assert "4 of the runs failed" in again.out


@pytest.mark.slow
def test_a_raised_limit_or_rerun_failed_tries_again(command, plugins, folder):
    arguments = ("-m", "problem=failing_bar", "problem.fault=slow")
    assert command(*arguments, "limits.time=0.2").code == 1
    assert "1 finished before" in command(*arguments, "limits.time=0.2").out
    healed = command(*arguments, "limits.time=20")
    assert (healed.code, "1 to run" in healed.out) == (0, True)
    assert command("-m", "problem=failing_bar", "problem.fault=not_finite").code == 1
    assert "0 to run" in command("-m", "problem=failing_bar", "problem.fault=not_finite").out
    assert (
        "1 to run"
        in command("-m", "problem=failing_bar", "problem.fault=not_finite", "rerun=failed").out
    )


def test_a_run_killed_once_heals_with_the_same_command(command, plugins, folder, tmp_path):
    arguments = (
        "-m",
        "problem=failing_bar",
        "problem.fault=once",
        f"problem.flag_file={tmp_path / 'flag'}",
    )
    assert command(*arguments).code == 1
    assert command(*arguments).code == 0


def test_a_hang_while_compiling_ends_at_its_own_limit(command, plugins, folder):
    outcome = command("problem=failing_bar", "problem.fault=hang_in_setup", "limits.setup=4")
    assert outcome.code == 1
    assert "stopped at limits.setup = 4 s, before the solver had started" in " ".join(
        outcome.out.split()
    )


def test_a_hang_while_a_sweep_is_checked_names_its_cell_and_the_others_run(
    command, plugins, folder
):
    faults = "problem.fault=none,hang_in_check"
    outcome = command("-m", "problem=failing_bar", faults, "limits.setup=4", "campaign=faults")
    assert outcome.code == 1
    found = by_fault(folder)
    assert found["none"][1]["status"] == "ok"
    file, attributes = found["hang_in_check"]
    reason = "while it was checked: stopped at limits.setup = 4 s, before the solver had started"
    assert (attributes["status"], attributes["reason"]) == ("timeout", reason)
    assert file.stem in outcome.out and reason in " ".join(outcome.out.split())
    single = command("problem=failing_bar", "problem.fault=hang_in_check", "limits.setup=1")
    assert single.code == 1 and f"{file.stem}: the configuration could not be" in single.err
    left = command("problem=failing_bar", "problem.fault=exit_in_check")
    assert left.code == 2 and "SystemExit: 5 (failing_bar.py, line " in left.err


@pytest.mark.parametrize(
    ("fault", "limit", "reason"),
    [
        ("children", "limits.time=2", "stopped at limits.time = 2 s"),
        ("memory_of_child", "limits.memory=700", "stopped at limits.memory = 700 MiB"),
    ],
)
def test_what_a_run_has_started_counts_and_ends_with_it(
    command, plugins, folder, fault, limit, reason
):
    """A child of the run in its process group, and one that has left it."""
    flag = folder.with_name(f"{folder.name}-children")
    words = ("problem=failing_bar", f"problem.fault={fault}", f"problem.flag_file={flag}")
    outcome = command(*words, "limits.time=20", limit)
    assert reason in " ".join(outcome.out.split())
    assert not any(psutil.pid_exists(int(pid)) for pid in flag.read_text().split())


def test_an_unstable_time_step_leaves_a_file_with_step_and_time(command, folder):
    outcome = command("method=mpm", "resolution=64", "time_step=0.02", "end_time=2")
    assert outcome.code == 1
    (file,) = folder.glob("results/default/*.nc")
    attributes = netcdf.read_attributes(file)
    assert attributes["status"] in ("diverged", "broke_down")
    assert "step " in attributes["reason"] and "t = " in attributes["reason"]
    assert attributes["reason"] in " ".join(outcome.out.split())


def test_on_error_stop_leaves_the_rest_undone(command, plugins, folder):
    outcome = command(
        "-m",
        "problem=failing_bar",
        "problem.fault=not_finite,none",
        "on_error=stop",
        "campaign=faults",
    )
    assert outcome.code == 1
    assert set(by_fault(folder)) == {"not_finite"}


@pytest.mark.parametrize(
    ("launcher", "sent"),
    [
        ("basic", signal.SIGINT),
        pytest.param("basic", signal.SIGTERM, marks=pytest.mark.slow),
        pytest.param("joblib", signal.SIGINT, marks=pytest.mark.slow),
        pytest.param("submitit_local", signal.SIGTERM, marks=pytest.mark.slow),
    ],
)
def test_an_interrupted_sweep_is_completed_by_the_same_command(
    folder, plugins, command, launcher, sent
):
    """Under joblib every process gets the signal, as by Ctrl-C on a terminal; under submitit only the command."""
    needs(launcher)
    flag, free = (folder.with_name(f"{folder.name}-held{end}") for end in ("", "-free"))
    arguments = ("-m", "problem=failing_bar", "problem.fault=none,held", "campaign=faults")
    arguments += ("end_time=0.002", f"problem.flag_file={flag}")
    process = start(*arguments, f"hydra/launcher={launcher}")
    lines = iter(process.stdout.readline, "")
    assert next(lines).startswith("2 runs: 2 to run")
    assert any(line.startswith("[1/2] ok") for line in lines)
    assert waited(flag.exists, HANGS)  # it goes on when it is set free
    if launcher == "submitit_local":
        os.kill(process.pid, sent)
    else:
        os.killpg(process.pid, sent)
    _, errors = process.communicate(timeout=HANGS)
    assert process.returncode == 1
    # other lines may say that it had to wait for another exclusive run on this machine
    assert (
        errors.strip().splitlines()[-1]
        == "mpmbench: interrupted; the same command completes what is missing"
    )
    found = by_fault(folder)
    assert {fault: attributes["status"] for fault, (_, attributes) in found.items()} == {
        "none": "ok",
        "held": "interrupted",
    }
    untouched = found["none"][0].stat().st_mtime_ns
    free.touch()
    again = command(*arguments)
    assert again.code == 0
    assert by_fault(folder)["held"][1]["status"] == "ok"
    assert by_fault(folder)["none"][0].stat().st_mtime_ns == untouched


def pids_of(session: str) -> list[int]:
    """Processes that were started with this mark in their environment."""
    return marked("MPMBENCH_TEST", session)


def computes(pid: int) -> bool:
    """Whether this is the child of a server."""
    process = psutil.Process(pid)
    return (
        "mpmbench.runs.process.server" in process.cmdline()
        and "mpmbench.runs.process.server" in process.parent().cmdline()
    )


@pytest.mark.parametrize(
    ("launcher", "processes"),
    [("basic", 3), slow_if(True, "joblib", 6), slow_if(True, "submitit_local", 7)],
)
def test_no_process_is_left_when_the_parent_is_killed(
    folder, plugins, monkeypatch, launcher, processes
):
    """Neither the server nor the child that hangs, nor a launcher's workers and controllers."""
    needs(launcher)
    monkeypatch.setenv("MPMBENCH_TEST", str(folder))
    flag = folder / "hangs"
    arguments = (
        "-m",
        "problem=failing_bar",
        "problem.fault=hang,slow",
        f"problem.flag_file={flag}",
    )
    process = start(*arguments, f"hydra/launcher={launcher}")
    assert waited(flag.exists, 60)
    assert len(pids_of(str(folder))) >= processes
    process.kill()
    process.wait()
    assert waited(lambda: not pids_of(str(folder)), 5), [
        psutil.Process(pid) for pid in pids_of(str(folder))
    ]


def test_what_a_killed_command_has_started_is_ended_before_it_has_done_anything(
    folder, monkeypatch
):
    monkeypatch.setenv("MPMBENCH_TEST", str(folder))
    code = (
        "import os, subprocess, sys; from mpmbench.runs.process.watchdog import guarded\n"
        "with guarded('this test'):\n"
        "    subprocess.Popen(['sleep', '60'], stdout=subprocess.DEVNULL)\n"
        "    if sys.argv[1] == 'killed': os.kill(os.getpid(), 9)"
    )
    for how, left in (("killed", 0), ("well", 1)):
        subprocess.run([sys.executable, "-c", code, how], check=how == "well")
        assert waited(lambda left=left: len(pids_of(str(folder))) == left, 5)
    psutil.Process(pids_of(str(folder))[0]).kill()


@pytest.mark.slow
def test_workers_of_joblib_that_are_killed_cost_one_run_at_most(folder, plugins, monkeypatch):
    """joblib gives up all runs when a worker dies: they are launched again, and one that it happens to twice fails."""
    needs("joblib")
    monkeypatch.setenv("MPMBENCH_TEST", str(folder))
    flag = folder / "hangs"
    arguments = ("problem=failing_bar", "problem.fault=hang,none,not_finite", "campaign=faults")
    arguments += ("-m", f"problem.flag_file={flag}", "limits.time=60", "hydra/launcher=joblib")
    process = start(*arguments)
    for _ in range(2):
        # a run that happens to be under way at both deaths would count as their cause too
        assert waited(
            lambda: flag.exists() and flag.read_text() and len(list(folder.rglob("*.nc"))) == 2, 60
        )
        child = psutil.Process(int(flag.read_text()))
        flag.unlink()
        child.parent().parent().kill()  # the worker, whose server started the child
    out, errors = process.communicate(timeout=60)
    assert process.returncode == 1, errors
    found = {
        fault: (attributes["status"], attributes["reason"])
        for fault, (_, attributes) in by_fault(folder).items()
    }
    assert found["hang"] == ("crashed", "the launcher's process that ran it was killed, twice")
    assert found["none"][0] == "ok"
    assert found["not_finite"][0] == "diverged"
    assert "2 of the runs failed" in out and "Traceback" not in errors


def test_a_server_that_is_killed_between_two_runs_costs_nothing(command, plugins, folder):
    from mpmbench.runs.process import isolation

    assert command("problem=failing_bar").code == 0
    isolation.processes.server.process.kill()
    isolation.processes.server.process.wait()
    assert command("problem=failing_bar").code == 0


SBATCH = """#!/bin/sh
echo 'sbatch: error: Unknown host' >&2
echo 'sbatch: fatal: Could not establish a configuration source' >&2
exit 1
"""


@pytest.mark.parametrize("installed", (False, True))
def test_a_launcher_that_does_not_work_is_one_sentence(
    command, folder, tmp_path, monkeypatch, installed
):
    """Without SLURM, and with its programs where no cluster is."""
    pytest.importorskip("submitit")
    programs = tmp_path / "programs"
    programs.mkdir()
    for name in ("srun", "sbatch") if installed else ():
        (programs / name).write_text(SBATCH)
        (programs / name).chmod(0o755)
    monkeypatch.setenv("PATH", f"{programs}")
    outcome = command("-m", "resolution=4,5", "hydra/launcher=submitit_slurm")
    assert outcome.code == 1 and outcome.err.count("\n") == 1
    assert outcome.err.startswith("mpmbench: hydra/launcher=submitit_slurm failed: ")
    assert ("Could not establish a configuration source" in outcome.err) == installed
    assert not list(folder.rglob("*.nc"))


def test_a_library_that_cannot_be_loaded_is_one_line(command, folder, tmp_path, monkeypatch):
    broken = tmp_path / "broken"
    broken.mkdir()
    (broken / "netCDF4.py").write_text("raise ImportError('no name array_namespace in scipy')\n")
    monkeypatch.setenv("PYTHONPATH", f"{broken}{os.pathsep}{os.environ.get('PYTHONPATH', '')}")
    process = start("resolution=4")
    out, err = process.communicate(timeout=60)
    assert (process.returncode, out, err.count("\n")) == (1, "", 1)
    assert "its libraries cannot be loaded: ImportError: no name array_namespace in scipy" in err


def test_a_server_whose_answer_was_not_awaited_is_not_asked_again(monkeypatch):
    """An answer that is read later would be taken for the number of a child, and 0 as its number means all of us."""
    from mpmbench.runs.process import isolation

    server = isolation.Server.start(dict(os.environ), {})
    child = server.child()

    class Interrupting:
        """A connection on which Ctrl-C comes between a request and its answer."""

        def __init__(self, connection):
            self.connection = connection

        def recv(self, *arguments):
            raise KeyboardInterrupt

        def __getattr__(self, name):
            return getattr(self.connection, name)

    server.control = Interrupting(server.control)
    with pytest.raises(KeyboardInterrupt):
        server.exit_code(child.pid)
    assert server.process.poll() is not None
    with pytest.raises((OSError, isolation.Ended)):
        server.child()
