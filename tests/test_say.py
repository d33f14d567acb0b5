"""What is printed cannot steer a terminal: each line is one line, and all of it can be seen."""

import ast
from pathlib import Path

import pytest

from mpmbench.cli import main
from mpmbench.runs.sweep import display
from mpmbench.runs.sweep.execute import Record
from mpmbench.say import one_line, say, visible, with_reason
from mpmbench.settings.schema import BadInput

PACKAGE = Path(__file__).parents[1] / "mpmbench"
HOSTILE = "a\x1b]0;title\x07\x1b[2J\r\nforged line\x85\u2028\u202ecba\u2066\x9b31m\x00 \udc80 b"


def test_what_cannot_be_seen_is_shown_as_its_code():
    assert visible("ü µ ✓ 漢") == "ü µ ✓ 漢"
    assert visible("\x1b[31m\n\t\u202e\udc80\\") == "\\x1b[31m\\n\\t\\u202e\\udc80\\"
    assert one_line("  a\n\tb\x07  ") == "a b\\x07"
    assert visible(HOSTILE).isprintable() and one_line(HOSTILE).isprintable()


@pytest.mark.parametrize("error", (False, True))
def test_a_line_stays_one_line(capsys, error):
    say(HOSTILE, 3, "", error=error)
    printed = capsys.readouterr()
    lines = (printed.err if error else printed.out).split("\n")
    assert lines == [visible(HOSTILE), "3", "", ""]
    assert (printed.out if error else printed.err) == ""


def test_reasons_are_said_in_one_line():
    record = Record("name", "crashed", HOSTILE, "file.nc", unwritten=HOSTILE)
    texts = [*display.line(record, 1, 2).split("\n"), str(BadInput(HOSTILE))]
    texts += [*display.summary(record, 1.0).split("\n"), *display.failures([record]).split("\n")]
    assert all(text.isprintable() for text in texts)
    assert not any(text.startswith("forged") for text in texts)


def test_lines_of_a_sweep_have_80_columns():
    name = "implicit_mpm-linear-soil_column-n16-0123abcd"
    why = "the iteration of step 7 did not converge within 50 iterations; " * 3
    good = Record(name, "ok", "", "f.nc", scalars={"error_displacement_rms": (1.23456e-5, "m")})
    for record in (good, Record(name, "not_converged", why, "f.nc")):
        lines = display.line(record, 7, 12).split("\n")
        assert max(map(len, lines)) <= 80 and lines[0].startswith(
            f"[ 7/12] {record.outcome}  {name}"
        )
        assert all(line.startswith(" " * 8) for line in lines[1:])
    short = Record("mpm-linear-bar_fixed_ends-n8-0123abcd", "ok", "", "f.nc", scalars=good.scalars)
    assert display.line(short, 7, 12).endswith(" s  1.23e-05 m")
    scalars = {"steps": (7.0, "1"), "plain_cells": (1.0, "1"), "run_out": (0.51234, "m")}
    soil = Record("mpm-linear-soil_column-n8-0123abcd", "ok", "", "f.nc", scalars=scalars)
    assert display.line(soil, 7, 12).endswith(" s  run out 0.512 m")


def test_a_reason_stands_beside_as_long_as_80_columns_have_room_for_it():
    start = "a" * 70
    assert with_reason(start, "b" * 8) == [f"{start}  {'b' * 8}"]
    assert with_reason(start, "b" * 9) == [start, " " * 8 + "b" * 9]
    assert with_reason(start, "") == [start]


def test_what_the_command_line_repeats_is_visible(capsys):
    assert main([f"method={HOSTILE}"]) == 2
    assert capsys.readouterr().err[:-1].isprintable()


def test_everything_is_printed_in_one_place():
    found = []
    for file in PACKAGE.rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_bytes())):
            if isinstance(node, ast.Call) and ast.unparse(node.func) in (
                *("print", "sys.stdout.write", "sys.stderr.write"),
            ):
                found.append(str(file.relative_to(PACKAGE)))
    assert found == ["say.py"]


def test_an_error_relative_to_a_zero_field_is_not_a_number():
    """The exact stress of a patch is zero up to round-off: a thousand million million times that says nothing."""
    assert display.of_the_field(0.012) == "  (0.012 of the field)"
    for relative in (1.01e13, float("nan"), float("inf")):
        assert display.of_the_field(relative) == "  (the exact field is zero)"
    assert display.of_the_field(0.0) == ""
