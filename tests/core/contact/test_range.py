"""`range`: with a wide range it is `shared`, with a narrow one bodies meet later; momentum is exact."""

import numpy as np

from mpmbench.core.contact.range import Near
from tests.core.contact.checks import SMALL, judge, refusal
from tests.core.support import run


def test_own_nodes_and_near_ones_are_seen() -> None:
    nodes = np.array([[0.0, 0.0], [1.0, 0.0], [1.5, 0.0], [2.1, 0.0]])
    near = Near(np.array([True, True, False, False]), 1.0)
    assert near(nodes).tolist() == [True, True, True, False]
    nodes[1, 0] += 0.2
    assert near(nodes).all()


def test_a_range_beyond_the_supports_is_the_shared_rule() -> None:
    far = {**SMALL, "end_time": 0.05}
    shared = run("two_squares", "otm", "lme", contact="shared", **far)
    wide = run("two_squares", "otm", "lme", contact="range", contact__range=8.0, **far)
    assert np.allclose(wide.position.values, shared.position.values, atol=1e-9)
    assert float(np.abs(wide.stress.values[-1]).max()) > 1.0
    narrow = run("two_squares", "otm", "lme", contact="range", contact__range=0.1, **far)
    moved = np.abs(narrow.body_momentum.values[:, 1, 0]) > 1e-9
    met = float(narrow.time.values[np.argmax(moved)])
    assert moved.any() and abs(met - 0.025) < 2e-3  # the gap of 0.05 m but for the range of 0.025 m


def test_momentum_is_exact_and_order_means_nothing() -> None:
    found = judge("range", "otm", "lme", contact__range=0.5)
    assert found.momentum < 1e-12 and found.order < 1e-11


def test_what_has_no_supports_to_choose_is_refused() -> None:
    assert "nodes that move" in refusal("two_squares", "mpm", "linear", contact="range")
    assert "basis=lme" in refusal("two_squares", "linear_fem", "linear", contact="range")
