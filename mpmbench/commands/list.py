"""The command ``list``: what there is, what can be set, and what applies to a problem."""

import ast
import re
import textwrap
from pathlib import Path

from mpmbench.commands.help import lines_of
from mpmbench.commands.verbs import VERBS
from mpmbench.say import in_lines, say
from mpmbench.settings.declarations import declaration, first_sentence, registered
from mpmbench.settings.files import papers, shipped_folder
from mpmbench.settings.schema import (
    GROUPS,
    INSTANTS,
    TOP_LEVEL,
    BadInput,
    all_keys,
    comment,
    declared,
    description,
    did_you_mean,
    experiments,
    options,
)
from mpmbench.settings.words import about, in_columns, in_yaml, keys_of

PLURALS = {
    **{"method": "methods", "basis": "bases", "material": "materials"},
    **{"contact": "contacts", "problem": "problems"},
}
KINDS = (*PLURALS.values(), "transfers", "experiments", "papers")
TITLES = {
    "contacts": "rules of contact between bodies (contact=)",
    "transfers": "transfers (method.transfer of explicit methods)",
}
MORE = (
    "`list NAME` tells what can be set for an option, and for a problem which methods and bases "
    "apply; it knows kinds (`list bases`), keys, experiments, papers and commands too."
)


def main(arguments: list[str]) -> int:
    """``list``, or ``list NAME``."""
    if len(arguments) > 1:
        raise BadInput("list: one name at most is needed")
    if arguments:
        return show_option(arguments[0])
    for kind in KINDS:
        say(TITLES.get(kind, kind), *in_columns(sentences_of(kind)))
    say("", *textwrap.wrap(MORE, 78))
    return 0


def sentences_of(kind: str) -> dict[str, str]:
    """All that there is of a kind, such as ``bases``, with a sentence about each."""
    if kind == "transfers":
        known = sorted(registered("transfer"))
        return {name: declaration("transfer", name).sentence for name in known}
    if kind == "experiments":
        return {name: comment(file) for name, file in experiments().items()}
    if kind == "papers":
        return {name: said_of(file) for name, file in papers().items()}
    (group,) = (group for group, plural in PLURALS.items() if plural == kind)
    return {name: description(group, name) for name in options(group)}


def said_of(file: Path) -> str:
    """The first sentence of a Python file."""
    return first_sentence(ast.get_docstring(ast.parse(file.read_bytes())) or "")


def show_option(name: str) -> int:
    """All about a name: of a kind, an option, a key, a transfer, an experiment, a paper or a command."""
    kind = PLURALS.get(name, name if name in KINDS else f"{name}s")
    groups = [group for group in GROUPS if name in options(group)]
    for group in groups:
        say(*in_lines(description(group, name)), *keys_of(group, name))
    if groups:
        return applicability(name) if "problem" in groups else 0
    if kind in KINDS:
        say(*in_columns(sentences_of(kind)))
    elif name in registered("transfer"):
        say(*in_lines(declaration("transfer", name).sentence), f"  method.transfer={name}")
    elif name in experiments():
        file = experiments()[name]
        say(f"experiments={name}: {file}", "", *file.read_text(encoding="utf-8").splitlines())
    elif name in papers():
        known = sentences_of("experiments").items()
        own = {key: text for key, text in known if key.startswith(f"{name}/")}
        say(
            *in_lines(said_of(papers()[name])),
            *in_columns(own),
            "",
            f"`reproduce {name}` runs all of them.",
        )
    elif name in VERBS:
        say(*lines_of(name, *VERBS[name]))
    elif found := about_key(name):
        say(*found)
    else:
        words = [
            *KINDS,
            *VERBS,
            *all_keys(),
            *(one for kind in KINDS for one in sentences_of(kind)),
        ]
        hint = did_you_mean(name, words)
        raise BadInput(f"list {name}: there is no such option, key, experiment or command{hint}")
    return 0


def about_key(name: str) -> list[str]:
    """What is said of a key, whole as ``basis.d_max`` or its last word, for each option that has it."""
    word = name.rpartition(".")[2]
    found = []
    if name in (*TOP_LEVEL, *INSTANTS):
        config = (shipped_folder("conf") / "config.yaml").read_text(encoding="utf-8")
        for line in re.findall(rf"^ *({re.escape(word)}: .*)$", config, re.MULTILINE):
            key, _, said = line.partition("#")
            found += in_columns({key.strip(): said.strip()})
    for group in GROUPS:
        of_group = name.startswith(f"{group}.") or "." not in name
        for option in options(group) if of_group else ():
            one = declared(group, option).get(word)
            if one is not None:
                key = f"{group}={option} {group}.{word}: {in_yaml(one.default)}"
                found += in_columns({key: about(one)})
    return found


def applicability(problem: str) -> int:
    """The methods and bases that apply to a problem, and why others do not."""
    from mpmbench.runs.sweep.execute import applying

    methods, bases = options("method"), options("basis")
    pairs = [(method, basis) for method in methods for basis in bases]
    cells = applying(
        [[f"method={method}", f"basis={basis}", f"problem={problem}"] for method, basis in pairs]
    )
    reasons = {pair: reason for pair, (_, reason) in zip(pairs, cells, strict=True)}
    found = {one: [basis for basis in bases if not reasons[one, basis]] for one in methods}
    say(
        "",
        "methods and bases that apply",
        *in_columns({one: ", ".join(some) or "-" for one, some in found.items()}),
    )
    if any(reasons.values()):
        say("", "those that do not, and why")
    for (method, basis), reason in reasons.items():
        if reason:
            say(*in_lines(f"{method}, {basis}: {reason}", "    ", "  "))
    return 0
