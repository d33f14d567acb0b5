"""One line for an error: its cause and its place."""

import numpy as np
import pytest
from numba import njit
from numba.extending import overload

from mpmbench.core import registry
from mpmbench.runs.process.reasons import LONGEST, explain


def scratch(handle):
    raise NotImplementedError


@overload(scratch)
def _scratch(handle):
    def implementation(handle):
        return handle.shapes

    return implementation


@njit
def takes(handle):
    return scratch(handle)


@njit
def too_many(handle):
    return np.linalg.solve(handle, handle, handle)


def raised(function, *arguments):
    with pytest.raises(Exception) as caught:
        function(*arguments)
    return caught.value


def line_of(text: str) -> int:
    with open(__file__) as file:
        return next(number for number, line in enumerate(file, 1) if text in line)


def test_the_cause_of_an_error_of_numba_and_its_place():
    assert explain(raised(takes, np.ones(2))) == (
        "TypingError: Unknown attribute 'shapes' of type array(float64, 1d, C) "
        f"(test_reasons.py, line {line_of('return handle.shapes')})"
    )
    assert explain(raised(too_many, np.ones((2, 2)))) == (
        "TypingError: too many positional arguments "
        f"(test_reasons.py, line {line_of('return np.linalg.solve')})"
    )


def test_a_long_text_keeps_its_beginning_and_its_end():
    def fail():
        raise ValueError("begins" + 1000 * " long" + " cause")

    text = explain(raised(fail))
    assert (
        text.startswith("ValueError: begins long") and "long cause (test_reasons.py, line" in text
    )
    assert len(text) < LONGEST + 60


def test_the_place_is_that_of_the_plugin(tmp_path, monkeypatch):
    (tmp_path / "asks.py").write_text("import json\n\n\ndef ask():\n    return json.loads('{')\n")
    monkeypatch.setenv("MPMBENCH_PLUGINS", str(tmp_path))
    registry.load_plugins()
    import mpmbench_plugin_asks

    error = raised(mpmbench_plugin_asks.ask)
    assert explain(error).endswith("(asks.py, line 5)")
