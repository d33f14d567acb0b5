"""Sweeps: which cells there are, which are run, and what is left of them."""

import json
import re
import shutil
from pathlib import Path

import pytest

import mpmbench
from mpmbench.results import identity, meanings, netcdf
from mpmbench.results.provenance import attributes
from mpmbench.runs.hydra.compose import compose_many
from mpmbench.runs.sweep import execute, plan
from mpmbench.settings.files import PACKAGE
from tests.runs.conftest import PLUGINS
from tests.support import unbroken


def names(folder):
    return sorted(file.stem.rsplit("-", 1)[0] for file in folder.rglob("*.nc"))


def test_a_sweep_runs_each_cell_once_and_is_resumed(command, folder):
    first = command("-m", "basis=linear,bspline", "resolution=4,5,4.0")
    assert first.code == 0 and "4 runs: 4 to run" in first.out
    assert names(folder) == sorted(
        f"mpm-{basis}-bar_fixed_ends-n{n}" for basis in ("linear", "bspline") for n in (4, 5)
    )
    times = {file: file.stat().st_mtime_ns for file in folder.rglob("*.nc")}
    next(iter(times)).unlink()
    second = command("-m", "basis=linear,bspline", "resolution=4,5")
    assert "1 to run, 3 finished before" in second.out
    now = {file: file.stat().st_mtime_ns for file in folder.rglob("*.nc")}
    assert sum(now[file] == times[file] for file in times) == 3
    assert "4 to run" in command("-m", "basis=linear,bspline", "resolution=4,5", "rerun=all").out
    assert [path.name for path in folder.iterdir()] == ["results"]


@pytest.mark.slow  # six runs
def test_lines_of_runs_of_the_same_name_say_what_tells_them_apart(command):
    sweep = ("-m", "basis=linear,bspline", "resolution=4", "end_time=1e-4", "cfl=0.4,0.5")
    said = unbroken(command(*sweep, "report=false", "method.mass=lumped").out)
    for basis in ("linear", "bspline"):
        for cfl in (0.4, 0.5):
            assert re.search(
                rf"mpm-{basis}-bar_fixed_ends-n4-\w+ .* s +cfl={cfl}: [\d.e-]+ m\n", said
            )
    alone = command(
        "-m", "basis=linear,bspline", "resolution=5", "end_time=1e-4", "report=false"
    ).out
    assert "basis.degree" not in alone and "2 runs" in alone


def test_a_key_of_another_option_makes_a_cell_inapplicable(command, folder):
    outcome = command("-m", "basis=linear,bspline", "basis.degree=1", "resolution=4")
    assert outcome.code == 0
    found = {file.name.split("-")[1]: netcdf.read_attributes(file) for file in folder.rglob("*.nc")}
    assert found["linear"]["status"] == "not_applicable"
    assert found["linear"]["reason"] == "basis=linear has no degree"
    assert json.loads(found["bspline"]["config"])["basis"]["degree"] == 1
    assert found["bspline"]["status"] == "ok"


@pytest.mark.slow  # compiles three bases with a mass of their own; cases are counted below, by `status`
def test_cases_are_pairs_and_not_a_product(command, folder):
    words = ("resolution=4", "report=false", "method=mpm", "method.mass=consistent")
    outcome = command("experiments=quickstart", *words)
    assert outcome.code == 0  # the command line beats the method of each case: three bases are left
    assert names(folder / "results/quickstart") == sorted(
        f"mpm-{basis}-bar_fixed_ends-n4" for basis in ("linear", "bspline", "maxent")
    )


def test_status_looks_up_the_cells_of_a_sweep(command, folder):
    mine = ("campaign=quickstart", "method.mass=consistent")
    command("resolution=4", *mine)
    command("resolution=8", *mine, "timing=exclusive", "repeats=1")
    outcome = command("status", "experiments=quickstart", "resolution=4,8", "repeats=1")
    assert outcome.code == 0
    assert outcome.out.splitlines()[-1] == "14 runs: 1 fresh, 1 untimed, 12 missing"
    assert "fresh" in command("status").out
    assert names(folder) == ["mpm-linear-bar_fixed_ends-n4", "mpm-linear-bar_fixed_ends-n8"]


def test_a_change_of_the_code_makes_results_stale(command, folder, monkeypatch):
    command("-m", "resolution=4")
    monkeypatch.setattr(identity, "code_hash", lambda digests: "another")
    monkeypatch.setattr("mpmbench.runs.sweep.plan.code_hash", lambda digests: "another")
    assert "1 to run" in command("-m", "resolution=4").out


def test_status_names_the_file_that_changed(command, folder, plugins, monkeypatch):
    """A comment makes nothing stale, a changed number does."""
    shutil.copytree(PLUGINS, folder / "mine")
    source = folder / "mine/failing_bar.py"
    sweep = ("-m", "problem=failing_bar", "end_time=1e-4")
    assert command(*sweep).code == 0
    monkeypatch.setenv("MPMBENCH_PLUGINS", str(folder / "mine"))
    source.write_text(
        source.read_text().replace('"""Body force that', '"""A body force that') + "\n# a remark\n"
    )
    assert "fresh " in command("status").out
    assert "fresh " in command("status", *sweep).out
    source.write_text(source.read_text().replace("t < 2e-4", "t < 3e-4"))
    for arguments in ((), sweep):
        lines = unbroken(command("status", *arguments).out).splitlines()
        (line,) = [line for line in lines if "stale " in line and "runs" not in line]
        assert line.endswith("changed since: failing_bar.py")
    assert "1 stale" in command("status", *sweep).out.splitlines()[-1]


@pytest.mark.slow
def test_joblib_runs_a_sweep_with_the_same_guarantees(command, plugins, folder):
    pytest.importorskip("hydra_plugins.hydra_joblib_launcher")
    outcome = command(
        "-m", "hydra/launcher=joblib", "hydra.launcher.n_jobs=2", "problem=failing_bar",
        "problem.fault=none,segfault,raise",
    )  # fmt: skip
    assert outcome.code == 1
    assert "2 of the runs failed" in outcome.out and "SIGSEGV" in outcome.out
    statuses = sorted(netcdf.read_attributes(file)["status"] for file in folder.rglob("*.nc"))
    assert statuses == ["crashed", "crashed", "ok"]
    assert [path.name for path in folder.iterdir()] == ["results"]


@pytest.mark.slow  # eight runs; a cube of two dimensions below
def test_the_cube_has_the_dimensions_that_vary(command, folder):
    words = ("-m", "method=mpm,otm", "basis=linear", "resolution=4,8", "material.density=1,2")
    before, _, _ = command(*words).out.partition("[1/")
    assert "mass: lumped for mpm, consistent for otm (method.mass=" in before
    cube = mpmbench.open_campaign("results/default")
    assert dict(cube.sizes) == {"method_name": 2, "resolution": 2, "material.density": 2}
    assert cube.attrs["basis"] == "linear" and cube.attrs["time_step"] == 1e-5
    assert (cube.status == "ok").all()
    one = cube.error_displacement_rms.sel(method_name="otm", resolution=8).sel(
        {"material.density": 2}
    )
    file = str(cube.file.sel(method_name="otm", resolution=8).sel({"material.density": 2}).item())
    assert float(one) == netcdf.read_scalars(Path(file))[1]["error_displacement_rms"][0]
    assert cube.error_displacement_rms.attrs["units"] == "m"
    assert cube.sel(method_name="otm").steps.sel(resolution=[4]).shape == (1, 2)
    assert cube.error_displacement_rms.sel(method_name=["otm"]).plot() is not None
    assert (
        cube.error_displacement_rms.sel(resolution=8)
        < cube.error_displacement_rms.sel(resolution=4)
    ).all()


def test_a_cube_marks_cells_without_a_run(command, folder):
    command("method=mpm", "resolution=4")
    command("method=otm", "basis=linear", "resolution=8")
    cube = mpmbench.open_campaign("results/default")
    assert cube.status.sel(method_name="mpm", resolution=8).item() == "missing"
    assert bool(cube.steps.sel(method_name="mpm", resolution=8).isnull())


def test_a_folder_without_results_or_with_foreign_files(command, folder):
    with pytest.raises(FileNotFoundError, match="no results"):
        mpmbench.open_campaign(folder)
    command("resolution=4")
    (folder / "results/default/foreign.nc").write_bytes(b"not a netCDF file")
    with pytest.warns(UserWarning, match=r"foreign\.nc: cannot be read"):
        cube = mpmbench.open_campaign("results/default")
    assert cube.status.item() == "ok"
    said = r"damaged +foreign +cannot be read as netCDF: "
    assert re.search(said, unbroken(command("status").out))


def test_the_code_hash_follows_what_a_run_uses():
    config = {
        "method": {"name": "mpm", "time": "explicit"},
        "basis": {"name": "bspline"},
        "material": {"name": "neo_hookean"},
        "problem": {"name": "bar_fixed_ends"},
    }
    files = identity.code_digests(config)
    assert {
        "case/build.py",
        "core/transfer/__init__.py",
        "core/bases/grid/bspline.py",
        "core/materials/elastic/neo_hookean.py",
    } <= set(files)
    assert {"core/bases/entropy/maxent.py", "cli.py", "runs/worker.py", "report/page.py"} & set(
        files
    ) == set()
    assert all((PACKAGE / name).exists() for name in files)


def test_comments_and_docstrings_mean_nothing_and_code_does(tmp_path):
    file = tmp_path / "some.py"

    def digest(text):
        file.write_text(text)
        return meanings.parsed(file.read_bytes())[0]

    plain = digest("import os\ndef f(x):\n    return x + 1\n")
    assert plain == digest(
        '"""Text."""\nimport os\n\n# why\ndef f(x):\n    """Doc."""\n    return x + 1  # what\n'
    )
    assert plain != digest("import os\ndef f(x):\n    return x + 2\n")
    assert plain != digest('import os\ndef f(x):\n    "not first"; y = "text"\n    return x + 1\n')


def test_the_configuration_hash_knows_what_matters():
    same = (
        "resolution=31.0",
        "end_time=1e-3",
        "limits.time=5",
        "output_dir=elsewhere",
        "campaign=other",
        "rerun=all",
    )
    other = (
        "resolution=30",
        "end_time=2e-3",
        "method.mass=consistent",
        "threads=2",
        "material.density=2",
    )
    composed = compose_many([[], *([pair] for pair in (*same, *other))])
    plain, *hashes = (identity.config_hash(config) for config, _ in composed)
    assert {
        pair for pair, found in zip((*same, *other), hashes, strict=True) if found == plain
    } == set(same)
    assert len(set(hashes)) == 1 + len(other)


def test_the_code_of_a_run_is_that_of_its_transfer_too(monkeypatch):
    monkeypatch.setenv("MPMBENCH_PLUGINS", str(PACKAGE / "samples"))
    words = ("flip", "plain_apic")
    cells = compose_many([["method=mpm", f"method.transfer={name}"] for name in words])
    done = {"status": "ok", "solver_times": []}
    answers = [
        execute.UNCHECKED | {"memory": 1.0, "earlier": attributes(config) | done}
        for config, _ in cells
    ]
    monkeypatch.setattr(execute, "check", lambda cells: answers)
    assert [cell.state for cell in plan.make_plan(cells).cells()] == ["fresh", "fresh"]


def test_the_code_of_many_runs_is_looked_up_once_for_each_choice(monkeypatch):
    """`status` of ten thousand files takes half the time."""
    looked_up = []

    def look_up(config):
        looked_up.append(config["method"]["transfer"])
        return {"file": config["method"]["transfer"]}

    monkeypatch.setattr(identity, "code_digests", look_up)
    words = [["resolution=4"], ["resolution=5"], ["resolution=4", "method.transfer=pic"]]
    digests = identity.digests_of_many()
    found = [digests(config)["file"] for config, _ in compose_many(words)]
    assert found == ["flip", "flip", "pic"] and looked_up == ["flip", "pic"]
