"""The contract of every method: the presets and every choice that differs from them, in every dimension.

Each combination of nodes, functions, mass, transfer and stress update either runs the whole
contract, or says why not.
"""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from mpmbench.contracts import loops
from mpmbench.core.errors import NotApplicable
from mpmbench.core.loops.explicit import Explicit, check, update_particles
from mpmbench.settings.schema import composed, options
from tests.support import slow_if

METHODS = [composed("method", name)["method"] for name in options("method")]
# ulmpm is mpm with another basis, which these checks choose themselves
EXPLICIT = [
    Explicit(**method)
    for method in METHODS
    if method["time"] == "explicit" and method["name"] != "ulmpm"
]
COMBINATIONS = [
    Explicit(
        name="combination",
        nodes=nodes,
        shape_functions=functions,
        mass=mass,
        transfer=transfer,
        flip=0.9,
        stress_update=update,
    )
    for nodes, functions, mass, transfer, update in itertools.product(
        ("fixed", "moving"),
        ("updated", "frozen"),
        ("lumped", "kept", "consistent"),
        ("flip", "pic", "blend", "position_difference", "nodal"),
        ("usl", "usf", "musl"),
    )
]


def applicable(choices: Explicit) -> bool:
    try:
        check(choices)
    except NotApplicable:
        return False
    return True


def name_of(choices: Explicit) -> str:
    return "-".join(
        (
            choices.nodes,
            choices.shape_functions,
            choices.mass,
            choices.transfer,
            choices.stress_update,
        )
    )


def case_name(case: loops.MethodCase) -> str:
    return f"{name_of(case.choices)}-{case.dimension}D"


FOR_ALL = (
    "rigid translation",
    "free fall",
    "mass and momentum",
    "angular momentum",
    "uniform stretch",
    "affine fields",
    "rest",
)
CASES = [case for choices in COMBINATIONS if applicable(choices) for case in loops.cases(choices)]


def costly(case: loops.MethodCase) -> bool:
    """Whatever is compiled anew: all is asked on a line, in a plane grids with a lumped mass, in space none.

    One bar is the same in all of them by tests/core/test_dimensions.py.
    """
    choices = case.choices
    on_a_grid = choices.nodes == "fixed" and choices.shape_functions == "updated"
    return case.dimension > 1 and not (
        case.dimension == 2 and on_a_grid and choices.mass == "lumped"
    )


BY_DEFAULT = [slow_if(costly(case), case) for case in CASES]


@pytest.mark.parametrize("case", BY_DEFAULT, ids=case_name)
@pytest.mark.parametrize("check", FOR_ALL)
def test_contract(check: str, case: loops.MethodCase) -> None:
    if check in loops.CHECKS.of(case):
        finding = loops.CHECKS[check](case)
        assert finding.passed, finding.text


@pytest.mark.parametrize(
    "case",
    [slow_if(costly(case), case) for case in CASES if case.dimension > 1],
    ids=case_name,
)
def test_angular_momentum_needs_a_symmetric_stress(case: loops.MethodCase) -> None:
    finding = loops.angular_momentum(replace(case, material="small_strain_elastic"))
    assert finding.passed, finding.text


OF_PRESETS = [  # orders are asked on a bar, by tests/core/test_orders.py
    slow_if(check == "order on a plate", check, choices)
    for check in loops.CHECKS
    if check not in FOR_ALL
    for choices in EXPLICIT
]


@pytest.mark.parametrize(
    ("check", "choices"), OF_PRESETS, ids=lambda part: part if isinstance(part, str) else part.name
)
def test_contract_of_the_presets(check: str, choices: Explicit) -> None:
    for case in loops.cases(choices):
        if check in loops.CHECKS.of(case):
            finding = loops.CHECKS[check](case)
            assert finding.passed, finding.text


@pytest.mark.parametrize("choices", [c for c in COMBINATIONS if not applicable(c)], ids=name_of)
def test_senseless_combinations_are_refused_with_a_reason(choices: Explicit) -> None:
    with pytest.raises(NotApplicable, match="method\\."):
        check(choices)


def test_flip_weight_of_the_blend() -> None:
    assert Explicit(transfer="blend", flip=0.95).flip_weight == 0.95
    assert Explicit(transfer="pic").flip_weight == 0.0
    assert Explicit().flip_weight == 1.0


@pytest.mark.parametrize("dim", (1, 2, pytest.param(3, marks=pytest.mark.slow)))
def test_deformations_multiply_from_the_left(dim: int) -> None:
    """Two linear velocity fields one after the other: ``F = (I + dt B)(I + dt A)``, not the other way round."""
    rng = np.random.default_rng(dim)
    state = loops.MethodCase(Explicit(), dim).block(np.zeros_like)
    expected = np.eye(dim)
    for gradient in rng.standard_normal((2, dim, dim)):
        state.nodes.v[:] = state.basis.nodes @ gradient.T
        update_particles(state, 0.1, strain=True)
        expected = (np.eye(dim) + 0.1 * gradient) @ expected
    assert np.allclose(state.particles.F, expected, atol=1e-12)
    assert np.allclose(state.particles.V, state.particles.V0 * np.linalg.det(expected), rtol=1e-12)
