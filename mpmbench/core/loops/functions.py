"""Time loops that are written as a function ``step(state, dt)``, as plug-ins of version 0.1 are."""

from collections.abc import Callable
from functools import cache
from typing import Any, ClassVar

from mpmbench.core.loops import TimeLoop
from mpmbench.core.loops.explicit import Explicit
from mpmbench.core.state import State


@cache
def loop_of_function(function: Callable[[State, float], None]) -> type[TimeLoop]:
    """The explicit loop, its settings included, with this function as its step.

    The function may have the attributes ``check(choices)`` and ``check_basis(name)``, which raise
    `NotApplicable`, and ``needs``, the stress that the material must have.
    """
    needed = getattr(function, "needs", None)

    class FunctionLoop(Explicit):
        stress: ClassVar[Any] = staticmethod(needed) if needed is not None else None

        def check(self, case: Any) -> None:
            getattr(function, "check", lambda _: None)(self)
            getattr(function, "check_basis", lambda _: None)(case.basis_name)

        def step(self, s: State, dt: float) -> None:
            function(s, dt)

    FunctionLoop.__name__, FunctionLoop.__module__ = function.__name__, function.__module__
    FunctionLoop.__doc__ = function.__doc__
    return FunctionLoop
