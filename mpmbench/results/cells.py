"""Cells of CSV files: no text becomes a formula when a spreadsheet opens them."""

import re
from typing import Any

from mpmbench.say import one_line

FORMULA = re.compile(r"\s*[=+\-@＝＋－＠]|[\t\r]")  # how what a spreadsheet computes begins
NUMBER = r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?%?"
NUMBERS = re.compile(f"{NUMBER}(, {NUMBER})*")


def csv_cell(value: Any) -> Any:
    """A value for `csv.writer`: text that would be a formula begins with an apostrophe.

    Numbers stay as they are, also where they are text or a list of them; so do words. All text is one line.

    >>> csv_cell("=1+1"), csv_cell("-1.5e-3"), csv_cell("-0.58, 0.89")
    ("'=1+1", '-1.5e-3', '-0.58, 0.89')
    """
    if not isinstance(value, str):
        return value
    is_formula = FORMULA.match(value) and not NUMBERS.fullmatch(value)
    return f"'{one_line(value)}" if is_formula else one_line(value)
