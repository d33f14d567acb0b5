"""The five checks by which every rule of contact is judged, on two soft squares that collide.

Momentum; energy, kinetic and stored apart; nothing inside the other body; no tension across the
interface after separation; no dependence on the order of the bodies.
"""

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import xarray as xr

from tests.core.support import compose, run

SMALL = {
    "resolution": 4,
    "time_step": 5e-4,
    "end_time": 0.15,
    "problem__gap": 0.05,
    "problem__room": 0.5,
    "problem__speed": 1.0,
}


@dataclass(frozen=True)
class Verdict:
    """What the five checks measure.

    Attributes
    ----------
    momentum, spin : float
        Change of the total momentum, and of the angular momentum, over those at the start.
    energy : float
        Largest part of the energy that no series accounts for, over that at the start.
    made : float
        Largest change of the kinetic and stored energy, over that at the start.
    kinetic, strain, contact : float
        Energies at the end over that at the start.
    inside, inside_ever : int
        Particles and moving nodes in the other body, at the end and at most.
    parted : float
        Speed with which the bodies move apart at the end, over that before.
    tension : float
        Largest momentum that the bodies exchange backwards in the last fifth of the run, over that of
        the start.
    order : float
        Largest difference of the positions when the bodies are named in the other order [m].
    """

    momentum: float
    spin: float
    energy: float
    made: float
    kinetic: float
    strain: float
    contact: float
    inside: int
    inside_ever: int
    parted: float
    tension: float
    order: float


@cache
def judge(rule: str, method: str, basis: str, **changes: Any) -> Verdict:
    """The verdict on a rule with a method and a basis."""
    settings = {"contact": rule, **SMALL, **changes}
    first = run("two_squares", method, basis, **settings)
    other = run("two_squares", method, basis, problem__swapped=True, **settings)
    return verdict(first, other)


def verdict(first: xr.Dataset, swapped: xr.Dataset) -> Verdict:
    start = float(first.kinetic_energy[0])
    scale = float(np.abs(first.body_momentum.values[0]).max())
    spin = first.angular_momentum.values
    apart = first.body_momentum.values[:, :, 0] / first.body_momentum.values[0, 0, 0]
    late = slice(int(0.8 * len(apart)), None)
    n = len(first.particle) // 2
    x, y = first.position.values[-1], swapped.position.values[-1]
    return Verdict(
        momentum=float(np.abs(first.momentum.values - first.momentum.values[0]).max()) / scale,
        spin=float(np.abs(spin - spin[0]).max()) / scale,
        energy=float(first.energy_imbalance),
        made=float(first.energy_drift),
        kinetic=float(first.kinetic_energy[-1]) / start,
        strain=float(first.strain_energy[-1]) / start,
        contact=float(first.contact_energy[-1]) / start,
        inside=int(first.captured),
        inside_ever=int(first.captured_most),
        parted=float(apart[-1, 1] - apart[-1, 0]),
        tension=float(np.ptp(apart[late, 1])),
        order=float(np.abs(x - np.vstack([y[n:], y[:n]])).max()),
    )


def refusal(problem: str, method: str, basis: str, **changes: Any) -> str:
    """Why a combination is refused."""
    import pytest

    from mpmbench import case
    from mpmbench.core.errors import NotApplicable

    with pytest.raises(NotApplicable) as caught:
        case.read(compose(problem, method, basis, **changes))
    return str(caught.value)


def drift_of_many(rule: str, method: str, basis: str, **changes: Any) -> float:
    """Largest change of the momentum of six cubes over the sum of its parts.

    Two equal squares cannot tell: by their point symmetry what one loses the other gets.
    """
    small = {"resolution": 3, "time_step": 2e-4, "end_time": 0.02, "contact": rule}
    found = run("six_cubes", method, basis, **small, **changes)
    momentum = found.momentum.values
    scale = np.abs(found.body_momentum.values[0]).sum(axis=0).max()
    assert np.abs(found.body_momentum.values - found.body_momentum.values[0]).max() > 1e-3 * scale
    return float(np.abs(momentum - momentum[0]).max()) / float(scale)
