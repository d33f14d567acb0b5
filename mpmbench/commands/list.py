"""The command ``list``: what there is, what can be set, and what applies to a problem."""

from mpmbench.say import say
from mpmbench.settings.declarations import declaration, registered
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

PLURALS = {
    **{"method": "methods", "basis": "bases", "material": "materials"},
    **{"contact": "rules of contact between bodies (contact=)", "problem": "problems"},
}


def main(arguments: list[str]) -> int:
    """``list``, or ``list NAME``."""
    if len(arguments) > 1:
        raise BadInput("list: one name at most is needed")
    if arguments:
        return show_option(arguments[0])
    found = {
        PLURALS[group]: {name: description(group, name) for name in options(group)}
        for group in GROUPS
    }
    found["transfers (method.transfer of explicit methods)"] = {
        name: declaration("transfer", name).sentence for name in sorted(registered("transfer"))
    }
    found["experiments"] = {name: comment(file) for name, file in experiments().items()}
    for title, sentences in found.items():
        say(title, *in_columns(sentences))
    say("", "`list NAME` tells what can be set, and for a problem which methods and bases apply.")
    return 0


def show_option(name: str) -> int:
    """What can be set for an option, and for a problem which methods and bases apply to it."""
    groups = [group for group in GROUPS if name in options(group)]
    if not groups and name in registered("transfer"):
        say(declaration("transfer", name).sentence, f"  method.transfer={name}")
        return 0
    if not groups:
        known = [option for group in GROUPS for option in options(group)]
        raise BadInput(f"list {name}: there is no such option{did_you_mean(name, known)}")
    for group in groups:
        say(description(group, name), *keys_of(group, name))
    return applicability(name) if "problem" in groups else 0


def applicability(problem: str) -> int:
    """Table of the methods and bases that apply to a problem, with the reasons of those that do not."""
    from mpmbench.runs.sweep.execute import applying

    methods, bases = options("method"), options("basis")
    pairs = [(method, basis) for method in methods for basis in bases]
    cells = applying(
        [[f"method={method}", f"basis={basis}", f"problem={problem}"] for method, basis in pairs]
    )
    reasons = {pair: reason for pair, (_, reason) in zip(pairs, cells, strict=True)}
    width = max(map(len, bases)) + 2
    say(" " * 16 + "".join(f"{basis:<{width}}" for basis in bases))
    for method in methods:
        marks = ["-" if reasons[method, basis] else "yes" for basis in bases]
        say(f"  {method:<14}" + "".join(f"{mark:<{width}}" for mark in marks))
    for (method, basis), reason in reasons.items():
        if reason:
            say(f"  {method}, {basis}: {reason}")
    return 0
