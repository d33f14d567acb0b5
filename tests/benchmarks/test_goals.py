"""The table of goals says what was measured, whether it meets its goal, and how it has changed."""

import pytest

from benchmarks import goals
from benchmarks.__main__ import SECTIONS, main


@pytest.fixture
def nothing_measured(monkeypatch):
    monkeypatch.setattr(goals, "_measured", {})


def test_figures_stand_beside_their_goals_and_an_earlier_run(
    nothing_measured, tmp_path, capsys, monkeypatch
):
    monkeypatch.setitem(SECTIONS, "bar", lambda: goals.measured("second run", 1.2))
    assert main(["bar", "--json", str(tmp_path / "before.json")]) == 0
    monkeypatch.setitem(SECTIONS, "bar", lambda: goals.measured("second run", 0.6))
    monkeypatch.setitem(
        SECTIONS, "users", lambda: goals.measured("explicit over the best peer, 2D linear", 1.4)
    )
    capsys.readouterr()
    assert main(["bar", "users", "--compare", str(tmp_path / "before.json")]) == 0
    rows = [line.split() for line in capsys.readouterr().out.splitlines()[3:]]
    assert [row[-2:] for row in rows] == [["times", "no"], ["yes", "0.50"]]


@pytest.mark.parametrize("words", [["nowhere"], ["bar", "--compare", "nowhere.json"]])
def test_what_is_not_there_is_named(nothing_measured, words, capsys):
    with pytest.raises(SystemExit) as ended:
        main(words)
    assert ended.value.code == 2 and "nowhere" in capsys.readouterr().err
