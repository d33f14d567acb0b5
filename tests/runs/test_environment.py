"""Where compiled kernels are kept."""

import os
import re

import pytest

from mpmbench.results import identity
from mpmbench.runs.process import environment
from tests.runs.conftest import PLUGINS


@pytest.fixture
def plain(tmp_path, monkeypatch):
    """The cache without plug-ins, with one kernel in it."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.delenv("MPMBENCH_PLUGINS", raising=False)
    folder = environment.cache_folder()
    (folder / "core").mkdir()
    (folder / "core/kernel.nbc").write_text("compiled")
    return folder


def test_a_cache_for_plugins_starts_with_what_is_compiled_without_them(plain, monkeypatch):
    monkeypatch.setenv("MPMBENCH_PLUGINS", str(PLUGINS))
    folder = environment.cache_folder()
    assert folder != plain and (folder / "core/kernel.nbc").read_text() == "compiled"
    (folder / "core/own.nbc").write_text("of a plug-in")
    (folder / "core/kernel.nbc").unlink()
    assert (
        environment.cache_folder() == folder and not (folder / "core/kernel.nbc").exists()
    )  # not begun again
    assert [file.name for file in plain.rglob("*.nbc")] == ["kernel.nbc"]
    assert sorted(path.name for path in plain.parent.iterdir()) == sorted([plain.name, folder.name])


def test_a_disk_without_links_begins_an_empty_cache(plain, monkeypatch):
    def refuse(source, target):
        raise PermissionError("no links here")

    monkeypatch.setattr(environment.os, "link", refuse)
    monkeypatch.setenv("MPMBENCH_PLUGINS", str(PLUGINS))
    folder = environment.cache_folder()
    assert list(folder.iterdir()) == [] and len(list(plain.parent.iterdir())) == 2


def test_processes_that_compute_share_one_cache_and_leave_threads_to_the_solver(plain):
    prepared = {"PYTHONPATH": "elsewhere"}
    environment.prepare(prepared)
    assert prepared["NUMBA_CACHE_DIR"] == str(plain)
    assert {prepared[f"{name}_NUM_THREADS"] for name in ("OPENBLAS", "OMP", "MKL")} == {"1"}
    assert prepared["PYTHONPATH"].split(os.pathsep) == [
        str(environment.PACKAGE.parent),
        "elsewhere",
    ]


def test_kernels_are_compiled_anew_after_changes_in_what_they_are_compiled_from_only():
    found = {str(file.relative_to(environment.PACKAGE)) for file in identity.kernel_files()}
    for decorated in environment.PACKAGE.joinpath("core").rglob("*.py"):
        text = decorated.read_text()
        if re.search(r"^@(compiled|lean|inlined|summing|implements)\b", text, re.MULTILINE):
            assert str(decorated.relative_to(environment.PACKAGE)) in found
    assert {
        "core/compiled/rows.py",
        "core/walls.py",
        "core/state.py",
        "core/bases/grid/pairs.py",  # by name, and without a decorator of its own
    } <= found  # imported by kernels
    assert {"problems/plate_axis_aligned.py"} <= found  # its body force is compiled
    assert found.isdisjoint({"problems/soil_column.py", "core/loops/newmark.py", "case/build.py"})
