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

from mpmbench.core.registry import PACKAGES, VARIABLE, is_ours
from mpmbench.runs.process import isolation
from mpmbench.say import BELOW, in_lines, say, with_reason
from mpmbench.settings.files import joined
from mpmbench.settings.schema import BadInput, composed, options

TIME = 120.0  # [s] for everything
LONGEST = 100.0  # [s] for one check
OVER = f"not checked: the {TIME:g} s of this command are over"
STEPS = 20  # of the run that a plug-in must go through


def main(arguments: list[str]) -> int:
    """``check FILE.py``; exit code 0 when the contract is kept, 1 when not."""
    if len(arguments) != 1:
        raise BadInput("check: one Python file is needed")
    file = Path(arguments[0]).absolute()
    if not file.is_file():
        raise BadInput(f"check {arguments[0]}: there is no such file")
    started = time.monotonic()
    deadline = started + TIME
    if not is_ours(file):
        known = os.environ.get(VARIABLE, "")
        os.environ[VARIABLE] = joined(known, str(file.parent))
    isolation.processes.warm_up()
    brought = ask("contents", str(file), deadline=math.inf)
    if isinstance(brought, str):
        raise BadInput(f"check {file.name}: it cannot be imported: {brought}")
    if not brought:
        how = f"@register(kind, name) does, with a kind of {', '.join(PACKAGES)}"
        raise BadInput(f"check {file.name}: it registers nothing; {how}")
    passed = total = late = 0
    for kind, name in brought:
        say(f"{kind} {name}")
        for row, cells in scorecard(kind, name, deadline):
            passed += sum(ok for ok, _ in cells.values())
            total += len(cells)
            marks, remarks = [], []
            for label, (ok, text) in cells.items():
                if text == OVER:
                    late += 1
                    marks.append(f"{label} not checked")
                else:
                    marks.append(f"{label} {'ok' if ok else 'FAILS'}")
                    remarks += [] if ok else in_lines(f"{label}: {text}", BELOW, "    ")
            say(*with_reason(f"  {row:<38}", ", ".join(marks)), *remarks)
    if late:
        say(f"{late} {OVER}")
    compiling = ask("compile_time", deadline=math.inf)
    seconds = f"{time.monotonic() - started:.0f} s"
    if not isinstance(compiling, str):
        seconds += f", compiling {compiling:.0f} s of it"
    say(f"{passed} of {total} checks passed in {seconds}")
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
                found = ask("judge", kind, name, settings, label, check, deadline=deadline)
                cells[label] = (False, found) if isinstance(found, str) else tuple(found)
        yield check, cells


def ask(*request: Any, deadline: float) -> Any:
    """The child's answer, or a sentence when there is none."""
    left = deadline - time.monotonic()
    if left <= 0.0:
        return OVER
    limits = {"setup": min(left, LONGEST), "time": LONGEST, "memory": None}
    try:
        return isolation.processes.ask(*request, limits=limits)
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
    key = "method.transfer" if kind == "transfer" else kind
    before = ["method=mpm"] if kind in ("transfer", "basis", "contact") else []
    if kind == "contact":
        before.append("problem=two_squares")
    return [*before, f"{key}={name}"]


def runs(config: dict[str, Any], reason: str, deadline: float) -> tuple[bool, str]:
    """Whether some steps of a run end well."""
    from mpmbench.runs.sweep import execute

    try:
        reason = reason or execute.reasons_against([(config, "")])[0]
    except BadInput as error:
        return False, str(error)
    if reason:
        return False, f"does not apply to {config['problem']['name']}: {reason}"
    step, end_time = config["time_step"], config["end_time"]
    short = end_time * 1e-3 if step == "auto" else min(end_time, STEPS * step)
    answer = ask("solve", config | {"end_time": short}, deadline=deadline)
    if isinstance(answer, str):
        return False, answer
    return answer["status"] == "ok", f"{answer['status']}: {answer['reason']}"
