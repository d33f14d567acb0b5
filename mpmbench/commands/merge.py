"""The command ``merge``: the results of several folders, or machines, in one."""

import os
import shutil
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from mpmbench.results.netcdf import read_attributes, remove_leftovers
from mpmbench.runs.sweep.display import shorten
from mpmbench.runs.sweep.execute import check_folder
from mpmbench.runs.sweep.plan import LASTING
from mpmbench.settings.schema import BadInput


@dataclass
class Merged:
    """What has become of the files."""

    copied: int = 0
    kept: int = 0
    replaced: list[str] = field(default_factory=list)
    left_out: list[str] = field(default_factory=list)


def main(arguments: list[str]) -> int:
    """``merge TARGET SOURCE...``: copies what TARGET lacks, or has in a worse state."""
    if len(arguments) < 2:
        raise BadInput(
            "merge: a target folder and at least one folder of results are needed: `merge results/all a b`"
        )
    target, *sources = (Path(argument) for argument in arguments)
    for source in sources:
        if not source.is_dir():
            raise BadInput(f"merge {source}: there is no such folder")
        if not any(source.glob("*.nc")):
            raise BadInput(f"merge {source}: there are no result files in it")
        if target.exists() and source.samefile(target):
            raise BadInput(f"merge {source}: this is the target itself")
    check_folder(target.absolute(), "merge:")
    target.mkdir(parents=True, exist_ok=True)
    done = Merged()
    for source in sources:
        for file in sorted(source.glob("*.nc")):
            copy_unless_as_good(file, target / file.name, done)
    for line in done.replaced + done.left_out:
        print(line)
    print(
        f"{shorten(str(target.absolute()))}: {done.copied} copied, {len(done.replaced)} replaced, {done.kept} kept, "
        f"{len(done.left_out)} left out"
    )
    return 1 if done.left_out else 0


def copy_unless_as_good(file: Path, place: Path, done: Merged) -> None:
    """Copy one file unless there is one as good; one that cannot be read is left out."""
    attributes = read_attributes(file)
    if attributes is None:
        done.left_out.append(f"left out: {file}: not a readable result")
        return
    present = read_attributes(place)
    if present is None and place.exists():
        done.replaced.append(f"replaced: {place.name}: was not readable")
    elif present is not None and present["config_hash"] != attributes["config_hash"]:
        done.left_out.append(
            f"left out: {file}: another configuration has its name in {place.parent}"
        )
        return
    elif present is not None and worth(present) >= worth(attributes):
        done.kept += 1
        return
    elif present is not None:
        done.replaced.append(
            f"replaced: {place.name}: {present['status']} of {present['started']} on {present['host']} by "
            f"{attributes['status']} of {attributes['started']} on {attributes['host']}"
        )
    else:
        done.copied += 1
    copy(file, place)


def worth(attributes: dict[str, Any]) -> tuple[bool, bool, int, str]:
    """How good a result is: ok, then one that will not change, the better timed, the newer."""
    status = attributes["status"]
    return status == "ok", status in LASTING, len(attributes["solver_times"]), attributes["started"]


def copy(file: Path, place: Path) -> None:
    """Copy a file in one move."""
    remove_leftovers(place)
    unfinished = place.with_name(f".{place.name}.{os.getpid()}.tmp")
    try:
        shutil.copyfile(file, unfinished)
        unfinished.replace(place)
    finally:
        unfinished.unlink(missing_ok=True)
