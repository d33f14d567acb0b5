"""Result files with hostile attributes, and damaged ones: every command names them and uses the others."""

import io
import json
import math
import random
import shutil
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import redirect_stderr, redirect_stdout, suppress
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import markupsafe
import netCDF4
import numpy as np
import pytest

import mpmbench
from mpmbench.cli import main
from mpmbench.report import writer as files
from mpmbench.results import netcdf
from mpmbench.runs.process import isolation, worker
from mpmbench.runs.sweep import execute
from mpmbench.settings.schema import BadInput
from tests.report.conftest import make_run
from tests.support import edited

pytestmark = pytest.mark.slow
ATTACK = '"><img src=q onerror="document.title=1"><script>document.title=1</script>'
TEXTS = (
    "",
    " ",
    "x" * 10**5,
    "../../../x",
    ATTACK,
    "\x1b[31m\n\r",
    "\u202e",
    "a\x00b",
    "=1+1",
    "$^$",
)
WORDS = ("null", "[]", "{}", '{"a": 1}', "NaN", "auto", "ok", "exclusive", "-1", "8")
NUMBERS = (0, -1, 1, 2**62, -(2**63), math.nan, math.inf, -math.inf, 1e308, 5e-324, 0.5)
LISTS = ([1, 2], [math.nan], ["a", "b"], [1e308] * 50)
VALUES = (*TEXTS, *WORDS, *NUMBERS, *LISTS)
SETTINGS = (
    *(None, True, "", ATTACK, "../x", -1, 0, 1e308, math.nan, math.inf, 2**70, 10**400),
    *([], [[1]], {}, {"a": {"b": 1}}, [None], ["a", 1], ["a", ["b"]]),
)
AT_A_TIME = 50  # files in a folder
Change = Callable[[netCDF4.Dataset], None]


@pytest.fixture(autouse=True)
def _quick(monkeypatch) -> None:
    """Nothing is computed, and the figures of one folder in ten are drawn, in one format."""
    draw = files.Writer.picture
    blank = markupsafe.Markup("<svg></svg>")

    def picture(writer: files.Writer, name: str, title: str, caption: str, figure: Any) -> Any:
        if writer.target.parent.name.endswith("0"):
            return draw(writer, name, title, caption, figure)
        return files.Picture(name, title, caption, blank)

    def enough(*arguments: Any, **named: Any) -> None:
        raise BadInput("this is far enough")

    monkeypatch.setattr(execute, "reasons_against", enough)
    monkeypatch.setattr(execute, "run", enough)
    monkeypatch.setattr(isolation.processes, "warm_up", lambda: None)
    monkeypatch.setattr(files.Writer, "picture", picture)
    monkeypatch.setattr(files, "FORMATS", {"svg": files.FORMATS["svg"]})


def said(words: list[str], wrong: Counter[str]) -> str:
    """What a command prints; an exception or a traceback is counted as wrong."""
    out = io.StringIO()
    try:
        with redirect_stdout(out), redirect_stderr(out):
            main(words)
    except Exception as error:
        wrong[f"{words[0]}: {type(error).__name__}: {str(error)[:200]}"] += 1
    if "Traceback" in out.getvalue():
        wrong[f"{words[0]}: traceback"] += 1
    return out.getvalue()


def try_all(folder: Path, good: Path, wrong: Counter[str]) -> dict[str, str]:
    """Use a folder by every command; what each says. Any that does not use the good file is wrong."""
    name, place = good.name, str(folder)
    shutil.copy(good, folder / name)
    told = {"status": said(["status", place], wrong)}
    told["merge"] = said(["merge", f"{place}-merged", place], wrong)
    told["export"] = said(["export", place, "--csv", "--vtk"], wrong)
    told["compare"] = said(["compare", place, str(good.parent)], wrong)
    said(["compare", str(good.parent), place], wrong)
    reported = said(["report", place], wrong)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            files = mpmbench.open_campaign(folder).file.values.ravel().tolist()
        except Exception as error:
            wrong[f"open_campaign: {type(error).__name__}: {str(error)[:200]}"] += 1
            files = []
        told["cube"] = "\n".join(str(one.message) for one in caught)
    used = {
        "status": good.stem in told["status"],
        "merge": Path(f"{place}-merged", name).exists(),
        "export": name in text_of(folder / "export/runs.csv"),
        "compare": " runs in both" in told["compare"] and "\n0 runs" not in told["compare"],
        "report": name in text_of(folder / "report/index.html"),
        "cube": bool(files),
    }
    wrong.update(f"{command}: the good file is not used" for command in used if not used[command])
    if not used["report"]:
        wrong[f"report: {reported[-200:]}"] += 1
    return told


def text_of(file: Path) -> str:
    """What a file holds; nothing when it is not there."""
    return file.read_text(encoding="utf-8") if file.exists() else ""


def report_wrong(wrong: Counter[str]) -> None:
    """Print what went wrong, the commonest first."""
    for what, number in wrong.most_common():
        print(f"{number:5} {what}")


def set_attribute(name: str, value: Any) -> Change:
    return lambda data: data.setncattr(name, value)


def remove_attribute(name: str) -> Change:
    return lambda data: data.delncattr(name)


def set_setting(keys: tuple[str, ...], value: Any, remove: bool = False) -> Change:
    def change(data: netCDF4.Dataset) -> None:
        config = json.loads(data.config)
        place = config
        for key in keys[:-1]:
            place = place[key]
        if remove:
            del place[keys[-1]]
        else:
            place[keys[-1]] = value
        data.config = json.dumps(config)

    return change


def set_label(variable: str, key: str, value: Any) -> Change:
    return lambda data: data[variable].setncattr(key, value)


def set_number(variable: str, value: float) -> Change:
    def change(data: netCDF4.Dataset) -> None:
        data[variable][...] = value

    return change


def add_variable(name: str, kind: Any, dimensions: tuple[str, ...] = ()) -> Change:
    def change(data: netCDF4.Dataset) -> None:
        data.createVariable(name, kind, dimensions)

    return change


def single_changes(base: Path) -> list[Change]:
    """Every attribute, setting and label with every hostile value, or without it."""
    with netCDF4.Dataset(base) as data:
        attributes, variables = data.ncattrs(), list(data.variables)
        config = json.loads(data.config)
    keys = [(key,) for key in config]
    keys += [(key, name) for key, one in config.items() if isinstance(one, dict) for name in one]
    keys += [(key,) for key in ("cfl", "", "a.b", ATTACK)]
    keys += [("method", name) for name in ("", "name.name", ATTACK, "time", "degree")]
    changes = [set_attribute(name, value) for name in attributes for value in VALUES]
    changes += [set_attribute(name, ATTACK) for name in ("x_version", "solver_times", "steal")]
    changes += [remove_attribute(name) for name in attributes]
    changes += [set_setting(key, value) for key in keys for value in SETTINGS]
    changes += [set_setting(key, None, remove=True) for key in keys if config.get(key[0])]
    scalars = [name for name in variables if name.startswith(("error", "solver", "steps", "time"))]
    changes += [set_label(name, "units", value) for name in scalars for value in VALUES[::4]]
    changes += [set_number(name, value) for name in scalars for value in NUMBERS[5:9]]
    changes += [set_number(name, math.nan) for name in ("position", "stress", "momentum")]
    changes += [add_variable(name, "f8") for name in ("status", "problem", ATTACK, "load", "file")]
    changes += [add_variable("words", kind) for kind in (str, "S1", "i1", "u8")]
    return changes


def changed_files(base: Path, folder: Path, changes: list[tuple[Change, ...]]) -> Iterator[Path]:
    """Copies of a file, each with its changes and a digest that fits."""
    for number, together in enumerate(changes):
        file = folder / f"{number // AT_A_TIME:03}" / f"case-{number:05}.nc"
        file.parent.mkdir(exist_ok=True)
        shutil.copy(base, file)
        with suppress(Exception), edited(file) as data:  # what cannot be written needs no reader
            for change in together:
                with suppress(KeyError, AttributeError):  # an earlier change has removed it
                    change(data)
        yield file


def test_hostile_attributes(tmp_path, counts):
    """Files that are whole and say strange things, one or two at once."""
    base = make_run(tmp_path / "good", "mpm", "linear", 8)
    random.seed(15)
    changes = [(one,) for one in single_changes(base)]
    random.shuffle(changes)
    singles = changes[:1600]
    changes = singles + [a + b for a, b in zip(singles[:400], singles[400:800], strict=True)]
    files = list(changed_files(base, tmp_path, changes))
    counts("hostile attributes", 2000, len(files))
    wrong: Counter[str] = Counter()
    for folder in sorted({file.parent for file in files}):
        told = try_all(folder, base, wrong)
        for file in files:
            if file.parent == folder:
                reason = netcdf.look(file)[1]
                for command, text in told.items():
                    if reason and reason not in text:
                        wrong[f"{command}: {reason} is not said"] += 1
                for words in (["status"], ["rerun"], ["export", "--csv", "--vtk"]):
                    said([words[0], str(file), *words[1:]], wrong)
    report_wrong(wrong)
    counts("wrong answers to hostile attributes", 0, wrong.total())


def places_of_arrays(file: Path) -> list[tuple[int, int]]:
    """Where the arrays of a result stand in its bytes: first byte and number of bytes."""
    content, found = file.read_bytes(), []
    for variable in netcdf.load(file).variables.values():
        raw = np.ascontiguousarray(variable.values).tobytes()
        if content.count(raw) == 1:
            found.append((content.find(raw), len(raw)))
    return found


def test_a_changed_byte_of_an_array_is_always_found(tmp_path, counts):
    base = make_run(tmp_path, "otm", "maxent", 8)
    random.seed(16)
    content, places = base.read_bytes(), places_of_arrays(base)
    before, found, changed = netcdf.load(base), 0, 0
    for _ in range(200):
        start, size = random.choice(places)
        damaged = bytearray(content)
        damaged[start + random.randrange(size)] ^= 1 << random.randrange(8)
        base.write_bytes(damaged)
        found += bool(netcdf.look(base)[1])
        with netCDF4.Dataset(base) as data:
            changed += any(
                data[name][...].tobytes() != before[name].values.tobytes()
                for name in before.variables
            )
    counts("single bytes changed in an array", 200, changed)
    counts("of them found", 200, found)


def damage(content: bytes) -> bytes:
    """A file cut off, overwritten in part, or with one byte changed or many."""
    out = bytearray(content)
    kind, at = random.randrange(5), random.randrange(len(content))
    if kind == 0:
        return content[:at]
    if kind == 1:
        out[at : at + 512] = bytes(255 - byte for byte in out[at : at + 512])
    elif kind == 2:
        for _ in range(50):
            out[random.randrange(len(out))] = random.randrange(256)
    else:
        out[at] ^= 1 << random.randrange(8)
    return bytes(out)


@pytest.mark.parametrize("age", ("with a digest", "of an older version"))
def test_damaged_files(tmp_path, counts, age):
    """400 of each age; without a digest some damage is read, but nothing ends by it."""
    base = make_run(tmp_path / "good", "mpm", "linear", 8)
    source = base
    if age != "with a digest":
        source = tmp_path / "old.nc"
        old = netcdf.load(base)
        old.attrs["schema_version"] = 1
        old.to_netcdf(source)
    random.seed(17)
    wrong: Counter[str] = Counter()
    named = 0
    config = {**json.loads(netcdf.read_attributes(base)["config"]), "output_dir": str(tmp_path)}
    for number in range(400 // AT_A_TIME):
        folder = tmp_path / f"{number}"
        folder.mkdir()
        files = [folder / f"case-{number}-{k}.nc" for k in range(AT_A_TIME)]
        for file in files:
            file.write_bytes(damage(source.read_bytes()))
        reasons = {file: netcdf.look(file)[1] for file in files}
        told = try_all(folder, base, wrong)
        answers: list[dict[str, Any]] = []
        line = SimpleNamespace(send=lambda part, answers=answers: answers.append(part[1]))
        worker.check(line, [(config, "not now", str(file)) for file in files])
        for file, answer in zip(files, answers, strict=True):
            texts = [*told.values()] if reasons[file] else []
            is_named = all(file.name in text or file.stem in text for text in texts)
            named += is_named and answer["damage"] == reasons[file]
            for words in (["status"], ["rerun"], ["export", "--csv"]):
                text = said([words[0], str(file), *words[1:]], wrong)
                if reasons[file] and file.stem not in text:
                    wrong[f"{words[0]}: the file is not named"] += 1
        if age == "with a digest":
            wrong["damaged, and not found"] += sum(not reason for reason in reasons.values())
    report_wrong(wrong)
    counts(f"damaged files {age}, named by all commands", 400, named)
    counts(f"wrong answers to damaged files {age}", 0, wrong.total())
