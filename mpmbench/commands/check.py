"""The command ``check``: the contract of a plug-in file as a scorecard.

Every check runs in the child process, so that a plug-in that hangs or crashes loses one line of the
card.
"""

import math
import os
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from mpmbench.core.registry import PACKAGES, is_ours
from mpmbench.runs.process import isolation
from mpmbench.settings.schema import BadInput, composed, options

TIME = 120.0  # [s] for everything
LIMITS = {"setup": 100.0, "time": 100.0, "memory": None}  # of one check
OVER = f"not checked: the {TIME:g} s of this command are over"
STEPS = 20  # of the run that a plug-in must go through


def main(arguments: list[str]) -> int:
    """``check FILE.py``; exit code 0 when the contract is kept, 1 when not."""
    if len(arguments) != 1:
        raise BadInput("check: one Python file is needed")
    file = Path(arguments[0]).absolute()
    if not file.is_file():
        raise BadInput(f"check {arguments[0]}: there is no such file")
    deadline = time.monotonic() + TIME
    started = time.monotonic()
    if not is_ours(file):
        known = [part for part in os.environ.get("MPMBENCH_PLUGINS", "").split(os.pathsep) if part]
        os.environ["MPMBENCH_PLUGINS"] = os.pathsep.join(dict.fromkeys([*known, str(file.parent)]))
    isolation.processes.warm_up()
    try:
        brought = isolation.processes.ask("contents", str(file), limits=LIMITS)
    except isolation.Ended as end:
        raise BadInput(f"check {file.name}: it cannot be imported: {end.reason}") from None
    if isinstance(brought, str):
        raise BadInput(f"check {file.name}: it cannot be imported: {brought}")
    if not brought:
        kinds = ", ".join(PACKAGES)
        raise BadInput(
            f"check {file.name}: it registers nothing; @register(kind, name) does, with a kind of {kinds}"
        )
    passed = total = late = 0
    for kind, name in brought:
        print(f"{kind} {name}")
        for row, cells in scorecard(kind, name, deadline):
            good = [ok for ok, _ in cells.values()]
            passed, total = passed + sum(good), total + len(good)
            marks = [
                f"{label} {'ok' if ok else 'not checked' if text == OVER else 'FAILS'}"
                for label, (ok, text) in cells.items()
            ]
            print(f"  {row:<40}{'  '.join(marks)}", flush=True)
            for label, (ok, text) in cells.items():
                late += text == OVER
                if not ok and text != OVER:
                    print(f"    {label}: {text}", flush=True)
    if late:
        print(f"{late} {OVER}")
    compiling = ask("compile_time", deadline=math.inf)
    seconds = f"{time.monotonic() - started:.0f} s"
    if not isinstance(compiling, str):
        seconds += f", compiling {compiling:.0f} s of it"
    print(f"{passed} of {total} checks passed in {seconds}")
    return 0 if passed == total else 1


def scorecard(
    kind: str, name: str, deadline: float
) -> Iterator[tuple[str, dict[str, tuple[bool, str]]]]:
    """Rows of the card: the name of a check, and by case whether it passed and what was found."""
    if kind != "transfer":  # a value of the key method.transfer has no file of its own
        problem = declaration(kind, name)
        yield "its YAML file", {"conf": (not problem, problem)}
        if problem:
            return
    from mpmbench.runs.hydra.compose import compose_many

    (settings, reason), *_ = compose_many([run_of(kind, name)])
    yield "runs on a benchmark", {"mpmbench": runs(settings, reason, deadline)}
    outline = ask("outline", kind, name, settings, deadline=deadline)
    if isinstance(outline, str):
        yield "its cases", {"all": (False, outline)}
        return
    for check in dict.fromkeys(check for _, checks in outline for check in checks):
        cells = {}
        for label, checks in outline:
            if check in checks:
                answer = ask("judge", kind, name, settings, label, check, deadline=deadline)
                cells[label] = (
                    (False, answer) if isinstance(answer, str) else (answer.passed, answer.text)
                )
        yield check, cells


def ask(*request: Any, deadline: float) -> Any:
    """The child's answer, or a sentence when there is none."""
    left = deadline - time.monotonic()
    if left <= 0.0:
        return OVER
    try:
        return isolation.processes.ask(
            *request, limits=LIMITS | {"setup": min(left, LIMITS["setup"] or left)}
        )
    except isolation.Ended as end:
        return end.reason


def declaration(kind: str, name: str) -> str:
    """What is wrong with what a plug-in declares; empty when nothing is."""
    if name not in options(kind):
        return f"conf/{kind}/{name}.yaml, the preset of the method, is missing beside it"
    try:
        given = composed(kind, name)[kind]["name"]
    except BadInput as error:
        return str(error)
    return "" if given == name else f"conf/{kind}/{name}.yaml has name: {given}, not {name}"


def run_of(kind: str, name: str) -> list[str]:
    """Overrides of a short run with the plug-in."""
    if kind == "transfer":
        return ["method=mpm", f"method.transfer={name}"]
    return [f"{kind}={name}"] if kind != "basis" else ["method=mpm", f"basis={name}"]


def runs(config: dict[str, Any], reason: str, deadline: float) -> tuple[bool, str]:
    """Whether some steps of a run end well."""
    from mpmbench.runs.sweep import execute

    try:
        reason = reason or execute.check([(config, "")])[0]["not_applicable"]
    except BadInput as error:
        return False, str(error)
    if reason:
        return False, f"does not apply to {config['problem']['name']}: {reason}"
    step = config["time_step"]
    short = config | {
        "end_time": config["end_time"] * 1e-3
        if step == "auto"
        else min(config["end_time"], STEPS * step)
    }
    answer = ask("solve", short, deadline=deadline)
    if isinstance(answer, str):
        return False, answer
    return answer["status"] == "ok", f"{answer['status']}: {answer['reason']}"
