"""The invariants of every registered basis, in every dimension it claims: each promise tested in both directions."""

import numpy as np
import pytest

from mpmbench.core import registry
from mpmbench.core.bases import Basis, BasisSettings
from mpmbench.core.errors import SolverFailure
from mpmbench.core.geometry import Box

BASES = registry.names("basis")
UPPER, CELLS = (1.2, 1.0, 0.8), (6, 5, 4)
# where the default is a special case (MLS with this radius is the linear basis in 1D), the general one
GENERAL: dict[str, dict] = {"mls": {"relative_radius": 2.3}}
SETTINGS: list[tuple[str, dict]] = [(name, GENERAL.get(name, {})) for name in BASES]
SETTINGS += [("bspline", {"degree": 1}), ("bspline", {"degree": 3})]
SETTINGS += [("maxent", {"prior": prior}) for prior in ("quartic_spline", "gaussian")]
CASES = [
    pytest.param(name, settings, dim, moving, id=f"{name}{settings or ''}-{dim}D-{'moved' if moving else 'fixed'}")
    for name, settings in SETTINGS
    for dim in registry.get("basis", name).promises.dimensions
    for moving in (False, True)
]


def make(name: str, settings: dict, dim: int, moving: bool) -> tuple[BasisSettings, Basis, np.ndarray]:
    """A basis on a box (its nodes displaced when `moving`), and the corners of the box after that."""
    plugin = registry.get("basis", name)(**settings)
    box = Box((0.0,) * dim, UPPER[:dim], CELLS[:dim])
    basis = plugin.build(box, 1, moving)
    if moving:
        length = np.array(UPPER[:dim])
        # zero on the faces, different along each axis, and (for knots that are lines) a function of its own axis
        basis.move(0.012 * np.sin(2.0 * np.pi * basis.nodes / length) * np.arange(1, dim + 1))
    return plugin, basis, np.array(UPPER[:dim])


def sample(upper: np.ndarray, margin: float = 0.0, n: int = 150) -> np.ndarray:
    """Points in the box, some of them close to its faces."""
    rng = np.random.default_rng(3)
    points = rng.random((n, len(upper)))
    points[: n // 3] = np.where(rng.random((n // 3, len(upper))) < 0.5, 0.02 * points[: n // 3], points[: n // 3])
    return (margin + (1.0 - 2.0 * margin) * points) * upper


@pytest.mark.parametrize(("name", "settings", "dim", "moving"), CASES)
class TestInvariants:
    def test_partition_of_unity(self, name: str, settings: dict, dim: int, moving: bool) -> None:
        plugin, basis, upper = make(name, settings, dim, moving)
        stored = basis.evaluate(sample(upper))
        error = np.abs(stored.matrix(len(basis.nodes)).sum(axis=1) - 1.0).max()
        gradient = np.abs(stored.gradient_matrix(len(basis.nodes)).sum(axis=1)).max()
        assert (error < 1e-12) == plugin.promises.partition_of_unity
        assert (gradient < 1e-8) == plugin.promises.partition_of_unity

    def test_linear_completeness(self, name: str, settings: dict, dim: int, moving: bool) -> None:
        plugin, basis, upper = make(name, settings, dim, moving)
        x = sample(upper)
        stored = basis.evaluate(x)
        error = np.abs(stored.matrix(len(basis.nodes)) @ basis.nodes - x).max()
        identity = np.einsum("pia,ib->pab", stored.gradient_matrix(len(basis.nodes)), basis.nodes)
        assert (error < 1e-11) == plugin.promises.linear_completeness
        assert (np.abs(identity - np.eye(dim)).max() < 1e-7) == plugin.promises.linear_completeness

    def test_sign(self, name: str, settings: dict, dim: int, moving: bool) -> None:
        plugin, basis, upper = make(name, settings, dim, moving)
        lowest = basis.evaluate(sample(upper, n=400)).matrix(len(basis.nodes)).min()
        assert (lowest >= -1e-14) == plugin.promises.non_negative

    def test_gradient_is_the_derivative(self, name: str, settings: dict, dim: int, moving: bool) -> None:
        """Central differences, in the home cell, outside it and close to the boundary."""
        _, basis, upper = make(name, settings, dim, moving)
        x, step = sample(upper, margin=1e-3, n=60), 1e-6
        gradient = basis.evaluate(x).gradient_matrix(len(basis.nodes))
        for d in range(dim):
            shift = step * np.eye(dim)[d]
            ahead = basis.evaluate(x + shift).matrix(len(basis.nodes))
            behind = basis.evaluate(x - shift).matrix(len(basis.nodes))
            difference = (ahead - behind) / (2.0 * step)
            assert np.abs(gradient[:, :, d] - difference).max() < 2e-5 * max(1.0, np.abs(difference).max())

    def test_kernels_see_the_same_functions(self, name: str, settings: dict, dim: int, moving: bool) -> None:
        """What transfers read through the handle is what `evaluate` returns, for any number of particles."""
        from mpmbench.core.transfer import p2g_mass

        plugin = registry.get("basis", name)(**settings)
        x = sample(np.array(UPPER[:dim]), n=40)
        basis = plugin.build(Box((0.0,) * dim, UPPER[:dim], CELLS[:dim]), len(x), moving)
        for _ in range(2):  # the second time stored functions are refreshed, not found anew
            basis.locate(x)
            m_i = np.zeros(len(basis.nodes))
            p2g_mass(basis.handle, x, np.arange(1.0, 41.0), m_i)
            assert np.allclose(m_i, np.arange(1.0, 41.0) @ basis.evaluate(x).matrix(len(basis.nodes)), atol=1e-9)

    def test_kronecker(self, name: str, settings: dict, dim: int, moving: bool) -> None:
        plugin, basis, upper = make(name, settings, dim, moving)
        inside = np.all((basis.nodes > 1e-9) & (basis.nodes < upper - 1e-9), axis=1)
        values = basis.evaluate(basis.nodes[inside]).matrix(len(basis.nodes))[:, inside]
        everywhere = bool(np.abs(values - np.eye(len(values))).max() < 1e-9)
        # on a face, functions of nodes that are not on it vanish
        x = sample(upper, n=20)
        x[:, 0] = 0.0
        off_face = basis.nodes[:, 0] > 1e-9
        hull = bool(np.abs(basis.evaluate(x).matrix(len(basis.nodes))[:, off_face]).max() < 1e-6)
        linear_splines = name == "bspline" and settings.get("degree") == 1
        expected = "everywhere" if linear_splines and dim == 1 else plugin.promises.kronecker
        if not linear_splines:
            assert everywhere == (expected == "everywhere")
        assert hull == (expected in ("everywhere", "hull"))

    def test_gradient_jumps(self, name: str, settings: dict, dim: int, moving: bool) -> None:
        """Across all cell faces met on a line through the box, the gradient jumps or does not."""
        plugin, basis, upper = make(name, settings, dim, moving)
        line = np.tile(0.37 * upper, (4001, 1))
        line[:, 0] = np.linspace(0.02, 0.98, 4001) * upper[0]
        gradient = basis.evaluate(line).gradient_matrix(len(basis.nodes))
        jump = np.abs(np.diff(gradient, axis=0)).max() / np.abs(gradient).max()
        if settings.get("degree") != 1:
            assert (jump < 0.05) == plugin.promises.continuous_gradient, jump

    def test_outside_is_noticed(self, name: str, settings: dict, dim: int, moving: bool) -> None:
        plugin, basis, upper = make(name, settings, dim, moving)
        beyond = np.vstack([0.5 * upper, 1.5 * upper])
        try:
            basis.evaluate(beyond)
            noticed = basis.first_outside(beyond) == 1  # bases that extrapolate leave it to the guard
        except SolverFailure:
            noticed = True
        assert noticed != plugin.promises.extrapolates
        lost = np.vstack([0.5 * upper, np.full(dim, np.nan)])
        assert basis.first_outside(lost) == 1


def test_greville_points_interpolate_linear_functions_only_there() -> None:
    """The nodes of a quadratic spline are its Greville abscissae: moving them anywhere else breaks completeness."""
    _, basis, upper = make("bspline", {}, 1, False)
    x = sample(upper)
    values = basis.evaluate(x).matrix(len(basis.nodes))
    equidistant = np.linspace(0.0, 1.0, len(basis.nodes))[:, None]
    assert np.abs(values @ equidistant - x).max() > 1e-3


def test_knots_that_cross_end_the_run() -> None:
    _, basis, _ = make("bspline", {}, 1, True)
    with pytest.raises(SolverFailure, match="crossed"):
        basis.move(-1.5 * basis.nodes)
