"""Rigid walls: the conditions of Signorini and Coulomb, what they give, and that they let go."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from mpmbench import case
from mpmbench.core import registry
from mpmbench.core.errors import NotApplicable
from mpmbench.core.geometry import Cloud
from mpmbench.core.geometry.triangulate import ring_mesh, seed_triangles
from mpmbench.core.loops.explicit import Explicit
from mpmbench.core.matrix.mass import LumpedMass
from mpmbench.core.particles import Particles
from mpmbench.core.simulation import Body, build_state, simulate
from mpmbench.core.state import Loads, State
from mpmbench.core.walls import Contacts, Wall
from tests.core.support import compose, run
from tests.support import slow_if

LAW = registry.get("material", "neo_hookean")(
    young_modulus=1000.0, poisson_ratio=0.3, density=1000.0
)


def test_a_node_at_two_walls_answers_to_both() -> None:
    """What is found at the contacts alone is the answer of all nodes there; held components have none."""
    rng, fixed = np.random.default_rng(2), np.zeros((4, 2), dtype=bool)
    fixed[3, 1] = True
    nobody: Any = SimpleNamespace(
        axes=(0.0, 0.0), gathered=lambda rhs, *_: rhs, scatter=lambda _: None
    )
    mass = LumpedMass(fixed, nobody)
    mass.m_i = mass._system = rng.uniform(1.0, 2.0, 4)
    s: Any = SimpleNamespace(mass=mass, nodes=SimpleNamespace(v=np.zeros((4, 2))))
    node = np.array([1, 3, 1])
    c = Contacts(node, np.ones((3, 2)), np.zeros(3), np.zeros(3), mass.m_i[node])
    impulse = rng.standard_normal((3, 2))
    assert np.allclose(c.answer_here(s, impulse), c.answer(s, impulse)[node])
    assert np.allclose(c.answer(s, impulse)[1], (impulse[0] + impulse[2]) / mass.m_i[1])


class Dense:
    """A mass matrix of any kind."""

    def __init__(self, matrix: np.ndarray) -> None:
        self.matrix = matrix

    def solve(self, rhs: np.ndarray, out: np.ndarray) -> None:
        out[:] = np.linalg.solve(self.matrix, rhs)


def chain(nodes: int, lumped: bool) -> np.ndarray:
    """The mass matrix of linear elements on a line [kg]."""
    matrix = np.diag(np.full(nodes, 4.0)) + np.eye(nodes, k=1) + np.eye(nodes, k=-1)
    matrix[0, 0] = matrix[-1, -1] = 2.0
    return np.diag(matrix.sum(axis=1)) if lumped else matrix


@pytest.mark.parametrize("lumped", (True, False))
@pytest.mark.parametrize("friction", (0.0, 0.4, np.inf))
@pytest.mark.parametrize("dim", (2, 3))
def test_impulses_satisfy_the_conditions(lumped: bool, friction: float, dim: int) -> None:
    rng = np.random.default_rng(1)
    nodes, scale = 12, 3.0
    matrix = chain(nodes, lumped)
    s: Any = SimpleNamespace(mass=Dense(matrix), nodes=SimpleNamespace(v=np.zeros((nodes, dim))))
    normal = rng.standard_normal((nodes, dim))
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    allowed = rng.uniform(0.0, 1.0, nodes)
    free = scale * rng.standard_normal((nodes, dim))
    c = Contacts(np.arange(nodes), normal, np.full(nodes, friction), allowed, matrix.sum(axis=1))
    largest = 1.2 * c.largest_eigenvalue(s)
    impulse = c.find(s, free, np.zeros((nodes, dim)), largest)
    v = free + c.answer(s, impulse)
    pressed, approach = np.sum(impulse * normal, axis=1), np.sum(v * normal, axis=1) + allowed
    assert np.allclose(matrix @ (v - free), impulse, atol=1e-12)
    # rough walls may have to pull in a step: some have no other solution
    assert (np.isinf(friction) or (pressed >= 0.0).all()) and (approach > -1e-8).all()
    assert np.abs(pressed * approach).max() < 1e-7
    assert 0 < np.count_nonzero(pressed) < nodes
    along = impulse - pressed[:, None] * normal
    size = np.linalg.norm(along, axis=1)
    sliding = v - np.sum(v * normal, axis=1)[:, None] * normal
    speed = np.linalg.norm(sliding, axis=1)
    if friction == 0.0:
        assert size.max() < 1e-12
    elif np.isinf(friction):
        assert speed[pressed > 1e-6].max() < 1e-8
    else:
        assert (size <= friction * pressed + 1e-10).all()
        slides = (pressed > 1e-6) & (speed > 1e-6)
        assert slides.any()
        assert np.allclose(
            along[slides] * speed[slides, None],
            -(friction * pressed)[slides, None] * sliding[slides],
            atol=1e-6,
        )


def disk(turned: float, choices: Explicit, basis: str, friction: float) -> State:
    """A disk of moving nodes above a wall, all turned by an angle about the origin."""
    Q = np.array([[np.cos(turned), -np.sin(turned)], [np.sin(turned), np.cos(turned)]])
    nodes, triangles = ring_mesh(0.2, 4)
    centre = np.array([0.0, 0.22])
    X, V0 = seed_triangles((nodes + centre) @ Q.T, triangles, 3)
    particles = Particles.at_rest(X, V0, LAW.density)

    def velocity(x: np.ndarray) -> np.ndarray:
        return np.tile(Q @ [0.1, -0.14], (len(x), 1))

    particles.v[:] = velocity(X)
    body = Body(
        Cloud((nodes + centre) @ Q.T, triangles, 0.05),
        particles,
        lambda x: np.zeros(x.shape, dtype=bool),
        velocity,
        Loads(walls=(Wall((0.0, 0.0), tuple(Q @ [0.0, 1.0]), friction),)),
    )
    return build_state(body, registry.get("basis", basis)(), LAW, choices)


MOVING = {"nodes": "moving", "transfer": "position_difference"}


@pytest.mark.parametrize(
    ("mass", "friction"),
    (
        slow_if(True, "lumped", 0.0),
        ("lumped", 0.3),
        slow_if(True, "lumped", np.inf),
        slow_if(True, "consistent", 0.3),
    ),
)
def test_momentum_is_what_walls_give_in_any_direction(mass: str, friction: float) -> None:
    choices, dt = Explicit(mass=mass, **MOVING), 1e-3
    found = []
    for turned in (0.0, 0.6):
        s = disk(turned, choices, "lme", friction)
        given = np.zeros(2)
        first = s.particles.m @ s.particles.v
        for _ in range(400):
            s.time_step = dt
            choices.step(s, dt)
            given += s.walls.impulse[0]
        size = float(s.particles.m @ np.linalg.norm(s.particles.v, axis=1))
        assert np.allclose(s.particles.m @ s.particles.v - first, given, atol=1e-12 * size)
        assert np.linalg.norm(given) > 0.1 * size
        back = np.array([[np.cos(turned), np.sin(turned)], [-np.sin(turned), np.cos(turned)]])
        assert (s.basis.nodes @ back.T)[:, 1].min() > -1e-12
        found.append(s.particles.x @ back.T)
    assert np.allclose(*found, atol=1e-9)


METHODS = {
    "mpm, B-spline": ("mpm", "bspline", {}),
    "mpm, linear, musl": ("mpm", "linear", {"method__stress_update": "musl"}),
    "otm": ("otm", "lme", {"method__mass": "lumped"}),
    "frozen": ("mpm", "bspline", {"method__shape_functions": "frozen"}),
    "implicit mpm": ("implicit_mpm", "linear", {"time_step": 5e-3}),
    "gmm": ("gmm", "lme", {"time_step": 5e-3}),
    "fem": ("fem", "linear", {"time_step": 5e-3}),
}
SHORT = {"problem__rise_time": 0.05, "end_time": 0.15, "resolution": 4}


@pytest.mark.parametrize(
    "name", [slow_if(name in ("mpm, B-spline", "otm", "gmm", "frozen"), name) for name in METHODS]
)
def test_a_block_slides_as_a_rigid_one_or_sticks(name: str) -> None:
    method, basis, changes = METHODS[name]
    slides = run("friction_slope", method, basis, **SHORT, **changes)
    assert abs(float(slides.error_end_relative)) < 5e-3
    # of the weight along the plane friction takes this part, and motion the rest
    taken = np.tan(np.radians(15.0)) / np.tan(np.radians(24.0))
    assert float(slides.contact_energy[-1] / slides.external_work[-1]) == pytest.approx(
        taken, rel=5e-3
    )
    assert float(slides.energy_imbalance) < 0.01
    angle = {"problem__friction_angle": 30.0}
    sticks = run("friction_slope", method, basis, **SHORT, **changes, **angle)
    assert np.abs(sticks.slide.values).max() < 1e-4 < 1e-2 * float(slides.slide_exact.max())


BOUNCES = {
    "otm": ("otm", "lme", {"time_step": 2e-3}),
    "explicit fem": ("linear_fem", "linear", {"time_step": 2e-3}),
    "fem": ("fem", "linear", {"time_step": 2e-2}),
    "gmm": ("gmm", "lme", {"time_step": 2e-2}),
}


@pytest.mark.parametrize(
    "name",
    [slow_if(name != "fem", name) for name in BOUNCES],
)
def test_a_disk_bounces_with_its_energy(name: str) -> None:
    """Contact by geometry at 1.5858 s until 2.68 s; restitution 0.907.

    Nodes land without a rebound, which costs energy with order one: 0.7 to 2 % on 16 cells.
    """
    method, basis, changes = BOUNCES[name]
    found = run("bouncing_disk", method, basis, resolution=8, **changes)
    assert float(found.first_contact) == pytest.approx(1.5858, abs=0.03)
    assert float(found.last_contact) == pytest.approx(2.68, abs=0.05)
    assert float(found.restitution) == pytest.approx(0.907, abs=0.03)
    assert float(found.energy_kept) == pytest.approx(1.0, abs=0.05)
    assert float(found.energy_imbalance) < 0.01
    assert float(found.wall_force.min()) == 0.0 < float(found.wall_force.max())


@pytest.mark.slow  # SPH in a plane is compiled for it alone
def test_particles_of_sph_bounce_and_do_not_pass() -> None:
    """The wall holds at the instant of geometry and lets go; of the speed SPH itself loses a quarter on 8 cells."""
    changes: dict[str, Any] = {
        "problem__particle_layout": "nodes",
        "method__derivatives": "symmetric",
        "time_step": 2e-3,
    }
    found = run("bouncing_disk", "sph", "sph_kernel", resolution=8, **changes)
    assert float(found.first_contact) == pytest.approx(1.5858, abs=0.03)
    assert float(found.position[..., 1].min()) > -1e-12
    assert float(found.wall_force.min()) == 0.0 == float(found.wall_force[-1])
    assert 0.0 < float(found.restitution) < 0.907


@pytest.mark.slow  # blocks that slide and stick above have both laws of friction
def test_a_disk_rolls_on_a_rough_wall() -> None:
    """No gap, no glue: near a rigid disk, with a polygon of 24 corners; with too little friction it slides further."""
    rolls = run("rolling_disk", "gmm", "lme", resolution=8, time_step=4e-3)
    assert abs(float(rolls.error_end_relative)) < 5e-2
    slips = run("rolling_disk", "gmm", "lme", resolution=8, time_step=4e-3, problem__friction=0.3)
    further = 1.5 * (1.0 - 0.3 / np.tan(np.radians(60.0))) - 1.0
    assert float(slips.error_end_relative) == pytest.approx(further, abs=1e-2)


@pytest.mark.parametrize(
    "problem", ("rolling_disk", slow_if(True, "soil_column"), "cantilever_dynamic")
)
def test_splines_run_against_walls(problem: str) -> None:
    changes: dict[str, dict[str, Any]] = {
        "rolling_disk": {"problem__background": "quads", "resolution": 8},
        "soil_column": {"problem__base": "wall", "resolution": 8},
        "cantilever_dynamic": {"problem__behind": "wall", "resolution": 8},
    }
    run(problem, "implicit_mpm", "bspline", end_time=0.2, **changes[problem])


def test_what_knows_no_walls_says_so() -> None:
    with pytest.raises(NotApplicable, match=r"particle_layout=nodes"):
        case.read(compose("bouncing_disk", "sph", "sph_kernel"))
    with pytest.raises(NotApplicable, match="dirichlet"):
        config = compose("bouncing_disk", "gmm", "lme", method__dirichlet="multipliers")
        case.read(config)
    s = simulate(disk(0.0, Explicit(**MOVING), "lme", 0.0), 1e-3, 0.05)
    assert s.status == "ok"
