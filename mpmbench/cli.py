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
from mpmbench.core.moved import advice
from mpmbench.core.registry import plugin_files
from mpmbench.runs.interrupts import terminated_like_interrupted
from mpmbench.runs.streams import forgiving
from mpmbench.say import say
from mpmbench.settings.arguments import split
from mpmbench.settings.files import shipped_folder
from mpmbench.settings.schema import GROUPS, BadInput, experiments, options

# What each command takes and does. `mpmbench.commands.<name>` is imported on use: its function
# ``main`` takes the remaining arguments and returns the exit code.
VERBS = {
    "list": ("[NAME]", "what there is, or what can be set for one option"),
    "status": ("[FOLDER | FILE | KEY=VALUE]", "what is finished, stale, failed or missing"),
    "reproduce": ("PAPER", "run what is missing of a paper, then write its report"),
    "show": ("RESULT [FIELD]", "draw the particles of a result, coloured by a field"),
    "animate": ("RESULT [FIELD]", "the same as a moving picture, GIF or MP4"),
    "report": ("RESULTS", "write the report of a folder of results"),
    "choose": ("problem=P error=E", "the cheapest stored run that is good enough, as a command"),
    "compare": ("A B", "what is better or worse in folder B than in A"),
    "merge": ("TARGET A B...", "results of several machines in one folder"),
    "rerun": ("FILE.nc [LIMIT=VALUE...]", "run again from a result file: is the same the result?"),
    "check": ("FILE.py", "does a plug-in keep its contract? a scorecard"),
    "new": ("KIND NAME FOLDER", "a working plug-in or paper to start from, with its test"),
    "export": ("RESULT --vtk|--csv", "particles for ParaView, or everything as CSV"),
    "warmup": ("[KEY=VALUE...]", "compile the kernels that a sweep needs beforehand"),
}

HELP = """\
mpmbench: particle methods of solid mechanics on the same problem, the same particles and the same
norm.

  python -m mpmbench KEY=VALUE...                        one run
  python -m mpmbench -m KEY=VALUE,VALUE...               all combinations
  python -m mpmbench experiments=NAME                    an experiment of {papers}
{verbs}

Choices
{options}

Keys, with their defaults (null: the problem brings a value) and units
{keys}
{chosen}
--cfg job prints all values of a run without running it. Exit codes: 0 fine, 1 some run failed, 2
bad input; of compare: 20 not comparable, 12 new failures, 11 less accurate, 10 slower, 30 speed
undecided, 0 none of these.
"""
KEYS_BELOW = """\
Keys below a choice, such as basis.d_max: `list maxent` or `--help basis=maxent` shows them with
their defaults, units and ranges."""
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
    if "--help" in arguments or "-h" in arguments:
        say(*help_text(arguments).splitlines())
        return 0
    if "--version" in arguments:
        say(__version__)
        return 0
    if arguments and arguments[0] in VERBS:
        command = importlib.import_module(f"mpmbench.commands.{arguments[0]}")
        return int(command.main(arguments[1:]))
    flags, pairs = split(arguments, list(VERBS))
    if flags in (["--cfg", "job"], ["-c", "job"], ["--cfg=job"]):
        return show_configuration(pairs)
    return run(flags, pairs, started)


def help_text(arguments: list[str]) -> str:
    """What ``--help`` prints: all that is general, and the keys of the options that were given."""
    from mpmbench.settings.words import keys_of

    given = [argument.split("=", 1) for argument in arguments if "=" in argument]
    chosen = [
        "\n".join([f"Keys of {group}={name}", *keys_of(group, name), ""])
        for group, name in given
        if group in GROUPS and name in options(group)
    ]
    config = (shipped_folder("conf") / "config.yaml").read_text(encoding="utf-8")
    lines = config.split("# The discretisation\n")[1].split("\n# For experiments")[0]
    return HELP.format(
        papers=", ".join(sorted({name.partition("/")[0] for name in experiments()})),
        verbs="\n".join(
            f"  python -m mpmbench {verb + ' ' + what:<36}{text}"
            for verb, (what, text) in VERBS.items()
        ),
        options="\n".join(in_lines(f"  {group}=".ljust(14), options(group)) for group in GROUPS),
        keys="".join(f"  {line}\n" for line in lines.splitlines() if line),
        chosen="\n".join(chosen) or KEYS_BELOW,
    )


def in_lines(start: str, names: Iterable[str]) -> str:
    """Names after a word, in lines of at most 100 characters."""
    return textwrap.fill(
        ", ".join(names), 100, initial_indent=start, subsequent_indent=" " * len(start)
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
    from mpmbench.runs.hydra import compose

    if {flag.partition("=")[0] for flag in flags} & SHOW_ONLY:
        compose.show(flags, pairs)
        return 0
    from mpmbench.runs.process import isolation

    isolation.processes.warm_up()  # loads its libraries while we compose the configuration
    from mpmbench.runs.sweep import session

    if compose.wants_many(flags, pairs):
        return session.Session(pairs).run()
    return session.run_one(pairs, started)
