"""The audit of transfers: what theory says of each measure, and by how much they differ."""

from typing import Any

import pytest

from mpmbench.contracts import audit
from mpmbench.core.loops.explicit import Explicit
from mpmbench.core.transfer import find_transfer


def choices(transfer: str, order: int = 2, **more: Any) -> Explicit:
    return Explicit(transfer=transfer, transfer_order=order, mass_cutoff=0.0, **more)


@pytest.mark.parametrize("transfer", ("flip", "pic", "apic", "asflip", "tpic"))
def test_angular_momentum(transfer: str) -> None:
    """APIC's is exact, the affine part included; nobody else's with a lumped mass is."""
    drift = audit.spin_drift(choices(transfer), 100)
    promised = find_transfer(transfer).promises.angular_momentum
    assert promised == (transfer == "apic")
    assert drift < 1e-13 if promised else drift > 1e-5, drift


@pytest.mark.slow
@pytest.mark.parametrize("transfer", ("apic", "tpic"))
def test_angular_momentum_over_ten_thousand_steps(transfer: str) -> None:
    drift = audit.spin_drift(choices(transfer), 10_000)
    assert drift < 1e-11 if transfer == "apic" else drift > 1e-5, drift


def test_a_standing_wave_in_a_filter_of_higher_order() -> None:
    """Each order of XPIC and FMPM loses less; five of them less than a tenth of what PIC loses."""
    for name in ("xpic", "fmpm"):
        first, second, third, fifth = (
            audit.loss(audit.wave(choices(name, order)), 100) for order in (1, 2, 3, 5)
        )
        assert first > 10.0 * second > 10.0 * third > 10.0 * fifth > 0.0
        assert first > 100.0 * fifth
        assert first == pytest.approx(audit.loss(audit.wave(choices("pic")), 100), rel=1e-9)
    assert audit.loss(audit.wave(choices("apic")), 100) < 0.02 * first
    assert abs(audit.loss(audit.wave(choices("flip")), 100)) < 1e-4


def test_a_shear_layer_without_stress() -> None:
    """FLIP loses nothing, since nothing accelerates; filters lose less the higher they are."""
    lost = {
        name + str(order): audit.loss(audit.shear(choices(name, order)), 20)
        for name, order in (("flip", 2), ("pic", 2), ("apic", 2), ("xpic", 2), ("xpic", 5))
    }
    assert abs(lost["flip2"]) < 1e-12
    assert lost["pic2"] > 10.0 * lost["xpic2"] > 10.0 * lost["apic2"] > 0.0
    assert lost["apic2"] > 2.0 * lost["xpic5"] > 0.0


def test_a_rotation_is_affine() -> None:
    """What transfers with an affine part do not lose, PIC loses at once."""
    lost = {name: audit.loss(audit.rotation(choices(name)), 20) for name in ("pic", "apic", "tpic")}
    assert abs(lost["apic"]) < 1e-4 and abs(lost["tpic"]) < 1e-4 and lost["pic"] > 1e-2


def test_noise_that_nodes_cannot_see() -> None:
    """FLIP keeps all of it, a blend loses its share in every step, and the others take it away at once."""
    assert audit.noise_left(choices("flip"), 20) == pytest.approx(1.0, rel=1e-3)
    assert audit.noise_left(choices("blend", flip=0.9), 20) == pytest.approx(0.9**20, rel=1e-3)
    at_rest = choices("asflip", flip=0.9, separation=0.0)
    assert audit.noise_left(at_rest, 20) == pytest.approx(0.9**20, rel=1e-3)
    for name in ("pic", "apic", "xpic", "fmpm"):
        assert audit.noise_left(choices(name), 1) < 1e-12


def test_orders_in_time() -> None:
    """Second where a step moves particles by the velocity that they have after it.

    With a lumped mass they move by ``S (S+ V + dt a)`` and keep ``V + dt S a``, of which S+ makes
    another nodal velocity: an error of the order ``dt (1 - S+ S) a``.
    """
    consistent, lumped = (
        audit.order_in_time(choices("flip", mass=mass, shape_functions="frozen"), 40)
        for mass in ("consistent", "lumped")
    )
    assert consistent == pytest.approx(2.0, abs=0.05)
    assert lumped == pytest.approx(1.0, abs=0.2)
