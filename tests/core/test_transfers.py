"""Transfers from outside: what they declare is kept, stored and tested."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mpmbench import case
from mpmbench.contracts import loops
from mpmbench.core import registry
from mpmbench.core.errors import BadSetting, Diverged, NotApplicable
from mpmbench.core.loops.explicit import Explicit
from mpmbench.core.particles import ParticleData, particle_data
from mpmbench.core.simulation import guard
from mpmbench.core.transfer import Transfer, find_transfer
from tests.core.support import compose

registry.load_file(Path(__file__).parents[1] / "plugins/transfers/apic_flipped.py")
SHORT: dict[str, Any] = {"resolution": 4, "time_step": 1e-4, "end_time": 1e-3}


def block(transfer: str, dimension: int, stress_update: str = "usl") -> loops.MethodCase:
    choices = Explicit(transfer=transfer, stress_update=stress_update)
    return loops.MethodCase(choices, dimension)


@pytest.mark.parametrize("stress_update", ("usl", "usf", "musl"))
@pytest.mark.parametrize(
    "check", ("rigid translation", "free fall", "mass and momentum", "affine fields")
)
def test_affine_velocities_keep_the_contract_with_every_stress_update(
    check: str, stress_update: str
) -> None:
    finding = loops.CHECKS[check](block("apic", 2, stress_update))
    assert finding.passed, finding.text


@pytest.mark.parametrize(
    "check", ("affine fields", pytest.param("order on a plate", marks=pytest.mark.slow))
)
def test_a_flipped_sign_is_found(check: str) -> None:
    right, flipped = (loops.CHECKS[check](block(name, 2)) for name in ("apic", "apic_flipped"))
    assert right.passed, right.text
    assert not flipped.passed


@pytest.mark.parametrize("name", ("flip", "pic", "blend", "apic"))
def test_which_transfers_filter_small_scales(name: str) -> None:
    finding = loops.energy_of_small_scales(loops.MethodCase(Explicit(transfer=name, flip=0.9), 2))
    assert finding.passed, finding.text


def test_order_of_pic() -> None:
    """That of FLIP is asked as that of the preset mpm."""
    finding = loops.order_on_a_plate(block("pic", 2))
    assert finding.passed, finding.text


def test_declared_data_is_in_the_result() -> None:
    config = compose("plate_axis_aligned", "mpm", "bspline", method__transfer="apic", **SHORT)
    result = case.solve(config)
    assert result.attrs["status"] == "ok", result.attrs["reason"]
    assert result.affine.dims == ("snapshot", "particle", "dim", "dim2")
    assert result.affine.attrs["units"] == "s-1"
    # u_1 = A sin(2 pi X_1) sin(omega t): the velocity gradient starts at 2 pi A omega cos(2 pi X_1)
    X = result.position_initial.values
    exact = 2.0 * np.pi * 0.005 * np.pi * 100.0 * np.cos(2.0 * np.pi * X[:, 0])
    error = result.affine.values[0, :, 0, 0] - exact
    assert np.sqrt(np.mean(error**2)) < 0.3 * np.abs(exact).max()


def test_declared_data_counts_in_the_estimate_of_memory() -> None:
    sizes = [
        case.estimate_memory(
            compose("plate_axis_aligned", "mpm", "bspline", method__transfer=name, **SHORT)
        )
        for name in ("flip", "apic")
    ]
    assert sizes[1] - sizes[0] == pytest.approx(16 * 16 * 4 * 8 * 4 / 2**20)


def test_declared_data_that_is_no_number_ends_the_run() -> None:
    state = block("apic", 2).block(np.zeros_like)
    state.basis.locate(state.particles.x)
    guard(state)
    state.particles.data["affine"][5, 0, 1] = np.nan
    with pytest.raises(Diverged, match="affine of particle 5 is not finite"):
        guard(state)


def test_names_of_particle_data_are_taken_once() -> None:
    class Mine:
        particle_data = {"position": ParticleData((), "m", "where it is")}

    with pytest.raises(ValueError, match="position is taken"):
        particle_data(Mine())
    with pytest.raises(ValueError, match="affine is taken"):
        particle_data(find_transfer("apic"), find_transfer("apic_flipped"))


def test_transfers_that_are_not_there_or_make_no_sense() -> None:
    with pytest.raises(BadSetting, match=r"one of .*blend, flip"):
        Explicit(transfer="flop")
    with pytest.raises(NotApplicable, match=r"needs method\.mass=lumped"):
        replace(Explicit(transfer="apic"), mass="consistent").check(None)


def test_nothing_waits_for_a_transfer_that_takes_nothing_more() -> None:
    assert not any(find_transfer(name).takes_more for name in ("flip", "pic", "blend", "nodal"))
    assert find_transfer("apic").takes_more
    assert Transfer.flip_weight(find_transfer("pic"), Explicit()) == 0.0
