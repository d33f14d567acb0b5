"""Runs that are timed are alone on the machine; the others wait for them, but not for ever."""

import json
import multiprocessing
import time

import pytest

from mpmbench.runs import result, turns


@pytest.fixture(autouse=True)
def place(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    return tmp_path


def hold(alone, seconds, entered, log, name):
    with turns.turn(alone):
        entered.set()
        log.put((name, "in", time.monotonic()))
        time.sleep(seconds)
        log.put((name, "out", time.monotonic()))


def held(*turns_taken):
    """When each of several processes, started one after the other, had its turn."""
    context = multiprocessing.get_context("spawn")
    log, processes = context.Queue(), []
    for number, (alone, seconds) in enumerate(turns_taken):
        entered = context.Event()
        processes.append(context.Process(target=hold, args=(alone, seconds, entered, log, number)))
        processes[-1].start()
        if number == 0:
            assert entered.wait(20)
        else:
            time.sleep(0.7)
    for process in processes:
        process.join(30)
    found = {}
    for _ in range(2 * len(turns_taken)):
        name, what, when = log.get(timeout=5)
        found[name, what] = when
    return found


def test_shared_runs_go_together_and_an_exclusive_one_waits_for_both():
    when = held((False, 3.0), (False, 3.0), (True, 0.1), (False, 0.1))
    assert when[1, "in"] < when[0, "out"]
    assert when[2, "in"] >= max(when[0, "out"], when[1, "out"])
    assert when[3, "in"] >= when[2, "out"]  # the last one does not overtake the one that waits


def test_a_run_that_is_not_timed_loses_patience_and_leaves_a_mark(monkeypatch):
    monkeypatch.setattr(turns, "WAIT_FOR_TIMED", 0.3)
    with turns.turn(alone=True) as began:
        assert turns.undisturbed_since(began)
        time.sleep(0.05)
        with turns.turn(alone=False):  # as if the first one were suspended
            assert not turns.undisturbed_since(began)
    with turns.turn(alone=True) as again:
        assert turns.undisturbed_since(again)


def test_exclusive_runs_are_timed_in_turn_and_completed_when_more_is_asked(command, folder):
    sweep = ("-m", "resolution=4,5", "timing=exclusive")
    out = command(*sweep, "repeats=2").out
    assert out.count("timing 2 runs in turn") == 1
    files = sorted(folder.rglob("*.nc"))
    for file in files:
        attributes, scalars = result.read_scalars(file)
        assert attributes["timing_context"] == "exclusive" and len(attributes["solver_times"]) == 2
        assert scalars["solver_time"][0] == pytest.approx(sum(attributes["solver_times"]) / 2)
        assert json.loads(attributes["config"])["repeats"] == 2
    assert "0 to run" in command(*sweep, "repeats=2").out
    assert "2 to run" in command(*sweep, "repeats=3").out
    assert all(len(result.read_attributes(file)["solver_times"]) == 3 for file in files)
    assert "0 to run" in command("-m", "resolution=4,5").out


def test_timings_of_parallel_runs_do_not_count(command, folder):
    pytest.importorskip("joblib")
    sweep = ("-m", "resolution=4,5", "hydra/launcher=joblib")
    command(*sweep)
    files = sorted(folder.rglob("*.nc"))
    assert [result.read_attributes(file)["timing_context"] for file in files] == ["shared"] * 2
    out = command(*sweep, "timing=exclusive", "repeats=2").out
    assert "2 to run" in out and out.count("timing 2 runs in turn") == 2
    for file in files:
        attributes = result.read_attributes(file)
        assert attributes["timing_context"] == "exclusive" and len(attributes["solver_times"]) == 2


def test_a_timing_that_was_disturbed_is_taken_again(command, folder, place, monkeypatch):
    """Another run comes in during the first two: only later times are kept."""
    from mpmbench.runs import execute

    original, calls = execute.isolation.ask, []

    def disturbed(*request, **options):
        if request[0] == "run":
            calls.append(request)
            if len(calls) <= 2:
                time.sleep(0.05)
                (turns.folder() / "intruded").touch()
        return original(*request, **options)

    monkeypatch.setattr(execute.isolation, "ask", disturbed)
    command("resolution=4", "timing=exclusive", "repeats=1")
    (file,) = folder.rglob("*.nc")
    assert len(calls) == 3
    assert len(result.read_attributes(file)["solver_times"]) == 1
