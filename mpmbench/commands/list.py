"""The command ``list``: what there is, what can be set, and what applies to a problem."""

from mpmbench.settings.schema import (
    GROUPS,
    BadInput,
    comment,
    description,
    did_you_mean,
    experiments,
    options,
)
from mpmbench.settings.words import in_columns, keys_of

PLURALS = {"method": "methods", "basis": "bases", "material": "materials", "problem": "problems"}


def show(title: str, sentences: dict[str, str]) -> None:
    """Print names and sentences about them below each other."""
    print("\n".join([title, *in_columns(sentences)]))


def main(arguments: list[str]) -> int:
    """``list``, or ``list NAME``."""
    if len(arguments) > 1:
        raise BadInput("list: one name at most is needed")
    if arguments:
        return show_option(arguments[0])
    for group in GROUPS:
        show(PLURALS[group], {name: description(group, name) for name in options(group)})
    show("experiments", {name: comment(file) for name, file in experiments().items()})
    print("\n`list NAME` tells what can be set, and for a problem which methods and bases apply.")
    return 0


def show_option(name: str) -> int:
    """What can be set for an option, and for a problem which methods and bases apply to it."""
    groups = [group for group in GROUPS if name in options(group)]
    if not groups:
        known = [option for group in GROUPS for option in options(group)]
        raise BadInput(f"list {name}: there is no such option{did_you_mean(name, known)}")
    for group in groups:
        print("\n".join([description(group, name), *keys_of(group, name)]))
    return applicability(name) if "problem" in groups else 0


def applicability(problem: str) -> int:
    """Table of the methods and bases that apply to a problem, with the reasons of those that do not."""
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
