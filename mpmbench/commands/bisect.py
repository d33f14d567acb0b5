"""Bisection of a key between runs that survive and runs that fail, for experiments that ask for it in a comment.

A line ``# reproduce: bisect cfl to 0.01`` in an experiment makes `reproduce` halve, for each of its
cases, the interval between the largest value that ends well and the smallest that does not, until
it is smaller than the given fraction of the value. The experiment's own values of the key are the
first bracket.
"""

import json
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from mpmbench.results.identity import NOT_PART_OF_A_RUN
from mpmbench.results.netcdf import read_attributes
from mpmbench.settings.files import read_yaml
from mpmbench.settings.resolve import dotted
from mpmbench.settings.schema import GROUPS

DIRECTIVE = re.compile(r"^# reproduce: bisect ([\w.]+) to ([\d.e-]+)$", re.MULTILINE)
SURVIVED = ("ok",)
FAILED = ("diverged", "broke_down", "not_converged")


@dataclass(frozen=True)
class Bisection:
    """What an experiment asks for.

    Attributes
    ----------
    key : str
        Such as ``cfl``.
    tolerance : float
        Width of the interval over its upper end at which the search stops.
    cases : tuple of str
        The experiment's cases; each has an interval of its own.
    """

    key: str
    tolerance: float
    cases: tuple[str, ...]


def asked_for(file: Path) -> Bisection | None:
    """The bisection that an experiment asks for, if any."""
    found = DIRECTIVE.search(file.read_text(encoding="utf-8"))
    if not found:
        return None
    cases = tuple(str(case) for case in read_yaml(file).get("cases") or [])
    return Bisection(found.group(1), float(found.group(2)), cases)


def related(key: str, results: Path, names: set[str]) -> set[str]:
    """Those of the files in a folder that differ from the named ones in nothing but the key."""
    configurations = {name: _without(key, config) for name, config, _ in _runs(results)}
    wanted = [configurations[name] for name in names if name in configurations]
    return {name for name, config in configurations.items() if config in wanted}


def next_round(bisection: Bisection, results: Path, names: set[str]) -> list[str]:
    """Cases with the values that come next, as an experiment would list them; empty when all intervals are small.

    A case whose runs all survive, or all fail, has no interval and is left as it is.
    """
    runs = [(config, status) for name, config, status in _runs(results) if name in names]
    cases = []
    for case in bisection.cases:
        values = [
            (_value(config, bisection.key), status)
            for config, status in runs
            if _belongs(config, case)
        ]
        high = min((value for value, status in values if status in FAILED), default=None)
        if high is None:
            continue
        low = max(
            (value for value, status in values if status in SURVIVED and value < high), default=None
        )
        if low is not None and high - low > bisection.tolerance * high:
            cases.append(f"{case} {bisection.key}={0.5 * (low + high):.6g}")
    return cases


def write_round(file: Path, campaign: str, cases: list[str], folder: Path) -> str:
    """Write an experiment with other cases into a plug-in folder, its results going where they belong.

    Returns
    -------
    str
        Name of that experiment, for a process whose ``MPMBENCH_PLUGINS`` names the folder.
    """
    content = read_yaml(file) | {"cases": cases, "campaign": campaign}
    name = f"{file.stem}_bisection"
    target = folder / "conf" / "experiments" / f"{name}.yaml"
    target.parent.mkdir(parents=True)
    target.write_text(
        "# @package _global_\n" + yaml.safe_dump(content, sort_keys=False), encoding="utf-8"
    )
    return name


def _runs(results: Path) -> Iterator[tuple[str, dict[str, Any], str]]:
    """Name, configuration and status of all runs in a folder."""
    for file in sorted(results.glob("*.nc")):
        attributes = read_attributes(file)
        if attributes is not None:
            yield file.name, json.loads(attributes["config"]), attributes["status"]


def _without(key: str, config: dict[str, Any]) -> dict[str, Any]:
    """What a result depends on but for one dotted key."""
    return {
        name: value
        for name, value in dotted(config).items()
        if name.partition(".")[0] not in NOT_PART_OF_A_RUN and name != key
    }


def _value(config: dict[str, Any], key: str) -> Any:
    """Value of a dotted key; that of a group is the name of the choice."""
    value: Any = config
    for part in key.split("."):
        value = value.get(part) if isinstance(value, dict) else None
    return value["name"] if key in GROUPS and isinstance(value, dict) else value


def _belongs(config: dict[str, Any], case: str) -> bool:
    return all(
        str(_value(config, key)) == value
        for key, _, value in (word.partition("=") for word in case.split())
    )
