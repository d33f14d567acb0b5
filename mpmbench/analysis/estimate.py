"""What is known of the order of a curve, and how it is printed."""

from dataclasses import dataclass, field

import numpy as np

from mpmbench.analysis.slopes import CONVERGES, OFF, RISES, ROUNDING, STAYS, UNEVEN, UNKNOWN

FALLS = 0.1  # a last slope that is lower than the fitted one by more than this is said to fall
WIDEST_INTERVAL = 2.0  # an interval longer than this says nothing


@dataclass(frozen=True)
class OrderEstimate:
    """What the levels of a curve show, and what they let one extrapolate.

    Attributes
    ----------
    slope : float
        Least-squares slope over all levels; NaN for fewer than two, or where all is round-off.
    local : ndarray
        Slopes between neighbouring levels above round-off, coarse to fine, shape (L - 1,).
    course : str
        How the curve ends, see `slopes.course_of`, or ``round-off``.
    last : int
        How many of the last slopes show it.
    levels : str
        ``8..64 cells``.
    asymptotic, low, high : float
        Extrapolated order and ends of its 95 % interval; NaN when none can be stated. The order is
        NaN, too, where it would lie outside the local slopes without a reason.
    reason : str
        Why it may lie outside the local slopes, or why it is not stated.
    floor : float
        Error that does not shrink with h, in the units of the errors; 0 when none was recognised.
    floor_probability : float
        Posterior probability that there is a floor (even odds beforehand).
    floor_share : ndarray
        Share of the floor in the error of each level, shape (L,); of the predicted floor where none
        was recognised and the predicted one is most of the finest error.
    used : ndarray of bool
        Levels that the asymptotic order was fitted to, shape (L,).
    pre_asymptotic : ndarray of bool
        Coarse levels where the drift changes the slope by more than 0.1, or which no drift
        explains, shape (L,).
    misfit : float
        RMS relative misfit of the best model on the used levels.
    verdict : str
        All of this as one sentence.
    """

    slope: float
    local: np.ndarray
    course: str
    levels: str = ""
    last: int = 1
    asymptotic: float = float("nan")
    low: float = float("nan")
    high: float = float("nan")
    reason: str = ""
    floor: float = 0.0
    floor_probability: float = float("nan")
    floor_share: np.ndarray = field(default_factory=lambda: np.zeros(0))
    used: np.ndarray = field(default_factory=lambda: np.zeros(0, bool))
    pre_asymptotic: np.ndarray = field(default_factory=lambda: np.zeros(0, bool))
    misfit: float = float("nan")
    verdict: str = ""

    @property
    def converges(self) -> bool:
        """Whether the errors still fall on the finest levels."""
        return self.course == CONVERGES

    @property
    def half_width(self) -> float:
        """Half the length of the interval of the asymptotic order."""
        return 0.5 * (self.high - self.low)


def numbers_text(slopes: np.ndarray) -> str:
    """``2.03, 1.99``; nothing is minus zero."""
    return ", ".join(map(_two_digits, slopes))


def _two_digits(slope: float) -> str:
    return f"{round(float(slope), 2) + 0.0:.2f}"


def slopes_text(found: OrderEstimate) -> str:
    """The order as the levels show it.

    ``2.97 (2.85 to 3.03)`` is the least-squares slope and the range of the local ones, ``1.64 (1.99
    falling to 1.29)`` one that is higher than the last; where the errors no longer fall there is no
    order, but ``levels off: last slope 0.17``, ``rises: ...``, ``stays: ...``, ``uneven: ...``,
    ``round-off`` or ``none``.
    """
    local = found.local
    if found.course in (ROUNDING, UNKNOWN):
        return found.course
    if found.course in (OFF, RISES):
        last = local[-found.last :]
        return f"{found.course}: last slope{'s' if len(last) > 1 else ''} {numbers_text(last)}"
    if found.course in (STAYS, UNEVEN):
        return f"{found.course}: slopes {' to '.join(map(_two_digits, (local.min(), local.max())))}"
    if len(local) == 1:
        return f"{found.slope:.2f}"
    if local[-1] < found.slope - FALLS:
        return f"{found.slope:.2f} ({local.max():.2f} falling to {local[-1]:.2f})"
    return f"{found.slope:.2f} ({local.min():.2f} to {local.max():.2f})"


def asymptotic_text(found: OrderEstimate) -> str:
    """``2.98 ± 0.04``, ``2.00 (1.74 to 2.59)`` when the interval is lopsided, ``1.9 to 3.0`` without a value.

    The reason follows when the order is outside the local slopes: ``2.21 ± 0.13 without a floor of
    1.5e-07 m``.
    """
    if not found.high - found.low <= WIDEST_INTERVAL:
        return "none"
    reason = f" {found.reason}" if found.reason else ""
    if not np.isfinite(found.asymptotic):
        return f"{found.low:.2f} to {found.high:.2f}{reason}"
    below, above = found.asymptotic - found.low, found.high - found.asymptotic
    if max(below, above) <= 1.3 * min(below, above) + 0.01:
        return f"{found.asymptotic:.2f} ± {max(below, above, 0.01):.2f}{reason}"
    return f"{found.asymptotic:.2f} ({found.low:.2f} to {found.high:.2f}){reason}"
