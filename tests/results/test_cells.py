"""CSV files that a spreadsheet may open: text stays text, numbers stay numbers."""

import csv
import io

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mpmbench.commands.export import write_table
from mpmbench.report.tables import Table
from mpmbench.results.cells import csv_cell

FORMULAS = (
    "=1+1",
    "+a",
    "-a",
    "@sum(a1)",
    "\t=1",
    "\r=1",
    " =1",
    "\n-x",
    "＝1",
    "=cmd|' /c x'!a1",
    "--1",
    "-1, =1+1",
)


@pytest.mark.parametrize("text", FORMULAS)
def test_text_that_would_be_a_formula_begins_with_an_apostrophe(text):
    assert csv_cell(text).startswith("'") and csv_cell(text).isprintable()
    assert csv_cell(text).split() == f"'{text.strip()}".split() or text[0].isspace()


@pytest.mark.parametrize(
    "text", ("", "MPM, linear", "-1", "+1.5", "-.5e-3", "-0.1%", "-0.58, 0.89", "1=2", "a-b", "ü")
)
def test_words_and_numbers_stay(text):
    assert csv_cell(text) == text


@given(st.text())
def test_no_cell_is_a_formula_or_breaks_its_row(text):
    out = io.StringIO()
    csv.writer(out, lineterminator="\n").writerow([csv_cell(text), csv_cell("end")])
    lines = out.getvalue().split("\n")
    assert len(lines) == 2 and lines[0].endswith(",end") and lines[0].isprintable()
    shown = lines[0].lstrip('"')
    assert not shown.startswith(("=", "@")) and (
        shown[:1] not in "+-" or shown[1:2] in "0123456789."
    )


NUMBERS = [-1.0, 1e-300, -1.7976931348623157e308, 0.1 + 0.2, -0.0, 5e-324, 3.0]


def test_numbers_are_read_back_equal_by_pandas(tmp_path):
    columns = ["=column", "text", "number", "whole"]
    rows = [[f"=a{k}", "-b", number, -k] for k, number in enumerate(NUMBERS)]
    write_table(tmp_path / "x.csv", columns, rows)
    (tmp_path / "y.csv").write_text(Table("y", "", columns, rows).csv())
    for name in ("x.csv", "y.csv"):
        found = pd.read_csv(tmp_path / name)
        assert list(found.columns[:4]) == ["'=column", "text", "number", "whole"]
        assert np.array_equal(found.number.to_numpy(), NUMBERS)
        assert np.array_equal(found.whole.to_numpy(), -np.arange(len(NUMBERS)))
        assert list(found["'=column"]) == [f"'=a{k}" for k in range(len(NUMBERS))]
