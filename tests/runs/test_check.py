"""The scorecard of plug-in files, and the contract of our own problems."""

import shutil
from pathlib import Path

import pytest

import mpmbench
from mpmbench.commands import check
from mpmbench.runs.hydra import compose
from mpmbench.runs.process import scoring
from mpmbench.settings.files import PACKAGE
from mpmbench.settings.schema import options
from tests.runs.conftest import PLUGINS
from tests.support import slow_if, unbroken

OUTSIDE = Path(mpmbench.__file__).parent / "samples"


def card(out: str) -> dict[str, str]:
    """Rows of a scorecard by their names."""
    return {
        line[2:42].strip(): line[42:]
        for line in unbroken(out).splitlines()
        if line.startswith("  ") and line[2] != " "
    }


@pytest.fixture(autouse=True)
def no_plugins(monkeypatch):
    monkeypatch.setenv("MPMBENCH_PLUGINS", "")  # the command adds the folder of the file


@pytest.mark.slow  # the same twenty checks on a broken one are asked below
def test_a_plugin_that_keeps_its_contract(command):
    outcome = command("check", str(OUTSIDE / "stored_hat.py"))
    assert outcome.code == 0, outcome.out
    rows = card(outcome.out)
    assert len(rows) == 11 and all(
        marks.count("ok") >= 1 and "FAILS" not in marks for marks in rows.values()
    )
    assert rows["kronecker"].strip() == "1D ok, 1D moved ok"
    assert "20 of 20 checks passed" in outcome.out


def test_a_folder_that_is_known_by_another_spelling_is_the_same(command, folder, monkeypatch):
    (folder / "plugins").mkdir()
    shutil.copy(OUTSIDE / "stored_hat.py", folder / "plugins")
    monkeypatch.setenv("MPMBENCH_PLUGINS", "plugins/")
    monkeypatch.setattr(check, "TIME", 0.0)  # what it registers is found, and nothing is judged
    outcome = command("check", "plugins/stored_hat.py")
    assert outcome.out.startswith("basis stored_hat"), outcome.err


# a material is compiled in all dimensions
@pytest.mark.parametrize("name", [slow_if(True, "simo_pister"), "free_bar"])
def test_other_kinds_of_plugins(command, name):
    outcome = command("check", str(OUTSIDE / f"{name}.py"))
    assert outcome.code == 0, outcome.out


@pytest.mark.slow
def test_a_time_loop_that_damps_must_say_so(command, folder, monkeypatch):
    right = command("check", str(OUTSIDE / "damped.py"))
    assert right.code == 0, right.out
    monkeypatch.setenv("MPMBENCH_PLUGINS", "")
    shutil.copytree(OUTSIDE / "conf/method", folder / "conf/method")
    text = (OUTSIDE / "damped.py").read_text()
    (folder / "damped.py").write_text(text.replace("def promises(", "def promised("))
    silent = command("check", "damped.py")
    assert silent.code == 1
    assert card(silent.out)["mass and momentum"].count("FAILS") == 3
    assert "change of momentum over mass" in silent.out
    (folder / "damped.py").write_text(text.replace("damping * dt", "damping * 0.0"))
    modest = command("check", "damped.py")
    assert modest.code == 1
    assert "conservation of momentum holds and is not declared" in modest.out


@pytest.mark.slow
def test_a_transfer_is_told_from_one_with_a_wrong_sign(command):
    """The affine term of APIC, right and flipped: fields are not kept, and the order is another."""
    flipped = PLUGINS / "transfers" / "plain_flipped.py"
    right, flipped = (command("check", str(file)) for file in (OUTSIDE / "plain_apic.py", flipped))
    assert right.code == 0, right.out
    assert "compiling" in right.out.splitlines()[-1]
    assert flipped.code == 1
    rows = card(flipped.out)
    assert rows["affine fields"].count("FAILS") == 3
    assert "FAILS" in rows["order on a plate"]


@pytest.mark.slow
def test_a_grid_basis_whose_nodes_stay_keeps_its_contract(command):
    outcome = command("check", str(PLUGINS / "bases" / "averaged_hat.py"))
    assert outcome.code == 0, outcome.out
    assert "29 of 29 checks passed" in outcome.out


def test_what_is_broken_is_named_and_costs_its_own_line_only(command, folder):
    """Half the gradient, a declaration that is too modest, and a crash where many points are evaluated."""
    text = (OUTSIDE / "stored_hat.py").read_text()
    text = text.replace("[-1.0 / h, 1.0 / h]", "[-0.5 / h, 0.5 / h]").replace(
        'kronecker="everywhere"', 'kronecker="none"'
    )
    text = text.replace(
        "        outside = self",
        "        if len(x) > 4000:\n            os.abort()\n        outside = self",
        1,
    )
    (folder / "stored_hat.py").write_text("import os\n" + text)
    outcome = command("check", "stored_hat.py")
    assert outcome.code == 1
    rows = card(outcome.out)
    failing = {name for name, marks in rows.items() if "FAILS" in marks}
    assert failing == {
        "gradient is the derivative",
        "linear completeness",
        "kronecker",
        "gradient jumps",
    }
    assert "1D: relative error of the gradient 0.5, less than 2e-05 is needed" in outcome.out
    assert "interpolation at the nodes holds and is not declared" in outcome.out
    assert "1D: the process was ended by SIGABRT" in outcome.out
    assert "12 of 20 checks passed" in outcome.out


def test_what_there_was_no_time_for_is_said_to_be_unchecked(command, monkeypatch):
    monkeypatch.setattr(check, "TIME", -1.0)
    outcome = command("check", str(OUTSIDE / "stored_hat.py"))
    assert outcome.code == 1
    assert card(outcome.out)["runs on a benchmark"] == "mpmbench not checked"
    assert outcome.out.splitlines()[-1].startswith("1 of 3 checks passed")


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("import nothing_of_this_name\n", "cannot be imported: ModuleNotFoundError"),
        ("x = 1\n", "it registers nothing"),
        (None, "there is no such file"),
    ],
)
def test_files_that_are_no_plugins(command, folder, text, sentence):
    if text is not None:
        (folder / "mine.py").write_text(text)
    outcome = command("check", "mine.py")
    assert outcome.code == 2
    assert sentence in outcome.err and outcome.err.count("\n") == 1


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("name: other", "conf/basis/stored_hat.yaml has name: other, not stored_hat"),
        (
            "name: [unclosed\n",
            "conf/basis/stored_hat.yaml, line 2: not valid YAML: did not find expected ',' or ']'",
        ),
    ],
)
def test_a_plugin_with_a_bad_yaml_file(folder, monkeypatch, text, sentence):
    monkeypatch.setenv("MPMBENCH_PLUGINS", str(folder))
    (folder / "conf/basis").mkdir(parents=True)
    (folder / "conf/basis/stored_hat.yaml").write_text(text)
    assert sentence in check.declaration("basis", "stored_hat")


def test_only_a_method_needs_a_yaml_file(folder, monkeypatch):
    monkeypatch.setenv("MPMBENCH_PLUGINS", str(folder))
    for name in ("stored_hat", "damped"):
        shutil.copy(OUTSIDE / f"{name}.py", folder)
    assert check.declaration("basis", "stored_hat") == ""
    missing = "conf/method/damped.yaml, the preset of the method, is missing beside it"
    assert check.declaration("method", "damped") == missing


@pytest.mark.parametrize("name", options("problem"))
def test_our_own_problems_keep_the_contract(name):
    ((config, _),) = compose.compose_many([[f"problem={name}"]])
    ((_, case, checks),) = scoring.cases("problem", name, config)
    assert len(checks) == 5
    for one in checks.values():
        finding = one(case)
        assert finding.passed, finding.text


def test_our_own_files_can_be_checked(command):
    outcome = command("check", str(PACKAGE / "problems/bar_fixed_ends.py"))
    assert outcome.code == 0, outcome.out
    assert outcome.out.startswith("problem bar_fixed_ends\n")
