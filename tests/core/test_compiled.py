"""Decorators of compiled functions."""

from mpmbench.core.compiled import inlined, lean, summing


@inlined
def twice(x):
    return 2.0 * x


@summing
def thrice(x):
    return 3.0 * x


@lean
def both(x):
    return twice(thrice(x))


def test_what_kernels_inline_may_be_called_from_python_too():
    """Without a wrapper of its own it would end the process: a plug-in's author tries her helpers."""
    assert both(1.0) == 6.0
    assert twice(1.0) == 2.0 and thrice(1.0) == 3.0 and twice(2.0) == 4.0
