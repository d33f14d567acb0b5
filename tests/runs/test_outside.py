"""A basis, a method, a material and a problem from outside the package: one Python file and one YAML file each."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import xarray as xr

OUTSIDE = Path(__file__).parents[1] / "plugins" / "outside"
CHOICES = {"basis": "stored_hat", "method": "damped", "material": "simo_pister", "problem": "free_bar"}


def command(folder: Path, *arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    where = {"PYTHONPATH": os.pathsep.join([str(Path(__file__).parents[2]), str(folder)])}
    return subprocess.run(
        [sys.executable, "-m", "mpmbench", *arguments],
        cwd=folder,
        env={**os.environ, **where, **environment},
        capture_output=True,
        text=True,
        check=False,
    )


def run_one(folder: Path, *arguments: str, **environment: str) -> xr.Dataset:
    done = command(folder, *arguments, **environment)
    assert done.returncode == 0, done.stderr
    (file,) = (folder / "results" / "default").glob("*.nc")
    with xr.open_dataset(file) as result:
        return result.load()


def test_all_four_from_a_folder(tmp_path: Path) -> None:
    chosen = [f"{group}={name}" for group, name in CHOICES.items()]
    result = run_one(tmp_path, *chosen, "end_time=1e-4", MPMBENCH_PLUGINS=str(OUTSIDE))
    assert {group: result.attrs[group] for group in CHOICES} == CHOICES


def test_each_changes_what_it_is_for(tmp_path: Path) -> None:
    """The problem has an exact solution, which the basis reproduces as the built-in one does and damping spoils."""
    errors = {}
    for case, choices in {
        "built in": ["basis=linear"],
        "outside": ["basis=stored_hat"],
        "damped": ["basis=linear", "method=damped"],
    }.items():
        folder = tmp_path / case.replace(" ", "_")
        folder.mkdir()
        result = run_one(folder, "problem=free_bar", *choices, MPMBENCH_PLUGINS=str(OUTSIDE))
        errors[case] = float(result["error_displacement_relative"])
    assert errors["built in"] < 0.05
    assert errors["outside"] == pytest.approx(errors["built in"], rel=1e-6)
    assert errors["damped"] > 3.0 * errors["built in"]


def test_from_an_installed_package(tmp_path: Path) -> None:
    """A distribution that names a subpackage as the entry point ``mpmbench.plugins``."""
    shutil.copytree(OUTSIDE, tmp_path / "company" / "particles")
    for package in ("company", "company/particles"):
        (tmp_path / package / "__init__.py").write_text('"""A package."""\n')
    metadata = tmp_path / "company-1.0.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: company\nVersion: 1.0\n")
    (metadata / "entry_points.txt").write_text("[mpmbench.plugins]\ncompany = company.particles\n")
    result = run_one(tmp_path, "material=simo_pister", "resolution=8", "end_time=1e-4")
    assert result.attrs["material"] == "simo_pister"


def test_a_wrong_setting_of_a_plugin_is_bad_input(tmp_path: Path) -> None:
    done = command(tmp_path, "material=simo_pister", "material.poisson_ratio=0.7", MPMBENCH_PLUGINS=str(OUTSIDE))
    assert done.returncode == 2
    assert "material.poisson_ratio" in done.stderr
    assert not (tmp_path / "results").exists()
