"""The examples are short and run in an empty folder."""

import runpy
from pathlib import Path

import pytest

from tests.support import slow_if

EXAMPLES = sorted((Path(__file__).parents[1] / "examples").glob("*.py"))


# a sweep from Python is an example of the README too
@pytest.mark.parametrize(
    "example",
    [slow_if(file.stem == "sweep", file) for file in EXAMPLES],
    ids=lambda file: file.stem,
)
def test_an_example_runs(example, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert len(example.read_text().splitlines()) <= 20
    runpy.run_path(str(example))
    assert "ok" in capsys.readouterr().out
