"""F-bar: forces are the derivative of an energy, cells keep their volume, and what it is not for is refused."""

from typing import Any

import numpy as np
import pytest

from mpmbench import case
from mpmbench.core.errors import NotApplicable
from mpmbench.core.implicit.assembly import internal_work
from mpmbench.core.implicit.f_bar import with_mean_pressure, with_same_functions
from mpmbench.core.implicit.newton import Equations
from mpmbench.core.implicit.step import convect, prepare
from mpmbench.core.state import State
from tests.core.support import compose


def state_of(**changes: Any) -> tuple[State, Equations]:
    """A state that has gone one random step, so that F-bar is not I at the start of the next one."""
    given = {"resolution": 8, "method__volumetric": "f_bar", **changes}
    config = compose("cantilever_self_weight", "fem", "linear", **given)
    state = case.build(case.read(config))
    equations = Equations(state, prepare(state), state.nodes.f_external, 1.0, None)
    du = random_increment(equations, 1)
    assert equations.residual(du) is not None
    convect(state, equations.w, du)
    return state, Equations(state, prepare(state), state.nodes.f_external, 1.0, None)


def random_increment(equations: Equations, seed: int) -> np.ndarray:
    du = np.zeros_like(equations.external)
    active = equations.pattern.active
    du[active] = 0.03 * np.random.default_rng(seed).standard_normal((len(active), 2))
    return du


def energy(state: State, F: np.ndarray) -> float:
    """Of a neo-Hookean body: ``sum V0 (mu (tr b - 2 - 2 ln J) / 2 + lambda (ln J)^2 / 2)`` [J]."""
    lame, shear = state.material.lame_parameters()
    log_J = np.log(np.linalg.det(F))
    stretch = np.sum(F * F, axis=(1, 2)) - 2.0
    density = 0.5 * shear * (stretch - 2.0 * log_J) + 0.5 * lame * log_J**2
    return float(state.particles.V0 @ density)


def test_forces_are_the_derivative_of_the_energy() -> None:
    state, equations = state_of(material__poisson_ratio=0.45)
    du, direction = random_increment(equations, 2), random_increment(equations, 3)

    def stored(du: np.ndarray) -> float:
        assert equations.residual(du) is not None
        return energy(state, equations.w.F)

    change = (stored(du + 1e-5 * direction) - stored(du - 1e-5 * direction)) / 2e-5
    assert equations.residual(du) is not None
    assert change == pytest.approx(float(np.sum(equations.internal * direction)), rel=1e-6)


def test_a_cell_has_one_change_of_volume_and_keeps_its_volume() -> None:
    """All J of the increment are equal in a cell, and ``sum V`` is that of the cell's quadrature."""
    state, equations = state_of()
    p, w = state.particles, equations.w
    du = random_increment(equations, 4)
    assert equations.residual(du) is not None
    J_bar = np.linalg.det(w.F[p.material]) / np.linalg.det(p.F[p.material])
    gradient = np.einsum("pka,pkb->pab", du[w.phi.index], w.phi.grad_phi)
    J = np.linalg.det(np.eye(2) + gradient)[p.material]
    V = p.V[p.material]
    assert w.cells is not None
    assert len(w.cells.first) == 8 + 1
    for start, stop in zip(w.cells.first[:-1], w.cells.first[1:], strict=True):
        member = w.cells.member[start:stop]
        assert len(member) == 4
        assert np.ptp(J_bar[member]) < 1e-12
        assert np.ptp(J[member]) > 1e-3  # without F-bar they differ
        assert V[member] @ J_bar[member] == pytest.approx(V[member] @ J[member], rel=1e-12)


def test_the_work_of_stresses_with_the_mean_pressure_is_that_of_the_forces() -> None:
    """At the start of a step, where stresses are those that particles keep; their own would miss it."""
    state, equations = state_of(material__poisson_ratio=0.45)
    p, w, direction = state.particles, equations.w, random_increment(equations, 5)
    assert equations.residual(np.zeros_like(direction)) is not None
    wanted = float(np.sum(equations.internal * direction))
    assert w.cells is not None
    with_mean = internal_work(w.phi, p.V, with_mean_pressure(state, w.cells), direction)
    assert with_mean == pytest.approx(wanted, rel=1e-10)
    assert internal_work(w.phi, p.V, p.sigma, direction) != pytest.approx(wanted, rel=1e-5)


def test_cells_are_particles_with_the_same_functions() -> None:
    """What stands behind the functions of a particle does not count, and one without any is in no cell."""
    index = np.array([[4, 5], [7, 8], [4, 5], [7, 3], [0, 0]])
    cells = with_same_functions(np.array([2, 1, 2, 1, 0]), index)
    found = [
        set(cells.member[start:stop])
        for start, stop in zip(cells.first[:-1], cells.first[1:], strict=True)
    ]
    assert sorted(found, key=min) == [{0, 2}, {1, 3}]


@pytest.mark.parametrize(
    ("problem", "method", "basis", "changes", "reason"),
    [
        ("cook_membrane", "gmm", "mls", {}, "all particles of a cell share"),
        ("plate_with_hole", "fem", "linear", {}, "changes nothing in triangles"),
        (
            "cook_membrane",
            "fem",
            "linear",
            {"method__shape_functions": "frozen", "method__nodes": "fixed"},
            "updated",
        ),
    ],
)
def test_refused(problem: str, method: str, basis: str, changes: dict, reason: str) -> None:
    config = compose(
        problem, method, basis, method__volumetric="f_bar", method__time="static", **changes
    )
    with pytest.raises(NotApplicable, match=reason):
        case.read(config)
