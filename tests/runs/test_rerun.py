"""A run again from its file alone."""

import json

import numpy as np
import pytest

from mpmbench.commands.rerun import compare, relative_difference
from mpmbench.results import netcdf
from mpmbench.runs.sweep import execute
from tests.report.conftest import make_run
from tests.runs.conftest import start, waited
from tests.support import edited, small, write


def result_of(folder):
    (file,) = folder.rglob("*.nc")
    return file


def test_a_run_again_is_bitwise_equal_and_leaves_nothing(command, folder):
    command("resolution=8", "method=otm", "basis.d_max=2.5", "material.density=2", "end_time=2e-4")
    file = result_of(folder)
    moved = folder / "elsewhere.nc"
    file.rename(moved)
    outcome = command("rerun", "elsewhere.nc")
    assert outcome.code == 0
    assert (
        outcome.out
        == "elsewhere: bitwise equal\n  code, versions, machine and threads are the same\n"
    )
    assert [path for path in folder.rglob("*") if path.is_file()] == [moved]


def test_rounding_and_real_differences_are_told_apart(command, folder):
    command("resolution=4")
    file = result_of(folder)
    with edited(file) as dataset:
        dataset["velocity"][...] *= 1.0 + 1e-13
        dataset["error_velocity_rms"][...] *= 1.0 + 1e-8  # a difference of what hardly differs
    outcome = command("rerun", str(file))
    assert (outcome.code, "equal within rounding" in outcome.out) == (0, True)
    with edited(file) as dataset:
        dataset["stress"][-1, 3] += 1e-6
        dataset.host, dataset.numpy_version, dataset.threads = "another", "1.0", 7
        code = json.loads(dataset.code_files)
        code["core/transfer/__init__.py"] = "other"
        dataset.code_files = json.dumps(code)
    outcome = command("rerun", str(file))
    assert outcome.code == 1
    assert ": different" in outcome.out and "stress: differs by " in outcome.out
    for line in (
        "changed: code: core/transfer/__init__.py",
        "changed: numpy version: 1.0 -> ",
        "changed: host: another -> ",
        "changed: threads: 7 -> 1",
    ):
        assert line in outcome.out


def test_a_run_that_failed_fails_again_at_the_same_place(command, folder):
    command("resolution=64", "time_step=0.02", "end_time=2")
    outcome = command("rerun", str(result_of(folder)))
    assert (outcome.code, "bitwise equal" in outcome.out) == (0, True)


def test_an_unknown_plugin_and_files_that_are_no_results(command, folder, plugins, monkeypatch):
    command("problem=failing_bar", "end_time=1e-4")
    file = result_of(folder)
    monkeypatch.delenv("MPMBENCH_PLUGINS")
    outcome = command("rerun", str(file))
    assert outcome.code == 2
    assert (
        "there is no problem failing_bar here; if it is a plug-in, name its folder in MPMBENCH_PLUGINS"
        in outcome.err
    )
    (folder / "broken.nc").write_bytes(file.read_bytes()[:3000])
    assert "rerun broken.nc: cannot be read as netCDF" in command("rerun", "broken.nc").err
    assert "no such file" in command("rerun", "nowhere.nc").err


def test_relative_differences():
    a = np.array([1.0, -4.0, np.nan])
    assert relative_difference(a, a) == 0.0
    assert relative_difference(a, a + np.array([0.5, 0.0, 0.0])) == 0.125
    assert relative_difference(a, np.array([1.0, -4.0, 0.0])) == np.inf
    assert relative_difference(a, a[:2]) == np.inf
    assert relative_difference(np.zeros(3), np.zeros(3)) == 0.0


def test_limits_of_a_file_are_capped_by_the_machine_and_can_be_set(command, plugins, folder):
    command("problem=failing_bar", "problem.fault=slow")
    file = str(result_of(folder))
    outcome = command("rerun", file, "limits.time=0.2")
    assert outcome.code == 1
    assert "status: ok -> timeout stopped at limits.time = 0.2 s" in outcome.out
    assert "all else is the file's" in command("rerun", file, "seed=3").err
    assert (
        "limits.time = -1: a number greater than 0" in command("rerun", file, "limits.time=-1").err
    )
    largest = execute.limits_of({"limits": {"time": 1.0, "memory": 1e12}})["memory"]
    assert largest == execute.limits_of({"limits": {"time": 1.0, "memory": None}})["memory"] < 1e9


def test_a_rerun_that_is_terminated_leaves_nothing(command, plugins, folder, monkeypatch):
    command("problem=failing_bar", "problem.fault=slow")
    (folder / "temporary").mkdir()
    monkeypatch.setenv("TMPDIR", str(folder / "temporary"))
    process = start("rerun", str(result_of(folder)))
    assert waited(lambda: list((folder / "temporary").glob("mpmbench-rerun-*")), 60)
    process.terminate()
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 1 and errors.startswith("mpmbench: interrupted")
    assert not list((folder / "temporary").glob("mpmbench-rerun-*"))


@pytest.mark.parametrize(
    ("name", "factor", "judged"),
    (
        ("error_displacement_rms", 2.0, "differs by 0.001 of the largest displacement"),
        ("error_displacement_relative", 2.0, "differs by 0.01 of one"),
        ("momentum_drift", 2.0, "differs by 0.002 of the largest momentum"),
        ("error_density", 2.0, "differs by 1 of its largest value"),
        ("error_displacement_rms", 1.0 + 1e-7, ""),  # a difference of what differs by rounding
        ("displacement", 1.0 + 1e-7, "differs by 1e-07 of its largest value"),
    ),
)
def test_errors_are_judged_by_the_size_of_what_they_are_errors_of(tmp_path, name, factor, judged):
    values = {
        "displacement": (("snapshot", "particle", "dim"), np.full((1, 2, 1), 1e-2), "m"),
        "momentum": (("time", "dim"), np.array([[0.5], [-1.0]]), "kg m s-1"),
        "error_displacement_rms": ((), 1e-5, "m"),
        "error_displacement_relative": ((), 1e-2, "1"),
        "momentum_drift": ((), 2e-3, "kg m s-1"),
        "error_density": ((), 1e-4, "kg m-2"),
    }
    stored = {key: (dims, value, {"units": unit}) for key, (dims, value, unit) in values.items()}
    write(small().assign(stored), tmp_path / "old.nc")
    dims, value, unit = values[name]
    stored[name] = (dims, value * factor, {"units": unit})
    write(small().assign(stored), tmp_path / "new.nc")
    how = {"status": "ok", "reason": ""}
    verdict, details = compare(tmp_path / "old.nc", tmp_path / "new.nc", how, how)
    assert details == ([f"{name}: {judged}"] if judged else [])
    assert verdict == ("different" if judged else "equal within rounding")


def test_what_later_versions_write_besides_is_no_difference(tmp_path):
    old, extra = make_run(tmp_path / "old"), ("snapshot", "particle", "dim", "dim2")
    dataset = netcdf.load(old)
    new = tmp_path / "new.nc"
    for name, verdict in (("deformation_gradient", "bitwise equal"), ("other", "different")):
        write(dataset.assign({name: (extra, 0.0 * dataset.stress.values)}), new)
        before, after = netcdf.read_attributes(old), netcdf.read_attributes(new)
        assert compare(old, new, before, after)[0] == verdict
