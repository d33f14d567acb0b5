"""The command ``merge``: the results of several folders, or machines, in one."""

import shutil
from pathlib import Path
from typing import Any

from mpmbench.commands.places import results_in
from mpmbench.results.netcdf import look, unverified
from mpmbench.results.one_move import in_one_move
from mpmbench.runs.sweep.display import shorten
from mpmbench.runs.sweep.execute import check_folder
from mpmbench.runs.sweep.plan import LASTING
from mpmbench.say import BELOW, in_lines, say
from mpmbench.settings.schema import BadInput


def main(arguments: list[str]) -> int:
    """``merge TARGET SOURCE...``: copies what TARGET lacks, or has in a worse state."""
    if len(arguments) < 2:
        raise BadInput(
            "merge: a target folder and at least one folder of results are needed: `merge results/all a b`"
        )
    target, *sources = (Path(argument) for argument in arguments)
    files = []
    for source in sources:
        files += results_in("merge", source)
        if target.exists() and source.samefile(target):
            raise BadInput(f"merge {source}: this is the target itself")
    check_folder(target.absolute(), "merge:")
    target.mkdir(parents=True, exist_ok=True)
    done: dict[str, list[str]] = {"copied": [], "replaced": [], "kept": [], "left out": []}
    taken: list[Path] = []
    for file in files:
        place = target / file.name
        verdict, about = judge(file, place)
        done[verdict].append(f"{verdict}: {about}")
        if verdict in ("copied", "replaced"):
            with in_one_move(place) as unfinished:
                shutil.copyfile(file, unfinished)
            taken.append(place)
    for line in done["replaced"] + done["left out"]:
        say(*in_lines(line, BELOW))
    told = unverified(place for place in taken if not (look(place)[0] or {}).get("digest"))
    if told:
        say(*in_lines(told, BELOW))
    counts = ", ".join(f"{len(lines)} {verdict}" for verdict, lines in done.items())
    say(f"{shorten(str(target.absolute()))}: {counts}")
    return 1 if done["left out"] else 0


def judge(file: Path, place: Path) -> tuple[str, str]:
    """What is to be done with a file whose place this is, and what is said about it."""
    attributes, damage = look(file)
    if attributes is None:
        return "left out", f"{file}: {damage}"
    present, damage = look(place)
    if present is None:
        return ("replaced", f"{place.name}: {damage}") if damage else ("copied", "")
    if present["config_hash"] != attributes["config_hash"]:
        return "left out", f"{file}: another configuration has its name in {place.parent}"
    if worth(present) >= worth(attributes):
        return "kept", ""
    before, after = (
        f"{one['status']} of {one['started']} on {one['host']}" for one in (present, attributes)
    )
    return "replaced", f"{place.name}: {before} by {after}"


def worth(attributes: dict[str, Any]) -> tuple[bool, bool, int, str]:
    """How good a result is: ok, then one that will not change, the better timed, the newer."""
    status = attributes["status"]
    return status == "ok", status in LASTING, len(attributes["solver_times"]), attributes["started"]
