"""Every place of the version before still gives what stands there now, under its new name."""

import importlib

import pytest

import mpmbench
from mpmbench.core.moved import MOVED, keep_old_places


@pytest.mark.parametrize("old", MOVED)
def test_an_old_place_is_the_new_one(old):
    keep_old_places()
    module = importlib.import_module(old)
    assert module is importlib.import_module(MOVED[old])
    assert module.__name__ == module.__spec__.name == MOVED[old]


def test_the_decorator_of_compiled_functions_keeps_its_old_name():
    assert mpmbench.kernel is mpmbench.compiled
