"""Which settings there are, of which type and range, and what is said to a user who gives another one.

Classes declare their keys (`declarations`), and YAML files of the same name change defaults. Nothing
heavy is imported here.
"""

import math
import os
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

from mpmbench.core.setting import Setting, did_you_mean
from mpmbench.settings.declarations import declaration, first_sentence, registered, with_preset
from mpmbench.settings.files import BadInput, experiments, is_global, presets, read_yaml

__all__ = ["GROUPS", "BadInput", "did_you_mean", "experiments", "options"]

GROUPS = ("method", "basis", "material", "contact", "problem")
# What is a number or a truth value, unless it stands in quotes.
NO_TEXT = re.compile(r"true|false|nan|[-+]?inf|[-+]?\.?\d[\d._]*(e[-+]?\d*)?", re.IGNORECASE)
PROBLEM_DEFAULTS = ("method_defaults", "basis_defaults", "material_defaults")


def options(group: str) -> dict[str, Path]:
    """Name of every option of a group, sorted, and the file that says most about it.

    Methods are presets; bases, materials and problems register themselves.
    """
    found = presets(group) if group == "method" else presets(group) | registered(group)
    return dict(sorted(found.items()))


def preset(group: str, option: str) -> dict[str, Any]:
    """What the YAML file of an option says; empty where there is none.

    A file speaks of its group only, unless it has a key of the group's name, a list of defaults,
    or the comment ``@package _global_``.
    """
    file = presets(group).get(option)
    if file is None:
        return {}
    content = read_yaml(file)
    if isinstance(content.get(group), dict) or "defaults" in content or is_global(file):
        return content
    return {group: content}


def description(group: str, option: str) -> str:
    """One sentence about an option: of its class, else of the comment at the top of its YAML file."""
    said = declaration(group, option).sentence if group != "method" else ""
    return said or comment(presets(group)[option])


def comment(file: Path) -> str:
    """The first sentence of the comment at the top of a YAML file."""
    lines = [
        line.lstrip("# ").strip()
        for line in file.read_text(encoding="utf-8").splitlines()
        if line.startswith("#")
    ]
    return first_sentence(" ".join(line for line in lines if line and not line.startswith("@")))


def declared(group: str, option: str) -> dict[str, Setting]:
    """Keys of one option, with their defaults and what may be given.

    Those of a method are those of the time loop that its preset names. Fields of a loop that are
    no settings, or settings `by_preset`, are keys where the preset gives them.
    """
    given = {
        key: value
        for key, value in preset(group, option).get(group, {}).items()
        if key not in (*PROBLEM_DEFAULTS, "defaults", "name")
    }
    if group != "method":
        return with_preset(declaration(group, option).settings, given)
    loop = declaration(group, given.get("time", option)).settings
    kept = {
        key: one for key, one in loop.items() if key in given or (one.says and not one.by_preset)
    }
    return with_preset(kept, given)


def composed(group: str, option: str) -> dict[str, Any]:
    """What choosing an option puts into a configuration: its keys with defaults, and its preset."""
    content = preset(group, option)
    section = content.get(group, {})
    defaults = {key: one.default for key, one in declared(group, option).items()}
    kept = {key: section[key] for key in PROBLEM_DEFAULTS if key in section}
    return {**content, group: {"name": section.get("name", option), **defaults, **kept}}


def declared_anywhere(group: str) -> set[str]:
    """Keys that some option of the group has."""
    return {key for option in options(group) for key in declared(group, option)}


def time_step(value: Any) -> Any:
    """A number greater than zero, or the word auto."""
    if value == "auto":
        return value
    try:
        return POSITIVE.cast(value)
    except ValueError:
        raise ValueError("a number greater than 0, or auto, is needed") from None


def report(value: Any) -> Any:
    """True, false, or the word auto."""
    if value == "auto":
        return value
    try:
        return Setting(False, "write one").cast(value)
    except ValueError:
        raise ValueError("true, false or auto is needed") from None


def instants(value: Any) -> list[float]:
    """A list of times, sorted."""
    if not isinstance(value, list) or not all(
        isinstance(time, (int, float)) and 0 <= time < math.inf for time in value
    ):
        raise ValueError("times in brackets, as in [0.1,0.2], are needed")
    return sorted({float(time) + 0.0 for time in value})


def folder_name(value: Any) -> str:
    """A path below another folder."""
    if isinstance(value, (bool, float)):
        raise ValueError("a name is needed, in quotes if it could be something else")
    if not isinstance(value, (str, int)) or not re.fullmatch(r"[\w.+-]+(/[\w.+-]+)*", str(value)):
        raise ValueError(
            "a name of letters, digits, '_', '-' and '.' is needed, with '/' between folders"
        )
    if any(set(part) == {"."} for part in str(value).split("/")):
        raise ValueError("a folder below output_dir is needed")
    return str(value)


def text(value: Any) -> str:
    """Any text that is not empty."""
    if not isinstance(value, (str, int)) or isinstance(value, bool) or str(value) == "":
        raise ValueError("a text is needed, in quotes if it could be something else")
    if "\0" in str(value):
        raise ValueError("a text without null characters is needed")
    return str(value)


POSITIVE = Setting(1.0, "any number greater than 0", above=0.0)
AT_LEAST_ONE = Setting(1, "any whole number from 1 on", least=1)
TOP_LEVEL: dict[str, Callable[[Any], Any]] = {
    "resolution": AT_LEAST_ONE.cast,
    "time_step": time_step,
    "cfl": POSITIVE.cast,
    "end_time": POSITIVE.cast,
    "particles_per_cell": AT_LEAST_ONE.cast,
    "snapshot_times": instants,
    "threads": Setting(1, "of the solver", least=1, most=os.cpu_count() or 1).cast,
    "seed": Setting(0, "for whatever is random", least=0).cast,
    "campaign": folder_name,
    "output_dir": text,
    "rerun": Setting("missing", "which cells are run", options=("missing", "failed", "all")).cast,
    "on_error": Setting("continue", "or not", options=("continue", "stop")).cast,
    "timing": Setting("shared", "of the machine", options=("shared", "exclusive")).cast,
    "repeats": AT_LEAST_ONE.cast,
    "report": report,
    "limits.time": POSITIVE.cast,
    "limits.setup": POSITIVE.cast,
    "limits.memory": Setting(None, "of one run", unit="MiB", above=0.0).cast,
}

MOST_INSTANTS = 10_000


def how_many(value: Any) -> int | None:
    """Null or a whole number of parts of the simulated time."""
    found = None if value is None else Setting(1, "parts", least=1, most=MOST_INSTANTS).cast(value)
    return found  # type: ignore[no-any-return]


# Short for a list of instants: they add to snapshot_times, and a result keeps these only.
INSTANTS: dict[str, Callable[[Any], Any]] = {
    "snapshots": how_many,
    "snapshot_every": Setting(None, "between two", unit="s", above=0.0).cast,
}


def all_keys() -> list[str]:
    """Every key that can stand on the command line."""
    below = [f"{group}.{key}" for group in GROUPS for key in sorted(declared_anywhere(group))]
    return [*GROUPS, "experiments", *TOP_LEVEL, *INSTANTS, *below]


def unknown_key(key: str, given: str | None = None) -> BadInput:
    """The sentence about a key that does not exist."""
    known = all_keys()
    if key.rpartition(".")[2] == "name" and key.partition(".")[0] in GROUPS:
        return BadInput(f"{given or key}: choose with {key.partition('.')[0]}=")
    hint = did_you_mean(key, known) or did_you_mean(key.rpartition(".")[2], known)
    group = key.partition(".")[0]
    if not hint and group in GROUPS:
        hint = f"; {group} has {', '.join(sorted(declared_anywhere(group)))}"
    return BadInput(f"{given or key}: there is no key {key}{hint or '; see --help for the keys'}")
