"""Gradients by distance: exact for linear fields, those of APIC, and of hats where these are linear."""

from types import SimpleNamespace

import numpy as np
import pytest

from mpmbench.contracts import loops
from mpmbench.contracts.audit import spin_drift
from mpmbench.core import registry
from mpmbench.core.bases.affine import AffineGradients
from mpmbench.core.errors import NotApplicable
from mpmbench.core.geometry import Box
from mpmbench.core.loops.explicit import Explicit
from mpmbench.core.simulation import simulate
from mpmbench.core.transfer import find_transfer

BOXES = {1: Box((0.0,), (1.2,), (6,)), 2: Box((0.0, 0.0), (1.2, 1.0), (6, 5))}


def functions(name: str, dim: int, **settings: float) -> AffineGradients:
    plugin = registry.get("basis", name)(**settings)
    return AffineGradients(plugin.build(BOXES[dim], 40, False), 40)


@pytest.mark.parametrize("dim", (1, 2))
@pytest.mark.parametrize("name", ("bspline", "mls"))
def test_linear_fields_have_their_gradient(name: str, dim: int) -> None:
    """As through the handle, which is filled at the particles; it is not the derivative, though."""
    basis = functions(name, dim, **({"relative_radius": 2.3} if name == "mls" else {}))
    x = np.random.default_rng(1).uniform(0.05, 0.95, (40, dim))
    basis.locate(x)
    n = len(basis.nodes)
    values, gradients = basis.handle.matrix(n), basis.handle.gradient_matrix(n)
    assert np.abs(gradients.sum(axis=1)).max() < 1e-11
    identity = np.einsum("pia,ib->pab", gradients, basis.nodes)
    assert np.abs(identity - np.eye(dim)).max() < 1e-11
    derivatives = basis.within.evaluate(x)
    assert np.array_equal(values, derivatives.matrix(n))
    assert np.abs(gradients - derivatives.gradient_matrix(n)).max() > 0.1
    assert np.array_equal(basis.evaluate(x).gradient_matrix(n), gradients)


@pytest.mark.parametrize("dim", (1, 2))
def test_inside_a_cell_it_is_the_gradient_of_hats(dim: int) -> None:
    """In 2D of fields without the product of two coordinates: the mean slope along each axis."""
    basis = functions("linear", dim)
    x = np.random.default_rng(1).uniform(0.05, 0.95, (40, dim))
    v = basis.nodes @ np.arange(1.0, dim + 1.0) + np.sin(9.0 * basis.nodes[:, 0])
    affine, plain = (
        np.einsum("pid,i->pd", one.evaluate(x).gradient_matrix(len(v)), v)
        for one in (basis, basis.within)
    )
    assert np.abs(affine - plain).max() < 1e-11


@pytest.mark.slow  # compiles APIC in a plane; linear fields above
def test_it_is_the_gradient_that_apic_carries() -> None:
    """MLS-MPM: ``F <- (I + dt B D^-1) F``."""
    choices = Explicit(transfer="apic", gradient="affine")
    state = loops.MethodCase(choices, 2, "bspline").block(lambda x: np.sin(3.0 * x[:, ::-1]))
    places = state.particles.x.copy()
    finding = loops.steps(state, n=1)
    assert finding.passed, finding.text
    stored = state.basis.within.evaluate(places)
    away = state.basis.nodes[stored.index] - places[:, None]
    D = np.einsum("pk,pkd,pke->pde", stored.phi, away, away)
    C = state.particles.data["affine"] @ np.linalg.inv(D)
    expected = np.eye(2) + loops.TIME_STEP * C
    assert np.abs(state.particles.F - expected).max() < 1e-13
    assert np.abs(C).max() > 0.5


@pytest.mark.parametrize("motion", ({}, {"nodes": "moving"}, {"shape_functions": "frozen"}))
def test_contract(motion: dict[str, str]) -> None:
    case = loops.MethodCase(Explicit(gradient="affine", **motion), 1, "bspline")
    for check in ("rigid translation", "free fall", "mass and momentum", "uniform stretch"):
        finding = loops.CHECKS[check](case)
        assert finding.passed, f"{check}: {finding.text}"


@pytest.mark.slow  # compiles them in a plane; tests/core/test_audit.py has that of APIC
def test_angular_momentum_is_that_of_apic() -> None:
    """Symmetric stresses turn nothing by these gradients either."""
    assert find_transfer("apic").promises.angular_momentum
    choices = Explicit(transfer="apic", gradient="affine", mass_cutoff=0.0)
    assert spin_drift(choices, 50) < 1e-13


def test_crossings_are_counted_on_the_grid() -> None:
    counts = []
    for gradient in ("functions", "affine"):
        state = loops.MethodCase(Explicit(gradient=gradient), 1, "bspline").block(
            lambda x: np.full_like(x, 5.0)
        )
        counts.append(simulate(state, 1e-3, 0.05).cell_crossings)
    assert counts[0] == counts[1] > 0


def test_functions_with_kinks_are_refused() -> None:
    plugin = registry.get("basis", "linear")()
    with pytest.raises(NotApplicable, match=r"method\.gradient=affine with basis=linear"):
        Explicit(gradient="affine").check(SimpleNamespace(basis=plugin, basis_name="linear"))
