"""Which settings there are, of which type, and what is said to a user who gives another one.

The YAML files are the schema: a key exists when the file of the chosen option has it, and its type
is that of its default. Ranges below the groups are the plug-in's business. Nothing heavy is
imported here.
"""

import difflib
import math
import os
import re
from collections.abc import Callable, Iterable
from functools import cache
from pathlib import Path
from typing import Any

import yaml

from mpmbench.core.registry import plugin_folders

PACKAGE = Path(__file__).resolve().parents[1]
GROUPS = ("method", "basis", "material", "problem")
PROBLEM_DEFAULTS = ("method_defaults", "basis_defaults", "material_defaults")


class BadInput(Exception):
    """What the user gave cannot be run; the message is one sentence, the exit code is 2 unless another is given."""

    def __init__(self, sentence: str, exit_code: int = 2) -> None:
        printable = "".join(character if character.isprintable() else " " for character in sentence)
        super().__init__(" ".join(printable.split()))
        self.exit_code = exit_code


class _Loader(yaml.CSafeLoader):
    """YAML that reads 1e-5 as a number, as Hydra does."""


_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float",
    re.compile(
        r"^[-+]?(\d[\d_]*(\.[\d_]*)?([eE][-+]?\d+)?|\.\d[\d_]*([eE][-+]?\d+)?|\.(inf|Inf|nan|NaN))$"
    ),
    list("-+0123456789."),
)


@cache
def read_yaml(path: Path) -> dict[str, Any]:
    """Content of a YAML file.

    Raises
    ------
    BadInput
        When it is none, with the line.
    """
    try:
        # CSafeLoader's own rules come first, so that whole numbers stay whole.
        content = yaml.load(path.read_text(encoding="utf-8"), _Loader)
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        mark = getattr(error, "problem_mark", None)
        place = f"{path}, line {mark.line + 1}" if mark else str(path)
        raise BadInput(
            f"{place}: not valid YAML: {getattr(error, 'problem', None) or error}"
        ) from None
    return content if isinstance(content, dict) else {}


def shipped_folder(name: str) -> Path:
    """`conf` or `experiments`: inside the package when it comes from a wheel, beside it in a checkout."""
    inside = PACKAGE / name
    return inside if inside.is_dir() else PACKAGE.parent / name


def conf_folders() -> list[Path]:
    """Our own folder of options, then those of plug-ins."""
    return _conf_folders(os.environ.get("MPMBENCH_PLUGINS", ""))


@cache
def _conf_folders(plugins: str) -> list[Path]:
    return [
        shipped_folder("conf"),
        *(place / "conf" for place in plugin_folders() if (place / "conf").is_dir()),
    ]


def options(group: str) -> dict[str, Path]:
    """Name and file of every option of a group, sorted."""
    files = {
        file.stem: file
        for folder in reversed(conf_folders())
        for file in (folder / group).glob("*.yaml")
    }
    return dict(sorted(files.items()))


def papers() -> dict[str, Path]:
    """Name and file of every paper that has a report, ours and those of plug-ins, sorted.

    The file is ``papers/<name>/__init__.py``, ``papers/<name>/paper.py`` or ``papers/<name>.py``,
    and it has a line that begins with ``PAPER =``.

    Raises
    ------
    BadInput
        When two files bring a paper of the same name.
    """
    found: dict[str, Path] = {}
    for folder in (PACKAGE, *plugin_folders()):
        for pattern in ("*/__init__.py", "*/paper.py", "*.py"):
            for file in sorted((folder / "papers").glob(pattern)):
                if not re.search(r"^PAPER\b.*=", file.read_text(encoding="utf-8"), re.MULTILINE):
                    continue
                name = file.stem if pattern == "*.py" else file.parent.name
                if name in found:
                    raise BadInput(
                        f"the paper {name} is there twice: in {found[name]} and in {file}"
                    )
                found[name] = file
    return dict(sorted(found.items()))


def experiment_folders() -> dict[Path, str]:
    """Every folder of experiments, and what the names of its experiments begin with.

    ``experiments`` beside `conf`, in it, and in the folders of plug-ins; a paper may hold its own
    in ``papers/<name>/experiments``, which are then called ``<name>/...``.
    """
    places = [shipped_folder("experiments").parent, *conf_folders(), *plugin_folders()]
    found = {place / "experiments": "" for place in places}
    found |= {
        file.parent / "experiments": f"{name}/"
        for name, file in papers().items()
        if file.parent.name == name
    }
    return {folder: prefix for folder, prefix in found.items() if folder.is_dir()}


def experiments() -> dict[str, Path]:
    """Name (with the folder, as in ``wobbes2020/fig6``) and file of every experiment, sorted."""
    found = {
        prefix + file.relative_to(folder).with_suffix("").as_posix(): file
        for folder, prefix in experiment_folders().items()
        for file in folder.rglob("*.yaml")
        if "plugins"
        not in file.relative_to(folder).parts  # options that an experiment brings along
    }
    return dict(sorted(found.items()))


def declared(group: str, option: str) -> dict[str, Any]:
    """Keys of one option with their defaults."""
    file = options(group)[option]
    content = read_yaml(file)
    if "@package _global_" in file.read_text(encoding="utf-8")[:500]:
        content = content.get(group, {})
    return {
        key: value for key, value in content.items() if key not in (*PROBLEM_DEFAULTS, "defaults")
    }


def declared_anywhere(group: str) -> set[str]:
    """Keys that some option of the group has."""
    return {key for option in options(group) for key in declared(group, option)}


def whole(value: Any) -> int:
    """A whole number; 100.0 is one too."""
    if (
        not isinstance(value, (int, float))
        or isinstance(value, bool)
        or not math.isfinite(value)
        or value != int(value)
    ):
        raise ValueError("a whole number is needed")
    return int(value)


def whole_number(least: int, most: float = math.inf) -> Callable[[Any], int]:
    """A check that casts to a whole number between `least` and `most`."""
    limits = f"of at least {least}" if most == math.inf else f"from {least} to {most:g}"

    def cast(value: Any) -> int:
        try:
            given = whole(value)
        except ValueError:
            given = least - 1
        if not least <= given <= most:
            raise ValueError(f"a whole number {limits} is needed")
        return given

    return cast


def number(value: Any) -> float:
    """A finite number."""
    if not isinstance(value, (int, float)) or isinstance(value, bool) or not math.isfinite(value):
        raise ValueError("a finite number is needed")
    return float(value) + 0.0  # minus zero is zero


def positive(value: Any, also: str | None = None) -> Any:
    """A number greater than zero, or the word `also`."""
    if also is not None and value == also:
        return also
    if not isinstance(value, (int, float)) or isinstance(value, bool) or not 0 < value < math.inf:
        raise ValueError(
            "a number greater than 0" + (f", or {also}," if also else "") + " is needed"
        )
    return float(value)


def instants(value: Any) -> list[float]:
    """A list of times, sorted."""
    if not isinstance(value, list) or not all(
        isinstance(time, (int, float)) and 0 <= time < math.inf for time in value
    ):
        raise ValueError("times in brackets, as in [0.1,0.2], are needed")
    return sorted({number(time) for time in value})


def one_of(*words: str) -> Callable[[Any], str]:
    """A check for one of several words."""

    def check(value: Any) -> str:
        if value not in words:
            raise ValueError(
                f"one of {', '.join(words)} is needed{did_you_mean(str(value), words)}"
            )
        return str(value)

    return check


def folder_name(value: Any) -> str:
    """A path below another folder."""
    if not isinstance(value, (str, int, float)) or not re.fullmatch(
        r"[\w.+-]+(/[\w.+-]+)*", str(value)
    ):
        raise ValueError(
            "a name of letters, digits, '_', '-' and '.' is needed, with '/' between folders"
        )
    if any(set(part) == {"."} for part in str(value).split("/")):
        raise ValueError("a folder below output_dir is needed")
    return str(value)


def text(value: Any) -> str:
    """Any text that is not empty."""
    if not isinstance(value, (str, int, float)) or str(value) == "":
        raise ValueError("a value is needed")
    return str(value)


def boolean(value: Any) -> bool:
    """True or false."""
    if not isinstance(value, bool):
        raise ValueError("true or false is needed")
    return value


TOP_LEVEL: dict[str, Callable[[Any], Any]] = {
    "resolution": whole_number(1),
    "time_step": lambda value: positive(value, also="auto"),
    "cfl": positive,
    "end_time": positive,
    "particles_per_cell": whole_number(1),
    "snapshot_times": instants,
    "threads": whole_number(1, os.cpu_count() or 1),
    "seed": whole_number(0),
    "campaign": folder_name,
    "output_dir": text,
    "rerun": one_of("missing", "failed", "all"),
    "on_error": one_of("continue", "stop"),
    "timing": one_of("shared", "exclusive"),
    "repeats": whole_number(1),
    "report": boolean,
    "limits.time": positive,
    "limits.setup": positive,
    "limits.memory": lambda value: None if value is None else positive(value),
}


def like(value: Any, default: Any) -> Any:
    """Cast `value` to the type of `default`; a default of null takes a number or null.

    Raises
    ------
    ValueError
        With the type that is needed.
    """
    if isinstance(default, bool):
        return boolean(value)
    if isinstance(default, int):
        return whole(value)
    if isinstance(default, float):
        return number(value)
    if default is None:
        return None if value is None else number(value)
    if isinstance(default, str):
        if not isinstance(value, str) or not value:
            raise ValueError("a word is needed")
        return value
    if isinstance(default, list):
        if not isinstance(value, list):
            raise ValueError("a list in brackets is needed")
        return [like(item, default[0]) if default else item for item in value]
    return value


def refuse(key: str, value: Any, error: Exception) -> BadInput:
    """The sentence about a value that does not fit."""
    return BadInput(f"{key} = {'null' if value is None else value}: {error}")


def check_types(config: dict[str, Any]) -> tuple[dict[str, Any], str]:
    """The configuration with every value cast to its declared type, and why it does not apply, if so.

    It does not apply when a key was given that another option of the group has, but not the chosen
    one.

    Raises
    ------
    BadInput
        For a key that does not exist or a value of another type or, at the top level, range.
    """
    checked: dict[str, Any] = {}
    for key, cast in TOP_LEVEL.items():
        group, _, name = key.rpartition(".")
        value = (config.get(group) or {}).get(name) if group else config.get(name)
        if value is None and key in ("resolution", "time_step", "end_time", "particles_per_cell"):
            raise BadInput(
                f"{key}: problem={config['problem']['name']} has no default for it, so give a value"
            )
        try:
            (checked.setdefault(group, {}) if group else checked)[name] = cast(value)
        except ValueError as error:
            raise refuse(key, value, error) from None
    for key in config:
        if key not in {*TOP_LEVEL, *GROUPS, "limits"}:
            raise unknown_key(key)
    reason = ""
    for group in GROUPS:
        option = config[group]["name"]
        defaults = declared(group, option)
        checked[group] = dict(config[group])
        for name, value in config[group].items():
            if name in defaults:
                try:
                    checked[group][name] = like(value, defaults[name])
                except ValueError as error:
                    raise refuse(f"{group}.{name}", value, error) from None
            elif name in declared_anywhere(group):
                reason = reason or f"{group}={option} has no {name}"
            else:
                raise unknown_key(f"{group}.{name}")
    return checked, reason


def all_keys() -> list[str]:
    """Every key that can stand on the command line."""
    below = [
        f"{group}.{key}"
        for group in GROUPS
        for key in sorted(declared_anywhere(group))
        if key != "name"
    ]
    return [*GROUPS, "experiments", *TOP_LEVEL, *below]


def unknown_key(key: str, given: str | None = None) -> BadInput:
    """The sentence about a key that does not exist."""
    known = all_keys()
    if key.rpartition(".")[2] == "name" and key.partition(".")[0] in GROUPS:
        return BadInput(f"{given or key}: choose with {key.partition('.')[0]}=")
    hint = did_you_mean(key, known) or did_you_mean(key.rpartition(".")[2], known)
    group = key.partition(".")[0]
    if not hint and group in GROUPS:
        hint = f"; {group} has {', '.join(sorted(declared_anywhere(group) - {'name'}))}"
    return BadInput(f"{given or key}: there is no key {key}{hint or '; see --help for the keys'}")


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """``; did you mean ...?`` when something similar is known, else nothing."""
    names = list(known)
    near = difflib.get_close_matches(word, names, 1, 0.6)
    if not near:  # a key without its group
        near = [name for name in names if name.rpartition(".")[2] == word]
    return f"; did you mean {near[0]}?" if near else ""
