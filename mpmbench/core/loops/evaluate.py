"""No motion at all: for studies of shape functions, whose problem observes them."""

from mpmbench.core.choices import Choices
from mpmbench.core.registry import register
from mpmbench.core.state import State


@register("method", "evaluate")
def step(s: State, dt: float) -> None:
    """Let the time pass."""
    s.time += dt


def check(choices: Choices) -> None:
    """There is nothing to refuse: nothing is done with the other choices."""


step.check = check  # type: ignore[attr-defined]
