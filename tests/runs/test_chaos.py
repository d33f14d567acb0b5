"""Runs, servers and whole commands are killed at random moments: nothing is lost, nothing half done looks complete.

``pytest -m slow tests/runs/test_chaos.py`` kills 200 times, under two launchers.
"""

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import psutil
import pytest

from mpmbench.report import tables
from mpmbench.report.series import order_of, studies
from mpmbench.results import netcdf
from mpmbench.results.records import read_campaign
from mpmbench.runs.sweep import ledger
from tests.runs.conftest import start, waited
from tests.runs.test_failures import computes, pids_of

SWEEP = (
    "-m",
    "method=mpm,otm",
    "basis=linear,bspline",
    "resolution=4,8,16",
    "end_time=5e-3",
    "campaign=chaos",
)
CLOCKS = ("solver_time", "solver_cpu_time", "compile_time", "wall_time", "peak_memory")
MOST_PATIENCE = 120  # seconds for one command


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("undisturbed")
    outcome = subprocess.run(
        [sys.executable, "-m", "mpmbench", *SWEEP],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    assert outcome.returncode == 0, outcome.stdout
    return folder / "results/chaos"


def cells(folder: Path) -> dict[str, list[list[str]]]:
    """All tables of a campaign without the columns that hold times."""
    found = {}
    for study in studies(read_campaign(folder)):
        orders = {
            name: {
                one.label: order
                for one in study.series
                if (order := order_of(study, one, name)) is not None
            }
            for name in ("error_displacement_rms", "error_stress_rms")
        }
        made = [
            tables.orders(study, orders),
            tables.errors(study, "error_displacement_rms"),
            tables.all_runs(study),
        ]
        for table in filter(None, [*made, tables.failures(study)]):
            kept = [
                k
                for k, name in enumerate(table.columns)
                if not any(c.replace("_", " ") in name for c in CLOCKS)
            ]
            found[table.name] = [[str(row[k].value) for k in kept] for row in table.rows]
    return found


def check_files(folder: Path, undisturbed: Path) -> None:
    """Every file is a whole result, and those that say so hold what an undisturbed run gives."""
    for file in folder.glob("*.nc"):
        dataset = netcdf.load(file)
        status, reason = dataset.attrs["status"], dataset.attrs["reason"]
        assert status in ("ok", "crashed", "interrupted"), (file, reason)
        if status == "ok":
            expected = netcdf.load(undisturbed / file.name)
            assert set(expected.variables) == set(dataset.variables)
            for name in set(expected.variables) - set(CLOCKS):
                equal = np.array_equal(dataset[name], expected[name], equal_nan=True)
                assert equal, (file, name)


def victims(session: str, command: "subprocess.Popen[str]") -> dict[str, list[int]]:
    """Processes by what they are."""
    found: dict[str, list[int]] = {"command": [command.pid], "run": [], "server": []}
    for pid in pids_of(session):
        try:
            words = psutil.Process(pid).cmdline()
            if "mpmbench.runs.process.server" in words:
                found["run" if computes(pid) else "server"].append(pid)
        except (psutil.Error, AttributeError):  # it has just ended
            continue
    return found


def disturb(
    folder: Path, undisturbed: Path, kills: int, seed: int, monkeypatch, *more: str
) -> dict[str, int]:
    """Kill so many processes of a sweep at random moments, and start the command anew when it was killed or is done."""
    monkeypatch.chdir(folder)
    monkeypatch.setenv("MPMBENCH_TEST", str(folder))
    dice = random.Random(seed)
    killed = {"command": 0, "run": 0, "server": 0, "terminated": 0}
    command = None
    deck: list[str] = []  # so that every kind has its turn
    while sum(killed.values()) < kills:
        if command is None or command.poll() is not None:
            command = start(*SWEEP, *more)
            if (
                "12 finished" in command.stdout.readline()
            ):  # done too early: give it something to do
                command.wait(MOST_PATIENCE)
                for file in dice.sample(sorted(folder.glob("results/chaos/*.nc")), 6):
                    file.unlink()
                continue
        time.sleep(dice.random() * dice.choice((0.05, 0.3, 1.0)))
        deck = deck or dice.sample(("command", "run", "run", "server", "terminated"), 5)
        what = deck[-1]
        pids = victims(str(folder), command).get("command" if what == "terminated" else what)
        if not pids or command.poll() is not None:
            continue
        try:
            os.kill(dice.choice(pids), signal.SIGTERM if what == "terminated" else signal.SIGKILL)
        except ProcessLookupError:
            continue
        killed[deck.pop()] += 1
        if what in ("command", "terminated"):
            _, errors = command.communicate(timeout=MOST_PATIENCE)
            assert "Traceback" not in errors, errors
            assert waited(lambda: not pids_of(str(folder)), 5)
        check_files(folder / "results/chaos", undisturbed)
    command.communicate(timeout=MOST_PATIENCE)
    return killed


def check_completed(folder: Path, undisturbed: Path, *more: str) -> None:
    """The same command once more completes the campaign, and nothing tells that it was disturbed."""
    command = start(*SWEEP, *more)
    out, errors = command.communicate(timeout=MOST_PATIENCE)
    assert (command.returncode, errors) == (0, ""), out
    check_files(folder / "results/chaos", undisturbed)
    assert cells(folder / "results/chaos") == cells(undisturbed)
    assert sorted(path.name for path in folder.iterdir()) == ["results"]
    assert {path.suffix for path in (folder / "results/chaos").iterdir()} == {".nc"}
    assert len(list((folder / "results/chaos").iterdir())) == 12
    place = Path(ledger.tempfile.gettempdir())
    gone = [path for path in place.glob(f"{ledger.PREFIX}*") if ledger.Ledger(path).is_leftover()]
    assert gone == [] or all(time.time() - path.stat().st_mtime < 60 for path in gone)
    assert pids_of(str(folder)) == []


@pytest.mark.slow
def test_five_kills(tmp_path, undisturbed, monkeypatch):
    killed = disturb(tmp_path, undisturbed, 5, 1, monkeypatch)
    assert sum(killed.values()) == 5 and killed["command"] and killed["run"]
    check_completed(tmp_path, undisturbed)


@pytest.mark.slow
@pytest.mark.parametrize(("launcher", "kills"), [("basic", 120), ("joblib", 80)])
def test_two_hundred_kills(tmp_path, undisturbed, monkeypatch, launcher, kills):
    more = f"hydra/launcher={launcher}"
    killed = disturb(tmp_path, undisturbed, kills, 2, monkeypatch, more)
    print(f"{launcher}: killed {killed}")
    check_completed(tmp_path, undisturbed, more)
