"""The command ``completion``: what a shell has to read so that the tabulator completes words of ``mpmbench``."""

import importlib
from pathlib import Path

from mpmbench.commands.help import WORDS
from mpmbench.commands.verbs import VERBS
from mpmbench.say import say
from mpmbench.settings.schema import (
    GROUPS,
    TOP_LEVEL,
    BadInput,
    all_keys,
    declared,
    did_you_mean,
    experiments,
    options,
)

SHELLS = ("bash", "zsh")
# The words so far go to `mpmbench completion --words`; what is wrong there must not show in a prompt. Bash takes
# the part after `=` for a word of its own, so that only this part is put in place.
BASH = """\
_mpmbench() {
    local line="${COMP_LINE:0:COMP_POINT}" current one
    current="${line##* }"
    COMPREPLY=()
    while IFS= read -r one; do
        [[ $one == "$current"* ]] || continue
        [[ $current == *=* ]] && one="${one#"${current%%=*}="}"
        COMPREPLY+=("$one")
    done < <(mpmbench completion --words $line 2>/dev/null)
    [[ ${#COMPREPLY[@]} == 1 && ${COMPREPLY[0]} == *[=/] ]] && compopt -o nospace 2>/dev/null
    return 0
}
complete -o default -F _mpmbench mpmbench"""
ZSH = "autoload -U +X bashcompinit && bashcompinit"
OF_RESULTS = (
    *("show", "animate", "report", "compare", "merge", "rerun", "continue", "export", "status"),
)


def main(arguments: list[str]) -> int:
    """``completion SHELL``; the shell itself asks ``completion --words WORD...`` for candidates."""
    if arguments[:1] == ["--words"]:
        say(*candidates(arguments[2:]))
        return 0
    if len(arguments) != 1 or arguments[0] not in SHELLS:
        given = arguments[0] if arguments else ""
        hint = did_you_mean(given, SHELLS)
        raise BadInput(f"completion {given}: one of {', '.join(SHELLS)} is needed{hint}")
    say(*([ZSH] if arguments[0] == "zsh" else []), *BASH.splitlines())
    return 0


def candidates(words: list[str]) -> list[str]:
    """Words that may come next, whole, after the words of a command line so far, `mpmbench` left out.

    The last word is the one that is being written, unless it is complete.
    """
    verb = words[0] if words and words[0] in VERBS else ""
    current = words[-1] if words else ""
    if "=" in current and not current.startswith("-"):
        return values(current, words)
    if verb in OF_RESULTS:
        return [*options_of(verb), *places()]
    if verb == "list":
        return sorted(
            {*VERBS, *experiments(), *(one for group in GROUPS for one in options(group))}
        )
    if verb == "reproduce":
        return papers()
    keys = [f"{key}=" for key in (*GROUPS, "experiments", *TOP_LEVEL)]
    below = [f"{key}=" for key in all_keys() if "." in key] if "." in current else []
    return [*([] if verb else VERBS), *keys, *below, "-m", "--help", "--version", "--cfg"]


def values(current: str, words: list[str]) -> list[str]:
    """Candidates for what stands behind a key, after the last comma."""
    key, _, value = current.partition("=")
    before, comma, _ = value.rpartition(",")
    known: list[str] = []
    if key in GROUPS:
        known = list(options(key))
    elif key == "experiments":
        known = list(experiments())
    elif "." in key:
        group, _, name = key.partition(".")
        chosen = [word.partition("=")[2] for word in words if word.startswith(f"{group}=")]
        for one in chosen or (options(group) if group in GROUPS else ()):
            setting = declared(group, one).get(name) if one in options(group) else None
            known += [str(value) for value in (setting.options or ()) if setting] if setting else []
    return [f"{key}={before}{comma}{one}" for one in dict.fromkeys(known)]


def options_of(verb: str) -> list[str]:
    """Options of a command that begin with dashes."""
    if verb in WORDS:
        return [word for word in WORDS[verb][0] if word.startswith("--")]
    return list(importlib.import_module(f"mpmbench.commands.{verb}").parser().options())


def papers() -> list[str]:
    """Names of papers that can be reproduced."""
    from mpmbench.settings.files import papers as found

    return sorted(found())


def places() -> list[str]:
    """Folders of results below ``results``, and the files in them."""
    top = Path("results")
    files = sorted(top.glob("*/*.nc"))[:1000] if top.is_dir() else []
    return [*dict.fromkeys(str(file.parent) for file in files), *map(str, files)]
