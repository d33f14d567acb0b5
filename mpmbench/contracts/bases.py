"""The contract of a basis: its promises, and what the solver relies on, in every dimension that it claims."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from mpmbench.contracts import Contract, Finding, largest
from mpmbench.core import registry
from mpmbench.core.bases import Basis, BasisSettings, Promises
from mpmbench.core.errors import NotApplicable, SolverFailure
from mpmbench.core.geometry import Box
from mpmbench.core.transfer.sums import p2g_mass

UPPER, CELLS = (1.2, 1.0, 0.8), (6, 5, 4)
CHECKS = Contract()


@dataclass(frozen=True)
class BasisCase:
    """A basis on a box, its nodes displaced or not."""

    name: str
    dimension: int
    moved: bool = False  # inside the box by up to a twentieth of a cell and more
    settings: dict[str, Any] = field(default_factory=dict)  # those that differ from the defaults
    promised: dict[str, Any] = field(default_factory=dict)  # what these settings change

    @property
    def plugin(self) -> BasisSettings:
        plugin: BasisSettings = registry.get("basis", self.name)(**self.settings)
        return plugin

    @property
    def promises(self) -> Promises:
        return replace(registry.get("basis", self.name).promises, **self.promised)

    @property
    def upper(self) -> np.ndarray:
        """The far corner of the box [m]; the other one is the origin."""
        return np.array(UPPER[: self.dimension])

    @property
    def box(self) -> Box:
        return Box((0.0,) * self.dimension, UPPER[: self.dimension], CELLS[: self.dimension])

    def build(self, particles: int = 1) -> Basis:
        """The basis with room for that many particles."""
        basis = self.plugin.build(self.box, particles, self.moved)
        if self.moved:
            # zero on the faces, different along each axis, and (for knots that are lines) a
            # function of its own axis
            wave = np.sin(2.0 * np.pi * basis.nodes / self.upper)
            basis.move(0.012 * wave * np.arange(1, self.dimension + 1))
        return basis

    def points(self, margin: float = 0.0, n: int = 150) -> np.ndarray:
        """Points in the box, some of them close to its faces [m], shape (n, dim)."""
        rng = np.random.default_rng(3)
        points = rng.random((n, self.dimension))
        close = rng.random((n // 3, self.dimension)) < 0.5
        points[: n // 3] = np.where(close, 0.02 * points[: n // 3], points[: n // 3])
        return (margin + (1.0 - 2.0 * margin) * points) * self.upper


def cases(name: str, settings: dict[str, Any] | None = None, **promised: Any) -> list[BasisCase]:
    """All cases of a basis: its dimensions, with nodes at rest and, if they can, moved."""
    promises = replace(registry.get("basis", name).promises, **promised)
    return [
        BasisCase(name, d, moved, settings or {}, promised)
        for d in promises.dimensions
        for moved in ((False, True) if promises.moves else (False,))
    ]


@CHECKS.asks()
def partition_of_unity(case: BasisCase) -> Iterator[Finding]:
    """``sum_i phi_i(x) = 1``, and the gradients add up to zero."""
    basis = case.build()
    stored, n = basis.evaluate(case.points()), len(basis.nodes)
    error = largest(stored.matrix(n).sum(axis=1) - 1.0)
    gradient = largest(stored.gradient_matrix(n).sum(axis=1))
    claim, measured = case.promises.partition_of_unity, f"errors {error:.2g} and {gradient:.2g} 1/m"
    yield Finding.as_declared(error < 1e-12, claim, "the sum of the functions is 1", measured)
    yield Finding.as_declared(gradient < 1e-8, claim, "the sum of the gradients is 0", measured)


@CHECKS.asks()
def linear_completeness(case: BasisCase) -> Iterator[Finding]:
    """``sum_i x_i phi_i(x) = x``, and its gradient is the identity."""
    basis, x = case.build(), case.points()
    stored, n = basis.evaluate(x), len(basis.nodes)
    error = largest(stored.matrix(n) @ basis.nodes - x)
    identity = np.einsum("pia,ib->pab", stored.gradient_matrix(n), basis.nodes)
    gradient = largest(identity - np.eye(case.dimension))
    claim, measured = case.promises.linear_completeness, f"errors {error:.2g} m and {gradient:.2g}"
    what = "linear completeness"
    yield Finding.as_declared(error < 1e-11, claim, what, measured)
    yield Finding.as_declared(gradient < 1e-7, claim, f"{what} of the gradients", measured)


@CHECKS.asks()
def sign(case: BasisCase) -> Iterator[Finding]:
    """No function is negative."""
    basis = case.build()
    lowest = float(basis.evaluate(case.points(n=400)).matrix(len(basis.nodes)).min())
    claim, measured = case.promises.non_negative, f"lowest {lowest:.2g}"
    yield Finding.as_declared(lowest >= -1e-14, claim, "non-negativity", measured)


@CHECKS.asks()
def gradient_is_the_derivative(case: BasisCase) -> Iterator[Finding]:
    """Gradients are central differences of the values, or it is declared that they are not."""
    basis, x, step = case.build(), case.points(margin=1e-3, n=60), 1e-6
    n = len(basis.nodes)
    gradient = basis.evaluate(x).gradient_matrix(n)
    errors = []
    for d in range(case.dimension):
        shift = step * np.eye(case.dimension)[d]
        ahead, behind = basis.evaluate(x + shift).matrix(n), basis.evaluate(x - shift).matrix(n)
        difference = (ahead - behind) / (2.0 * step)
        errors.append(largest(gradient[:, :, d] - difference) / max(1.0, largest(difference)))
    error = np.array(errors)
    if case.promises.derivative:
        yield Finding.below(error, 2e-5, "relative error of the gradient")
        return
    text = f"declared to have other gradients than the derivatives, which differ by {largest(error):.2g}"
    yield Finding(largest(error) >= 2e-5, text)


@CHECKS.asks()
def kernels_see_the_same_functions(case: BasisCase) -> Iterator[Finding]:
    """What transfers read through the handle is what `evaluate` returns, for any number of particles."""
    x, m = case.points(n=40), np.arange(1.0, 41.0)
    basis = case.plugin.build(case.box, len(x), case.moved)
    errors = []
    for _ in range(2):  # the second time stored functions are refreshed, not found anew
        basis.locate(x)
        m_i = np.zeros(len(basis.nodes))
        p2g_mass(basis.handle, x, m, m_i)
        errors.append(m_i - m @ basis.evaluate(x).matrix(len(basis.nodes)))
    yield Finding.below(np.array(errors), 1e-8, "difference between handle and evaluate")


@CHECKS.asks()
def kronecker(case: BasisCase) -> Iterator[Finding]:
    """``phi_i(x_j) = delta_ij`` everywhere, or only that interior functions vanish on the hull, or neither."""
    basis, promise = case.build(), case.promises.kronecker
    n = len(basis.nodes)
    inside = np.all((basis.nodes > 1e-9) & (basis.nodes < case.upper - 1e-9), axis=1)
    values = basis.evaluate(basis.nodes[inside]).matrix(n)[:, inside]
    error = largest(values - np.eye(len(values)))
    claim = "interpolation at the nodes"
    yield Finding.as_declared(error < 1e-9, promise == "everywhere", claim, f"{error:.2g}")
    x = case.points(n=20)
    x[:, 0] = 0.0
    off_face = basis.nodes[:, 0] > 1e-9
    seen = largest(basis.evaluate(x).matrix(n)[:, off_face])
    claim = "that interior functions vanish on faces"
    yield Finding.as_declared(seen < 1e-6, promise != "none", claim, f"{seen:.2g}")


@CHECKS.asks()
def gradient_jumps(case: BasisCase) -> Iterator[Finding]:
    """Across all cell faces met on a line through the box, the gradient jumps or does not."""
    basis, upper = case.build(), case.upper
    line = np.tile(0.37 * upper, (4001, 1))
    line[:, 0] = np.linspace(0.02, 0.98, 4001) * upper[0]
    gradient = basis.evaluate(line).gradient_matrix(len(basis.nodes))
    jump = largest(np.diff(gradient, axis=0)) / largest(gradient)
    promise, measured = case.promises.continuous_gradient, f"relative jump {jump:.2g}"
    yield Finding.as_declared(jump < 0.05, promise, "continuity of the gradient", measured)


@CHECKS.asks()
def outside_is_noticed(case: BasisCase) -> Iterator[Finding]:
    """A point outside the nodes, or nowhere, is reported, unless functions exist there and nodes move."""
    basis, upper = case.build(), case.upper
    beyond = np.vstack([0.5 * upper, 1.5 * upper])
    noticed = basis.first_outside(beyond) == 1
    try:
        basis.evaluate(beyond)
        exists = True
    except SolverFailure:
        exists, noticed = False, True
    extrapolates = case.promises.extrapolates
    yield Finding.as_declared(exists, extrapolates, "evaluation outside the nodes", "at 1.5 x")
    claim = "a particle outside goes unnoticed"
    yield Finding.as_declared(not noticed, extrapolates and case.moved, claim, "at 1.5 x")
    found = basis.first_outside(np.vstack([0.5 * upper, np.full(case.dimension, np.nan)]))
    yield Finding(found == 1, f"first_outside says {found} where particle 1 is not a number")


@CHECKS.asks()
def nodes_follow(case: BasisCase) -> Iterator[Finding]:
    """A stretch along the axes with a shift moves the nodes exactly, and all that follows; or it is refused."""
    if not case.promises.moves:
        yield moving_is_refused(case)
        return
    if not case.moved:
        yield Finding(True, "nodes at rest")
        return
    basis = case.build()
    start = basis.nodes.copy()
    displacement = 0.03 + start * np.linspace(0.1, 0.2, case.dimension)
    basis.move(displacement)
    error = largest(basis.nodes - start - displacement)
    text = f"nodes follow a stretch along the axes with an error of {error:.2g} m"
    yield Finding(error < 1e-13, text)


def moving_is_refused(case: BasisCase) -> Finding:
    """A basis whose nodes stay says so when it is built to move or, at the latest, when it is moved."""
    try:
        basis = case.plugin.build(case.box, 1, True)
        basis.move(np.zeros_like(basis.nodes))
    except NotApplicable as refusal:
        return Finding(True, f"refused: {refusal}")
    return Finding(False, "nodes move, and it is declared that they cannot")
