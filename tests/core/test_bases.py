"""The invariants of every registered basis, in every dimension it claims: each promise tested in both directions."""

from dataclasses import replace

import numpy as np
import pytest

from mpmbench.contracts import bases
from mpmbench.core import registry
from mpmbench.core.bases import Basis
from mpmbench.core.bases.grid.linear import Linear
from mpmbench.core.bases.grid.spline import TensorSpline
from mpmbench.core.errors import SolverFailure
from mpmbench.core.geometry import Geometry
from mpmbench.core.registry import register
from tests.support import slow_if

# where the default is a special case (MLS with this radius is the linear basis in 1D), the general
# one
GENERAL: dict[str, dict] = {"mls": {"relative_radius": 2.3}, "rkpm": {"relative_radius": 2.3}}
# Each dimension and kind of nodes is compiled anew from the same text: all in a plane, those on a line
# that the bars of other tests need too, and in space one.
EVERYWHERE = "linear"
ON_A_LINE = (EVERYWHERE, "bspline", "lme", "maxent", "sph_kernel")


def costly(case: bases.BasisCase) -> bool:
    if case.dimension == 3:
        return case.moved or case.name != EVERYWHERE
    return case.dimension == 1 and (case.moved or case.name not in ON_A_LINE)


CASES = [
    slow_if(costly(case), case)
    for name in registry.names("basis")
    for case in bases.cases(name, GENERAL.get(name))
]
OTHER_DEGREES = bases.cases(
    "bspline", {"degree": 1}, kronecker="everywhere", continuous_gradient=False
)
OTHER_DEGREES += bases.cases("bspline", {"degree": 3})
CASES += [  # each dimension and degree is compiled anew: the other degrees in 1D here
    slow_if(case.dimension > 1 or case.moved, case) for case in OTHER_DEGREES
]
CASES += [  # with the products of two coordinates, which tests/core/implicit/test_clouds.py asks; in 1D there are none
    slow_if(True, case)
    for case in bases.cases("mls", {"mixed_terms": True, "relative_radius": 2.3})
    if case.dimension == 2
]
CASES += [  # of other orders, whose terms tests/core/test_rkpm.py asks
    slow_if(True, case)
    for case in (
        *bases.cases("rkpm", {"order": 0}, linear_completeness=False, non_negative=True),
        *bases.cases("rkpm", {"order": 2, "relative_radius": 3.0}),
    )
]
CASES += [
    slow_if(case.dimension == 3, case)
    for prior in ("quartic_spline", "gaussian")
    for case in bases.cases("maxent", {"prior": prior})
]


def name_of(case: bases.BasisCase) -> str:
    return (
        f"{case.name}{case.settings or ''}-{case.dimension}D-{'moved' if case.moved else 'fixed'}"
    )


@pytest.mark.parametrize("case", CASES, ids=name_of)
@pytest.mark.parametrize("check", bases.CHECKS)
def test_contract(check: str, case: bases.BasisCase) -> None:
    finding = bases.CHECKS[check](case)
    assert finding.passed, finding.text


def test_greville_points_interpolate_linear_functions_only_there() -> None:
    """The nodes of a quadratic spline are its Greville abscissae: moving them anywhere else breaks completeness."""
    case = bases.BasisCase("bspline", 1)
    basis, x = case.build(), case.points()
    values = basis.evaluate(x).matrix(len(basis.nodes))
    equidistant = np.linspace(0.0, 1.0, len(basis.nodes))[:, None]
    assert np.abs(values @ equidistant - x).max() > 1e-3


def test_knots_that_cross_end_the_run() -> None:
    basis = bases.BasisCase("bspline", 1, moved=True).build()
    with pytest.raises(SolverFailure, match="crossed"):
        basis.move(-1.5 * basis.nodes)


def test_bases_whose_nodes_stay_are_not_moved_and_refuse_it() -> None:
    """They have no cases with moved nodes; one that moves all the same is found out."""

    class Still(TensorSpline):
        move = Basis.move

    @register("basis", "still")
    class StillLinear(Linear):
        promises = replace(Linear.promises, moves=False)

        def build(self, geometry: Geometry, particles: int, moving: bool) -> Basis:
            basis = super().build(geometry, particles, moving)
            basis.__class__ = Still
            return basis

    @register("basis", "not_so_still")
    class NotSoStill(Linear):
        promises = StillLinear.promises

    cases = {name: bases.cases(name) for name in ("still", "not_so_still")}
    assert not any(case.moved for found in cases.values() for case in found)
    assert len(cases["still"]) == 3
    refused = bases.nodes_follow(cases["still"][0])
    assert refused.passed and "cannot move" in refused.text
    assert not bases.nodes_follow(cases["not_so_still"][0]).passed
