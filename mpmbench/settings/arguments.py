"""First look at the command line, before Hydra: unknown keys and options, what may be set and what may be swept."""

import re
from collections.abc import Iterable

from mpmbench.settings.files import experiment_of, refuse_targets
from mpmbench.settings.schema import (
    GROUPS,
    NO_TEXT,
    BadInput,
    all_keys,
    did_you_mean,
    experiments,
    options,
    unknown_key,
)

# Hydra's options, and how many values follow each.
FLAGS = {
    "--multirun": 0, "-m": 0, "--run": 0, "-r": 0, "--resolve": 0, "--hydra-help": 0, "--shell-completion": 0, "-sc": 0,
    "--cfg": 1, "-c": 1, "--package": 1, "-p": 1, "--info": 1, "-i": 1,
}  # fmt: skip
CFG = ("job", "hydra", "all")
INFO = ("all", "config", "defaults", "defaults-tree", "plugins", "searchpath")
VALUES = {"--cfg": CFG, "-c": CFG, "--info": INFO, "-i": INFO}
WITH_CFG = ("--resolve", "--package", "-p")  # flags that say how --cfg prints
PLUGINS = "experiments and presets of your own lie in a folder named in MPMBENCH_PLUGINS"
MOST_NAMED = 20  # in one sentence
TEXTS = ("campaign", "output_dir")  # keys whose values are texts, whatever they look like


def split(arguments: list[str], verbs: list[str]) -> tuple[list[str], list[str]]:
    """Separate options from ``key=value`` pairs, and check both as far as names go.

    Raises `BadInput` with the nearest known word.
    """
    flags: list[str] = []
    pairs: list[str] = []
    values = 0
    for argument in arguments:
        if values > 0:
            values -= 1
            check_value(flags[-1], argument)
            flags.append(argument)
        elif argument.startswith("-"):
            name = argument.partition("=")[0]
            if name in ("--config-dir", "-cd", "--config-path", "-cp"):
                raise BadInput(f"{name}: there is no such option; {PLUGINS}")
            if name not in FLAGS:
                hint = did_you_mean(name, [*FLAGS, "--help", "--version"])
                raise BadInput(f"{name}: there is no such option{hint}")
            values = FLAGS[name] if "=" not in argument else 0
            if "=" in argument:
                check_value(*argument.split("=", 1))
            flags.append(argument)
        else:
            pairs.append(by_name(argument))
    if values > 0:
        raise BadInput(f"{flags[-1]} needs a value")
    names = {flag.partition("=")[0] for flag in flags}
    for name in names & set(WITH_CFG) if not names & {"--cfg", "-c"} else ():
        raise BadInput(f"{name}: this goes with --cfg only")
    if "-sc" not in flags and "--shell-completion" not in flags:
        for pair in pairs:
            check_pair(pair, verbs)
    return flags, [as_text(pair) for pair in pairs]


def check_value(name: str, value: str) -> None:
    """Raise `BadInput` for a value that an option does not take."""
    if value not in VALUES.get(name, (value,)):
        hint = did_you_mean(value, VALUES[name])
        raise BadInput(f"{name} {value}: one of {', '.join(VALUES[name])} is needed{hint}")


def by_name(pair: str) -> str:
    """A ``key=value``, with its name for an experiment that is given as a file."""
    key, _, value = pair.partition("=")
    path = value.strip("'\"")
    if key != "experiments" or not path.endswith((".yaml", ".yml")):
        return pair
    return f"{key}={experiment_of(path)}"


def as_text(pair: str) -> str:
    """A ``key=value`` with quotes where the value would be taken for something else than a text."""
    key, _, value = pair.partition("=")
    if key not in TEXTS:
        return pair
    words = [f"'{word}'" if NO_TEXT.fullmatch(word) else word for word in value.split(",")]
    return f"{key}={','.join(words)}"


def value_of(key: str, pairs: Iterable[str], default: str = "") -> str:
    """What the last of some ``key=value`` gives for a key."""
    given = dict(pair.partition("=")[::2] for pair in pairs)
    return given.get(key, default).strip("'\"")


def check_pair(pair: str, verbs: list[str]) -> None:
    """Check one ``key=value``: the key must exist, and the option of a group too."""
    key, equals, value = pair.partition("=")
    refuse_targets(pair, pair)
    if key.startswith(("hydra.", "hydra/", "+hydra.", "++hydra.", "~hydra")):
        return
    if key.startswith(("+", "~")):
        bare = key.lstrip("+~")
        hint = did_you_mean(bare, all_keys()) or "; see --help for the keys"
        raise BadInput(f"{pair}: keys can be neither added nor removed{hint}")
    if not equals:
        hint = did_you_mean(key, verbs) or f"; commands are {', '.join(verbs)}"
        raise BadInput(f"{pair}: neither key=value nor a command{hint}")
    if key not in all_keys():
        raise unknown_key(key, pair)
    if not value.strip():
        raise BadInput(f"{pair}: a value is needed after {key}=")
    if key == "experiments" and not re.fullmatch(r"[\w./-]+", value):
        raise BadInput(f"{pair}: one experiment at a time is needed")
    if key in GROUPS and value.startswith(("{", "[")):
        raise BadInput(f"{pair}: a name is needed; there are {', '.join(options(key))}")
    if key in (*GROUPS, "experiments") and re.fullmatch(r"[\w./,\s-]+", value):
        known = experiments() if key == "experiments" else options(key)
        for name in map(str.strip, value.split(",")):
            if name not in known:
                some = ", ".join(list(known)[:MOST_NAMED]) or "none"
                more = ", ...; `list` names all" if len(known) > MOST_NAMED else ""
                hint = did_you_mean(name, known) or f"; there are {some}{more}"
                raise BadInput(f"{pair}: there is no {key} {name or chr(39) * 2}{hint}")
