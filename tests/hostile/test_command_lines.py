"""Command lines that nobody should type: each is done, or refused in one sentence."""

import random

import pytest

from mpmbench.cli import VERBS, main
from mpmbench.settings.schema import GROUPS, all_keys, options

NUMBER = 500
VALUES = (
    *("0", "-1", "1", "8", "007", "1e3", "1e308", "-1e308", "1e-308", "nan", "inf", "-inf", "1e400"),
    *("null", "true", "'8'", "''", '"', "'", "[", "]", "[]", "{}", "{a:1}", "[1,[2]]", "a b", "ü", "\x1b[2J"),
    *("..", "../x", "/", "~", "$(x)", "${nowhere}", "${oc.env:HOME}", "${oc.env:NOT_SET,4}", "${seed}"),
    *("range(4,4)", "range(1,3)", "range(0,1,0)", "range(1,1e9)", "range(0.1,0.4,0.1)", "glob(x*)", "glob(*)"),
    *("1,2", "1,1", ",", "a,", "choice()", "choice(1,2)", "interval(0,1)", "sort(3,1)", "shuffle(1,2)"),
    *("x" * 300, "9" * 400, "_target_", "?", "\\", "=", "==1", "*", "&a", "!!python/none", "%s", "{0}"),
)  # fmt: skip
FLAGS = (
    "-m",
    "--cfg",
    "job",
    "--resolve",
    "--config-dir",
    "/nonexistent",
    "--info",
    "-x",
    "--",
    "-",
)


def lines(dice: random.Random) -> list[list[str]]:
    """Random lines: settings as one run or a sweep, printed or looked up, and commands."""
    keys = [*all_keys(), "nonsense", "method.", ".x", "+seed", "~seed", "++a", "hydra.nonsense"]
    names = [name for group in GROUPS for name in options(group)]
    found = []
    while len(found) < NUMBER:
        pairs = [
            f"{dice.choice(keys)}={dice.choice((*VALUES, dice.choice(names)))}"
            for _ in range(dice.randint(1, 4))
        ]
        kind = dice.randrange(4)
        if kind == 0:
            found.append(["--cfg", "job", *pairs])
        elif kind == 1:
            found.append(["status", "-m", *pairs])
        elif kind == 2:
            found.append([dice.choice(FLAGS), dice.choice(FLAGS), *pairs, "resolution=-1"])
        else:
            verb = dice.choice([verb for verb in VERBS if verb not in ("reproduce", "warmup")])
            found.append(
                [verb, *(dice.choice((*VALUES, *names)) for _ in range(dice.randrange(4)))]
            )
    return found


@pytest.mark.slow
def test_command_lines(tmp_path, monkeypatch, capfd, counts):
    monkeypatch.chdir(tmp_path)
    tracebacks, codes, long = [], [], []
    for line in lines(random.Random(1)):
        capfd.readouterr()
        try:
            code = main(line)
        except BaseException as error:
            tracebacks.append((line, repr(error)))
            continue
        out, errors = capfd.readouterr()
        if "Traceback" in out + errors:
            tracebacks.append((line, errors))
        if code not in (0, 2):
            codes.append((line, code, errors))
        if code == 2 and (not errors.startswith("mpmbench: ") or errors.count("\n") != 1):
            long.append((line, errors))
    print(*tracebacks, *codes, *long, sep="\n")
    counts("command lines: tracebacks", 0, len(tracebacks))
    counts("command lines: exit codes other than 0 and 2", 0, len(codes))
    counts("command lines: refused in other than one sentence", 0, len(long))
