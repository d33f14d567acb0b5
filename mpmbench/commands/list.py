"""The command ``list``: what there is, and what applies to a problem."""

import re
import shutil
import textwrap
from pathlib import Path

from mpmbench.settings.schema import GROUPS, BadInput, did_you_mean, experiments, options

PLURALS = {"method": "methods", "basis": "bases", "material": "materials", "problem": "problems"}


def description(file: Path) -> str:
    """The first sentence of the comment at the top of a YAML file."""
    lines = [
        line.lstrip("# ").strip()
        for line in file.read_text(encoding="utf-8").splitlines()
        if line.startswith("#")
    ]
    text = " ".join(line for line in lines if line and not line.startswith("@"))
    return re.split(r"(?<=\.)(?<!\bSt\.) +(?=[A-Z])", text, maxsplit=1)[0]


def show(title: str, files: dict[str, Path]) -> None:
    """Print names and descriptions below each other."""
    print(title)
    column = max(map(len, files), default=0) + 4
    for name, file in files.items():
        width = max(60, shutil.get_terminal_size((120, 24)).columns)
        print(
            textwrap.fill(
                f"  {name:<{column - 2}}{description(file)}", width, subsequent_indent=" " * column
            )
        )


def main(arguments: list[str]) -> int:
    """``list``, or ``list PROBLEM``."""
    if len(arguments) > 1:
        raise BadInput("list: one problem at most is needed")
    if arguments:
        return applicability(arguments[0])
    for group in GROUPS:
        show(PLURALS[group], options(group))
    show("experiments", experiments())
    print("\n`list PROBLEM` tells which methods and bases apply to a problem.")
    return 0


def applicability(problem: str) -> int:
    """Table of the methods and bases that apply to a problem, with the reasons of those that do not."""
    if problem not in options("problem"):
        raise BadInput(
            f"list {problem}: there is no such problem{did_you_mean(problem, options('problem'))}"
        )
    from mpmbench.runs.process import isolation
    from mpmbench.runs.sweep import execute

    isolation.processes.warm_up()
    from mpmbench.runs.hydra.compose import compose_many

    pairs = [(method, basis) for method in options("method") for basis in options("basis")]
    cells = compose_many(
        [[f"method={method}", f"basis={basis}", f"problem={problem}"] for method, basis in pairs]
    )
    reasons = []
    width = max(len(basis) for basis in options("basis")) + 2
    print(" " * 16 + "".join(f"{basis:<{width}}" for basis in options("basis")))
    answers = dict(zip(pairs, execute.check(cells), strict=True))
    for method in options("method"):
        marks = []
        for basis in options("basis"):
            reason = answers[method, basis]["not_applicable"]
            marks.append(f"{'-' if reason else 'yes':<{width}}")
            reasons += [f"  {method}, {basis}: {reason}"] if reason else []
        print(f"  {method:<14}" + "".join(marks))
    print("\n".join(reasons))
    return 0
