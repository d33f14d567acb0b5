"""`none`: bodies pass through each other and feel nothing; the checks see that they are inside."""

import pytest

from tests.core.contact.checks import judge, refusal


def test_bodies_pass_through_each_other() -> None:
    found = judge("none", "otm", "lme")
    assert found.momentum < 1e-12 and found.energy < 1e-12 and found.strain < 1e-12
    assert found.kinetic == pytest.approx(1.0, abs=1e-12)
    assert found.inside > 10 and found.parted == pytest.approx(-1.0, abs=1e-12)
    assert found.order < 1e-12


def test_one_body_has_no_contact() -> None:
    assert "has one" in refusal("rigid_motion", "mpm", "linear", contact="none")
