"""`shared`: momentum is exact, the price is capture, adhesion and energy that stays locked."""

import pytest

from tests.core.contact.checks import drift_of_many, judge, refusal


@pytest.mark.parametrize(("method", "basis"), (("mpm", "linear"), ("otm", "lme")))
def test_momentum_is_exact_and_order_means_nothing(method: str, basis: str) -> None:
    found = judge("shared", method, basis)
    assert found.momentum < 1e-12 and found.order < 1e-12


@pytest.mark.parametrize(("rule", "changes"), (("shared", {}), ("range", {"contact__range": 2.0})))
def test_momentum_of_unequal_bodies_is_exact(rule: str, changes: dict[str, float]) -> None:
    """Nodes that keep velocities have other masses when they see other bodies: 2e-5 without a correction."""
    assert drift_of_many(rule, "otm", "lme", **changes) < 1e-12


def test_a_grid_keeps_bodies_apart_but_holds_them_together() -> None:
    found = judge("shared", "mpm", "linear")
    assert found.inside_ever == 0
    assert found.tension > 0.1 and found.parted < 0.5  # they stick
    assert found.energy < 0.01 and found.strain > 0.3  # and what they lose is strain energy


def test_moving_nodes_are_captured_by_fast_coarse_bodies() -> None:
    found = judge("shared", "otm", "lme")
    assert found.inside > 0


def test_nodes_that_keep_their_masses_keep_the_energy() -> None:
    """Masses that are lumped anew where bodies meet change it by a hundredth; momenta are those of nodes."""
    kept = judge("shared", "otm", "lme", method__mass="kept")
    assert kept.momentum < 1e-12 and kept.spin < 1e-12 and kept.order < 1e-12
    assert kept.made < 0.005 < judge("shared", "otm", "lme").made


def test_what_sees_no_foreign_nodes_is_refused() -> None:
    assert "cells of its own body" in refusal("two_squares", "linear_fem", "linear")
    frozen = {"method__shape_functions": "frozen", "method__stress_update": "usl"}
    assert "see new nodes" in refusal("two_squares", "mpm", "lme", **frozen)
