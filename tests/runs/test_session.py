"""A command that is interrupted while others clean up after it."""

from contextlib import contextmanager
from dataclasses import replace

import psutil
import pytest
from hydra.core.hydra_config import HydraConfig

from mpmbench.runs.hydra import compose, launch
from mpmbench.runs.process import environment
from mpmbench.runs.sweep import launchers, session
from mpmbench.runs.sweep.ledger import Ledger
from mpmbench.runs.sweep.plan import Cell, Plan
from mpmbench.settings.schema import BadInput
from tests.runs.conftest import start


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


@pytest.mark.parametrize("one_has_ended", [True, False])
def test_what_a_dying_worker_takes_down_is_launched_again(of_two, monkeypatch, one_has_ended):
    sweep, ledger = of_two
    first, second = (cell.name for cell in sweep.plan.to_run)
    calls = []

    def die_once(pairs, function, names, *_):
        calls.append(list(names))
        if len(calls) == 1:
            if one_has_ended:
                ledger.note(session.Record(first, "ok", "", "file"))
            ledger.started(second)
            raise RuntimeError("a worker was killed")

    monkeypatch.setattr(session, "launch", die_once)
    sweep.launch(ledger)
    assert calls == [[first, second], [second] if one_has_ended else [first, second]]


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


def test_a_worker_of_joblib_is_one_job_that_takes_runs_one_after_the_other(tmp_path, monkeypatch):
    """Hydra keeps 0.1 MiB for each job until the end."""
    pytest.importorskip("hydra_plugins.hydra_joblib_launcher")
    done, jobs = [], []

    class Launcher:
        def launch(self, overrides, first):
            jobs.extend(overrides)
            for job in overrides:
                HydraConfig.instance().set_config(self.config)
                self.task_function(job)
            return []

    def instantiate(self, config, task_function, hydra_context):
        launcher = Launcher()
        launcher.config, launcher.task_function = config, task_function
        return launcher

    monkeypatch.setattr(launch.Plugins, "instantiate_launcher", instantiate)
    names = [f"run{k}" for k in range(200)]
    for _ in range(2):  # the second time as after the death of a worker
        launch.launch(["hydra/launcher=joblib"], done.append, names, tmp_path, 2)
        assert done == names and len(jobs) == 2
        done.clear()
        jobs.clear()
    words = ["hydra/launcher=joblib", "hydra.launcher.n_jobs=4"]
    launch.launch(words, done.append, names, tmp_path, 2)
    assert done == names and len(jobs) == 4  # as many as were asked for


@pytest.mark.parametrize("by_others", (0, 1, 2))
def test_what_another_process_has_timed_meanwhile_is_not_timed_again(
    folder, monkeypatch, by_others
):
    """Three repeats are wanted: one is known, the other process does some, and the rest is ours."""
    ((config, _),) = compose.compose_many([["timing=exclusive", "repeats=3"]])
    record = session.Record("run", "ok", "", "file", timings={"solver_times": [1.0]})
    record.name = session.result_path(config).stem
    on_disk = [1.0] + by_others * [2.0]

    def run(_, alone, earlier):
        assert alone
        on_disk[:] = [*earlier["solver_times"], 3.0]
        return replace(record, timings={"solver_times": list(on_disk)})

    monkeypatch.setattr(session.execute, "run", run)
    monkeypatch.setattr(session.isolation.processes, "renew", lambda: None)
    monkeypatch.setattr(
        session, "record_of", lambda _: replace(record, timings={"solver_times": list(on_disk)})
    )
    records = {record.name: record}
    session.repeat_timings([config], records)
    assert records[record.name].solver_times == [1.0] + by_others * [2.0] + (2 - by_others) * [3.0]


@pytest.mark.slow
@pytest.mark.parametrize("launcher", ["basic", "joblib"])
def test_a_command_does_not_grow_with_its_runs(folder, launcher):
    process = start(
        "-m", "resolution=4", "end_time=1e-5", "cfl=range(0.1,0.3,0.001)", f"hydra/launcher={launcher}"
    )  # fmt: skip
    sizes = []
    for line in process.stdout:
        if line.startswith("["):
            sizes.append(psutil.Process(process.pid).memory_info().rss / 2**20)
    assert process.wait() == 0 and len(sizes) == 200
    print(launcher, sizes[50], sizes[-1])
    assert sizes[-1] - sizes[50] < 150 * 0.03  # MiB
