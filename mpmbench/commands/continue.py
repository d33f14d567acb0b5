"""The command ``continue``: a longer run that goes on from the end of a stored one, with the same bits.

It leaves the file that a run from the start with this end time would leave. Only the instants of
its history differ: those of the stored run come first.
"""

import time
from pathlib import Path
from typing import Any

from mpmbench.commands.places import attributes_of
from mpmbench.commands.rerun import rebuild
from mpmbench.results.identity import changed_files, code_digests, result_path
from mpmbench.results.provenance import library_versions, machine
from mpmbench.runs.process import isolation
from mpmbench.runs.sweep import display, execute
from mpmbench.runs.sweep.claims import claimed
from mpmbench.say import say
from mpmbench.settings.arguments import split
from mpmbench.settings.files import here, parsed
from mpmbench.settings.resolve import cast_to, check_types
from mpmbench.settings.schema import TOP_LEVEL, BadInput

# What may be other than in the stored run: it changes nothing of what has been computed.
MAY_CHANGE = ("threads", "campaign", "output_dir", "limits.time", "limits.setup", "limits.memory")
GIVEN = ("end_time", "snapshot_times", *MAY_CHANGE)


def main(arguments: list[str]) -> int:
    """``continue FILE.nc end_time=T [KEY=VALUE...]``; the exit code is that of a run."""
    started = time.perf_counter()
    files = [argument for argument in arguments if "=" not in argument]
    if len(files) != 1:
        raise BadInput("continue: one result file is needed")
    file = here() / files[0]
    before = attributes_of("continue", file)
    isolation.processes.warm_up()
    stored = rebuild(file, before)
    config = longer(file, stored, before, given_in(arguments))
    refuse_other_bits(file, before, config)
    execute.reasons_against([(config, "")])
    try:
        limits = execute.limits_of(config)
        reason = isolation.processes.ask("continuing", config, str(file), limits=limits)
    except isolation.Ended as end:
        reason = end.reason
    if reason:
        raise BadInput(f"continue {file.name}: {reason}")
    target = result_path(config)
    with display.progress_bar(target.stem) as progress, claimed(target):
        record = execute.run(config, progress, before=file)
    say(*display.summary(record, time.perf_counter() - started).splitlines())
    return 1 if record.failed else 0


def given_in(arguments: list[str]) -> dict[str, Any]:
    """The keys that are given, with checked values; raises `BadInput` for others, or without an end time."""
    _, pairs = split([argument for argument in arguments if "=" in argument], [])
    given = {}
    for pair in pairs:
        key, _, value = pair.partition("=")
        if key not in GIVEN:
            those = ", ".join(GIVEN)
            raise BadInput(f"continue: {pair}: all else is the stored run's; give {those}")
        given[key] = parsed(value)
    if "end_time" not in given:
        raise BadInput("continue: end_time is needed, as in end_time=0.2")
    return given


def longer(
    file: Path, stored: dict[str, Any], before: dict[str, Any], given: dict[str, Any]
) -> dict[str, Any]:
    """The configuration of the longer run; raises `BadInput` when it would not have the same steps."""
    name = f"continue {file.name}"
    if before["status"] != "ok":
        raise BadInput(f"{name}: the stored run has not come to its end: {before['status']}")
    config = {key: dict(one) if isinstance(one, dict) else one for key, one in stored.items()}
    for key, value in given.items():
        group, _, word = key.rpartition(".")
        (config[group] if group else config)[word] = value
    step = before["time_step"]
    config |= {"time_step": step, "timing": "shared"}
    end, ended = cast_to(TOP_LEVEL["end_time"], "end_time", given["end_time"]), stored["end_time"]
    if end <= ended:
        raise BadInput(
            f"{name}: end_time = {end:g}: more than {ended:g} s is needed, where it ends"
        )
    steps = round(end / step)
    if abs(steps * step - end) > 1e-12 * end:
        near = f"{steps * step!r} or {(steps + 1) * step!r}"
        raise BadInput(f"{name}: end_time = {end:g}: whole steps of {step:g} s are needed: {near}")
    added = cast_to(TOP_LEVEL["snapshot_times"], "snapshot_times", given.get("snapshot_times", []))
    for instant in added:
        if not ended <= instant <= end:
            where = f"from {ended:g} s, where the stored run ends, to end_time"
            raise BadInput(f"{name}: snapshot_times = {instant:g}: instants {where} are needed")
    config["snapshot_times"] = sorted({*stored["snapshot_times"], *added})
    checked, reason = check_types(config)
    if reason:
        raise BadInput(f"{name}: {reason}")
    return checked


def refuse_other_bits(file: Path, before: dict[str, Any], config: dict[str, Any]) -> None:
    """Raise `BadInput` when a run from the start would have other bits here than the stored one has."""
    changed = changed_files(before, code_digests(config))
    here_now = {**library_versions(), **{key: machine()[key] for key in ("python", "cpu")}}
    other = [
        f"{key.removesuffix('_version')} {before.get(key)} -> {value}"
        for key, value in here_now.items()
        if before.get(key) != value
    ]
    if changed or other:
        what = ", ".join([*changed, *other])
        raise BadInput(
            f"continue {file.name}: a run from the start would have other bits than the stored one, "
            f"since something has changed: {what}; run it from the start"
        )
