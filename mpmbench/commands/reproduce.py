"""The command ``reproduce``: all experiments of a paper, what is missing of them, and then its report.

Experiments that ask for exclusive timing run alone, the others two at a time, each as a program of
its own; when none is left to begin, a second program shares the runs of one that is under way. An
experiment that is complete is known by a stamp in its folder, so that a second call composes nothing.
"""

import hashlib
import json
import os
import re
import subprocess
import sys
import threading
import time
from collections.abc import Iterable, Mapping
from concurrent.futures import FIRST_EXCEPTION, ThreadPoolExecutor, wait
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mpmbench.commands import bisect
from mpmbench.core.registry import VARIABLE
from mpmbench.results import completion
from mpmbench.results.private import temporary_folder
from mpmbench.runs.interrupts import terminated_like_interrupted
from mpmbench.runs.sweep.display import shorten
from mpmbench.runs.sweep.reporting import build as build_report
from mpmbench.runs.sweep.reporting import is_younger
from mpmbench.say import say
from mpmbench.settings.arguments import value_of
from mpmbench.settings.files import PACKAGE, joined, papers, read_yaml, shipped_folder
from mpmbench.settings.schema import BadInput, did_you_mean, experiments

AT_A_TIME = 2
# A numerical failure is what some experiments are made to show: it is a result. These are not.
NOT_RESULTS = ("crashed", "interrupted", "timeout", "out_of_memory", "damaged")
SOURCES = (  # of runs, and of what makes them out of an experiment
    *(f"{room}/**/*.py" for room in ("core", "problems", "analysis", "case", "settings")),
    *("results/*.py", "runs/hydra/*.py", "runs/sweep/plan.py"),
)
_running: set["subprocess.Popen[str]"] = set()
_stop = threading.Event()


@dataclass(frozen=True)
class Experiment:
    """One experiment: its name with the folder, its file, and where its results go."""

    name: str
    file: Path
    results: Path

    @property
    def short(self) -> str:
        """Its name without the folder."""
        return self.name.rpartition("/")[2]

    @property
    def alone(self) -> bool:
        """Whether it needs the machine for itself."""
        return bool(read_yaml(self.file).get("timing") == "exclusive")

    @property
    def plugins(self) -> Path | None:
        """The paper's own folder of plug-ins, when the experiment names one of them.

        It is beside the experiment, or beside its folder ``experiments``.
        """
        words = set(re.findall(r"\w+", self.file.read_text(encoding="utf-8")))
        for place in self.file.parents[:2]:
            brought = {option.stem for option in (place / "plugins").glob("conf/*/*.yaml")}
            if brought & words:
                return place / "plugins"
        return None


def main(arguments: list[str]) -> int:
    """``reproduce PAPER`` or ``reproduce EXPERIMENT``, with further KEY=VALUE for all runs.

    The exit code is 0 when every run has come to a result, be it that the method broke down; 1
    otherwise.
    """
    given = [word for word in arguments if "=" not in word]
    pairs = [word for word in arguments if "=" in word]
    if len(given) != 1:
        known = ", ".join(groups())
        raise BadInput(f"reproduce: the name of a paper or an experiment is needed: {known}")
    for key in ("experiments", "campaign"):
        if value_of(key, pairs):
            raise BadInput(f"reproduce: {key} is chosen by the name; leave it out")
    name = given[0].strip("/")
    output = Path(value_of("output_dir", pairs, "results"))
    chosen = choose(name, output)
    folder = output / name
    started = time.perf_counter()
    todo = [one for one in chosen if not is_complete(one, pairs)]
    say(f"{name}: {len(chosen)} experiments, {len(chosen) - len(todo)} complete")
    with terminated_like_interrupted():
        finished = run_all(todo, pairs)
    say(f"runs: {time.perf_counter() - started:.1f} s")
    reported = report(name, folder, chosen)
    return 0 if reported and finished else 1


def groups() -> list[str]:
    """Folders of experiments, and experiments in none."""
    return sorted({name.partition("/")[0] for name in experiments()})


def choose(name: str, output: Path) -> list[Experiment]:
    """The experiment of that name, or all in the folder of that name; those that run alone first."""
    found = [
        Experiment(one, file, output / (read_yaml(file).get("campaign") or one))
        for one, file in experiments().items()
        if one == name or one.startswith(f"{name}/")
    ]
    if not found:
        known = [*groups(), *experiments()]
        hint = did_you_mean(name, known)
        raise BadInput(f"reproduce {name}: there is no such paper or experiment{hint}")
    return sorted(found, key=lambda one: (not one.alone, one.name))


def is_complete(experiment: Experiment, pairs: list[str]) -> bool:
    """Whether its stamp fits the code, the configuration and the result files that are there now."""
    asks_again = value_of("rerun", pairs, "missing") != "missing"
    return not asks_again and completion.is_valid(experiment.results, inputs(experiment, pairs))


def inputs(experiment: Experiment, pairs: list[str]) -> str:
    """Digest of all that the results of an experiment depend on."""
    conf, plugins = shipped_folder("conf"), experiment.plugins
    more = plugins.rglob("*") if plugins else ()
    files = [
        experiment.file,
        *sorted(conf.rglob("*.yaml")),
        *sorted(file for pattern in SOURCES for file in PACKAGE.glob(pattern)),
        *sorted(file for file in more if file.suffix in (".py", ".yaml")),
    ]
    digest = hashlib.sha256(json.dumps(sorted(pairs)).encode())
    for file in files:
        digest.update(str(file).encode() + b"\0" + file.read_bytes() + b"\0")
    return digest.hexdigest()


def run_all(todo: list[Experiment], pairs: list[str]) -> bool:
    """Run experiments, those that time first and alone, then the others side by side; whether all runs have results.

    Whatever ends this early ends the sweeps that it has started, with their records.
    """
    together = iter([experiment for experiment in todo if not experiment.alone])
    under_way: list[Experiment] = []
    at_a_time = min(AT_A_TIME, os.cpu_count() or 1)
    pool = ThreadPoolExecutor(at_a_time)

    def work() -> None:
        for one in together:  # whichever thread comes first
            under_way.append(one)
            done.append(run(one, pairs))
            under_way.remove(one)
        for one in tuple(under_way):  # sweeps that want the same runs share them
            sweep(one, one.name, pairs, with_plugins(os.environ, one.plugins))

    _stop.clear()
    try:
        done = [run(experiment, pairs) for experiment in todo if experiment.alone]
        workers = [pool.submit(work) for _ in range(at_a_time)]
        wait(workers, return_when=FIRST_EXCEPTION)
        for worker in workers:
            if worker.done():
                worker.result()
    except BaseException:
        _stop.set()
        for process in list(_running):
            process.terminate()
        raise
    finally:
        pool.shutdown(wait=True, cancel_futures=True)
    return all(done)


def run(experiment: Experiment, pairs: list[str]) -> bool:
    """One experiment, as a user would start it; answers whether every run has come to a result."""
    environment = with_plugins(os.environ, experiment.plugins)
    before = inputs(experiment, pairs)
    sweep(experiment, experiment.name, pairs, environment)
    names = cells(experiment, pairs, environment)
    bisection = bisect.asked_for(experiment.file)
    while bisection:
        names = bisect.related(bisection.key, experiment.results, names)
        cases = bisect.next_round(bisection, experiment.results, names)
        if not cases:
            break
        with temporary_folder("mpmbench-") as folder:
            name = bisect.write_round(experiment.file, experiment.name, cases, folder)
            sweep(experiment, name, pairs, with_plugins(environment, folder))
    bad = list(without_result(experiment, names))
    for line in bad:
        say(line)
    if not bad:
        completion.write(experiment.results, before, names)
    return not bad


def with_plugins(environment: Mapping[str, str], folder: Path | str | None) -> dict[str, str]:
    """An environment with one more folder of plug-ins, if there is one."""
    return {**environment, VARIABLE: joined(environment.get(VARIABLE, ""), str(folder or ""))}


def cells(experiment: Experiment, pairs: list[str], environment: dict[str, str]) -> set[str]:
    """Names of the result files of all cells, whichever else the folder holds from earlier versions."""
    command = [sys.executable, "-m", "mpmbench", "status", f"experiments={experiment.name}", *pairs]
    done = subprocess.run(command, capture_output=True, text=True, env=environment)
    known = {file.stem: file.name for file in experiment.results.glob("*.nc")}
    return {known[word] for word in done.stdout.split() if word in known}


def sweep(experiment: Experiment, name: str, pairs: list[str], environment: dict[str, str]) -> None:
    """Start a sweep and pass its lines on; raises `BadInput` with what it says of its input."""
    command = [
        sys.executable,
        "-m",
        "mpmbench",
        f"experiments={name}",
        *pairs,
        "report=false",
    ]  # the paper has one
    if _stop.is_set():
        raise KeyboardInterrupt
    options: dict[str, Any] = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
    # In a session of its own, so that Ctrl-C comes to it once, from us.
    process = subprocess.Popen(command, env=environment, start_new_session=True, **options)
    _running.add(process)
    try:
        assert process.stdout is not None
        last = "bad input"
        for line in process.stdout:
            last = line.strip() or last
            if line.startswith(("[", "mpmbench:", "timing", "waiting")) or " to run" in line:
                say(f"{experiment.short:<18}{line.rstrip()}")
        code = process.wait()
    except BaseException:
        process.terminate()
        process.wait()
        raise
    finally:
        _running.discard(process)
    if _stop.is_set():
        raise KeyboardInterrupt
    if code == 2:
        raise BadInput(f"reproduce {experiment.name}: {last.removeprefix('mpmbench: ')}")


def without_result(experiment: Experiment, names: set[str]) -> Iterable[str]:
    """A line for every run that ended by accident rather than by its method."""
    from mpmbench.results.netcdf import look

    if not names:
        yield f"{experiment.name}: no results"
    for name in sorted(names):
        found, damage = look(experiment.results / name)
        found = found or {"status": "damaged", "reason": damage}
        if found["status"] in NOT_RESULTS:
            yield f"{experiment.name}: {name}: {found['status']}: {found['reason']}"


def report(name: str, folder: Path, chosen: list[Experiment]) -> bool:
    """The paper's own report; that of each campaign where there is none."""
    file = papers().get(name)
    if file is None:
        built = [build_report(one.results, only_when_older=True) for one in chosen]
        return all(built)
    page = Path("reports") / name / "index.html"
    if not (page.exists() and is_younger(page, [*folder.rglob("*.nc"), *page_sources(name, file)])):
        from mpmbench.papers import build

        page = build(name, folder.parent)
    say(f"report: {shorten(str(page))}")
    return True


def page_sources(name: str, file: Path) -> list[Path]:
    """What makes the page of a paper: its own files, those that all papers share, and the drawing."""
    shared = [PACKAGE / "papers", PACKAGE / "report", PACKAGE / "analysis"]
    own = [*file.parent.rglob("*.py")] if file.parent.name == name else [file]
    return own + [source for room in shared for source in room.iterdir() if source.is_file()]
