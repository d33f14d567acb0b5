"""What `new` writes works as it stands, and what is there is never overwritten."""

import os
import subprocess
import sys

import pytest

from mpmbench.commands.new import KINDS
from tests.support import slow_if


def passes(folder, name) -> subprocess.CompletedProcess:
    command = [sys.executable, "-m", "pytest", "-q", "-n", "0", f"plugins/tests/test_{name}.py"]
    environment = os.environ | {"MPMBENCH_PLUGINS": ""}
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)


@pytest.mark.slow
def test_the_test_of_a_plugin_fails_when_that_is_broken(command, folder):
    assert command("new", "material", "my_own", "plugins").code == 0
    file = folder / "plugins/my_own.py"
    file.write_text(file.read_text().replace("0.5 * law.lame", "0.6 * law.lame"))
    assert passes(folder, "my_own").returncode == 1


@pytest.mark.parametrize(
    "kind",
    [slow_if(kind != "problem", kind) for kind in KINDS],  # the others compile kernels of their own
)
def test_every_kind_works(command, folder, kind):
    assert command("new", kind, "my_own", "plugins").code == 0
    done = passes(folder, "my_own")
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("basis",), "a kind (basis, method, transfer, material, problem, paper), a name"),
        (("bases", "mine", "here"), "did you mean basis?"),
        (("basis", "My-Own", "here"), "small letters"),
        (("basis", "bspline", "here"), "there is a basis of that name already"),
        (("paper", "wobbes2020", "here"), "there is a paper of that name already"),
        (("transfer", "flip", "here"), "there is a transfer of that name already"),
    ],
)
def test_bad_input_writes_nothing(command, folder, words, sentence):
    outcome = command("new", *words)
    assert outcome.code == 2 and sentence in outcome.err
    assert not list(folder.iterdir())


def test_an_existing_file_is_kept(command, folder):
    (folder / "plugins").mkdir()
    (folder / "plugins/mine.py").write_text("# mine\n")
    outcome = command("new", "basis", "mine", "plugins")
    assert outcome.code == 2 and "exists, and is kept" in outcome.err
    assert (folder / "plugins/mine.py").read_text() == "# mine\n"
