"""What a result file has to hold: checked once, when it is read, so that its readers need not."""

import json
import math
from collections.abc import Callable
from typing import Any

import netCDF4
import numpy as np

from mpmbench.results import digest
from mpmbench.results.timings import UNITS
from mpmbench.results.version import KNOWN, SINCE_DIGEST

KINDS = ("method", "basis", "material", "problem")  # of choices: each has a name in a configuration
STATUSES = (
    "ok", "diverged", "broke_down", "not_converged", "timeout", "crashed", "out_of_memory", "interrupted",
    "not_applicable",
)  # fmt: skip
LARGEST = 2**63  # numbers beyond it are none of ours
MOST_SHOWN = 40  # characters of a value that is wrong


class Unfit(Exception):
    """A file does not hold what it has to; the message says what is needed."""


def is_text(value: Any) -> bool:
    """Whether a value is text."""
    return isinstance(value, str)


def is_number(value: Any) -> bool:
    """Whether a value is a number, be it infinite or none, that fits into 64 bits."""
    whole = isinstance(value, int) and not isinstance(value, bool) and abs(value) < LARGEST
    return whole or isinstance(value, float)


def is_count(value: Any) -> bool:
    """Whether a value is a whole number from 1 on."""
    return is_number(value) and not isinstance(value, float) and value >= 1


def is_step(value: Any) -> bool:
    """Whether a value is a time step: a positive number, or what was given for it as text."""
    return is_text(value) or (is_number(value) and 0 < value < math.inf)


def is_plain(value: Any) -> bool:
    """Whether a setting is a number, a text, a switch, nothing, or a list of such."""
    if isinstance(value, list):
        return all(is_plain(one) and not isinstance(one, list) for one in value)
    return value is None or isinstance(value, bool) or is_text(value) or is_number(value)


Kind = tuple[Callable[[Any], bool], str]  # what is true of a value, and in words
TEXT: Kind = (is_text, "text")
COUNT: Kind = (is_count, "a whole number from 1 on")
STEP: Kind = (is_step, "a number greater than 0, or auto,")
ATTRIBUTES: dict[str, Kind] = {
    "schema_version": (lambda value: value in KNOWN, f"one of {', '.join(map(str, KNOWN))}"),
    "status": (lambda value: value in STATUSES, f"one of {', '.join(STATUSES)}"),
    **dict.fromkeys(("reason", "config", "config_hash", "code_hash", "code_files"), TEXT),
    **dict.fromkeys((*KINDS, "mass", "started", "host", "cpu", "timing_context"), TEXT),
    **dict.fromkeys(("resolution", "particles_per_cell", "threads"), COUNT),
    "time_step": STEP,
}
OPTIONAL: dict[str, Kind] = {
    name: (lambda value: all(map(is_number, value)), "numbers") for name in UNITS
}
OTHER: Kind = (lambda value: is_text(value) or is_number(value), "text or a number")
SETTINGS: dict[str, Kind] = {
    "resolution": COUNT,
    "particles_per_cell": COUNT,
    "time_step": STEP,
    "end_time": (lambda value: is_number(value) and 0 < value < math.inf, "a positive number"),
    "timing": (lambda value: value in ("shared", "exclusive"), "shared or exclusive"),
    "limits": (
        lambda value: (
            isinstance(value, dict) and all(one is None or is_number(one) for one in value.values())
        ),
        "a mapping of numbers",
    ),
}
FIELD = ("snapshot", "particle", "dim")
DIMENSIONS = {
    "time": ("time",),
    "snapshot_time": ("snapshot",),
    "position_initial": ("particle", "dim"),
    **{f"{name}{end}": FIELD for name in ("displacement", "velocity") for end in ("", "_exact")},
    "position": FIELD,
    **{f"stress{end}": (*FIELD, "dim2") for end in ("", "_exact")},
}
END_STATE = "end_state"  # variables whose name begins so are for the command `continue`
LABELS = ("units", "long_name")


def check(attributes: dict[str, Any], file: netCDF4.Dataset, size: int) -> None:
    """Raise `Unfit` unless an open file of that size [bytes] is a result, as far as readers rely on it."""
    if "config_hash" not in attributes:
        raise Unfit("not a result of mpmbench")
    for name, kind in ATTRIBUTES.items():
        if name not in attributes:
            raise Unfit(f"it has no attribute {name}")
        _require(name, attributes[name], kind)
    for name, value in attributes.items():
        _require(name, value, OPTIONAL.get(name, ATTRIBUTES.get(name, OTHER)))
    if attributes["schema_version"] >= SINCE_DIGEST and not attributes[digest.VARIABLE]:
        raise Unfit("its digest is missing")
    _check_config(_mapping("config", attributes["config"]))
    for name, value in _mapping("code_files", attributes["code_files"]).items():
        _require(f"code_files: {name}", value, TEXT)
    _check_variables(file, size)


def _require(name: str, value: Any, kind: Kind) -> None:
    is_right, needed = kind
    if not is_right(value):
        shown = repr(value)
        shown = shown if len(shown) <= MOST_SHOWN else f"{shown[:MOST_SHOWN]}..."
        raise Unfit(f"{name} = {shown}: {needed} is needed")


def _mapping(name: str, text: str) -> dict[str, Any]:
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):
        raise Unfit(f"{name} is no JSON") from None
    if not isinstance(found, dict):
        raise Unfit(f"{name} is no mapping")
    return found


def _check_config(config: dict[str, Any]) -> None:
    """Raise `Unfit` unless a configuration has its four names, and plain values."""
    for key, value in config.items():
        if not isinstance(value, dict):
            _require(f"config: {key}", value, (is_plain, "a plain value"))
            continue
        for name, one in value.items():
            _require(f"config: {key}.{name}", one, (is_plain, "a plain value"))
    for group in KINDS:
        choice = config.get(group)
        if not isinstance(choice, dict):
            raise Unfit(f"config: {group} is no mapping")
        for name in ("name", *(("time", "transfer") if group == "method" else ())):
            if name == "name" or choice.get(name) is not None:
                _require(f"config: {group}.{name}", choice.get(name), TEXT)
    for key, kind in SETTINGS.items():
        _require(f"config: {key}", config.get(key), kind)
    _require("config: repeats", config.get("repeats", 1), COUNT)


def _check_variables(file: netCDF4.Dataset, size: int) -> None:
    """Raise `Unfit` unless the file has room for its variables, and those that are known are as known."""
    claimed = 0
    for name, variable in variables_of(file).items():
        if name in DIMENSIONS and not is_numeric(variable):
            raise Unfit(f"variable {name}: numbers are needed")
        expected = DIMENSIONS.get(name, variable.dimensions)
        if variable.dimensions != expected:
            raise Unfit(f"variable {name}: the dimensions {', '.join(expected)} are needed")
        for key in labels_of(variable):
            _require(f"{key} of {name}", variable.getncattr(key), TEXT)
        claimed += math.prod(variable.shape) * np.dtype(variable.dtype).itemsize
    if "position" in file.variables and "snapshot_time" not in file.variables:
        raise Unfit("it has positions, and no times of them: snapshot_time is needed")
    if claimed > size:
        raise Unfit(f"its variables would take {claimed} bytes, and it has {size}")


def variables_of(file: netCDF4.Dataset) -> dict[str, netCDF4.Variable]:
    """All variables of an open file but its digest and the state at the end."""
    return {
        name: one
        for name, one in file.variables.items()
        if name != digest.VARIABLE and not name.startswith(END_STATE)
    }


def is_numeric(variable: netCDF4.Variable) -> bool:
    """Whether a variable holds numbers."""
    return np.dtype(variable.dtype).kind in "iuf"


def labels_of(variable: netCDF4.Variable) -> list[str]:
    """Those of units and long name that a variable has."""
    return [key for key in LABELS if key in variable.ncattrs()]
