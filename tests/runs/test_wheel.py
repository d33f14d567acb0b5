"""The program also works from a wheel, in a folder with nothing in it."""

import os
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from mpmbench.results.netcdf import read_attributes

ROOT = Path(__file__).parents[2]


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
    targets = re.findall(r"\]\(([^)]*)\)", text)
    assert targets and all(target.startswith("https://") for target in targets)
