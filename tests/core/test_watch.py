"""What a step on a grid sees of the particles while it updates them: who left a cell, and what a guard must see."""

from typing import Any

import numpy as np
import pytest

from mpmbench import case
from mpmbench.core.errors import BrokeDown, Diverged
from mpmbench.core.guards import guard
from mpmbench.core.simulation import Solution, Watch
from mpmbench.core.state import State
from mpmbench.core.transfer.parts import NOTHING, InBox
from tests.core.support import compose
from tests.support import slow_if

DT = 2e-3  # [s]


def vortex(basis: str = "linear", **changes: Any) -> State:
    """The body of the generalised vortex, which crosses cells."""
    return case.build(
        case.read(compose("generalized_vortex", "mpm", basis, resolution=8, **changes))
    )


def advance(s: State) -> None:
    s.time_step = DT
    s.choices.step(s, DT)


CHANGES = (
    {"method__stress_update": "usl"},
    {"method__stress_update": "musl"},
    {"method__stress_update": "usf"},
    {"method__transfer": "xpic"},
    {"method__transfer": "asflip"},
)


@pytest.mark.parametrize(  # transfers of their own are compiled for each basis: with one here
    ("changes", "basis"),
    [
        slow_if(
            changes.get("method__transfer") == "asflip"
            or ("method__transfer" in changes and basis == "bspline"),
            changes,
            basis,
        )
        for changes in CHANGES
        for basis in ("linear", "bspline")
    ],
    ids=lambda given: given if isinstance(given, str) else "-".join(given.values()),
)
def test_crossings_are_those_of_the_places(basis: str, changes: dict[str, str]) -> None:
    s = vortex(basis, **changes)
    p, solution = s.particles, Solution()
    watch, box = Watch(s, solution, 1.0, []), s.basis
    assert isinstance(s.watched, InBox) == ("asflip" not in changes.values())
    p.v[:] = 3.0 * p.v + 1.0
    spacing = (box.upper - box.lower) / s.geometry.cells
    crossed = 0
    for _ in range(15):
        before = np.floor((p.x - box.lower) / spacing)
        advance(s)
        guard(s)
        watch.count_crossings()
        moved = (np.floor((p.x - box.lower) / spacing) != before).any(axis=1)
        crossed += np.count_nonzero(moved[p.material])
    assert solution.cell_crossings == crossed > 50


@pytest.mark.parametrize("update", ("usl", "musl"))
@pytest.mark.parametrize("place", (-1, 0))
@pytest.mark.parametrize("velocity, error", ((1e6, BrokeDown), (np.nan, Diverged)))
def test_a_particle_that_leaves_is_seen(
    update: str, place: int, velocity: float, error: type[Exception]
) -> None:
    s = vortex(method__stress_update=update)
    advance(s)
    guard(s)
    s.nodes.v[:] = 0.0
    s.particles.v[:] = 0.0
    row = np.arange(len(s.particles.x))[s.particles.material][place]
    s.particles.v[row] = velocity
    advance(s)
    assert s.bad is not None and s.bad > 0
    with pytest.raises(error):
        guard(s)


@pytest.mark.parametrize("update", ("usl", "musl", "usf"))
def test_a_body_that_leaves_the_grid_unstrained_is_seen(update: str) -> None:
    s = vortex(method__stress_update=update)
    advance(s)
    guard(s)
    s.particles.v[:] = [1e3, 0.0]
    advance(s)
    assert (s.particles.V[s.particles.material] > 0.0).all() and s.bad is not None and s.bad > 0
    with pytest.raises(BrokeDown, match="left the nodes' domain"):
        guard(s)


@pytest.mark.parametrize("update", ("usl", "musl", "usf"))
def test_a_volume_that_is_lost_is_seen(update: str) -> None:
    s = vortex(method__stress_update=update)
    advance(s)
    guard(s)
    row = len(s.particles.x) // 2
    s.particles.F[row] = np.diag([-1.0, 1.0])
    advance(s)
    assert s.bad is not None and s.bad > 0
    with pytest.raises(BrokeDown, match=f"particle {row} has the volume -"):
        guard(s)


def test_nothing_is_known_of_what_changed_after_a_step() -> None:
    s = vortex()
    advance(s)
    guard(s)
    s.particles.x[3] = 1e3
    with pytest.raises(BrokeDown, match="particle 3 at"):
        guard(s)


@pytest.mark.parametrize(
    "method, basis", (("otm", "lme"), ("tlmpm", "bspline"), ("moving_mesh_mpm", "linear"))
)
def test_functions_that_move_are_not_watched(method: str, basis: str) -> None:
    s = case.build(case.read(compose("bar_fixed_ends", method, basis, resolution=7)))
    assert s.watched is NOTHING
