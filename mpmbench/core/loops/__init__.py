"""Time loops: one file per loop. A loop is the dataclass of its settings, with the step that it does.

It derives from `TimeLoop` and is registered with ``@register("method", name)``; the key
``method.time`` selects it.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

from mpmbench.core import registry
from mpmbench.core.choices import Choices
from mpmbench.core.transfer.parts import NOTHING

if TYPE_CHECKING:
    from mpmbench.core.state import State

__all__ = ["Choices", "LoopPromises", "TimeLoop", "find_loop"]


@dataclass(frozen=True)
class LoopPromises:
    """What a method claims about itself; the contract tests each claim in both directions.

    Attributes
    ----------
    conserves : frozenset of str
        Which of mass, momentum, angular_momentum and energy the method conserves without
        constraints and loads, if the material lets it.
    affine : bool
        A velocity field that is affine on the nodes comes back to them unchanged from the
        particles, wherever these are.
    order : float or None
        Order of the displacements of a vibrating plate with quadratic B-splines, where the loop
        knows it.
    translation : bool
        The same velocity everywhere strains nothing.
    """

    conserves: frozenset[str] = frozenset({"mass", "momentum"})
    affine: bool = False
    order: float | None = None
    translation: bool = True


@dataclass(frozen=True)
class TimeLoop(Choices):
    """Base of all time loops: a dataclass of settings with one method that advances the state.

    Attributes
    ----------
    velocity_lag : float
        How many steps earlier than positions and stresses velocities live.
    stress : function or None
        What the material must have: `cauchy_stress`, `kirchhoff_stress`, or nothing.
    """

    velocity_lag: ClassVar[float] = 0.0
    stress: ClassVar[Any] = None

    @property
    def promises(self) -> LoopPromises:
        """What holds with these settings."""
        return LoopPromises()

    def check(self, case: Any) -> None:
        """Refuse combinations that make no sense.

        Parameters
        ----------
        case : mpmbench.case.Case
            The problem, basis and material that the loop is to work with.

        Raises
        ------
        NotApplicable
            With the reason.
        """

    def start(self, s: "State", dt: float) -> None:
        """Begin in balance, ``M a(0) = f(0)``: called before the first step, whose size `dt` [s] is.

        Loops whose velocities lag bring them to ``v(0) - a(0) velocity_lag dt``; loops with
        accelerations set these. By default nothing is done.
        """

    def circumstances(self, s: "State") -> str:
        """What may have ended a run, to be added to the reason; often nothing."""
        return ""

    def watches(self, s: "State") -> Any:
        """In what `parts.watch` looks at the particles in every step, for guards that need not do so; often nothing."""
        return NOTHING

    def step(self, s: "State", dt: float) -> None:
        """Advance the state by one step of size `dt` [s]."""
        raise NotImplementedError


def find_loop(name: str) -> type[TimeLoop]:
    """Class of the time loop of this name.

    Raises
    ------
    KeyError
        When there is none.
    """
    plugin = registry.get("method", name)
    if isinstance(plugin, type):
        return plugin
    from mpmbench.core.loops.functions import loop_of_function  # it builds on a loop, thus on this

    return loop_of_function(plugin)
