"""What campaigns cost besides solving: a run, doing nothing again, and the report of 200 runs. Wall-clock times."""

import os
import subprocess
import sys
import tempfile
from pathlib import Path
from statistics import mean, median
from time import perf_counter

import mpmbench
from mpmbench.settings.files import shipped_folder

from .goals import measured

ROUNDS = 5
FEW, MANY = 1, 41  # runs of two sweeps, whose difference is free of what a command costs
# What Hydra itself does for such a sweep, with a task that does nothing.
HYDRA_ALONE = """\
import sys
import hydra
from hydra.core.plugins import Plugins
from mpmbench.runs.hydra.compose import SearchPath
from mpmbench.runs.hydra.source import OptionsSource

Plugins.instance().register(OptionsSource)
Plugins.instance().register(SearchPath)

@hydra.main(version_base="1.3", config_path=sys.argv.pop(1), config_name="config")
def nothing(config):
    pass

nothing()
"""
TWO_HUNDRED = """\
# @package _global_
# Eight curves of 25 resolutions, which cost little.
end_time: 2.0e-4
cases:
  - method=mpm basis=linear
  - method=mpm basis=bspline
  - method=mpm basis=linear method.mass=consistent
  - method=mpm basis=bspline method.mass=consistent
  - method=unified basis=linear
  - method=unified basis=bspline
  - method=otm basis=linear
  - method=otm basis=maxent
hydra:
  mode: MULTIRUN
  sweeper:
    params:
      resolution: range(4,29)
"""


def seconds_of(words: list[str], folder: Path, **environment: str) -> float:
    """Wall-clock seconds of a command in a folder."""
    began = perf_counter()
    subprocess.run(
        words, cwd=folder, env={**os.environ, **environment}, check=True, stdout=subprocess.DEVNULL
    )
    return perf_counter() - began


def program(*words: str) -> list[str]:
    """Our command line."""
    return [sys.executable, "-m", "mpmbench", *words]


def overhead() -> None:
    """What a run costs in a sweep: all, the solver's part, the rest, and what Hydra's own sweeper takes."""
    print(
        "\nOne run of a sweep with warm kernels, wall-clock ms (goal: the rest below Hydra's own sweep)"
    )
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        conf = str(shipped_folder("conf"))
        times: dict[tuple[str, int], list[float]] = {}
        seconds_of(program("resolution=4"), folder)  # compiles
        for _ in range(ROUNDS):
            for number in (FEW, MANY):
                sweep = ["-m", f"resolution={','.join(str(4 + k) for k in range(number))}"]
                ours = program(*sweep, "rerun=all")
                hydra = [
                    sys.executable,
                    "-c",
                    HYDRA_ALONE,
                    conf,
                    *sweep,
                    f"hydra.sweep.dir={folder / 'hydra'}",
                ]
                times.setdefault(("all", number), []).append(seconds_of(ours, folder))
                times.setdefault(("Hydra", number), []).append(seconds_of(hydra, folder))
        cube = mpmbench.open_campaign(folder / "results/default")
        parts = {
            what: 1e3 * (median(times[what, MANY]) - median(times[what, FEW])) / (MANY - FEW)
            for what in ("all", "Hydra")
        }
        parts["solver"] = 1e3 * mean(cube.solver_time.values.ravel().tolist())
        parts["rest"] = parts["all"] - parts["solver"]
    for what, value in parts.items():
        print(f"{what:10} {value:8.1f}")
    measured("cell of a sweep besides solving", parts["rest"])


def campaign() -> None:
    """A campaign of 200 runs: doing it again when it is finished, and its report."""
    print("\nA campaign of 200 runs, wall-clock seconds")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        study = folder / "brought/conf/experiments/benchmark/two_hundred.yaml"
        study.parent.mkdir(parents=True)
        study.write_text(TWO_HUNDRED)
        brought = {"MPMBENCH_PLUGINS": str(folder / "brought")}
        print(
            f"{'first time':48} {seconds_of(program('reproduce', 'benchmark'), folder, **brought):7.2f}"
        )
        results = folder / "results/benchmark/two_hundred"
        assert len(list(results.glob("*.nc"))) == 200
        commands = {
            "again with Hydra, all finished (goal: 40)": program(
                "experiments=benchmark/two_hundred"
            ),
            "again through reproduce (goal: 3)": program("reproduce", "benchmark"),
            "report (goal: 15)": program("report", str(results)),
        }
        for what, words in commands.items():
            print(
                f"{what:48} {median(seconds_of(words, folder, **brought) for _ in range(3)):7.2f}"
            )
        page = results / "report"
        size = sum(file.stat().st_size for file in page.rglob("*") if file.is_file()) / 1e6
        print(f"{'size of the report, MB (goal: 3)':48} {size:7.2f}")
