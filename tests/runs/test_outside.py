"""A basis, a method, a material and a problem from outside the package: one Python file and one YAML file each."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import xarray as xr

import mpmbench

OUTSIDE = Path(mpmbench.__file__).parent / "samples"
OLD_PLACES = (
    Path(__file__).parents[1] / "plugins" / "old_places"
)  # as it was written for version 0.1
CHOICES = {
    "basis": "stored_hat",
    "method": "damped",
    "material": "simo_pister",
    "problem": "free_bar",
}


def result_in(folder: Path) -> xr.Dataset:
    (file,) = folder.rglob("*.nc")
    with xr.open_dataset(file) as result:
        return result.load()


@pytest.fixture
def outside(monkeypatch) -> None:
    monkeypatch.setenv("MPMBENCH_PLUGINS", str(OUTSIDE))


def test_all_four_from_a_folder(command, folder, outside) -> None:
    assert (
        command(*[f"{group}={name}" for group, name in CHOICES.items()], "end_time=1e-4").code == 0
    )
    result = result_in(folder)
    assert {group: result.attrs[group] for group in CHOICES} == CHOICES


@pytest.mark.slow  # they are imported below, and run above in their new form
def test_all_four_as_they_were_written_for_the_version_before(command, folder, monkeypatch) -> None:
    """A step that is a function with attributes, and modules under their old names."""
    monkeypatch.setenv("MPMBENCH_PLUGINS", str(OLD_PLACES))
    assert (
        command(*[f"{group}={name}" for group, name in CHOICES.items()], "end_time=1e-4").code == 0
    )
    result = result_in(folder)
    assert {group: result.attrs[group] for group in CHOICES} == CHOICES


@pytest.mark.slow  # the class runs below; a step that is a function in tests/core/test_loops.py
def test_an_old_step_does_what_the_class_does_that_took_its_place(
    command, folder, monkeypatch
) -> None:
    """Its velocities lose the share ``100 dt`` per step, which is the default of the class."""
    found = {}
    for name, plugins in (("function", OLD_PLACES), ("class", OUTSIDE)):
        monkeypatch.setenv("MPMBENCH_PLUGINS", str(plugins))
        words = ["problem=free_bar", "method=damped", "basis=linear", "end_time=4e-4"]
        assert command(*words, f"output_dir='{folder / name}'").code == 0
        found[name] = result_in(folder / name)
    assert (found["function"].position == found["class"].position).all()
    assert float(found["class"].kinetic_energy[-1] / found["class"].kinetic_energy[0]) < 0.95


def test_a_method_brings_a_setting_of_its_own(command, folder, outside) -> None:
    """``method.damping`` is in its YAML and in its class and nowhere else."""
    energy = {}
    for damping in (0, 1000):
        place = folder / str(damping)
        words = ["problem=free_bar", "method=damped", f"method.damping={damping}"]
        assert command(*words, "end_time=1e-3", f"output_dir='{place}'").code == 0
        energy[damping] = float(result_in(place)["kinetic_energy"][-1])
    assert energy[1000] < 0.5 * energy[0]
    done = command("problem=free_bar", "method=damped", "method.damping=-1")
    assert done.code == 2
    assert "method.damping = -1" in done.err


def test_each_changes_what_it_is_for(command, folder, outside) -> None:
    """The problem has an exact solution, which the basis reproduces as the built-in one does and damping spoils."""
    errors = {}
    for case, choices in {
        "built in": ["basis=linear"],
        "outside": ["basis=stored_hat"],
        "damped": ["basis=linear", "method=damped"],
    }.items():
        place = folder / case
        assert command("problem=free_bar", *choices, f"output_dir='{place}'").code == 0
        errors[case] = float(result_in(place)["error_displacement_relative"])
    assert errors["built in"] < 0.05
    assert errors["outside"] == pytest.approx(errors["built in"], rel=1e-6)
    assert errors["damped"] > 3.0 * errors["built in"]


@pytest.mark.slow  # compiles the material once more, in a process of its own
def test_from_an_installed_package(tmp_path: Path) -> None:
    """A distribution that names a subpackage as the entry point ``mpmbench.plugins``."""
    shutil.copytree(OUTSIDE, tmp_path / "company" / "particles")
    for package in ("company", "company/particles"):
        (tmp_path / package / "__init__.py").write_text('"""A package."""\n')
    metadata = tmp_path / "company-1.0.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: company\nVersion: 1.0\n")
    (metadata / "entry_points.txt").write_text("[mpmbench.plugins]\ncompany = company.particles\n")
    arguments = ["material=simo_pister", "resolution=8", "end_time=1e-4"]
    done = subprocess.run(
        [sys.executable, "-m", "mpmbench", *arguments],
        cwd=tmp_path,
        env={
            **os.environ,
            "PYTHONPATH": os.pathsep.join([str(Path(__file__).parents[2]), str(tmp_path)]),
        },
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert result_in(tmp_path).attrs["material"] == "simo_pister"


def test_a_wrong_setting_of_a_plugin_is_bad_input(command, folder, outside) -> None:
    done = command("material=simo_pister", "material.poisson_ratio=0.7")
    assert done.code == 2
    assert "material.poisson_ratio" in done.err
    assert not (folder / "results").exists()


def test_old_places_are_named_once_with_the_new_line(command, folder, monkeypatch) -> None:
    monkeypatch.setenv("MPMBENCH_PLUGINS", str(OLD_PLACES))
    done = command("resolution=4", "end_time=2e-5")
    assert done.code == 0
    lines = [line for line in done.err.splitlines() if "simo_pister.py" in line]
    assert len(lines) == 1
    assert "from mpmbench import IsotropicElastic, Lame, cauchy_stress, determinant" in lines[0]
    (damped,) = [line for line in done.err.splitlines() if "damped.py" in line]
    assert "from mpmbench.core.loops import explicit" in damped
    monkeypatch.setenv("MPMBENCH_PLUGINS", str(OUTSIDE))
    assert command("resolution=4", "end_time=2e-5").err == ""
