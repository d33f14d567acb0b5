"""The command ``status``: what is finished, stale, damaged, failed or missing.

Every file is checked against its digest each time: that costs less than to open it.
"""

import json
import re
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

from mpmbench.core.registry import places, plugins_of
from mpmbench.results.identity import changed_files, code_digests, code_hash, digests_of_many
from mpmbench.results.netcdf import look
from mpmbench.runs.sweep.display import shorten
from mpmbench.runs.sweep.plan import make_plan, state_of
from mpmbench.say import one_line, say, visible, with_reason
from mpmbench.settings.schema import GROUPS, BadInput, options

FEW = 3  # files that are named in a line
STATES = ("fresh", "stale", "untimed", "damaged", "failed", "missing")


def main(arguments: list[str]) -> int:
    """``status``, ``status RESULTS``, ``status FILE.nc``, or ``status`` and a sweep's arguments.

    A file's line comes with the traceback of a run that crashed.
    """
    if any("=" in argument or argument == "-m" for argument in arguments):
        return of_sweep(arguments)
    if len(arguments) > 1:
        raise BadInput("status: one folder of results, or key=value as for a sweep, is needed")
    top = Path(arguments[0] if arguments else "results")
    if top.is_file():
        say(*describe(top, code_digests))
        say(*str((look(top)[0] or {}).get("traceback", "")).splitlines())
        return 0
    if not top.is_dir():
        raise BadInput(f"status: there is no folder {top}")
    digests = digests_of_many()
    folders = sorted({file.parent for file in top.rglob("*.nc")})
    for folder in folders:
        say(shorten(str(folder)))
        files = sorted(folder.glob("*.nc"), key=lambda file: in_order(file.stem))
        width = max((len(file.stem) for file in files), default=0) + 2
        for file in files:
            say(*describe(file, digests, width, "  "))
    if not folders:
        say(f"no results in {top}")
    return 0


def in_order(name: str) -> list[tuple[int, str]]:
    """A key that sorts the number of cells in the name of a result by its size: n8 before n16."""
    parts = re.split(r"(?<=-n)(\d+)(?=-)", name)
    return [(int(part), "") if k % 2 else (0, part) for k, part in enumerate(parts)]


def describe(
    file: Path,
    digests: Callable[[dict[str, Any]], dict[str, str]],
    width: int = 46,
    before: str = "",
) -> list[str]:
    """A line about a result file, or two; `digests` are those of the code of a configuration."""
    attributes, damage = look(file)
    if attributes is None:
        return row(
            f"{before}{'damaged':<10}", file.stem, width, damage or "it has just been removed"
        )
    config = json.loads(attributes["config"])
    now = digests(config)
    state = state_of(attributes, config, code_hash(now))
    if state == "missing":  # interrupted or crashed: to be run again, but there is a file
        state = "failed"
    changed = ""
    if state == "stale" and (missing := missing_plugins(config)):
        state, changed = "plug-in missing", f"  {missing}: name its folder in MPMBENCH_PLUGINS"
    elif state == "stale":
        changed = "  " + changed_since(attributes, now)
    outcome = attributes["status"] + (
        f": {one_line(attributes['reason'])}" if attributes["reason"] else ""
    )
    unverified = "" if attributes["digest"] else "  unverified: an older version wrote no digest"
    return row(f"{before}{state:<10}", file.stem, width, f"{outcome}{changed}{unverified}")


def row(state: str, name: str, width: int, said: str) -> list[str]:
    """The state of a run, its name in a column of that width, and what is said of it."""
    return with_reason(f"{state} {visible(name):<{width - 2}}", said)


def missing_plugins(config: dict[str, Any]) -> str:
    """The choices of a configuration that nothing here registers, as ``basis=name``."""
    missing = []
    for group in GROUPS:
        if group not in config:
            continue  # it came later
        name = config[group]["name"]
        registered = config[group].get("time") or name  # a method names its loop
        known = registered in places(group) or plugins_of(group, registered)
        if not known or name not in options(group):
            missing.append(f"{group}={name}")
    return ", ".join(missing)


def changed_since(attributes: dict[str, Any], now: dict[str, str]) -> str:
    """The source files that make a result stale, the first few of many."""
    files = changed_files(attributes, now)
    more = f" and {len(files) - FEW} more" if len(files) > FEW + 1 else ""
    return f"changed since: {', '.join(files[:FEW] if more else files)}{more}"


def of_sweep(arguments: list[str]) -> int:
    """Look up every cell of a sweep."""
    from mpmbench.runs.process import isolation
    from mpmbench.settings import arguments as command_line

    _, pairs = command_line.split(arguments, [])
    isolation.processes.warm_up()
    from mpmbench.runs.hydra import compose

    cells, digests = make_plan(compose.compose_sweep(pairs)).cells(), digests_of_many()
    width = max((len(cell.name) for cell in cells), default=0) + 2
    for cell in cells:
        state, remark = cell.state, cell.not_applicable
        if cell.not_applicable:
            state = "does not apply"
        elif state == "damaged":
            remark = cell.damage
        elif state == "stale" and cell.earlier:
            remark = changed_since(cell.earlier, digests(cell.config))
        say(*row(f"{state:<15}", cell.name, width, remark))
    counts = Counter("not applicable" if cell.not_applicable else cell.state for cell in cells)
    found = [f"{counts[state]} {state}" for state in (*STATES, "not applicable") if counts[state]]
    say(f"{len(cells)} runs: {', '.join(found)}")
    return 0
