"""The command ``list``: what there is, and what applies to a problem."""

from pathlib import Path

from mpmbench.runs.schema import GROUPS, BadInput, did_you_mean, experiments, options

PLURALS = {"method": "methods", "basis": "bases", "material": "materials", "problem": "problems"}


def description(file: Path) -> str:
    """The first sentence of a YAML file."""
    for line in file.read_text(encoding="utf-8").splitlines():
        text = line.lstrip("# ").strip()
        if line.startswith("#") and text and not text.startswith("@"):
            return text
    return ""


def main(arguments: list[str]) -> int:
    """``list``, or ``list PROBLEM``."""
    if len(arguments) > 1:
        raise BadInput("list: one problem at most is needed")
    if arguments:
        return applicability(arguments[0])
    for group in GROUPS:
        print(PLURALS[group])
        for name, file in options(group).items():
            print(f"  {name:<24}{description(file)}")
    print("experiments")
    for name, file in experiments().items():
        print(f"  {name:<24}{description(file)}")
    print("\n`list PROBLEM` tells which methods and bases apply to a problem.")
    return 0


def applicability(problem: str) -> int:
    """Table of the methods and bases that apply to a problem, with the reasons of those that do not."""
    if problem not in options("problem"):
        raise BadInput(f"list {problem}: there is no such problem{did_you_mean(problem, options('problem'))}")
    from mpmbench.runs import execute, isolation

    isolation.warm_up()
    from mpmbench.runs.compose import compose_many

    pairs = [(method, basis) for method in options("method") for basis in options("basis")]
    cells = compose_many([[f"method={method}", f"basis={basis}", f"problem={problem}"] for method, basis in pairs])
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
