"""The program also works from a wheel, in a folder with nothing in it."""

import os
import re
import shlex
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from mpmbench.results.netcdf import read_attributes

ROOT = Path(__file__).parents[2]
# Commands of the README's table, on what its examples have left.
OF_THE_TABLE = """\
list papers
status results/default
report results/ablation
compare results/default results/default
merge results/both results/default results/ablation
rerun {file}
continue {file} end_time=0.0011
export {file} --vtk
export results/ablation --csv
new material own plugins
check plugins/own.py
completion bash
warmup method=mpm basis=linear
"""


@pytest.mark.slow
def test_a_wheel_in_an_empty_folder_runs_an_experiment(tmp_path):
    command = [
        sys.executable,
        "-m",
        "pip",
        "wheel",
        "--no-deps",
        "--wheel-dir",
        str(tmp_path),
        str(ROOT),
    ]
    subprocess.run(command, check=True, capture_output=True)
    (wheel,) = tmp_path.glob("*.whl")
    zipfile.ZipFile(wheel).extractall(tmp_path / "site")
    (said,) = (tmp_path / "site").glob("*.dist-info/METADATA")
    assert links_of(said.read_text()) == []  # there is no address that they could lead to
    (tmp_path / "empty").mkdir()
    arguments = [
        "experiments=quickstart",
        "resolution=4",
        "method=mpm",
        "method.mass=consistent",
        "basis=linear",
        "report=false",
    ]
    outcome = subprocess.run(
        [sys.executable, "-P", "-m", "mpmbench", *arguments],
        cwd=tmp_path / "empty",
        env={**os.environ, "PYTHONPATH": str(tmp_path / "site")},
        capture_output=True,
        text=True,
    )
    assert outcome.returncode == 0, outcome.stderr
    assert "1 to run" in outcome.stdout
    (file,) = (tmp_path / "empty/results/quickstart").glob("*.nc")
    head = subprocess.run(["git", "-C", ROOT, "rev-parse", "HEAD"], capture_output=True, text=True)
    assert read_attributes(file)["git_commit"] == head.stdout.strip()  # a plain install knows it


@pytest.mark.slow
def test_what_a_wheel_says_of_itself_and_holds_also_without_a_checkout(tmp_path):
    exported = tmp_path / "sources"
    exported.mkdir()
    tree = subprocess.run(["git", "-C", ROOT, "archive", "HEAD"], capture_output=True, check=True)
    subprocess.run(["tar", "-x", "-C", exported], input=tree.stdout, check=True)
    with open(exported / "pyproject.toml", "a") as file:
        file.write('[project.urls]\nSource = "https://sources.test/here"\n')
    command = [sys.executable, "-m", "pip", "wheel", "--no-deps", "--wheel-dir", str(tmp_path)]
    subprocess.run([*command, str(exported)], check=True, capture_output=True)
    (wheel,) = tmp_path.glob("*.whl")
    held = set(zipfile.ZipFile(wheel).namelist())
    assert "mpmbench/commit.txt" not in held  # nobody knows it
    for name in ("CONTRIBUTING.md", "CHANGELOG.md", "py.typed", "report/page.html.jinja"):
        assert f"mpmbench/{name}" in held
    assert {name.partition("/")[0].partition("-")[0] for name in held} == {"mpmbench"}
    zipfile.ZipFile(wheel).extractall(tmp_path / "site")
    (tmp_path / "empty").mkdir()
    outcome = subprocess.run(
        [sys.executable, "-P", "-m", "mpmbench.benchmarks", "--help"],
        cwd=tmp_path / "empty",
        env={**os.environ, "PYTHONPATH": str(tmp_path / "site")},
        capture_output=True,
        text=True,
    )
    assert outcome.returncode == 0 and "mpmbench.benchmarks" in outcome.stdout, outcome.stderr
    assert "--json FILE" in outcome.stdout and "--compare FILE" in outcome.stdout
    (said,) = [name for name in held if name.endswith("METADATA")]
    text = zipfile.ZipFile(wheel).read(said).decode()
    assert "Project-URL: Source" in text and "Keywords: " in text and "Typing :: Typed" in text
    targets = links_of(text)
    assert len(targets) > 10
    assert all(target.startswith(("https://sources.test/here/", "#")) for target in targets)


def links_of(text: str) -> list[str]:
    """Targets of the links in a description."""
    return re.findall(r"\]\(([^)]*)\)", text)


def commands_of_readme() -> list[str]:
    """Every command line of ours in the README's blocks but the first campaign, which takes minutes."""
    blocks = re.findall(r"^```\w*\n(.*?)^```", (ROOT / "README.md").read_text(), re.M | re.S)
    lines = [line for block in blocks for line in block.splitlines()]
    return [line for line in lines if line.startswith("python -m mpmbench ")]


@pytest.mark.slow
def test_a_wheel_in_an_empty_folder_does_what_the_readme_shows(tmp_path):
    """In an environment of its own, which has the libraries of this one and nothing of the sources."""
    wheels, site, empty = (tmp_path / name for name in ("wheels", "site", "empty"))
    empty.mkdir()
    pip = [sys.executable, "-m", "pip"]
    build = [*pip, "wheel", "--no-deps", "--wheel-dir", str(wheels), str(ROOT)]
    subprocess.run(build, check=True, capture_output=True)
    (wheel,) = wheels.glob("*.whl")
    place = [*pip, "install", "--no-deps", "--target", str(site), str(wheel)]
    subprocess.run(place, check=True, capture_output=True)
    environment = {**os.environ, "PYTHONPATH": str(site)}
    environment.pop("MPMBENCH_PLUGINS", None)

    def done(*words: str) -> str:
        outcome = subprocess.run(
            [sys.executable, "-P", *words],
            cwd=empty,
            env=environment,
            capture_output=True,
            text=True,
        )
        assert outcome.returncode == 0, (words, outcome.stdout, outcome.stderr)
        return outcome.stdout

    shown = commands_of_readme()
    assert len(shown) == 9
    for line in shown:
        done(*shlex.split(line)[1:])
    file = next(empty.glob("results/default/mpm-linear-bar_fixed_ends-n8-*.nc"))
    assert read_attributes(file)["git_commit"] != "unknown"
    for line in OF_THE_TABLE.format(file=file.relative_to(empty)).splitlines():
        said = done("-m", "mpmbench", *shlex.split(line))
        assert said or line.startswith("warmup"), line
    (python,) = re.findall(r"^```python\n(.*?)^```", (ROOT / "README.md").read_text(), re.M | re.S)
    assert "resolution" in done("-c", python)
    assert list(empty.rglob("*.gif")) or list(empty.rglob("*.mp4"))
    assert done("-m", "mpmbench", "--version").startswith("0.2.0 (commit ")
    assert (site / "bin" / "mpmbench").exists()  # the script
