"""The command ``new``: a working plug-in to start from, made of the sample of its kind."""

import re
from pathlib import Path

from mpmbench.core.registry import PACKAGE, places
from mpmbench.say import say
from mpmbench.settings.files import BadInput, papers
from mpmbench.settings.schema import did_you_mean, options

SAMPLES = PACKAGE / "samples"
KINDS = {  # and their samples
    "basis": "stored_hat",
    "method": "damped",
    "transfer": "plain_apic",
    "material": "simo_pister",
    "problem": "free_bar",
    "paper": "bar_orders",
}
TEST = '''"""`pytest {place}` asks whether {kind}={name} keeps its contract."""

import os
import subprocess
import sys
from pathlib import Path

FOLDER = Path(__file__).parents[1]


def test_it_keeps_its_contract(tmp_path):
    words = {words}
    environment = os.environ | {{"MPMBENCH_PLUGINS": str(FOLDER)}}
    command = [sys.executable, "-m", "mpmbench", *words]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
'''


def main(arguments: list[str]) -> int:
    """``new KIND NAME FOLDER``."""
    if len(arguments) != 3:
        raise BadInput(
            f"new: a kind ({', '.join(KINDS)}), a name and a folder are needed, "
            "for example `new basis my_basis plugins`"
        )
    kind, name, folder = arguments[0], arguments[1], Path(arguments[2])
    if kind not in KINDS:
        hint = did_you_mean(kind, KINDS) or f"; there are {', '.join(KINDS)}"
        raise BadInput(f"new {kind}: there is no such kind{hint}")
    if not re.fullmatch(r"[a-z][a-z0-9_]*", name):
        raise BadInput(
            f"new {kind} {name}: a name of small letters, digits and '_' is needed, a letter first"
        )
    taken = papers() if kind == "paper" else places(kind) if kind == "transfer" else options(kind)
    if name in taken:
        raise BadInput(f"new {kind} {name}: there is a {kind} of that name already")
    files = contents(kind, name)
    existing = [place for place in files if (folder / place).exists()]
    if existing:
        raise BadInput(f"new {kind} {name}: {folder / existing[0]} exists, and is kept")
    if folder.exists() and not folder.is_dir():
        raise BadInput(f"new {kind} {name}: {folder} is not a folder")
    for place, text in files.items():
        (folder / place).parent.mkdir(parents=True, exist_ok=True)
        (folder / place).write_text(text, encoding="utf-8")
        say(folder / place)
    say(f"MPMBENCH_PLUGINS={folder} makes it known to every command, and its test passes:")
    say(f"pytest {folder / test_of(name)}")
    return 0


def contents(kind: str, name: str) -> dict[str, str]:
    """Text of each file of a new plug-in, by its place below the folder."""
    sample = KINDS[kind]
    found = {}
    for file in sorted(SAMPLES.rglob("*")):
        place = file.relative_to(SAMPLES).as_posix()
        if file.suffix in (".py", ".yaml") and re.search(rf"(^|/){sample}(\.|/)", place):
            text = file.read_text(encoding="utf-8")
            text = text.replace(camel(sample), camel(name)).replace(sample, name)
            found[place.replace(sample, name)] = text
    plugin = f'["check", str(FOLDER / "{name}.py")]'
    words = f'["reproduce", "{name}"]' if kind == "paper" else plugin
    place = test_of(name)
    found[place] = TEST.format(place=place, kind=kind, name=name, words=words)
    return found


def test_of(name: str) -> str:
    """Place of the test; not beside the plug-in, where every Python file is one."""
    return f"tests/test_{name}.py"


def camel(name: str) -> str:
    """The name of a class: ``simo_pister`` is SimoPister."""
    return "".join(part.capitalize() for part in name.split("_"))
