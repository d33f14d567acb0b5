"""One run from the command line to its file, and what stays light before it."""

import json
import os
import subprocess
import sys
import time

import numpy as np
import pytest
import xarray as xr

from mpmbench.commands import list as listing
from mpmbench.results import netcdf
from mpmbench.settings.schema import options

ATTRIBUTES = {
    "schema_version", "status", "reason", "config", "config_hash", "problem", "method", "basis", "material", "mass",
    "resolution", "time_step", "particles_per_cell", "mpmbench_version", "git_commit", "git_dirty", "python",
    "numpy_version", "numba_version", "xarray_version", "host", "cpu", "threads", "started", "timing_context",
    "Conventions", "code_hash",
}  # fmt: skip


def test_a_run_prints_its_errors_and_leaves_one_file(command, folder):
    outcome = command("method=otm", "basis=maxent", "resolution=8")
    assert outcome.code == 0 and outcome.err == ""
    assert (
        "displacement error" in outcome.out
        and "energy drift" in outcome.out
        and "compiling" in outcome.out
    )
    files = [path for path in folder.rglob("*") if path.is_file()]
    assert len(files) == 1
    assert str(files[0].relative_to(folder)) in outcome.out
    dataset = netcdf.load(files[0])
    assert set(dataset.attrs) >= ATTRIBUTES
    assert dataset.attrs["status"] == "ok" and dataset.attrs["mass"] == "consistent"
    assert files[0].name == f"otm-maxent-bar_fixed_ends-n8-{dataset.attrs['config_hash'][:8]}.nc"
    printed = float(outcome.out.split("displacement error")[1].split()[0])
    assert printed == pytest.approx(float(dataset.error_displacement_rms), rel=1e-5)
    final = dataset.isel(snapshot=-1)
    recomputed = np.sqrt(((final.displacement - final.displacement_exact) ** 2).sum("dim").mean())
    assert float(recomputed) == pytest.approx(float(dataset.error_displacement_rms))
    for name in dataset.data_vars:
        assert "units" in dataset[name].attrs and "long_name" in dataset[name].attrs, name
    assert 0 < float(dataset.solver_time) < float(dataset.wall_time)
    assert 0 < float(dataset.solver_cpu_time) < float(dataset.wall_time)
    assert 20 < float(dataset.peak_memory) < 4000
    assert 0 <= dataset.load_by_others < 1000 or np.isnan(dataset.load_by_others)
    assert "solver_times" not in dataset.attrs  # it was not timed


def test_a_second_run_replaces_the_file_with_the_same_numbers(command, folder):
    command("resolution=4")
    (file,) = folder.rglob("*.nc")
    first = netcdf.load(file)
    command("resolution=4.0", "time_step=0.00001", "report=false", "limits.time=99")
    (same,) = folder.rglob("*.nc")
    second = netcdf.load(same)
    assert file == same
    timing = ["solver_time", "solver_cpu_time", "compile_time", "wall_time", "peak_memory"]
    xr.testing.assert_identical(
        first.drop_attrs().drop_vars(timing), second.drop_attrs().drop_vars(timing)
    )


def test_the_method_brings_its_basis_and_the_command_line_beats_it(command):
    for arguments, basis in (((), "linear"), (("method=otm",), "maxent"), (("method=unified",), "bspline"),
                             (("method=otm", "basis=linear"), "linear")):  # fmt: skip
        assert f"basis:\n  name: {basis}\n" in command("--cfg", "job", *arguments).out


def test_a_problem_sets_defaults_for_a_method_unless_they_were_given(command, plugins):
    def shown(*arguments):
        return command("--cfg", "job", "problem=failing_bar", *arguments).out

    assert "mass: lumped\n  transfer: nodal" in shown("method=otm")
    assert "mass: consistent\n  transfer: nodal" in shown("method=otm", "method.mass=consistent")
    assert "transfer: flip" in shown("method=mpm")
    assert "viscosity" not in shown()
    assert "young_modulus: 5.0" in shown("material.young_modulus=5")


def test_report_true_writes_a_report_and_a_failing_report_loses_nothing(
    command, folder, monkeypatch
):
    import mpmbench.report

    def broken(path):
        raise RuntimeError("no ink")

    def quick(path):
        (path / "report").mkdir()
        page = path / "report" / "index.html"
        page.touch()
        os.utime(page, (time.time() + 1.0,) * 2)  # a clock may tick more slowly than this writes
        return page

    monkeypatch.setattr(mpmbench.report, "build", quick)
    assert "report: results/default/report/index.html" in command("resolution=4", "report=true").out
    monkeypatch.setattr(mpmbench.report, "build", broken)
    assert (
        command("-m", "resolution=4", "report=true").code == 0
    )  # nothing ran, and the report is there
    outcome = command("-m", "resolution=4", "report=auto", "rerun=all")
    assert outcome.code == 1, "a sweep writes its report by default"
    assert (
        "the report failed (RuntimeError: no ink); the results are in results/default"
        in outcome.err
    )
    assert netcdf.read_attributes(next(folder.rglob("*.nc")))["status"] == "ok"
    assert command("resolution=4").code == 0, "one run writes none"
    assert command("-m", "resolution=4", "report=false", "rerun=all").code == 0


@pytest.mark.parametrize("arguments", ["--help", "list", "--version"])
def test_nothing_heavy_is_imported_to_answer(arguments):
    code = (
        f"import sys; from mpmbench.cli import main; assert main(['{arguments}']) == 0;"
        "loaded = {'numba', 'numpy', 'xarray', 'matplotlib', 'hydra', 'scipy'} & set(sys.modules);"
        "assert not loaded, loaded"
    )
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)


def test_the_parent_of_a_run_stays_light(folder):
    code = (
        "import sys; from mpmbench.cli import main; assert main(['resolution=4']) == 0;"
        "loaded = {'numba', 'xarray', 'matplotlib', 'scipy'} & set(sys.modules); assert not loaded, loaded"
    )
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)


def test_the_process_that_runs_are_forked_from_loads_what_they_need_and_no_more(folder):
    """Each of these takes a tenth of a second or more, which a run with a lumped mass on a grid does without."""
    code = (
        "import sys; from mpmbench.runs.process import worker; from mpmbench.core import registry;"
        "[registry.get('basis', name) for name in ('linear', 'bspline')];"
        "import numpy as np; from mpmbench.core.energies import kinetic_energy;"
        "assert kinetic_energy(np.ones(1), np.ones((1, 1))) == 0.5;"
        "unwanted = ('xarray', 'pandas', 'matplotlib', 'scipy.sparse', 'scipy.spatial', 'scipy.linalg');"
        "loaded = set(unwanted) & set(sys.modules); assert not loaded, loaded"
    )
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)


def test_cfg_job_prints_what_a_run_records(command, folder):
    from omegaconf import OmegaConf

    shown = OmegaConf.to_container(
        OmegaConf.create(command("--cfg", "job", "basis=bspline", "resolution=5").out)
    )
    assert not (folder / "results").exists()
    command("basis=bspline", "resolution=5")
    assert json.loads(netcdf.read_attributes(next(folder.rglob("*.nc")))["config"]) == shown


def test_list_names_what_there_is(command, monkeypatch):
    out = command("list").out
    for name in (
        "mpm",
        "otm",
        "unified",
        "linear",
        "bspline",
        "maxent",
        "neo_hookean",
        "bar_fixed_ends",
        "quickstart",
    ):
        assert f"\n  {name} " in out
    few = {"method": ("mpm", "sph"), "basis": ("maxent", "sph_kernel")}

    def some(group):
        return {
            name: file for name, file in options(group).items() if name in few.get(group, [name])
        }

    monkeypatch.setattr(listing, "options", some)
    table = command("list", "bar_fixed_ends")
    assert table.code == 0
    keys, _, rest = table.out.partition("\nmethods and bases that apply\n")
    found, _, reasons = rest.partition("\nthose that do not, and why\n")
    layouts = [line.split()[:2] for line in keys.splitlines()]
    assert ["problem.particle_layout:", "midpoint"] in layouts
    assert [line.split() for line in found.splitlines()] == [["mpm", "maxent"], ["sph", "-"]]
    pairs = [line.split(":")[0].strip() for line in reasons.splitlines() if line[2] != " "]
    assert pairs == ["mpm, sph_kernel", "sph, maxent", "sph, sph_kernel"]
    third = " ".join(reasons.split())
    assert max(map(len, table.out.splitlines())) <= 80
    assert "its 372 particles must be the 32 nodes" in third
