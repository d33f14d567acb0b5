"""Bisection of a key between runs that survive and runs that fail, for experiments that ask for it in a comment.

A line ``# reproduce: bisect cfl to 0.01`` in an experiment makes `reproduce` halve, for each of its
cases, the interval between the largest value that ends well and the smallest that does not, until
it is smaller than the given fraction of the value. The experiment's own values of the key are the
first bracket.
"""

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from mpmbench.results.campaign import flat_settings
from mpmbench.results.netcdf import look
from mpmbench.settings.files import read_yaml

DIRECTIVE = re.compile(r"^# reproduce: bisect ([\w.]+) to ([\d.e-]+)$", re.MULTILINE)
FAILED = ("diverged", "broke_down", "not_converged")


@dataclass(frozen=True)
class Bisection:
    """What an experiment asks for; each of its cases has an interval of its own."""

    key: str
    tolerance: float  # width of an interval over its upper end at which the search stops
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
    rest = {name: settings | {key: None} for name, settings, _ in _runs(results)}
    wanted = [rest[name] for name in names if name in rest]
    return {name for name, settings in rest.items() if settings in wanted}


def next_round(bisection: Bisection, results: Path, names: set[str]) -> list[str]:
    """Cases with the values that come next, as an experiment would list them; empty when all intervals are small.

    A case whose runs all survive, or all fail, has no interval and is left as it is.
    """
    runs = [(settings, status) for name, settings, status in _runs(results) if name in names]
    cases = []
    for case in bisection.cases:
        wanted = [word.partition("=") for word in case.split()]
        values = [
            (settings[bisection.key], status)
            for settings, status in runs
            if all(str(settings.get(key)) == value for key, _, value in wanted)
        ]
        high = min((value for value, status in values if status in FAILED), default=math.inf)
        low = max(
            (value for value, status in values if status == "ok" and value < high), default=None
        )
        if high < math.inf and low is not None and high - low > bisection.tolerance * high:
            cases.append(f"{case} {bisection.key}={0.5 * (low + high):.6g}")
    return cases


def write_round(file: Path, campaign: str, cases: list[str], folder: Path) -> str:
    """Write an experiment with other cases into a plug-in folder, and return its name there."""
    content = read_yaml(file) | {"cases": cases, "campaign": campaign}
    name = f"{file.stem}_bisection"
    target = folder / "conf" / "experiments" / f"{name}.yaml"
    target.parent.mkdir(parents=True)
    target.write_text(
        "# @package _global_\n" + yaml.safe_dump(content, sort_keys=False), encoding="utf-8"
    )
    return name


def _runs(results: Path) -> Iterator[tuple[str, dict[str, Any], str]]:
    """Name, settings by their dotted keys, and status of all runs in a folder that are not damaged."""
    for file in sorted(results.glob("*.nc")):
        attributes, _ = look(file)
        if attributes is not None:
            yield file.name, flat_settings(attributes), attributes["status"]
