"""What lies around is not run: the current folder, and code that settings name."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from mpmbench.commands.rerun import rebuild
from mpmbench.runs.process import environment
from mpmbench.settings.files import BadInput, refuse_targets
from tests.support import slow_if

ROOT = Path(__file__).parents[2]
TRAPS = (  # modules that a command imports, of the standard library and of others
    *("typing", "pathlib", "difflib", "json", "csv", "tempfile", "signal", "yaml", "hydra"),
    *("omegaconf", "numpy", "pandas", "xarray", "netCDF4", "psutil", "scipy", "hydra_plugins/a"),
)


def lay_traps(folder: Path) -> Path:
    """Modules that leave a mark when they are imported from a folder; returns the mark."""
    for name in TRAPS:
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / f"{name}.py").write_text(f"open('mark', 'a').write('{name} ')\n")
    return folder / "mark"


@pytest.mark.parametrize("arguments", ("--cfg job", slow_if(True, "export x.nc --csv")))
def test_nothing_is_imported_from_the_current_folder(tmp_path, arguments):
    mark = lay_traps(tmp_path)
    (tmp_path / "x.nc").write_text("no result")
    places = {"PYTHONPATH": str(ROOT), "PYTHONSAFEPATH": ""}
    command = [sys.executable, "-m", "mpmbench", *arguments.split()]
    done = subprocess.run(
        command, cwd=tmp_path, env=os.environ | places, capture_output=True, text=True
    )
    assert not mark.exists(), mark.read_text()
    assert "resolution:" in done.stdout or "cannot be read as netCDF" in done.stderr, done.stderr


@pytest.mark.slow
def test_workers_of_a_launcher_import_nothing_from_the_current_folder(tmp_path):
    mark = lay_traps(tmp_path)
    for name in ("joblib", "cloudpickle", "numba", "matplotlib", "argparse"):
        (tmp_path / f"{name}.py").write_text(f"open('mark', 'a').write('{name} ')\n")
    command = [sys.executable, "-m", "mpmbench", "-m", "hydra/launcher=joblib", "resolution=2,3"]
    places = {"PYTHONPATH": str(ROOT), "PYTHONSAFEPATH": "", "MPMBENCH_PLUGINS": ""}
    done = subprocess.run(
        [*command, "end_time=1e-5"], cwd=tmp_path, env=os.environ | places, capture_output=True
    )
    assert not mark.exists(), mark.read_text()
    assert done.returncode == 0 and len(list(tmp_path.glob("results/default/*.nc"))) == 2


def test_the_package_may_lie_in_the_current_folder(tmp_path):
    (tmp_path / "mpmbench").symlink_to(ROOT / "mpmbench")
    (tmp_path / "conf").symlink_to(ROOT / "conf")
    (tmp_path / "hydra_plugins").mkdir()
    (tmp_path / "hydra_plugins" / "ours.py").write_text("open('mark', 'w')")
    command = [sys.executable, "-m", "mpmbench", "--cfg", "job"]
    places = {"PYTHONPATH": "", "PYTHONSAFEPATH": ""}
    assert subprocess.run(command, cwd=tmp_path, env=os.environ | places).returncode == 0
    assert (tmp_path / "mark").exists()


@pytest.mark.parametrize("before", (None, "", "1"))
def test_workers_of_launchers_import_nothing_from_here_and_pass_that_on_to_no_plugin(
    monkeypatch, before
):
    monkeypatch.delenv("PYTHONSAFEPATH", raising=False)
    if before is not None:
        monkeypatch.setenv("PYTHONSAFEPATH", before)
    with environment.importing_nothing_from_here():
        of_workers = dict(os.environ)
    assert of_workers["PYTHONSAFEPATH"] and os.environ.get("PYTHONSAFEPATH") == before
    environment.prepare(of_workers)
    assert of_workers.get("PYTHONSAFEPATH") == (before or None)


def test_settings_of_numba_in_the_current_folder_are_refused(folder):
    (folder / ".numba_config.yaml").write_text("disable_jit: 1")
    with pytest.raises(BadInput, match=r"\.numba_config\.yaml in the current folder"):
        environment.prepare({})


EXPERIMENTS = {
    "problem: {a: {_target_: os.getcwd}}": "_target_ is refused",
    "cases: [resolution=4, basis.a._target_=b]": "_target_ is refused",
    'problem: {"\\x5ftarget_": os.getcwd}': "_target_ is refused",
    "hydra: {launcher: {_target_: os.getcwd}}": "_target_ is refused",
    "hydra: {callbacks: {a: {b: c}}}": "mode and sweeper.params only",
    "hydra: {job: {env_set: {A: b}}}": "mode and sweeper.params only",
    "hydra: {launcher: {setup: [true]}}": "mode and sweeper.params only",
    "hydra: {sweeper: {params: {resolution: 4}, a: b}}": "mode and sweeper.params only",
    "hydra: [a]": "mode and sweeper.params only",
}


@pytest.mark.parametrize("text", EXPERIMENTS)
def test_an_experiment_calls_no_code(command, folder, monkeypatch, text):
    monkeypatch.setenv("MPMBENCH_PLUGINS", str(folder))
    (folder / "experiments").mkdir()
    (folder / "experiments" / "mine.yaml").write_text(f"# @package _global_\n{text}\n")
    outcome = command("--cfg", "job", "experiments=mine")
    assert outcome.code == 2 and "mine.yaml" in outcome.err and EXPERIMENTS[text] in outcome.err


def test_presets_of_plugins_call_no_code(command, folder, monkeypatch):
    monkeypatch.setenv("MPMBENCH_PLUGINS", str(folder))
    (folder / "conf/method").mkdir(parents=True)
    (folder / "conf/method/mine.yaml").write_text("time: explicit\nmass: {_target_: os.getcwd}\n")
    outcome = command("--cfg", "job", "method=mine")
    assert outcome.code == 2 and "mine.yaml: _target_ is refused" in outcome.err


def test_configurations_of_files_call_no_code():
    groups = {group: {"name": "x"} for group in ("method", "basis", "material", "problem")}
    config = json.dumps(groups | {"limits": {"_target_": "os.getcwd"}})
    with pytest.raises(BadInput, match=r"rerun x\.nc: _target_ is refused"):
        rebuild(Path("x.nc"), {"config": config})


def test_targets_are_found_at_any_depth():
    refuse_targets({"a": [1, None, {"b": ("target", 2.0)}]}, "x")
    for content in ([{"a": {1: [{"_target_": 1}]}}], ("a", "b._target_=c"), {"x._target_.y": 1}):
        with pytest.raises(BadInput, match="x: _target_ is refused"):
            refuse_targets(content, "x")
