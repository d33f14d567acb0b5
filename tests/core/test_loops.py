"""Time loops from outside: what the program knows about a loop it is told by the loop."""

import ast
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr

from mpmbench.case import read, solve
from mpmbench.contracts import loops
from mpmbench.core import registry
from mpmbench.core.errors import NotApplicable
from mpmbench.core.loops import Choices, explicit, find_loop
from mpmbench.core.loops.explicit import Explicit
from mpmbench.core.materials import kirchhoff_stress
from mpmbench.core.registry import PACKAGE, register
from mpmbench.core.state import State
from tests.core.support import compose

SHORT = {"resolution": 8, "time_step": 1e-5, "end_time": 1e-4}


@register("method", "same")
@dataclass(frozen=True)
class Same(Explicit):
    """The explicit loop under another name."""


@register("method", "same_function")
def same_function(s: State, dt: float) -> None:
    """The explicit loop as it is called by plug-ins of version 0.1."""
    explicit.step(s, dt)


same_function.check = explicit.check  # type: ignore[attr-defined]


def bar(time: str) -> xr.Dataset:
    return solve(compose("bar_fixed_ends", "mpm", "bspline", method__time=time, **SHORT))


@pytest.mark.parametrize("time", ["same", "same_function"])
def test_a_loop_is_judged_by_what_it_declares_and_not_by_its_name(time: str) -> None:
    """Velocities live half a step earlier than positions whatever the loop is called: same bits."""
    known, other = bar("explicit"), bar(time)
    for name in known.data_vars:
        # the places of what is kept at the end hold the times of the solver as text
        if name not in ("solver_time", "solver_cpu_time", "compile_time", "end_state_places"):
            assert np.array_equal(known[name], other[name], equal_nan=True), name
    late = known.velocity_exact[-1] - bar_velocity_at_the_end(known)
    assert np.abs(late).max() > 1e-6  # half a step is seen


def bar_velocity_at_the_end(result: xr.Dataset) -> np.ndarray:
    """Exact velocity [m/s] at the instant of the positions, shape (P, dim)."""
    problem = registry.get("problem", "bar_fixed_ends")()
    settings = compose("bar_fixed_ends", "mpm", "bspline")["material"]
    material = registry.get("material", settings.pop("name"))(**settings)
    X, t = result.position_initial.values, float(result.time_reached)
    return problem.exact(X, t, material)["velocity"]


def test_functions_become_loops_with_the_settings_of_the_explicit_one() -> None:
    @register("method", "demanding")
    def demanding(s: State, dt: float) -> None:
        explicit.step(s, dt)

    def only_lumped(choices: Explicit) -> None:
        if choices.mass != "lumped":
            raise NotApplicable("method.mass=consistent is too much")

    demanding.check = only_lumped  # type: ignore[attr-defined]
    demanding.needs = kirchhoff_stress  # type: ignore[attr-defined]
    loop = find_loop("demanding")
    assert loop is find_loop("demanding") and issubclass(loop, Explicit)
    assert loop().stress is kirchhoff_stress and loop().velocity_lag == 0.5
    case = SimpleNamespace(basis_name="linear")
    loop().check(case)
    with pytest.raises(NotApplicable, match="too much"):
        loop(mass="consistent").check(case)


def test_loops_say_what_they_are() -> None:
    said = {
        name: (loop.velocity_lag, loop.dynamic, loop.implicit, loop.moves_particles)
        for name in ("explicit", "sph", "newmark", "static", "evaluate")
        for loop in [find_loop(name)]
    }
    assert said == {
        "explicit": (0.5, True, False, True),
        "sph": (0.5, True, False, True),
        "newmark": (0.0, True, True, True),
        "static": (0.0, False, True, True),
        "evaluate": (0.0, False, False, False),
    }
    assert Choices().mass == "lumped"  # a loop without such a setting


@pytest.mark.parametrize("derivatives", ("plain", "symmetric"))
@pytest.mark.parametrize("dimension", (1, 2, pytest.param(3, marks=pytest.mark.slow)))
def test_contract_of_a_method_without_nodes(dimension: int, derivatives: str) -> None:
    """What plain derivatives deny, exactness and momentum, really fails."""
    choices = find_loop("sph")(nodes="moving", derivatives=derivatives)
    case = loops.MethodCase(choices, dimension, basis="sph_kernel")
    assert choices.promises.translation == (derivatives == "symmetric")
    for name, check in loops.CHECKS.of(case).items():
        finding = check(case)
        assert finding.passed, f"{name}: {finding.text}"


def test_circumstances_name_the_lightest_node_and_what_the_step_bears() -> None:
    """In masses of the heaviest particle, whatever the others and points without mass weigh."""
    tracers = np.array([[3.1 * loops.SPACING]])
    state = loops.MethodCase(Explicit(mass_cutoff=0.0), 1).block(np.sin, tracers=tracers)
    p, material = state.particles, state.material
    p.m[p.material] *= np.linspace(0.5, 3.0, len(p.m) - 1)
    state.time_step = 1e-3
    state.choices.step(state, state.time_step)
    lightest = state.nodes.m[state.nodes.m > 0.0].min() / p.m.max()
    lame, shear = material.lame_parameters()
    bearable = (lame + 2.0 * shear) / material.density * (1e-3 / loops.SPACING) ** 2
    said = state.choices.circumstances(state)
    assert f"had {lightest:.1e} particle masses" in said, said
    assert f"(c dt/h)^2 = {bearable:.1e} " in said, said


def test_nothing_compares_the_name_of_a_time_loop() -> None:
    """``choices.time`` is for messages: whoever compares it knows too much."""
    for file in PACKAGE.rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Compare):
                text = ast.unparse(node)
                assert "choices.time" not in text, f"{file.name}: {text}"


@pytest.mark.parametrize("mass", ("lumped", "consistent"))
def test_drag_takes_its_share_of_the_velocity_in_every_step(mass: str) -> None:
    """``v <- (1 - drag dt) v`` of a body that flies, the work of which is counted as external."""
    dt, drag, n = loops.TIME_STEP, 40.0, 20
    choices = Explicit(drag=drag, mass=mass)
    assert choices.promises.conserves == {"mass"}
    state = loops.MethodCase(choices, 1).block(lambda x: np.full_like(x, 2.0))
    assert loops.steps(state, n, dt).passed
    v = 2.0 * (1.0 - drag * dt) ** n
    assert np.allclose(state.particles.v, v, rtol=1e-10)
    work, gone = state.external_work, 0.5 * state.particles.m.sum() * (v**2 - 4.0)
    assert work == pytest.approx(gone, rel=drag * dt)


def test_functions_alone_are_no_method_for_motion() -> None:
    with pytest.raises(NotApplicable, match="evaluate moves nothing, and plate_axis_aligned"):
        read(compose("plate_axis_aligned", "evaluate", "linear"))
    read(compose("shape_functions", "evaluate", "linear"))
