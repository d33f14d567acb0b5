"""The ways in which a run can end without a result, each with a reason that a user can read."""


class BadSetting(ValueError):
    """A setting outside its range; the message names the key, the value and what is allowed.

    Parameters
    ----------
    key : str
        The key below its group, for example ``d_max``; the caller puts the group in front.
    value : object
        What was given.
    allowed : str
        What would have been accepted, for example ``"a number greater than 1"``.
    hint : str
        What is said after that.
    """

    def __init__(self, key: str, value: object, allowed: str, hint: str = "") -> None:
        super().__init__(f"{key} = {value!r}: {allowed} is needed{hint}")
        self.key, self.value, self.allowed, self.hint = key, value, allowed, hint


class NotApplicable(Exception):
    """The combination makes no sense or is outside what a method can do; the message says why."""


class SolverFailure(Exception):
    """A run that stopped before its end; `status` is the word that its result file carries."""

    status = "crashed"


class Diverged(SolverFailure):
    """A non-finite or exploding field: the time step is unstable."""

    status = "diverged"


class BrokeDown(SolverFailure):
    """Negative volume, singular mass matrix, or a particle outside the basis."""

    status = "broke_down"


class NotConverged(SolverFailure):
    """An iteration (max-ent multipliers, equilibrium) that did not reach its tolerance."""

    status = "not_converged"


def require(condition: bool, key: str, value: object, allowed: str) -> None:
    """Raise `BadSetting` unless `condition` holds."""
    if not condition:
        raise BadSetting(key, value, allowed)


def require_option(key: str, value: object, options: tuple[str, ...]) -> None:
    """Raise `BadSetting` unless `value` is one of `options`."""
    require(value in options, key, value, "one of " + ", ".join(options))
