"""What ``COMMAND --help`` prints: what the command does, the words that can follow it, and an example."""

import importlib
import textwrap

from mpmbench.settings.words import in_columns

# Words that follow a command, with what they are, and an example of them. Commands that have a
# `parser` say it themselves.
WORDS: dict[str, tuple[dict[str, str], str]] = {
    "list": (
        {
            "NAME": "an option, a key, a kind such as problems or bases, transfers, an experiment, "
            "a paper, or a command; without a name all that there is",
        },
        "list bspline",
    ),
    "status": (
        {
            "FOLDER": "of results, folders in it too; `results` by default",
            "FILE": "one result file, with the traceback of a run that crashed",
            "KEY=VALUE": "of a sweep, after -m: what of it is finished or missing",
        },
        "status -m method=mpm,otm resolution=8,16",
    ),
    "reproduce": (
        {
            "PAPER": "its name; `list papers` names them",
            "KEY=VALUE": "such as output_dir=FOLDER",
        },
        "reproduce wobbes2020",
    ),
    "report": ({"RESULTS": "a folder of result files"}, "report results/quickstart"),
    "choose": (
        {
            "problem=P": "the problem",
            "error=E": "error that is good enough, in the unit that the answer shows",
            "results=FOLDER": "where the runs are; results/matrix by default",
            "pages=FOLDER": "write pages of all runs there instead",
        },
        "choose problem=bar_fixed_ends error=0.01",
    ),
    "compare": (
        {"A": "a folder of results", "B": "the folder that is judged against it"},
        "compare results/main results/branch",
    ),
    "merge": (
        {"TARGET": "the folder that gets the results", "A B...": "folders that they come from"},
        "merge results/all results/a results/b",
    ),
    "rerun": (
        {
            "FILE.nc": "a result file",
            "limits.time=60": "another limit than that of the file; limits.setup, limits.memory too",
        },
        "rerun results/default/mpm-linear-patch_test-n8-9eb8fbdd.nc",
    ),
    "continue": (
        {
            "FILE.nc": "the result file of a run with a constant time step",
            "end_time=T": "a later one, in seconds: whole time steps of the stored run",
            "KEY=VALUE": "snapshot_times after its end, threads, limits, campaign and output_dir",
        },
        "continue results/default/RESULT.nc end_time=0.2",
    ),
    "check": ({"FILE.py": "a plug-in"}, "check plugins/my_basis.py"),
    "new": (
        {
            "KIND": "basis, material, method, transfer, problem or paper",
            "NAME": "small letters, digits and _",
            "FOLDER": "where it is written, with its test",
        },
        "new basis my_basis plugins",
    ),
    "export": (
        {
            "RESULT": "a result file, or a folder of them",
            "--vtk": "particles at all instants for ParaView, with all fields",
            "--csv": "particles, histories, and a row for each run, as tables",
        },
        "export results/default --vtk --csv",
    ),
    "warmup": (
        {"KEY=VALUE": "as of the runs; without a method or basis, all that apply"},
        "warmup problem=taylor_anvil",
    ),
    "completion": (
        {"SHELL": "bash or zsh: prints what the shell has to read"},
        'eval "$(mpmbench completion bash)"',
    ),
}


def lines_of(verb: str, usage: str, sentence: str) -> list[str]:
    """The help of one command, in lines of the terminal's width."""
    if verb not in WORDS:
        module = importlib.import_module(f"mpmbench.commands.{verb}")
        return str(module.parser().format_help()).splitlines()
    words, example = WORDS[verb]
    start = "" if example.startswith("eval") else "python -m mpmbench "
    return [
        *textwrap.wrap(f"usage: python -m mpmbench {verb} {usage}", 80, subsequent_indent="    "),
        "",
        sentence[0].upper() + sentence[1:] + ".",
        "",
        *in_columns(words),
        "",
        f"For example: {start}{example}",
    ]
