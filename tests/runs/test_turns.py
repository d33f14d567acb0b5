"""Runs that are timed are alone on the machine; the others wait for them, but not for ever."""

import json
import threading
import time

import pytest

from mpmbench.results import netcdf
from mpmbench.results.timings import UNITS
from mpmbench.runs.process import exclusive


def held(*turns_taken):
    """When each of several runs, started one after the other, had its turn; locks tell threads apart as processes."""
    found = {}

    def hold(number, alone, seconds):
        with exclusive.turn(alone):
            found[number, "in"] = time.monotonic()
            time.sleep(seconds)
            found[number, "out"] = time.monotonic()

    threads = [
        threading.Thread(target=hold, args=(k, *taken)) for k, taken in enumerate(turns_taken)
    ]
    for thread in threads:
        thread.start()
        time.sleep(0.1)
    for thread in threads:
        thread.join(30)
    return found


def test_shared_runs_go_together_and_an_exclusive_one_waits_for_both():
    when = held((False, 0.8), (False, 0.8), (True, 0.1), (False, 0.1))
    assert when[1, "in"] < when[0, "out"]
    assert when[2, "in"] >= max(when[0, "out"], when[1, "out"])
    assert when[3, "in"] >= when[2, "out"]  # the last one does not overtake the one that waits


def test_a_run_that_is_not_timed_loses_patience_and_leaves_a_mark(monkeypatch):
    monkeypatch.setattr(exclusive, "WAIT_FOR_TIMED", 0.3)
    with exclusive.turn(alone=True) as began:
        assert exclusive.undisturbed_since(began)
        time.sleep(0.05)
        with exclusive.turn(alone=False):  # as if the first one were suspended
            assert not exclusive.undisturbed_since(began)
    with exclusive.turn(alone=True) as again:
        assert exclusive.undisturbed_since(again)


def test_exclusive_runs_are_timed_in_turn_and_completed_when_more_is_asked(command, folder):
    sweep = ("-m", "resolution=4,5", "timing=exclusive")
    out = command(*sweep, "repeats=2").out
    assert out.count("timing 2 runs in turn") == 1
    files = sorted(folder.rglob("*.nc"))
    for file in files:
        attributes, scalars = netcdf.read_scalars(file)
        assert attributes["timing_context"] == "exclusive" and len(attributes["solver_times"]) == 2
        assert scalars["solver_time"][0] == pytest.approx(sum(attributes["solver_times"]) / 2)
        assert json.loads(attributes["config"])["repeats"] == 2
        cpu = attributes["solver_cpu_times"]
        assert scalars["solver_cpu_time"][0] == pytest.approx(sum(cpu) / 2)
        assert all(
            0 < own < 1.5 * wall for own, wall in zip(cpu, attributes["solver_times"], strict=True)
        )
        assert len(attributes["load_by_others"]) == len(attributes["steal"]) == 2
    assert "0 to run" in command(*sweep, "repeats=2").out
    assert "2 to run" in command(*sweep, "repeats=3").out
    for name in UNITS:
        assert all(len(netcdf.read_attributes(file)[name]) == 3 for file in files)
    assert "0 to run" in command("-m", "resolution=4,5").out


@pytest.mark.slow
def test_timings_of_parallel_runs_do_not_count(command, folder):
    pytest.importorskip("joblib")
    sweep = ("-m", "resolution=4,5", "hydra/launcher=joblib")
    command(*sweep)
    files = sorted(folder.rglob("*.nc"))
    assert [netcdf.read_attributes(file)["timing_context"] for file in files] == ["shared"] * 2
    out = command(*sweep, "timing=exclusive", "repeats=2").out
    assert "2 to run" in out and out.count("timing 2 runs in turn") == 2
    for file in files:
        attributes = netcdf.read_attributes(file)
        assert attributes["timing_context"] == "exclusive" and len(attributes["solver_times"]) == 2


def test_a_timing_that_was_disturbed_is_taken_again(command, folder, monkeypatch):
    """Another run comes in during the first two: only later times are kept."""
    from mpmbench.runs.sweep import execute

    original, calls = execute.isolation.processes.ask, []

    def disturbed(*request, **options):
        if request[0] == "run":
            calls.append(request)
            if len(calls) <= 2:
                time.sleep(0.05)
                (exclusive.folder() / "intruded").touch()
        return original(*request, **options)

    monkeypatch.setattr(execute.isolation.processes, "ask", disturbed)
    command("resolution=4", "timing=exclusive", "repeats=1")
    (file,) = folder.rglob("*.nc")
    assert len(calls) == 3
    assert len(netcdf.read_attributes(file)["solver_times"]) == 1
