"""A command that is interrupted while others clean up after it."""

from contextlib import contextmanager

import pytest

from mpmbench.runs.hydra import compose
from mpmbench.runs.process import environment
from mpmbench.runs.sweep import launchers, session
from mpmbench.runs.sweep.ledger import Ledger
from mpmbench.runs.sweep.plan import Cell, Plan
from mpmbench.settings.schema import BadInput


@contextmanager
def cleaning_up_fails():
    try:
        yield
    finally:
        raise AttributeError("half built")


def test_an_interruption_whose_clean_up_fails_is_still_one():
    """OmegaConf, interrupted while it composes, raises an error of its own from what it had not built yet."""
    with pytest.raises(KeyboardInterrupt), compose.composing([]), cleaning_up_fails():
        raise KeyboardInterrupt
    with pytest.raises(AttributeError, match="a fault"), compose.composing([]):
        raise AttributeError("a fault")


@pytest.fixture
def of_two(monkeypatch, folder):
    """A session under a launcher with two runs, and its ledger; nothing is really run."""
    ((config, _), (other, _)) = compose.compose_many([["resolution=4"], ["resolution=5"]])
    sweep = session.Session(["hydra/launcher=joblib"])
    sweep.plan = Plan([Cell(config), Cell(other)])
    (folder / "ledger").mkdir()
    return sweep, Ledger(folder / "ledger")


def test_a_launcher_that_does_nothing_but_fail_is_given_up(of_two, monkeypatch):
    sweep, ledger = of_two
    calls = []

    def fail(pairs, function, names, *_):
        calls.append(names)
        raise RuntimeError("no cluster here")

    monkeypatch.setattr(session, "launch", fail)
    with pytest.raises(BadInput, match="hydra/launcher=joblib failed: RuntimeError: no cluster"):
        sweep.launch(ledger)
    assert len(calls) == 1


def test_what_a_dying_worker_takes_down_is_launched_again(of_two, monkeypatch):
    sweep, ledger = of_two
    first, second = (cell.name for cell in sweep.plan.to_run)
    calls = []

    def die_once(pairs, function, names, *_):
        calls.append(list(names))
        if len(calls) == 1:
            ledger.note(session.Record(first, "ok", "", "file"))
            ledger.started(second)
            raise RuntimeError("a worker was killed")

    monkeypatch.setattr(session, "launch", die_once)
    sweep.launch(ledger)
    assert calls == [[first, second], [second]]


def test_kernels_are_compiled_once_for_each_kind_of_run_and_again_when_that_failed(
    tmp_path, monkeypatch
):
    pairs = [["basis=linear"], ["basis=bspline"], ["basis=linear", "time_step=2e-5"]]
    plan = Plan([Cell(config) for config, _ in compose.compose_many(pairs)])
    compiled = []

    def compiles(config):
        compiled.append(config["basis"]["name"])
        return "ok" if config["basis"]["name"] == "linear" else "crashed, no"

    monkeypatch.setattr(environment, "cache_folder", lambda: tmp_path)
    monkeypatch.setattr(launchers, "compile_kernels", compiles)
    launchers.warm_up(plan)
    assert sorted(compiled) == ["bspline", "linear"]
    launchers.warm_up(plan)
    assert sorted(compiled) == ["bspline", "bspline", "linear"]
