"""What the command line says of itself: the help of each command, `list` of anything, completion, order of results."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from mpmbench.cli import VERBS, main
from mpmbench.commands import help as words_of_commands
from mpmbench.commands.completion import OF_RESULTS, candidates
from mpmbench.commands.list import KINDS, sentences_of
from mpmbench.commands.status import in_order
from mpmbench.settings.schema import INSTANTS, TOP_LEVEL

SOURCES = Path(words_of_commands.__file__).parent


@pytest.mark.parametrize("verb", VERBS)
def test_every_command_has_help(verb, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    assert main([verb, "--help"]) == 0
    text = capsys.readouterr().out
    assert text.startswith(f"usage: python -m mpmbench {verb}") and "For example: " in text
    assert max(map(len, text.splitlines())) <= 80 or verb == "rerun"  # the name of a result
    known = "".join(file.read_text() for file in SOURCES.glob(f"{verb}*.py")) + (
        (SOURCES / "show.py").read_text() if verb == "animate" else ""
    )
    options = {*re.findall(r"(?<![\w-])--[a-z][a-z0-9-]*", text)} - {"--help"}
    assert all(f'"{option}"' in known for option in options)
    if verb in OF_RESULTS:
        offered = {word.rstrip("=") for word in candidates([verb, ""]) if word.startswith("--")}
        assert options == offered


def test_the_general_help_fits_a_terminal_of_80_columns(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    assert main(["--help"]) == 0
    text = capsys.readouterr().out
    assert max(map(len, text.splitlines())) <= 80
    keys = {line.split(":")[0].strip() for line in text.split("\nKeys, ")[1].splitlines()}
    assert {key.rpartition(".")[2] for key in (*TOP_LEVEL, *INSTANTS)} <= keys
    assert all(re.search(rf"^  {verb} ", text, re.MULTILINE) for verb in VERBS)


@pytest.mark.parametrize("kind", KINDS)
def test_list_knows_every_kind_in_one_and_in_many(kind, capsys):
    assert main(["list", kind]) == 0
    text = capsys.readouterr().out
    assert sentences_of(kind) and all(f"  {name}" in text for name in sentences_of(kind))


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("problem", "  bar_fixed_ends"),
        ("basis", "  bspline"),
        ("quickstart", "Method-basis pairs"),
        ("wobbes2020/fig6", "experiments=wobbes2020/fig6: "),
        ("li2009", "  li2009/taylor"),
        ("time_step", "cfl times the stability limit"),
        ("snapshots", "equal parts"),
        ("limits.time", "for the solver of one run"),
        ("d_max", "basis=maxent basis.d_max: 2.0"),
        ("basis.d_max", "basis=maxent basis.d_max: 2.0"),
        ("apic", "method.transfer=apic"),
        ("status", "usage: python -m mpmbench status"),
    ],
)
def test_list_knows_anything_that_there_is(name, sentence, capsys):
    assert main(["list", name]) == 0
    assert sentence in capsys.readouterr().out


def test_list_of_what_is_not_there(capsys):
    for name, hint in (
        ("quickstrat", "quickstart"),
        ("probelms", "problems"),
        ("statsu", "status"),
    ):
        assert main(["list", name]) == 2
        assert f"did you mean {hint}?" in capsys.readouterr().err


def test_words_that_may_come_next(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "results/some").mkdir(parents=True)
    (tmp_path / "results/some/a.nc").touch()
    assert {"show", "method=", "experiments=", "-m"} <= {*candidates(["sh"])}
    assert "problem=soil_column" in candidates(["method=mpm", "problem=so"])
    assert "method=mpm,otm" in candidates(["-m", "method=mpm,o"])
    assert "experiments=wobbes2020/fig6" in candidates(["experiments="])
    assert "method.mass=lumped" in candidates(["method=mpm", "method.mass="])
    assert "basis.d_max=" in candidates(["basis."])
    assert candidates(["reproduce", ""]) == [
        *("family", "family_studies", "iaconeta2017", "li2009", "wobbes2020")
    ]
    for verb in OF_RESULTS:
        assert {"results/some", "results/some/a.nc"} <= {*candidates([verb, ""])}
    assert "bar_fixed_ends" in candidates(["list", "bar"])
    assert {"--limits=", "--nodes"} <= {*candidates(["show", ""])}  # with a value, and without


@pytest.mark.skipif(shutil.which("bash") is None, reason="needs bash")
def test_bash_completes_and_says_nothing_else(tmp_path):
    script = f"""
    mpmbench() {{ {sys.executable} -m mpmbench "$@"; }}
    eval "$(mpmbench completion bash)"
    for COMP_LINE in 'mpmbench problem=soil' 'mpmbench stat' 'mpmbench "nonsense'; do
        COMP_POINT=${{#COMP_LINE}}; _mpmbench; echo "${{COMPREPLY[@]}}"
    done
    """
    done = subprocess.run(["bash", "-c", script], capture_output=True, text=True, cwd=tmp_path)
    assert (done.stdout.splitlines(), done.stderr) == (["soil_column", "status", ""], "")


def test_version_and_commit(capsys):
    assert main(["--version"]) == 0
    assert re.fullmatch(
        r"\d+\.\d+\.\d+( \(commit [0-9a-f]{12}(, edited)?\))?\n", capsys.readouterr().out
    )


def test_results_stand_in_the_order_of_their_cells():
    names = [f"mpm-linear-bar_n2-n{n}-{tail}" for n in (4, 8, 16, 128) for tail in ("0ab", "9cd")]
    assert sorted(sorted(names), key=in_order) == names
