"""`multi_field`: the conditions of Signorini and Coulomb at the nodes, and the correction for the gap."""

import numpy as np
import pytest

from mpmbench.core.contact.multi_field import Pairs, exchange
from mpmbench.core.state import Nodes
from tests.core.contact.checks import SMALL, judge, refusal
from tests.core.support import run


@pytest.mark.slow
def test_the_five_checks() -> None:
    found = judge("multi_field", "mpm", "linear")
    assert found.momentum < 1e-12 and found.order < 1e-12
    # contact of nodes is inelastic, by the mass of one layer of them
    assert found.kinetic > 0.75 and found.strain < 0.15
    assert 0.0 < found.contact < 0.05 and found.energy < 0.03
    assert found.inside_ever == 0
    assert found.parted > 0.7 and found.tension < 1e-12


@pytest.mark.parametrize("friction", (0.0, 0.3))
@pytest.mark.parametrize("bodies", (2, 3))
def test_impulses_satisfy_the_conditions(friction: float, bodies: int) -> None:
    rng, nodes, dim = np.random.default_rng(0), 20, 2
    m = rng.uniform(0.5, 2.0, bodies * nodes)
    free = rng.standard_normal((bodies * nodes, dim))
    pairs = [(0, 1)] if bodies == 2 else [(0, 1), (0, 2), (1, 2)]
    a, b = (
        np.concatenate([np.arange(nodes) + k * nodes for k in side])
        for side in zip(*pairs, strict=True)
    )
    normal = rng.standard_normal((len(a), dim))
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    allowed = rng.uniform(0.0, 0.5, len(a))
    impulse = Pairs(a, b, normal, allowed, m).impulses(free, friction)
    v = free.copy()
    np.add.at(v, b, impulse / m[b, None])
    np.subtract.at(v, a, impulse / m[a, None])
    between, pressed = v[b] - v[a], np.sum(impulse * normal, axis=1)
    approach = np.sum(between * normal, axis=1) + allowed
    assert (pressed >= 0.0).all() and (approach > -1e-9).all()
    assert np.abs(pressed * approach).max() < 1e-9
    assert 0 < np.count_nonzero(pressed > 1e-9) < len(pressed)
    along = impulse - pressed[:, None] * normal
    sliding = between - np.sum(between * normal, axis=1)[:, None] * normal
    assert (np.linalg.norm(along, axis=1) <= friction * pressed + 1e-12).all()
    slides = (pressed > 1e-6) & (np.linalg.norm(sliding, axis=1) > 1e-6)
    assert slides.any()
    size = np.linalg.norm(sliding[slides], axis=1)[:, None]
    expected = -friction * pressed[slides, None] * sliding[slides] / size
    assert np.allclose(along[slides], expected, atol=1e-8)
    assert np.allclose(m @ v, m @ free, atol=1e-12)


def test_all_pairs_accelerate_particles_as_their_nodes() -> None:
    """Of three bodies in a row the middle one is in two pairs; what is held gets nothing."""
    n, dt, rng = Nodes.zeros(6, 2), 0.1, np.random.default_rng(1)
    n.m[:], n.v[:], n.v_last[:] = rng.uniform(0.5, 2.0, 6), *rng.standard_normal((2, 6, 2))
    fixed = np.zeros((6, 2), dtype=bool)
    fixed[5, 1] = True
    before, a, b = n.v.copy(), np.array([0, 1, 2]), np.array([2, 3, 4])
    impulse = rng.standard_normal((3, 2))
    work = exchange(n, fixed, a, b, impulse, dt)
    gained = n.m[:, None] * (n.v - before)
    assert np.allclose(gained[:5], [*-impulse[:2], impulse[0] - impulse[2], *impulse[1:]])
    assert np.allclose(n.a, (n.v - before) / dt) and not n.a[5].any()
    mean = 0.5 * (n.v + n.v_last)
    assert work == pytest.approx(float(np.sum(gained * mean)))
    exchange(n, fixed, np.array([4]), np.array([5]), np.ones((1, 2)), dt)
    assert n.a[5, 1] == 0.0 and n.v[5, 1] == before[5, 1] and n.a[5, 0] > 0.0


@pytest.mark.slow
def test_bodies_meet_when_their_surfaces_do() -> None:
    met = {}
    for gap in ("corrected", "ignored"):
        result = run(
            "two_squares", "mpm", "linear", contact="multi_field", contact__gap=gap, **SMALL
        )
        moved = result.body_momentum.values[:, 1, 0] > 1e-9
        met[gap] = float(result.time.values[np.argmax(moved)])
    assert met["corrected"] == pytest.approx(0.05, abs=2e-3)  # gap over speed
    assert met["ignored"] < 0.01  # they see the same nodes from the start


def test_what_has_no_grid_is_refused() -> None:
    chosen = {"contact": "multi_field"}
    assert "needs a grid" in refusal("two_squares", "otm", "lme", **chosen)
    assert "lumped" in refusal("two_squares", "mpm", "linear", method__mass="consistent", **chosen)
