"""The program also works from a wheel, in a folder with nothing in it."""

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

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
    assert len(list((tmp_path / "empty/results/quickstart").glob("*.nc"))) == 1
