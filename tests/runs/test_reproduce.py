"""The command `reproduce`: what is missing, then the report; a failure of a method is a result, an accident is none."""

import os
import threading
import time

import psutil
import pytest

from mpmbench import report
from mpmbench.commands import reproduce
from mpmbench.results import completion
from tests.runs.conftest import PLUGINS, start

EXPERIMENT = """\
# @package _global_
# A small study.
time_step: 1.0e-4
cases:
  - method=mpm basis=linear
  - method=mpm basis=linear time_step=1e-2 end_time=0.2
hydra:
  mode: MULTIRUN
  sweeper:
    params:
      resolution: 4,8
"""
BISECTION = """\
# @package _global_
# reproduce: bisect cfl to 0.5
resolution: 4
time_step: auto
end_time: 0.5
cases:
  - method=mpm basis=linear
hydra:
  mode: MULTIRUN
  sweeper:
    params:
      cfl: 0.5,2.0
"""


@pytest.fixture
def study(folder, monkeypatch):
    place = folder / "brought" / "conf" / "experiments" / "mini"
    place.mkdir(parents=True)
    (place / "one.yaml").write_text(EXPERIMENT)
    monkeypatch.setenv("MPMBENCH_PLUGINS", str(folder / "brought"))
    return place


def test_runs_what_is_missing_and_then_nothing(command, folder, study, monkeypatch):
    def quick(results):
        (results / "report").mkdir(exist_ok=True)
        (results / "report/index.html").write_text("a page")
        return results / "report/index.html"

    monkeypatch.setattr(report, "build", quick)
    monkeypatch.setattr(reproduce, "AT_A_TIME", 1)  # how the last one is shared is asked below
    first = command("reproduce", "mini")
    assert first.code == 0, first.err
    files = sorted((folder / "results/mini/one").glob("*.nc"))
    assert (
        len(files) == 4
        and "diverged" in first.out
        and "report: results/mini/one/report" in first.out
    )
    before = [file.stat().st_mtime_ns for file in files]
    start = time.perf_counter()
    second = command("reproduce", "mini")
    assert second.code == 0 and "1 complete" in second.out and time.perf_counter() - start < 5.0
    assert [file.stat().st_mtime_ns for file in files] == before
    files[0].unlink()
    assert "1 to run" in command("reproduce", "mini").out and files[0].exists()


def test_the_last_experiment_is_shared(folder, study, monkeypatch):
    """Who has none left to begin sweeps the one that is under way, once; nobody sweeps what is done."""
    (study / "two.yaml").write_text(EXPERIMENT)
    (study / "three.yaml").write_text(EXPERIMENT)
    begun, last = [], threading.Event()

    def run(one, pairs):
        begun.append(one.short)
        if one.short == "two":
            assert last.wait(20.0)
        return one.short != "one"

    def sweep(one, *_):
        begun.append(f"{one.short} again")
        last.set()

    monkeypatch.setattr(reproduce, "run", run)
    monkeypatch.setattr(reproduce, "sweep", sweep)
    assert not reproduce.run_all(reproduce.choose("mini", folder / "results"), [])
    assert sorted(begun[:3]) == ["one", "three", "two"] and begun[3:] == ["two again"]


def test_the_stamp_knows_the_experiment_the_settings_and_the_files(folder, study):
    (one,) = reproduce.choose("mini", folder / "results")
    one.results.mkdir(parents=True)
    before = reproduce.inputs(one, [])
    assert reproduce.inputs(one, []) == before != reproduce.inputs(one, ["threads=2"])
    result = one.results / "x.nc"
    result.write_text("x")
    completion.write(one.results, before, {"x.nc"})
    assert reproduce.is_complete(one, []) and not reproduce.is_complete(one, ["rerun=all"])
    (one.results / "of_an_earlier_version.nc").write_text("y")
    assert reproduce.is_complete(one, [])
    result.write_text("xx")
    assert not reproduce.is_complete(one, [])
    completion.write(one.results, before, {"x.nc"})
    (study / "one.yaml").write_text(EXPERIMENT + "\n")
    assert not reproduce.is_complete(one, [])


@pytest.mark.slow
def test_bisection_ends_with_a_small_interval(command, folder, study):
    (study / "one.yaml").write_text(BISECTION)
    assert command("reproduce", "mini/one").code == 0
    import mpmbench

    cube = mpmbench.open_campaign(folder / "results/mini/one")
    survived = [float(c) for c in cube.cfl if str(cube.status.sel(cfl=c).item()) == "ok"]
    failed = [float(c) for c in cube.cfl if float(c) not in survived]
    assert (
        0.5 < min(failed) < 2.0
        and max(survived) < min(failed)
        and min(failed) - max(survived) <= 0.5 * min(failed)
    )


SLOW = """\
# @package _global_
defaults:
  - override /problem: failing_bar
problem:
  fault: slow
time_step: 1.0e-5
end_time: 10.0
resolution: 4
hydra:
  mode: MULTIRUN
  sweeper:
    params:
      method: mpm
"""


@pytest.mark.slow
def test_a_request_to_terminate_ends_the_sweeps_too(folder, study, plugins, monkeypatch):
    (study / "one.yaml").write_text(SLOW)
    (study / "two.yaml").write_text(SLOW)
    monkeypatch.setenv("MPMBENCH_PLUGINS", os.pathsep.join([str(PLUGINS), str(folder / "brought")]))
    process = start("reproduce", "mini")
    for line in process.stdout:
        if "1 to run" in line:
            break
    children = psutil.Process(process.pid).children(recursive=True)
    assert children
    process.terminate()
    assert process.wait(60) == 1 and "Traceback" not in process.stderr.read()
    assert psutil.wait_procs(children, 20)[1] == []


def test_an_accident_is_no_result(command, folder, study):
    place = folder / "results/mini/one"
    place.mkdir(parents=True)
    (place / "broken.nc").write_text("no netCDF")
    (one,) = reproduce.choose("mini", folder / "results")
    (said,) = reproduce.without_result(one, {"broken.nc"})
    assert said.startswith("mini/one: broken.nc: damaged: cannot be read as netCDF: ")


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("wobes2020",), "did you mean wobbes2020?"),
        ((), "the name of a paper or an experiment is needed"),
        (("mini", "campaign=x"), "campaign is chosen by the name"),
        (("mini", "rezolution=4"), "did you mean resolution?"),
    ],
)
def test_bad_input_is_one_sentence(command, study, words, sentence):
    outcome = command("reproduce", *words)
    assert outcome.code == 2 and sentence in outcome.err and "Traceback" not in outcome.err
    assert len(outcome.err.strip().splitlines()) == 1
