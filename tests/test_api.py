"""The door for Python: the same results as the command line, in a script and in a notebook."""

import re
import subprocess
import sys

import numpy as np
import pytest
import xarray as xr

import mpmbench
from mpmbench.results.campaign import refuse_method
from mpmbench.runs.sweep import execute

SETTINGS = {"basis": "linear", "problem": "bar_fixed_ends"}


@pytest.fixture(scope="module")
def cube(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(tmp_path_factory.mktemp("api"))
        yield mpmbench.sweep(method=["mpm", "otm"], resolution=[4, 8], report=False, **SETTINGS)


def test_a_run_is_that_of_the_command_line_and_is_not_computed_twice(cube, capsys, monkeypatch):
    from mpmbench.cli import main

    assert main(["method=mpm", "basis=linear", "resolution=6", "campaign=shell"]) == 0
    capsys.readouterr()
    first = mpmbench.run(method="mpm", resolution=6, campaign="notebook", **SETTINGS)
    with monkeypatch.context() as patch:
        patch.setattr(execute, "run", None)  # it cannot be computed now
        again = mpmbench.run("resolution=6", "method=mpm", campaign="notebook", **SETTINGS)
    shell = xr.load_dataset(first.file.replace("notebook", "shell"), decode_cf=False)
    assert first.attrs["config_hash"] == shell.attrs["config_hash"]
    assert np.array_equal(first.position, shell.position)
    assert first.started == again.started and first.status == "ok"
    rerun = mpmbench.run(method="mpm", resolution=6, campaign="notebook", rerun="all", **SETTINGS)
    assert float(rerun.solver_time) != float(first.solver_time)


def test_settings_are_written_as_on_the_command_line(cube):
    result = mpmbench.run(
        resolution=np.int64(4),
        method__mass="consistent",
        snapshot_times=[0.0002, 0.0004],
        end_time=5e-4,
        basis__degree=1,
        basis="bspline",
        campaign="a-b.c",
    )
    assert result.mass == "consistent" and result.sizes["snapshot"] == 4
    assert "/results/a-b.c/" in result.file


def test_a_failed_run_is_a_result_and_bad_input_is_not(cube):
    failed = mpmbench.run(resolution=8, time_step=1.0, end_time=50.0, **SETTINGS)
    assert failed.status in ("diverged", "broke_down") and "step" in failed.reason
    with pytest.raises(mpmbench.BadInput, match="did you mean resolution"):
        mpmbench.run(resolutoin=3)
    with pytest.raises(mpmbench.BadInput, match="does not apply"):
        mpmbench.run(method="sph", basis="linear")
    with pytest.raises(mpmbench.BadInput, match="sweep"):
        mpmbench.run(experiments="quickstart")
    with pytest.raises(mpmbench.BadInput, match="greater than 0"):
        mpmbench.sweep(time_step=[1e-5, -1.0])


OPERATIONS = {
    "itself": lambda c: c,
    "variable": lambda c: c.error_displacement_rms,
    "item": lambda c: c["error_displacement_rms"],
    "where": lambda c: c.where(c.resolution > 2),
    "array where": lambda c: c.error_displacement_rms.where(c.status == "ok"),
    "xr.where": lambda c: xr.where(c.steps > 0, c.steps, 0),
    "log10": lambda c: np.log10(c.error_displacement_rms),
    "fillna": lambda c: c.error_displacement_rms.fillna(0.0),
    "arithmetic": lambda c: 2.0 * c.error_displacement_rms + 1.0,
    "ratio": lambda c: c.error_displacement_rms / c.error_displacement_rms.isel(resolution=0),
    "comparison": lambda c: c.steps > 10,
    "negative": lambda c: -c.steps,
    "subset": lambda c: c[["steps", "status"]],
    "drop_vars": lambda c: c.drop_vars("status"),
    "assign": lambda c: c.assign(twice=2 * c.steps),
    "rename": lambda c: c.rename(steps="n"),
    "isel": lambda c: c.isel(resolution=0),
    "sel": lambda c: c.sel(resolution=8),
    "nearest": lambda c: c.sel(resolution=7, method="nearest"),
    "transpose": lambda c: c.transpose(),
    "mean": lambda c: c.error_displacement_rms.mean("resolution"),
    "sortby": lambda c: c.sortby("resolution", ascending=False),
    "astype": lambda c: c.steps.astype(float),
    "copy": lambda c: c.copy(deep=True),
    "to_array": lambda c: c[["steps", "solver_time"]].to_array(),
    "concat": lambda c: xr.concat([c.steps, c.steps], "twice"),
    "groupby": lambda c: c.steps.groupby("resolution", squeeze=False).sum(),
    "pandas": lambda c: xr.Dataset.from_dataframe(c[["steps"]].to_dataframe()),
}


@pytest.mark.parametrize("name", OPERATIONS)
def test_selection_by_method_outlives_what_is_done_to_a_cube(cube, name):
    changed = OPERATIONS[name](cube)
    one = changed.sel(method_name="otm")
    assert changed.sizes["method_name"] == 2 and "method_name" not in one.sizes
    assert "method" not in changed.dims and "method" not in changed.coords


def test_a_cube_survives_a_file(cube, tmp_path):
    cube.to_netcdf(tmp_path / "cube.nc")
    with xr.open_dataset(tmp_path / "cube.nc") as stored:
        assert stored.sel(method_name="otm", resolution=8).steps == 100
        assert stored.attrs == cube.attrs


def test_a_method_where_xarray_expects_a_way_to_look_up_is_refused(cube):
    for method in ("otm", ["otm"], "mpm"):
        for what in (cube, cube.steps, cube["status"]):
            with pytest.raises(ValueError, match=re.escape(f"sel(method_name={method!r})")):
                what.sel(method=method)
    refuse_method(None)
    refuse_method("ffill")


def test_the_names_are_listed_and_found():
    assert {"run", "sweep", "Box", "register", "open_campaign"} <= set(dir(mpmbench))
    for name in mpmbench.__all__:
        assert getattr(mpmbench, name) is not None
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = mpmbench.nothing


def test_importing_the_package_loads_nothing_heavy():
    code = "import sys, mpmbench; assert not {'numba', 'xarray', 'hydra'} & set(sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True)
