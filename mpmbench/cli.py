"""The command line: one run, a sweep, or a command. Nothing heavy is imported before it is needed.

Exit codes: 0 all runs are fine, 1 some run failed, 2 bad input.
"""

import importlib
import sys
import textwrap
import time
from collections.abc import Iterable
from pathlib import Path

from mpmbench import PLACES, __version__
from mpmbench.commands.verbs import VERBS
from mpmbench.core.moved import advice
from mpmbench.core.registry import plugin_files
from mpmbench.runs.interrupts import terminated_like_interrupted
from mpmbench.runs.streams import forgiving
from mpmbench.say import say
from mpmbench.settings.arguments import split
from mpmbench.settings.files import shipped_folder
from mpmbench.settings.schema import GROUPS, BadInput, options

HELP = """\
mpmbench: particle methods of solid mechanics on the same problem, the same
particles and the same norm. `mpmbench` is short for `python -m mpmbench`.

  python -m mpmbench KEY=VALUE...            one run
  python -m mpmbench -m KEY=VALUE,VALUE...   all combinations
  python -m mpmbench experiments=NAME        an experiment; `list experiments`
  python -m mpmbench experiments=FILE.yaml   one of your own

Commands, after python -m mpmbench; COMMAND --help says more of each
{verbs}

Choices
{options}

Keys, with their defaults (null: the problem brings a value) and units
{keys}
{chosen}
--cfg job prints all values of a run without running it. Exit codes: 0 fine,
1 some run failed, 2 bad input; of compare: 20 not comparable, 12 new failures,
11 less accurate, 10 slower, 30 speed undecided, 0 none of these.
"""
KEYS_BELOW = """\
Keys below a choice, such as basis.d_max: `list maxent` or `--help basis=maxent`
shows them with their defaults, units and ranges."""
SHOW_ONLY = {"--cfg", "-c", "--info", "-i", "-sc", "--shell-completion", "--hydra-help"}


def main(arguments: list[str] | None = None) -> int:
    """Do what the command line says and return the exit code."""
    started = time.perf_counter()
    arguments = sys.argv[1:] if arguments is None else arguments
    if sys.platform == "win32":
        say("mpmbench runs on Linux and macOS; on Windows, use it inside WSL.", error=True)
        return 2
    with forgiving(), terminated_like_interrupted():
        try:
            return answered(arguments, started)
        except BadInput as error:
            say(f"mpmbench: {error}", error=True)
            return error.exit_code
        except KeyboardInterrupt:
            what = "interrupted; the same command completes what is missing"
            say(f"mpmbench: {what}", error=True)
            return 1
        except OSError as error:  # a full disk, a folder that is not ours, ...
            place = error.filename2 or error.filename or "a temporary file"  # that of a copy first
            why = f"{place}: {error.strerror.lower()}" if error.strerror else str(error)
            say(f"mpmbench: {why}", error=True)
            return 1


def answered(arguments: list[str], started: float) -> int:
    """The exit code of a command line, from a folder that is there."""
    try:
        Path.cwd()
    except FileNotFoundError:
        raise BadInput("the current folder has been removed; change to another one") from None
    warn_of_old_places()
    return dispatch(arguments, started)


def warn_of_old_places() -> None:
    """Name, once for each file of a plug-in, the line that should stand for its imports."""
    for file in plugin_files():
        sentence = advice(file, PLACES)
        if sentence:
            say(f"mpmbench: {sentence}", error=True)


def dispatch(arguments: list[str], started: float) -> int:
    """Find out what is wanted."""
    asked = "--help" in arguments or "-h" in arguments
    if asked and arguments[0] in VERBS:
        from mpmbench.commands.help import lines_of

        say(*lines_of(arguments[0], *VERBS[arguments[0]]))
        return 0
    if asked:
        say(*help_text(arguments).splitlines())
        return 0
    if "--version" in arguments:
        say(version())
        return 0
    if arguments and arguments[0] in VERBS:
        command = importlib.import_module(f"mpmbench.commands.{arguments[0]}")
        return int(command.main(arguments[1:]))
    flags, pairs = split(arguments, list(VERBS))
    if flags in (["--cfg", "job"], ["-c", "job"], ["--cfg=job"]):
        return show_configuration(pairs)
    return run(flags, pairs, started)


def version() -> str:
    """The version, and the commit as far as it is known."""
    from mpmbench.results.provenance import git

    commit, edited = git()
    changed = ", edited" if edited == "yes" else ""
    return __version__ + ("" if commit == "unknown" else f" (commit {commit[:12]}{changed})")


def help_text(arguments: list[str]) -> str:
    """What ``--help`` prints: all that is general, and the keys of the options that were given."""
    from mpmbench.settings.words import in_columns, keys_of

    given = [argument.split("=", 1) for argument in arguments if "=" in argument]
    chosen = [
        "\n".join([f"Keys of {group}={name}", *keys_of(group, name), ""])
        for group, name in given
        if group in GROUPS and name in options(group)
    ]
    config = (shipped_folder("conf") / "config.yaml").read_text(encoding="utf-8")
    lines = config.split("# The discretisation\n")[1].split("\n# For experiments")[0]
    return HELP.format(
        verbs="\n".join(
            in_columns({f"{verb} {what}": text for verb, (what, text) in VERBS.items()})
        ),
        options="\n".join(in_lines(f"  {group}=".ljust(14), options(group)) for group in GROUPS),
        keys="\n".join(general_keys(lines)) + "\n",
        chosen="\n".join(chosen) or KEYS_BELOW,
    )


def general_keys(text: str) -> list[str]:
    """The lines of a YAML file, with comments beside the keys, in columns."""
    from mpmbench.settings.words import in_columns

    found: list[str] = []
    keys: dict[str, str] = {}
    for line in [*filter(None, text.splitlines()), "#"]:
        key, _, said = line.partition("#")
        if key.strip():
            keys[key.rstrip()] = said.strip()
            continue
        found += [*in_columns(keys), said.strip()]
        keys = {}
    return found[:-1]


def in_lines(start: str, names: Iterable[str]) -> str:
    """Names after a word, in lines of at most 80 characters."""
    return textwrap.fill(
        ", ".join(names), 80, initial_indent=start, subsequent_indent=" " * len(start)
    )


def show_configuration(pairs: list[str]) -> int:
    """Print the configuration of a run, as it would be used."""
    from omegaconf import OmegaConf

    from mpmbench.runs.hydra import compose

    config, reason = compose.compose_many([pairs])[0]
    if reason:
        raise BadInput(f"this combination does not apply: {reason}")
    say(*OmegaConf.to_yaml(config).splitlines())
    return 0


def run(flags: list[str], pairs: list[str], started: float) -> int:
    """One run or a sweep, or what Hydra says of them."""
    if {flag.partition("=")[0] for flag in flags} & SHOW_ONLY:
        from mpmbench.runs.hydra.compose import show

        show(flags, pairs)
        return 0
    from mpmbench.runs.process import isolation

    isolation.processes.warm_up()  # loads its libraries while we load ours and compose
    from mpmbench.runs.hydra import compose
    from mpmbench.runs.sweep import session

    if compose.wants_many(flags, pairs):
        return session.Session(pairs).run()
    return session.run_one(pairs, started)
