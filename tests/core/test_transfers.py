"""Transfers: what theory says two of them have in common, what each declares, and those from outside."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from mpmbench import case
from mpmbench.contracts import loops
from mpmbench.core import registry
from mpmbench.core.errors import BadSetting, Diverged, NotApplicable
from mpmbench.core.guards import guard
from mpmbench.core.loops.explicit import Explicit
from mpmbench.core.particles import ParticleData, particle_data
from mpmbench.core.state import State
from mpmbench.core.transfer import Transfer, find_transfer
from mpmbench.core.transfer.series import leave_held
from tests.core.support import compose
from tests.support import slow_if

registry.load_file(Path(__file__).parents[1] / "plugins/transfers/plain_flipped.py")
SHORT: dict[str, Any] = {"resolution": 4, "time_step": 1e-4, "end_time": 1e-3}
NEW = ("apic", "asflip", "tpic", "xpic", "fmpm")
CHECKS = (
    *("rigid translation", "free fall", "mass and momentum", "angular momentum"),
    *("uniform stretch", "affine fields", "rest"),
)
NOTHING = {"basis": "linear", "young_modulus": loops.NO_STIFFNESS}


def block(transfer: str, dimension: int, stress_update: str = "usl") -> loops.MethodCase:
    choices = Explicit(transfer=transfer, stress_update=stress_update)
    return loops.MethodCase(choices, dimension)


def wave(x: np.ndarray) -> np.ndarray:
    """A velocity [m/s] in which nothing is special."""
    return 0.5 * np.sin(3.0 * x[:, ::-1] + 1.0) + 0.2


def after(steps: int, dimension: int = 1, basis: str = "bspline", **choices: Any) -> State:
    """A free block after so many steps; `young_modulus` [Pa] may be among the choices."""
    stiffness = choices.pop("young_modulus", 1e4)
    one = loops.MethodCase(Explicit(**choices), dimension, basis, young_modulus=stiffness)
    state = one.block(wave)
    finding = loops.steps(state, n=steps)
    assert finding.passed, finding.text
    return state


def difference(one: State, other: State, names: str = "x v F sigma") -> float:
    """Largest difference of two runs, each array over its own largest number."""
    return max(
        float(np.abs(a - b).max() / np.abs(a).max())
        for name in names.split()
        for a, b in [(getattr(one.particles, name), getattr(other.particles, name))]
    )


ANY_CASE = SimpleNamespace(basis=SimpleNamespace(stands_in=False))


@pytest.mark.parametrize(  # of those that are not refused, functions that go with the body are compiled anew
    ("transfer", "nodes", "stress_update"),
    [
        slow_if(
            nodes != "fixed" and stress_update == "usl" and transfer in NEW,
            transfer,
            nodes,
            stress_update,
        )
        for transfer in ("flip", *NEW)
        for nodes in ("fixed", "moving", "frozen")
        for stress_update in ("usl", "usf", "musl", "usavg")
    ],
)
def test_contract_of_transfers_with_every_stress_update(
    transfer: str, nodes: str, stress_update: str
) -> None:
    """On a line; planes and space follow below, and are slow."""
    keep_the_contract(transfer, nodes, stress_update, 1)


@pytest.mark.slow
@pytest.mark.parametrize("stress_update", ("usl", "usavg"))
@pytest.mark.parametrize("transfer", NEW)
def test_contract_of_transfers_in_a_plane(transfer: str, stress_update: str) -> None:
    keep_the_contract(transfer, "fixed", stress_update, 2)


@pytest.mark.slow
@pytest.mark.parametrize("dimension", (2, 3))
@pytest.mark.parametrize("stress_update", ("usl", "usf", "musl", "usavg"))
@pytest.mark.parametrize("nodes", ("fixed", "moving", "frozen"))
@pytest.mark.parametrize("transfer", ("flip", *NEW))
def test_contract_of_transfers_in_planes_and_space(
    transfer: str, nodes: str, stress_update: str, dimension: int
) -> None:
    keep_the_contract(transfer, nodes, stress_update, dimension)


def keep_the_contract(transfer: str, nodes: str, stress_update: str, dimension: int) -> None:
    """Ask all checks, or see that the combination is refused."""
    motion = {"shape_functions": "frozen"} if nodes == "frozen" else {"nodes": nodes}
    choices = Explicit(transfer=transfer, stress_update=stress_update, **motion)
    if (nodes != "fixed" and stress_update != "usl") or (nodes, transfer) == ("frozen", "tpic"):
        with pytest.raises(NotApplicable, match=r"needs method\."):
            choices.check(ANY_CASE)
        return
    choices.check(ANY_CASE)
    one = loops.MethodCase(choices, dimension)
    for check in CHECKS:
        if check in loops.CHECKS.of(one):
            finding = loops.CHECKS[check](one)
            assert finding.passed, f"{check}: {finding.text}"


@pytest.mark.parametrize(
    ("one", "other"),
    [
        slow_if(True, {"transfer": "xpic", "transfer_order": 1}, {"transfer": "pic"}),
        ({"transfer": "fmpm", "transfer_order": 1}, {"transfer": "pic"}),
        ({"transfer": "blend", "flip": 1.0}, {"transfer": "flip"}),
        ({"transfer": "blend", "flip": 0.0}, {"transfer": "pic"}),
        ({"transfer": "position_difference"}, {"transfer": "pic"}),
        (
            {"transfer": "xpic", "transfer_order": 4, "shape_functions": "frozen", **NOTHING},
            {"transfer": "fmpm", "transfer_order": 4, "shape_functions": "frozen", **NOTHING},
        ),
        ({"transfer": "tpic", "basis": "linear"}, {"transfer": "apic", "basis": "linear"}),
        slow_if(True, {"transfer": "plain_apic"}, {"transfer": "apic"}),
        slow_if(True, {"transfer": "asflip", "flip": 0.0}, {"transfer": "apic"}),
        pytest.param(
            {"transfer": "plain_apic", "dimension": 2},
            {"transfer": "apic", "dimension": 2},
            marks=pytest.mark.slow,
        ),
    ],
    ids=lambda choices: "-".join(map(str, choices.values())),
)
def test_transfers_that_are_one(one: dict[str, Any], other: dict[str, Any]) -> None:
    """To round-off, over twenty steps; velocities only of xpic and fmpm, whose positions follow other ones."""
    same = "v" if "young_modulus" in one else "x v F sigma"
    assert difference(after(20, **one), after(20, **other), same) < 1e-12


def test_one_step_of_xpic_and_fmpm_on_functions_that_are_updated() -> None:
    """Without forces the velocities are the same; the places are not, as x follows other velocities."""
    for order in (2, 5):
        states = [
            after(1, transfer=name, transfer_order=order, **NOTHING) for name in ("xpic", "fmpm")
        ]
        assert difference(*states, "v") < 1e-12
        assert difference(*states, "x") > 1e-9


def test_what_asflip_keeps_moves_particles_that_are_not_compressed() -> None:
    """``v = S v_i + alpha (v - S v_old)``, and places follow by beta of the last part where det F >= exp(-0.001)."""
    together, apart = (after(3, transfer="asflip", flip=0.9, separation=0.0) for _ in range(2))
    p, q = together.particles, apart.particles
    q.V[:2], q.V[2:] = 0.99 * q.V0[:2], q.V0[2:]  # two are compressed, the others follow
    apart.choices = replace(apart.choices, separation=0.5)
    before = q.x.copy()
    apart.transfer.shift(apart, 2.0)
    assert np.array_equal(q.x[:2], before[:2])
    assert np.allclose(q.x[2:] - before[2:], q.data["remainder"][2:], rtol=1e-9, atol=1e-15)
    old, at = p.v.copy(), p.x.copy()
    together.choices.step(together, loops.TIME_STEP)
    S = together.basis.evaluate(at).matrix(len(together.basis.nodes))
    kept = 0.9 * (old - S @ together.nodes.v_old)
    assert np.abs(kept).max() > 1e-3
    assert np.allclose(p.data["remainder"], kept, rtol=0.0, atol=1e-12)
    assert np.allclose(p.v, S @ together.nodes.v + kept, rtol=0.0, atol=1e-12)
    assert np.allclose(p.x, at + loops.TIME_STEP * S @ together.nodes.v, rtol=0.0, atol=1e-14)


def test_more_terms_of_the_series_go_to_the_consistent_mass() -> None:
    """Two thirds of a cell's half-width apart, particles tell the hats apart: the series converges."""
    kept = {"basis": "linear", "shape_functions": "frozen"}
    exact = after(3, transfer="pic", mass="consistent", **kept)
    errors = [
        difference(after(3, transfer="fmpm", transfer_order=k, **kept), exact, "v F")
        for k in (1, 5, 10, 20)
    ]
    assert np.all(np.diff(errors) < 0.0) and errors[-1] < 1e-2 * errors[0], errors


@pytest.mark.parametrize("transfer", ("xpic", "fmpm"))
def test_the_series_leaves_what_is_held(transfer: str) -> None:
    """Each further term is zero on fixed components, and the rest gives nothing away."""

    def left(x: np.ndarray) -> np.ndarray:
        return x < 2.004 * loops.SPACING

    choices = Explicit(transfer=transfer, transfer_order=5, shape_functions="frozen")
    case = loops.MethodCase(choices, 1)
    state = case.block(lambda x: 1.0 + np.sin(9.0 * x), fixed=left)
    assert loops.steps(state, n=5).passed
    terms = state.transfer.higher_terms(state, state.nodes.v)
    assert np.all(terms[state.fixed] == 0.0) and np.abs(terms).max() > 1e-3
    free = case.block(lambda x: 1.0 + np.sin(9.0 * x))
    assert loops.steps(free, n=5).passed
    given = free.nodes.m @ free.transfer.higher_terms(free, free.nodes.v)
    assert abs(float(given[0])) < 1e-13 * free.particles.m.sum()


def test_further_terms_leave_what_walls_hold() -> None:
    """Across a frictionless wall only, and all where nothing slides; nodes that no wall touches stay."""
    impulse = np.zeros((2, 3, 2))
    impulse[0, 0], impulse[1, 1] = [0.0, 1.0], [2.0, 0.1]
    walls = SimpleNamespace(
        normal=np.array([[0.6, 0.8], [1.0, 0.0]]),
        friction=np.array([0.3, np.inf]),
        nodal_impulse=impulse,
    )
    term = np.array([[2.0, 1.0], [3.0, 4.0], [5.0, 6.0]])
    leave_held(SimpleNamespace(walls=walls), term)  # type: ignore[arg-type]
    assert np.allclose(term, [[0.8, -0.6], [0.0, 0.0], [5.0, 6.0]], atol=1e-14)


@pytest.mark.slow  # in a plane; what it is made of is asked by the contract
def test_the_affine_part_counts_in_the_angular_momentum() -> None:
    def velocity(x: np.ndarray) -> np.ndarray:
        return np.column_stack([-x[:, 1], x[:, 0] ** 2])

    case = loops.MethodCase(Explicit(transfer="apic", mass_cutoff=0.0), 2, "bspline")
    state = case.block(velocity)
    assert loops.steps(state, n=1).passed
    p, n = state.particles, state.nodes
    x_i, x_p = state.basis.nodes, p.x - loops.TIME_STEP * p.v  # where they were
    total = float(n.m @ (x_i[:, 0] * n.v[:, 1] - x_i[:, 1] * n.v[:, 0]))
    particles = float(p.m @ (x_p[:, 0] * p.v[:, 1] - x_p[:, 1] * p.v[:, 0]))
    affine = state.transfer.spin(state)
    assert abs(particles + affine[2] - total) < 1e-13 * abs(total)
    assert abs(affine[2]) > 1e-3 * abs(total)
    assert np.all(affine[:2] == 0.0)


@pytest.mark.parametrize(
    "check", ("affine fields", pytest.param("order on a plate", marks=pytest.mark.slow))
)
def test_a_flipped_sign_is_found(check: str) -> None:
    right, flipped = (
        loops.CHECKS[check](block(name, 2)) for name in ("plain_apic", "plain_flipped")
    )
    assert right.passed, right.text
    assert not flipped.passed


# in a plane the new ones are compiled anew: on a line they have a contract above
@pytest.mark.parametrize("name", ("flip", "pic", "blend", *(slow_if(True, name) for name in NEW)))
def test_which_transfers_filter_small_scales(name: str) -> None:
    finding = loops.energy_of_small_scales(loops.MethodCase(Explicit(transfer=name, flip=0.9), 2))
    assert finding.passed, finding.text


@pytest.mark.parametrize(
    "name", ("pic", *(pytest.param(name, marks=pytest.mark.slow) for name in NEW))
)
def test_orders(name: str) -> None:
    """That of FLIP is asked as that of the preset mpm."""
    finding = loops.order_on_a_plate(block(name, 2))
    assert finding.passed, finding.text


@pytest.mark.slow  # APIC of splines in a plane; what a guard sees of declared data is asked below
def test_declared_data_is_in_the_result() -> None:
    config = compose("plate_axis_aligned", "mpm", "bspline", method__transfer="apic", **SHORT)
    result = case.solve(config)
    assert result.attrs["status"] == "ok", result.attrs["reason"]
    assert result.affine.dims == ("snapshot", "particle", "dim", "dim2")
    assert result.affine.attrs["units"] == "m2 s-1"
    # u_1 = A sin(2 pi X_1) sin(omega t): the velocity gradient starts at 2 pi A omega cos(2 pi X_1);
    # B is the gradient times D, which is h^2 / 4 but at edges
    X = result.position_initial.values
    exact = 2.0 * np.pi * 0.005 * np.pi * 100.0 * np.cos(2.0 * np.pi * X[:, 0])
    inside = np.all(np.abs(X - 0.5) < 0.25, axis=1)
    error = 64.0 * result.affine.values[0, inside, 0, 0] - exact[inside]
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
        particle_data(find_transfer("apic"), find_transfer("plain_flipped"))


def test_transfers_that_are_not_there_or_make_no_sense() -> None:
    with pytest.raises(BadSetting, match=r"one of .*apic, asflip, blend, flip"):
        Explicit(transfer="flop")
    for name in (*NEW, "plain_apic"):
        with pytest.raises(NotApplicable, match=r"needs method\.mass=lumped"):
            replace(Explicit(transfer=name), mass="consistent").check(None)


def test_nothing_waits_for_a_transfer_that_takes_nothing_more() -> None:
    assert not any(
        find_transfer(name).takes_more for name in ("flip", "pic", "blend", "nodal", "fmpm", "apic")
    )
    assert find_transfer("xpic").takes_more
    assert Transfer.flip_weight(find_transfer("pic"), Explicit()) == 0.0
