"""The command ``choose``: the cheapest combination in stored runs that reaches an error, with its command."""

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mpmbench.commands.places import attributes_of, results_in
from mpmbench.results.bookkeeping import NOT_PART_OF_A_RUN, with_later
from mpmbench.say import BELOW, in_lines, say
from mpmbench.settings.schema import GROUPS, BadInput
from mpmbench.settings.trees import dotted
from mpmbench.settings.words import in_yaml

if TYPE_CHECKING:
    from mpmbench.report.front import Field

KEYS = ("problem", "error", "results", "pages")
USAGE = "choose: problem=NAME error=NUMBER is needed, or pages=FOLDER; results=FOLDER says where runs are"


def main(arguments: list[str]) -> int:
    """``choose problem=NAME error=NUMBER [results=FOLDER]``, or ``choose pages=FOLDER``.

    The exit code is 1 where no run is good enough.
    """
    given = dict(argument.partition("=")[::2] for argument in arguments)
    for key, value in given.items():
        if key not in KEYS or not value:
            raise BadInput(f"{USAGE}; {key}={value} was given")
    if not ("pages" in given or {"problem", "error"} <= set(given)):
        raise BadInput(USAGE)
    folder = Path(given.get("results", "results/matrix"))
    results_in("choose", folder)
    from mpmbench.report import front, matrix_pages
    from mpmbench.results.records import read_campaign

    campaign = read_campaign(folder)
    if "pages" in given:
        for page in matrix_pages.write(campaign, Path(given["pages"])):
            say(f"report: {page}")
        return 0
    error, everything = number(given["error"]), front.fields_of(campaign)
    asked = [field for field in everything if matrix_pages.base(field) == given["problem"]]
    if not asked:
        known = ", ".join(sorted({matrix_pages.base(field) for field in everything})) or "none"
        raise BadInput(
            f"problem = {given['problem']}: the stored runs need an error of it; there are {known}"
        )
    return max(answer(field, error, folder) for field in asked)


def answer(field: "Field", error: float, folder: Path) -> int:
    """Say which run to take, and its command; the exit code."""
    if not len(field.results):
        say(f"{field.problem}: no run has a result")
        return 1
    enough = field.results[field.results.error <= error]
    file = enough.index[0] if len(enough) else field.results.error.idxmin()
    run = field.results.loc[file]
    what = f"{field.quantity.replace('_', ' ')} {run.error:.3g} {field.unit}".rstrip()
    found = f"{run.combination}, {what}, {field.clock.replace('_', ' ')} {run.cost:.3g} s"
    if len(enough):
        told = f"{found}; the cheapest of {len(enough)} runs that are good enough"
    else:
        told = f"no stored run is good enough; the best is {found}"
    say(*in_lines(f"{field.problem}: {told}", BELOW))
    try:
        say(command_of(attributes_of("choose", folder / str(file))))
    except BadInput:
        more = f"it used a plug-in that is not here: `rerun {folder / str(file)}` says more"
        say(*in_lines(more, BELOW))
    return 0 if len(enough) else 1


def number(text: str) -> float:
    """A positive number; raises `BadInput` for anything else."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0.0 < value < math.inf:
        raise BadInput(f"error = {text}: a number greater than 0 is needed")
    return value


def command_of(attributes: dict[str, Any]) -> str:
    """The command line that gives the run of a result file: its choices, and what differs from their defaults."""
    from mpmbench.runs.hydra.compose import compose_many

    stored = with_later(json.loads(attributes["config"]))
    names = [f"{group}={stored[group]['name']}" for group in GROUPS if group in stored]
    choices = [pair for pair in names if not pair.startswith("material=")]
    (usual, _), *_ = compose_many([choices])
    if usual["material"]["name"] != stored["material"]["name"]:
        choices = names
        (usual, _), *_ = compose_many([choices])
    default = dotted(usual)
    own = [
        f"{key}={in_yaml(value)}"
        for key, value in dotted(stored).items()
        if key.partition(".")[0] not in NOT_PART_OF_A_RUN
        and not key.endswith(".name")
        and default.get(key) != value
    ]
    return " ".join(["python -m mpmbench", *choices, *own])
