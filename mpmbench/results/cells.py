"""Cells of CSV files: no text becomes a formula when a spreadsheet opens them."""

import re
from typing import Any

from mpmbench.say import one_line

FORMULA = re.compile(r"\s*[=+\-@＝＋－＠]|[\t\r]")  # how what a spreadsheet computes begins
NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?%?")


def csv_cell(value: Any) -> Any:
    """A value for `csv.writer`: text that would be a formula begins with an apostrophe.

    Numbers stay as they are, also where they are text; so do words. All text is one line.

    >>> csv_cell("=1+1"), csv_cell("-1.5e-3"), csv_cell(-1.5)
    ("'=1+1", '-1.5e-3', -1.5)
    """
    if not isinstance(value, str):
        return value
    is_formula = FORMULA.match(value) and not NUMBER.fullmatch(value)
    return f"'{one_line(value)}" if is_formula else one_line(value)
