"""What ends a run, and what holds nodes, seen from close by."""

import numpy as np
import pytest

from mpmbench.contracts.loops import MethodCase
from mpmbench.core.errors import Diverged
from mpmbench.core.loops.explicit import Explicit
from mpmbench.core.simulation import ENERGY_GROWTH, Solution, Watch
from mpmbench.core.state import Loads


def test_energy_may_grow_by_what_loads_have_put_in_at_most() -> None:
    """The most that was ever put in counts, of either sign, also when it has been taken out again."""
    state = MethodCase(Explicit(), 1).block(np.zeros_like)
    p, watch = state.particles, Watch(state, Solution(), 1.0, [])
    for work in (0.0, -2.0, 0.5, 0.0):
        state.external_work = work
        watch.sample()
    p.v[:] = np.sqrt(2.0 * 1.99 * ENERGY_GROWTH / p.m.sum())
    watch.sample()
    p.v *= 1.01
    with pytest.raises(Diverged, match="the energy has grown to"):
        watch.sample()


@pytest.mark.parametrize("nodes", ("moving", "fixed"))
def test_moving_nodes_are_held_where_they_land(nodes: str) -> None:
    def landing(x: np.ndarray) -> np.ndarray:
        return x < 0.6

    state = MethodCase(Explicit(nodes=nodes), 1).block(np.ones_like, Loads(landing=landing))
    state.nodes.v[:], state.nodes.a[:] = 1.0, 2.0
    state.land()
    held = landing(state.basis.nodes) if nodes == "moving" else np.zeros_like(state.fixed)
    assert held.any() == (nodes == "moving")
    assert np.array_equal(state.fixed, held)
    assert np.array_equal(state.nodes.v, np.where(held, 0.0, 1.0))
    assert np.array_equal(state.nodes.a, np.where(held, 0.0, 2.0))
