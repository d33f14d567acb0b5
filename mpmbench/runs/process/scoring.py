"""The child's side of ``check``: what a plug-in file brings, and whether it keeps its contract."""

import importlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from numba.core.event import TimingListener, register

from mpmbench.contracts import Check, Contract, bases, loops, materials, problems
from mpmbench.core import registry
from mpmbench.core.loops import find_loop
from mpmbench.core.loops.explicit import Explicit
from mpmbench.settings.files import PACKAGE

Cases = list[tuple[str, Any, dict[str, Check]]]  # label, case and its checks by name

compiling = TimingListener()
register("numba:compile", compiling)


def compile_time() -> float:
    """How long this process has compiled so far [s]."""
    return float(compiling.duration) if compiling.done else 0.0


def contents(file: str) -> list[tuple[str, str]]:
    """Kind and name of everything that a file registers."""
    module = load(Path(file))
    brought = [(kind, name) for kind in registry.PACKAGES for name in registry.names(kind)]
    return [(kind, name) for kind, name in brought if registry.get(kind, name).__module__ == module]


def load(file: Path) -> str:
    """Import a plug-in file, which may be one of ours, and return its name as a module."""
    if registry.is_ours(file):
        name = ".".join(["mpmbench", *file.relative_to(PACKAGE).with_suffix("").parts])
        importlib.import_module(name)
        return name
    return registry.load_file(file)


def outline(kind: str, name: str, settings: dict[str, Any]) -> list[tuple[str, list[str]]]:
    """Label of each case of a plug-in, and the names of its checks."""
    return [(label, list(checks)) for label, _, checks in cases(kind, name, settings)]


def judge(
    kind: str, name: str, settings: dict[str, Any], label: str, check: str
) -> tuple[bool, str]:
    """One check of one case: whether it passed, and what was found."""
    case, checks = next(
        (case, checks) for at, case, checks in cases(kind, name, settings) if at == label
    )
    found = checks[check](case)
    return bool(found.passed), found.text


def cases(kind: str, name: str, settings: dict[str, Any]) -> Cases:
    """All cases of a plug-in, lowest dimension first."""
    contract: Contract
    found: Sequence[Any]
    if kind == "contact":
        return []  # a rule is judged by collisions, which take longer than a card may
    if kind == "basis":
        contract, found = bases.CHECKS, bases.cases(name)
    elif kind == "material":
        contract, found = materials.CHECKS, materials.cases(name)
    elif kind in ("method", "transfer"):
        loop = find_loop(name) if kind == "method" else Explicit
        choices = loop(**settings["method"])
        # the contract is that of explicit loops
        contract, found = loops.CHECKS, [] if choices.implicit else loops.cases(choices)
    else:
        problem = problems.ProblemCase(
            name, parameters(settings["problem"]), settings["material"]["name"], parameters(settings["material"]),
            settings["resolution"], settings["particles_per_cell"], settings["end_time"],
        )  # fmt: skip
        contract, found = problems.CHECKS, [problem]
    return [(label(case), case, contract.of(case)) for case in found]


def label(case: Any) -> str:
    """What a case is called on the card, for example ``2D moved``."""
    return f"{case.dimension}D{' moved' if getattr(case, 'moved', False) else ''}"


def parameters(settings: dict[str, Any]) -> dict[str, Any]:
    """Settings of an option without its name."""
    return {key: value for key, value in settings.items() if key != "name"}
