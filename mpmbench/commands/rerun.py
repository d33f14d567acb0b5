"""The command ``rerun``: a run again from its result file alone, and whether the same comes out."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from mpmbench.commands.places import attributes_of
from mpmbench.results.bookkeeping import with_later
from mpmbench.results.identity import changed_files, code_digests
from mpmbench.results.netcdf import Damaged, load, read_attributes, unverified
from mpmbench.results.private import temporary_folder
from mpmbench.results.provenance import machine
from mpmbench.runs.interrupts import terminated_like_interrupted
from mpmbench.runs.process import isolation
from mpmbench.runs.sweep import execute
from mpmbench.runs.sweep.plan import LASTING
from mpmbench.say import BELOW, in_lines, say
from mpmbench.settings.arguments import split
from mpmbench.settings.files import parsed, refuse_targets
from mpmbench.settings.resolve import cast_to, check_types
from mpmbench.settings.schema import GROUPS, TOP_LEVEL, BadInput, did_you_mean, options

# Largest difference, relative to the largest value of a field, that counts as rounding.
ROUNDING = 1e-9
LATER = {"deformation_gradient"}  # which files of older versions do not have
CLOCKS = ("solver_time", "solver_cpu_time", "compile_time", "wall_time", "peak_memory")
# What is a difference of others is rounded as they are, be it ever so small: errors and drifts by
# the largest value of the field of their unit.
# What depends on the instants of a history, of which a continued run has those of the shorter one too.
OF_HISTORY = {"energy_drift", "energy_imbalance", "momentum_drift"}
DERIVED = ("error_", "energy_drift", "momentum_drift")
FIELDS = {"m": "displacement", "m s-1": "velocity", "Pa": "stress", "kg m s-1": "momentum"}
MACHINE = ("host", "cpu", "cpu_count", "operating_system")


def main(arguments: list[str]) -> int:
    """``rerun FILE.nc [LIMIT=VALUE...]``; exit code 0 when the result is the same, be it within rounding.

    Limits are those of the file, as far as this machine has so much, unless they are given.
    """
    files = [argument for argument in arguments if "=" not in argument]
    if len(files) != 1:
        raise BadInput("rerun: one result file is needed")
    file = Path(files[0])
    before = attributes_of("rerun", file)
    isolation.processes.warm_up()
    config = rebuild(file, before)
    config["limits"] |= limits_in(arguments)
    with (
        terminated_like_interrupted(),
        temporary_folder("mpmbench-rerun-") as folder,
    ):
        config |= {"output_dir": str(folder), "campaign": "rerun"}
        execute.reasons_against([(config, "")])
        record = execute.run(config)
        try:
            after = read_attributes(Path(record.file))
        except Damaged as damaged:
            why = record.unwritten or damaged.reason
            raise BadInput(f"rerun {file}: {why}", exit_code=1) from None
        verdict, details = compare(file, Path(record.file), before, after)
    say(*in_lines(f"{file.stem}: {verdict}", BELOW))
    told = unverified([] if before["digest"] else [file])
    for line in filter(None, [*details, told, *what_changed(before, after, config)]):
        say(*in_lines(line, BELOW, "  "))
    return 0 if verdict in ("bitwise equal", "equal within rounding") else 1


def limits_in(arguments: list[str]) -> dict[str, Any]:
    """The limits among ``key=value``; raises `BadInput` for any other key."""
    _, pairs = split([argument for argument in arguments if "=" in argument], [])
    limits = {}
    for pair in pairs:
        group, _, name = pair.partition("=")[0].rpartition(".")
        if group != "limits":
            raise BadInput(f"rerun: {pair}: limits can be given, and all else is the file's")
        value = parsed(pair.partition("=")[2])
        limits[name] = cast_to(TOP_LEVEL[f"limits.{name}"], f"limits.{name}", value)
    return limits


def rebuild(file: Path, attributes: dict[str, Any]) -> dict[str, Any]:
    """The configuration of a file; raises `BadInput` when this version does not know it."""
    config = with_later(json.loads(attributes["config"]))
    refuse_targets(config, f"rerun {file}")
    for group in GROUPS:
        name = config[group]["name"]
        if name not in options(group):
            plugin = "; if it is a plug-in, name its folder in MPMBENCH_PLUGINS"
            hint = did_you_mean(name, options(group)) or plugin
            raise BadInput(f"rerun {file}: there is no {group} {name} here{hint}")
    config.setdefault("repeats", 1)
    checked, reason = check_types(config)
    if reason:
        raise BadInput(f"rerun {file}: {reason}")
    return checked


def compare(
    file: Path, again: Path, before: dict[str, Any], after: dict[str, Any]
) -> tuple[str, list[str]]:
    """Verdict on two result files, and the variables that differ."""
    was, now, reason = before["status"], after["status"], after["reason"]
    if was != now:
        return "different", [f"status: {was} -> {now} {reason}".rstrip()]
    if was not in LASTING:
        nothing = "which leaves nothing to compare"
        return "different", [f"status: {was} again, {nothing}: {reason}"]
    old, new = load(file), load(again)
    names = sorted({*map(str, old.variables), *map(str, new.variables)} - set(CLOCKS))
    if "continued_from" in before:
        series = {str(name) for name, one in old.variables.items() if "time" in one.dims}
        names = [name for name in names if name not in OF_HISTORY | series]
    equal, large = True, []
    for name in names:
        if name in LATER and name not in old.variables:
            continue
        if name not in old.variables or name not in new.variables:
            large.append(f"{name}: only in the {'new' if name in new.variables else 'old'} result")
            continue
        a, b = old[name].values, new[name].values
        if a.shape == b.shape and a.tobytes() == b.tobytes():
            continue
        equal = False
        size, called = scale_of(name, new)
        difference = relative_difference(a, b, size)
        if not difference <= ROUNDING:
            large.append(f"{name}: differs by {difference:.2g} of {called}")
    verdict = "different" if large else "bitwise equal" if equal else "equal within rounding"
    return verdict, large


def scale_of(name: str, dataset: xr.Dataset) -> tuple[float, str]:
    """The least size that a difference of a variable is compared with, and what it is the size of."""
    unit = dataset[name].attrs.get("units", "1")
    field = FIELDS.get(unit, "")
    if not name.startswith(DERIVED):
        return 0.0, "its largest value"
    if unit == "1":
        return 1.0, "one"
    if field not in dataset or not dataset[field].size:
        return 0.0, "its largest value"
    return float(np.nanmax(np.abs(dataset[field].values))), f"the largest {field}"


def relative_difference(a: np.ndarray, b: np.ndarray, least: float = 0.0) -> float:
    """Largest difference over the largest value, or over the `least` size where that is larger.

    It is infinite when shapes or not-a-numbers do not agree.
    """
    if (
        a.shape != b.shape
        or not np.issubdtype(a.dtype, np.number)
        or not np.array_equal(np.isnan(a), np.isnan(b))
    ):
        return np.inf
    if a.size == 0 or np.isnan(a).all():
        return 0.0
    difference, scale = float(np.nanmax(np.abs(a - b))), max(float(np.nanmax(np.abs(a))), least)
    return difference / scale if scale > 0.0 else (np.inf if difference > 0.0 else 0.0)


def what_changed(
    before: dict[str, Any], after: dict[str, Any], config: dict[str, Any]
) -> list[str]:
    """Code, versions, machine and threads that are not what they were."""
    files = changed_files(before, code_digests(config))
    lines = [f"code: {', '.join(files)}"] if files else []
    versions = [key for key in before if key.endswith("_version") and key != "schema_version"]
    here = {**after, **machine(), "threads": config["threads"]}
    for key in [*versions, "python", *MACHINE, "threads"]:
        if before.get(key) != here.get(key):
            lines.append(f"{key.replace('_', ' ')}: {before.get(key)} -> {here.get(key)}")
    return [f"changed: {line}" for line in lines] or [
        "code, versions, machine and threads are the same"
    ]
