"""Rigid motion of a free block: exact for every method, basis, mass, update and layout, and any time step."""

import itertools
import re
from typing import Any

import numpy as np
import pytest

from mpmbench import case
from mpmbench.analysis.slopes import fitted_order
from mpmbench.core import registry
from mpmbench.core.errors import BrokeDown, NotApplicable
from mpmbench.core.loops.explicit import Explicit
from mpmbench.core.simulation import Solution, simulate
from mpmbench.core.state import State
from mpmbench.settings import schema
from tests.core.support import compose, run
from tests.support import slow_if

BINARY, DECIMAL = 2.0**-8, 0.004  # [s] the first hits the edges of cells exactly
# (c dt / h)^2 is 3e-4 below: a lighter node is unstable with usl or a consistent mass
STABLE = 1e-2
FREE = [
    name
    for name in schema.options("basis")
    if registry.get("basis", name).promises.partition_of_unity
]
LAYOUTS = ("midpoint", "gauss", "nodes")
END = 0.3  # [s]


def block(
    choices: Any, basis: str, dt: float, end: float = END, resolution: int = 4, **settings: Any
) -> tuple[State, Solution]:
    """A block of 2 particles per axis and cell, and what became of it."""
    problem = registry.get("problem", "rigid_motion")(**settings)
    law = registry.get("material", "neo_hookean")(young_modulus=10.0, density=10.0)
    functions = registry.get("basis", basis)()
    per_cell = 2**problem.dimension
    body = case.Case(problem, choices, functions, law, basis, resolution, per_cell)
    state = case.build(body)
    return state, simulate(state, dt, end)


def assert_exact(state: State, solution: Solution, **settings: Any) -> None:
    """Positions, velocities at their own instant, and no stress, to rounding."""
    assert solution.status == "ok", solution.reason
    problem, p = registry.get("problem", "rigid_motion")(**settings), state.particles
    lag = state.choices.velocity_lag * solution.time_step
    there = problem.exact(p.X, state.time, state.material)
    before = problem.exact(p.X, state.time - lag, state.material)
    assert np.abs(p.x - p.X - there["displacement"]).max() < 1e-12
    assert np.abs(p.v - before["velocity"]).max() < 1e-11
    assert np.abs(p.sigma).max() < 1e-9 * 10.0


def cut_off(motion: str, mass: str, update: str) -> float:
    """The default, where that can be stable."""
    if mass == "consistent" or (motion == "fall" and update == "usl"):
        return STABLE
    return 1e-6


ALL = list(
    itertools.product(
        FREE, ("lumped", "consistent"), ("usl", "usf", "musl"), ("translation", "fall")
    )
)


def costly(basis: str, mass: str, update: str, motion: str) -> bool:
    """A consistent mass is compiled for each basis: with two of them here. Sums on a grid of its own are compiled
    with a body force and without: with one, in the fall, which has the same velocity at its start.
    """
    if mass == "consistent":
        return basis not in ("linear", "bspline")
    return motion == "translation" and basis in ("gimp", "ddmp")


@pytest.mark.parametrize(
    ("basis", "mass", "update", "motion"), [slow_if(costly(*one), *one) for one in ALL]
)
def test_a_block_on_a_fixed_grid_in_the_plane(
    basis: str, mass: str, update: str, motion: str
) -> None:
    choices = Explicit(mass=mass, stress_update=update, mass_cutoff=cut_off(motion, mass, update))
    for dt, layout in ((BINARY, "nodes"), (DECIMAL, "gauss")):
        found = block(choices, basis, dt, motion=motion, particle_layout=layout)
        assert_exact(*found, motion=motion)


@pytest.mark.slow
@pytest.mark.parametrize(("basis", "mass", "update", "motion"), ALL)
@pytest.mark.parametrize("dimension", (1, 2, 3))
def test_all_cells_of_the_cross_product(
    dimension: int, basis: str, mass: str, update: str, motion: str
) -> None:
    cut = cut_off(motion, mass, update)
    for transfer, dt, layout in itertools.product(
        ("flip", "pic", "blend", "position_difference"), (BINARY, DECIMAL), LAYOUTS
    ):
        choices = Explicit(
            mass=mass, stress_update=update, mass_cutoff=cut, transfer=transfer, flip=0.9
        )
        settings = {"motion": motion, "dimension": dimension, "particle_layout": layout}
        resolution = 3 if dimension == 3 else 4  # in space a consistent mass takes its time
        assert_exact(*block(choices, basis, dt, 0.1, resolution, **settings), **settings)


@pytest.mark.parametrize(  # on a line by one basis: all are compiled for each dimension, and asked in a plane
    ("basis", "dimension"),
    [
        slow_if(basis != "linear" or dimension == 3, basis, dimension)
        for basis in FREE
        for dimension in (1, 3)
    ],
)
def test_one_and_three_dimensions(basis: str, dimension: int) -> None:
    for motion in ("translation", "fall"):
        choices = Explicit(stress_update="musl")
        settings = {"motion": motion, "dimension": dimension, "particle_layout": "nodes"}
        found = block(choices, basis, BINARY, 0.3 if dimension == 1 else 0.1, 3, **settings)
        assert_exact(*found, **settings)


def test_weight_pulls_back() -> None:
    """So that a fall of the shipped problem stays on its grid."""
    problem = registry.get("problem", "rigid_motion")
    falls, flies = (
        problem(motion=motion).exact(np.zeros((1, 2)), 1.0, None)
        for motion in ("fall", "translation")
    )
    assert (falls["velocity"] < flies["velocity"]).all()


def test_particles_are_counted_against_nodes_that_are_not_light() -> None:
    """Wide functions reach 9 nodes from 8 particles; those on the outside follow, and the rest is regular."""
    choices = Explicit(mass="consistent", mass_cutoff=STABLE)
    settings = {"motion": "fall", "dimension": 1}
    assert_exact(*block(choices, "lme", BINARY, 0.1, **settings), **settings)
    with pytest.raises(BrokeDown, match="9 nodes and only 8 particles"):
        block(Explicit(mass="consistent", mass_cutoff=0.0), "lme", BINARY, 0.1, **settings)


PRESETS = [
    (method, basis)
    for method in schema.options("method")
    for basis in schema.options("basis")
    if method not in ("mpm", "ulmpm")  # which differ in the default basis only
]


@pytest.mark.parametrize(("method", "basis"), PRESETS)
@pytest.mark.parametrize("motion", ("translation", "fall"))
def test_whatever_list_promises_is_exact(method: str, basis: str, motion: str) -> None:
    """Or it is refused with a reason; what a loop does not promise does not hold either."""
    layout = "nodes" if method == "sph" else "midpoint"
    cells = {"particles_per_cell": 1} if method == "sph" else {}
    try:
        config = compose(
            "rigid_motion",
            method,
            basis,
            problem__motion=motion,
            problem__particle_layout=layout,
            time_step=DECIMAL,
            end_time=0.1,
            **cells,
        )
        choices = case.read(config).choices
    except (NotApplicable, AssertionError) as refusal:
        assert len(str(refusal)) > 20
        return
    result = case.solve(config)
    assert result.attrs["status"] == "ok", result.attrs["reason"]
    errors = [float(result[f"error_{name}_rms"]) for name in ("displacement", "velocity")]
    # Newton's iteration ends at its tolerance
    exact = max(errors) < (1e-7 if choices.implicit else 1e-11)
    assert exact == choices.promises.translation, errors


class TestRotation:
    """Order 2 on grids, where the projection of velocities errs, and far smaller errors on the body."""

    @pytest.mark.parametrize(  # each update with hats, and splines with one of them
        ("basis", "update"),
        [
            slow_if((basis, update) in (("bspline", "usf"), ("bspline", "usl")), basis, update)
            for basis in ("linear", "bspline")
            for update in ("usl", "usf", "musl")
        ],
    )
    def test_order_on_a_grid(self, basis: str, update: str) -> None:
        errors = [self.error("mpm", basis, n, method__stress_update=update) for n in (4, 8, 16)]
        order = fitted_order(1.0 / np.array([4, 8, 16]), np.array(errors))
        assert 1.6 < order < 2.2, (order, errors)

    @pytest.mark.parametrize(
        ("method", "basis"),
        (pytest.param("otm", "maxent", marks=pytest.mark.slow), ("linear_fem", "linear")),
    )
    def test_order_in_time_on_the_body(self, method: str, basis: str) -> None:
        errors = [self.error(method, basis, n) for n in (4, 8, 16)]
        order = fitted_order(1.0 / np.array([4, 8, 16]), np.array(errors))
        assert 1.8 < order < 2.2 and errors[-1] < 2e-5, (order, errors)

    def error(self, method: str, basis: str, n: int, **changes: Any) -> float:
        settings = {"problem__motion": "rotation", "time_step": 2.0**-7 / n, "end_time": 0.5}
        result = run("rigid_motion", method, basis, resolution=n, **settings, **changes)
        return float(result.error_displacement_rms)

    def test_lines_that_stay_straight_cannot_turn(self) -> None:
        config = compose("rigid_motion", "unified", "bspline", problem__motion="rotation")
        with pytest.raises(NotApplicable, match="keeps lines along the axes straight"):
            case.read(config)


STRESSED = [
    *itertools.product(("mpm",), ("linear", "bspline"), ("lumped",), ("usf", "musl")),
    ("mpm", "linear", "lumped", "usl"),
    *itertools.product(("mpm",), ("linear", "bspline"), ("consistent",), ("musl",)),
    *itertools.product(
        ("otm", "unified"), ("linear", "maxent"), ("lumped", "consistent"), ("usl",)
    ),
    ("linear_fem", "linear", "lumped", "usl"),
]


@pytest.mark.parametrize(
    ("method", "basis", "mass", "update"),
    [
        slow_if(one[1] == "maxent" or one[1:3] == ("bspline", "consistent"), *one)
        for one in STRESSED
    ],
)
@pytest.mark.parametrize(
    "steps", (1000, pytest.param(10_000, marks=pytest.mark.slow)), ids=("short", "long")
)
def test_a_stressed_block_with_particles_on_nodes(
    method: str, basis: str, mass: str, update: str, steps: int
) -> None:
    """Momentum to rounding, and bounded energy: the block breathes with 1 % of strain.

    Max-ent functions have particles inside: their gradients have no bound on a hull that bends.
    """
    own = {} if method != "mpm" else {"stress_update": update, "mass_cutoff": STABLE}
    preset = schema.composed("method", method)["method"]
    choices = Explicit(**preset | {"mass": mass} | own)
    layout = "midpoint" if basis == "maxent" else "nodes"
    settings = {"velocity_amplitude": 0.1, "stretch": 0.01, "particle_layout": layout}
    dt = 2e-4  # [s]: 10,000 steps are two periods and a fifth of a cell
    state, solution = block(choices, basis, dt, steps * dt, **settings)
    assert solution.status == "ok", solution.reason
    p, history = state.particles, {k: np.array(v) for k, v in solution.history.items()}
    drift = np.abs(history["momentum"] - history["momentum"][0]).max()
    # conjugate gradients end at 1e-13, and this transfer takes all velocity from their solution
    limit = 1e-12 if method == "otm" and mass == "consistent" else 1e-14
    assert drift < limit * (p.m @ np.abs(p.v)).sum()
    energy = history["kinetic_energy"] + history["strain_energy"]
    moving = 0.5 * p.m.sum() * float(np.sum((0.1 * np.array([1.0, 0.5])) ** 2))
    assert (energy.max() - moving) < 1.3 * (energy[0] - moving)


def test_max_ent_functions_on_the_hull_say_what_broke_the_block() -> None:
    preset = schema.composed("method", "unified")["method"]
    settings = {"velocity_amplitude": 0.1, "stretch": 0.01, "particle_layout": "nodes"}
    state, solution = block(Explicit(**preset), "maxent", 2e-4, 0.5, **settings)
    assert solution.status == "broke_down"
    lost, phi = re.search(r"particle (\d+) has the volume", solution.reason), state.basis.handle
    assert lost is not None and state.geometry is not None
    p = int(lost[1])
    steepest = np.abs(phi.grad_phi[p, : phi.size[p]]).max() * state.geometry.nodal_spacing
    said = re.search(
        r"gradients of (\S+) over the nodal spacing, which have no bound", solution.reason
    )
    assert said and float(said[1]) == pytest.approx(steepest, rel=0.05), solution.reason
    assert steepest > 1e5


def test_usl_says_what_it_met() -> None:
    """Below a cut-off of about (c dt/h)^2 it is unstable by itself, and the reason has both numbers."""
    settings = {"velocity_amplitude": 0.0, "stretch": 0.01, "particle_layout": "nodes"}
    choices = Explicit(stress_update="usl", mass_cutoff=0.0)
    _, solution = block(choices, "linear", 0.02, 2.0, dimension=1, **settings)
    assert solution.status == "diverged"
    assert "the lightest node so far had 1.8e-04 particle masses" in solution.reason
    assert "(c dt/h)^2 = 6.4e-03" in solution.reason
    choices = Explicit(stress_update="musl", mass_cutoff=0.0)
    _, solution = block(choices, "linear", 0.02, 2.0, dimension=1, **settings)
    assert solution.status == "ok", solution.reason


@pytest.mark.parametrize("time", ("explicit", "newmark"))
def test_loads_act_from_the_start_unless_a_body_says_otherwise(time: str) -> None:
    """Balanced, a fall is exact; starting without acceleration it errs by g t dt / 2."""
    g, dt, t = np.array([2.0, 1.0]), 0.01, 0.2
    wrong = {}
    for start in ("balance", "zero"):
        method = {"explicit": "mpm", "newmark": "fem"}[time]
        config = compose(
            "rigid_motion", method, "linear", problem__motion="fall", time_step=dt, end_time=t
        )
        read = case.read(config)
        type(read.problem).initial_acceleration, kept = start, "balance"
        try:
            state = case.build(read)
        finally:
            type(read.problem).initial_acceleration = kept
        solution = simulate(state, dt, t)
        p = state.particles
        exact = read.problem.exact(p.X, t, read.material)["displacement"]
        wrong[start] = np.abs(p.x - p.X - exact).max()
        energy = np.add(solution.history["kinetic_energy"], solution.history["strain_energy"])
        balance = energy - solution.history["external_work"] - energy[0]
        if start == "balance":
            assert np.abs(balance).max() < 1e-8 * energy.max()
    assert wrong["balance"] < 1e-9
    assert wrong["zero"] == pytest.approx(0.5 * g[0] * t * dt, rel=0.3)
