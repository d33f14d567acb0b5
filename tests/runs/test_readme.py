"""The README's examples do what it says: commands in the order of the text, then the Python lines."""

import re
import shlex
from pathlib import Path

from mpmbench.cli import VERBS

README = Path(__file__).parents[2] / "README.md"


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", README.read_text(encoding="utf-8"), re.DOTALL)


def test_the_examples_of_the_readme_work(command, folder, capfd):
    commands = [line for block in blocks("console") for line in block.splitlines()]
    assert len(commands) == 6
    for line in commands:
        words = shlex.split(line)
        assert words[:3] == ["python", "-m", "mpmbench"]
        outcome = command(*words[3:])
        assert outcome.code == 0, (line, outcome)
    (code,) = blocks("python")
    exec(code, {})
    assert "resolution" in capfd.readouterr().out
    assert len(list(folder.glob("results/default/otm-maxent-bar_fixed_ends-n31-*.nc"))) == 1
    assert len(list(folder.glob("results/default/*.nc"))) == 13
    assert len(list(folder.glob("results/ablation/*.nc"))) == 4


def test_every_command_is_in_the_table():
    rows = re.findall(r"^\| `(\w+)", README.read_text(encoding="utf-8"), re.MULTILINE)
    assert set(VERBS) <= set(rows)


def test_the_two_commands_of_the_readme_are_the_ones_that_are_tested():
    text = README.read_text(encoding="utf-8")
    assert "pip install -e . && python -m mpmbench experiments=quickstart" in text
    ci = (README.parent / ".ci/run").read_text(encoding="utf-8")
    assert "pip install -e '.[test]' && pytest" in text
    assert re.search(r"-e '\.\[test\]' && pytest", ci)
