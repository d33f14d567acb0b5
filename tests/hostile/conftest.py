"""Hostile and damaged input, in numbers: each test counts what it tried and what went wrong.

A table at the end of the session shows all counts (`tests/conftest.py` prints it).
"""

from collections.abc import Callable, Iterator

import pytest

Count = Callable[[str, int, int], None]


@pytest.fixture
def counts(record_property) -> Iterator[Count]:
    """A function that notes a row of the table: what was counted, the number asked for, that found.

    A row whose two numbers differ fails the test once it has ended, so that all rows are known.
    """
    rows: list[tuple[str, int, int]] = []

    def count(what: str, asked: int, found: int) -> None:
        rows.append((what, asked, found))
        record_property("counts", rows[-1])

    yield count
    wrong = [f"{what}: {found} instead of {asked}" for what, asked, found in rows if asked != found]
    assert not wrong, "; ".join(wrong)
