"""Plug-ins that come, change and go: whatever was compiled for them concerns only the runs that use them."""

import importlib
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import mpmbench
from mpmbench.core import registry
from mpmbench.results import identity, netcdf
from tests.support import slow_if, unbroken

KERNEL = """
from numba import njit

@njit(cache=True)
def first(handle):
    return handle[0]
"""
PLUGIN = """
from typing import NamedTuple
from mpmbench.core.registry import register

class Handle(NamedTuple):
    value: float

@register("material", "mine")
class Mine:
    handle = Handle(3.0)
"""
# Each step is a process of its own, as runs are, and all share one cache.
STEPS = """
import os, sys
import numba
sys.path.insert(0, os.getcwd())
for step in sys.argv[1:]:
    word, _, rest = step.partition(" ")
    if word in ("built-in", "plug-in"):
        if os.fork() == 0:
            import kernels
            from mpmbench.core import registry
            handle = (4.0,) if word == "built-in" else registry.get("material", "mine").handle
            value = kernels.first(handle)
            hits = sum(kernels.first.stats.cache_hits.values())
            print(word, value, "from the cache" if hits else "compiled", flush=True)
            os._exit(0)
        os.wait()
    elif word == "folders":
        os.environ["MPMBENCH_PLUGINS"] = os.pathsep.join(rest.split())
    elif word == "rename":
        os.rename(*rest.split())
    elif word == "remove":
        os.unlink(rest)
    elif word == "write":
        file, _, text = rest.partition(" ")
        open(file, "w").write(text)
"""
NEW = "plug-in 3.0 compiled"
OLD = "plug-in 3.0 from the cache"
BUILT_IN = "built-in 4.0 from the cache"


@pytest.mark.parametrize(
    ("steps", "said"),
    [  # by default one that stays; slow are those that change or go
        slow_if(True, ["plug-in", "built-in"], [NEW, "built-in 4.0 compiled"]),
        (["built-in", "plug-in", "built-in", "plug-in"], [..., NEW, BUILT_IN, OLD]),
        slow_if(True, ["built-in", "plug-in", "remove one/mine.py", "built-in"], [..., NEW, BUILT_IN]),
        slow_if(
            True,
            ["plug-in", "rename one/mine.py one/other.py", "built-in", "built-in", "plug-in"],
            [NEW, ..., BUILT_IN, NEW],
        ),
        slow_if(True, ["built-in", "plug-in", "write one/mine.py import nothing", "built-in"], [..., NEW, BUILT_IN]),
        slow_if(True, ["built-in", "plug-in", "write one/mine.py x = 1", "built-in"], [..., NEW, BUILT_IN]),
        slow_if(True, ["built-in", "plug-in", "folders two", "built-in"], [..., NEW, BUILT_IN]),
        slow_if(True, ["plug-in", "folders two one", "built-in", "plug-in", "built-in"], [NEW, ..., OLD, BUILT_IN]),
    ],
)  # fmt: skip
def test_the_cache_of_kernels_outlives_plugins(tmp_path, steps, said):
    for name, text in {"one/mine.py": PLUGIN, "two/other.py": "", "kernels.py": KERNEL}.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    done = subprocess.run(
        [sys.executable, "-c", STEPS, "folders one", *steps], cwd=tmp_path, env=environment,
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    lines = done.stdout.splitlines()
    assert len(lines) == len(said), done.stderr
    assert [line for line, expected in zip(lines, said, strict=True) if expected is not ...] == [
        expected for expected in said if expected is not ...
    ]


@pytest.mark.parametrize("way", ["file", "folder"])
def test_a_module_that_was_asked_for_before_its_file_was_known(tmp_path, monkeypatch, request, way):
    """As the cache of kernels asks for it, when a folder is named or a file loaded later on."""
    name = registry.PREFIX + "early"
    request.addfinalizer(lambda: registry.forget_other(name, Path()))
    assert importlib.import_module(name).Handle.__name__ == "Handle"  # an empty one
    file = tmp_path / "early.py"
    file.write_text(PLUGIN.replace('"mine"', '"early"'))
    if way == "file":
        assert registry.load_file(file) == name
    else:
        monkeypatch.setenv("MPMBENCH_PLUGINS", str(tmp_path))
    assert registry.get("material", "early").handle == (3.0,)


@pytest.fixture
def mine(folder, monkeypatch) -> Path:
    """A copy of a material from outside, in a folder of its own."""
    (folder / "mine").mkdir()
    shutil.copy(Path(mpmbench.__file__).parent / "samples/simo_pister.py", folder / "mine")
    monkeypatch.setenv("MPMBENCH_PLUGINS", str(folder / "mine"))
    return folder / "mine/simo_pister.py"


BAR = ("resolution=4", "end_time=1e-4")
WITH = (*BAR, "material=simo_pister")


@pytest.mark.slow  # the cache is asked above, by a kernel that compiles at once
def test_built_in_runs_before_and_after_those_of_a_plugin(command, mine, folder):
    assert command(*BAR).code == 0
    assert command(*WITH).code == 0
    again = command(*BAR)
    assert again.code == 0, again.out
    mine.rename(mine.with_name("renamed.py"))
    assert command(*BAR).code == 0
    mine.with_name("renamed.py").unlink()
    assert command(*BAR).code == 0
    lines = unbroken(command("status").out).splitlines()
    (line,) = [line for line in lines if "plug-in missing" in line]
    assert "material=simo_pister: name its folder in MPMBENCH_PLUGINS" in line
    assert sum("fresh " in line for line in lines) == 1


@pytest.mark.slow
@pytest.mark.parametrize("launcher", ["basic", "joblib", "submitit_local"])
def test_a_sweep_over_built_in_and_plugin_materials(command, mine, launcher):
    pytest.importorskip("submitit" if "submitit" in launcher else "joblib")
    materials = "material=neo_hookean,simo_pister,small_strain_elastic"
    done = command("-m", *BAR, materials, "resolution=4,5", f"hydra/launcher={launcher}")
    assert done.code == 0, done.out
    again = command("-m", *BAR, materials, "resolution=6,7", f"hydra/launcher={launcher}")
    assert again.code == 0, again.out


def test_a_broken_plugin_is_a_sentence_for_those_who_use_it(command, mine, folder):
    mine.write_text(mine.read_text() + "\n\nprint(undefined)\n")
    refused = command(*WITH)
    assert refused.code == 2
    assert (
        "material=simo_pister: the plug-in simo_pister.py cannot be imported: NameError"
        in refused.err
    )
    line = mine.read_text().splitlines().index("print(undefined)") + 1
    assert f"(simo_pister.py, line {line})" in refused.err and refused.err.count("\n") == 1
    assert command(*BAR).code == 0


def test_a_name_that_two_plugins_register_is_refused_and_no_other(command, mine):
    shutil.copy(mine, mine.with_name("twin.py"))
    refused = command(*WITH)
    assert refused.code == 2 and "material=simo_pister is registered twice" in refused.err
    assert command(*BAR).code == 0


def test_a_plugin_that_is_edited_while_a_process_lives_is_the_edited_one(command, mine, folder):
    """The process that forks runs stays between commands, as in a notebook."""
    mine.write_text("raise ValueError('first')\n" + mine.read_text())
    assert "ValueError: first" in command(*WITH).err
    mine.write_text(mine.read_text().replace("'first'", "'other'"))
    assert "ValueError: other" in command(*WITH).err


def test_a_result_depends_on_the_file_of_its_plugin_and_on_no_other(mine):
    config = {
        "method": {"name": "mpm", "time": "explicit"},
        "basis": {"name": "linear"},
        "material": {"name": "simo_pister"},
        "problem": {"name": "bar_fixed_ends"},
    }
    before = identity.code_digests(config)
    assert "simo_pister.py" in before
    mine.with_name("other.py").write_text("x = 1\n")
    assert "other.py" not in identity.code_digests(config)


def test_a_crash_in_a_plugin_says_where_and_how_to_read_the_traceback(command, folder):
    outcome = command("problem=failing_bar", "problem.fault=raise")
    assert outcome.code == 1
    (file,) = folder.rglob("*.nc")
    reason = netcdf.read_attributes(file)["reason"]
    assert "ZeroDivisionError: a fault in a plug-in (failing_bar.py, line " in reason
    told = outcome.out.split("`python -m mpmbench ")[1].split("`")[0]
    assert told == f"status results/default/{file.name}"
    shown = command(*told.split()).out
    assert "Traceback (most recent call last)" in shown and "failing_bar.py" in shown
    swept = command("-m", "problem=failing_bar", "problem.fault=raise", "rerun=all")
    assert f"`python -m mpmbench {told}`" in swept.out
    assert json.loads(netcdf.read_attributes(file)["config"])["problem"]["fault"] == "raise"
