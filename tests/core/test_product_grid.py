"""A grid basis is one function along an axis: uniform GIMP as a plug-in of at most 45 lines."""

from pathlib import Path

import numpy as np
import pytest

from mpmbench import case
from mpmbench.case.build import build
from mpmbench.core import registry
from mpmbench.core.errors import NotApplicable
from mpmbench.core.geometry import Box
from mpmbench.core.matrix import mass
from tests.core.support import compose

FILE = Path(__file__).parents[1] / "plugins/bases/averaged_hat.py"
BAR = {"problem": "bar_fixed_ends", "method": "mpm", "particles_per_cell": 4, "time_step": 1e-6}


@pytest.fixture(autouse=True)
def averaged_hat(monkeypatch) -> None:
    monkeypatch.setenv("MPMBENCH_PLUGINS", str(FILE.parent))
    registry.load_file(FILE)


def error(basis: str, resolution: int, **more: object) -> float:
    config = compose(**(BAR | {"basis": basis, "resolution": resolution} | more))
    result = case.solve(config)
    assert result.status == "ok", result.reason
    return float(result.error_displacement_rms)


def test_the_plugin_is_short() -> None:
    assert len(FILE.read_text().splitlines()) <= 45


@pytest.mark.parametrize("particles_per_cell", [2, 4])
def test_it_learns_the_size_of_the_particles(particles_per_cell: int) -> None:
    config = compose(**(BAR | {"basis": "averaged_hat", "resolution": 8}))
    state = build(case.read(config | {"particles_per_cell": particles_per_cell}))
    assert state.basis.handle.half == pytest.approx(0.5 / particles_per_cell)


def test_it_is_the_average_of_hats_over_a_particle() -> None:
    """Where particles do not reach beyond the ends: there kinks have no other side."""
    box = Box((0.0,), (1.0,), (5,))
    basis = registry.get("basis", "averaged_hat")().build(box, 1, False)
    size = 2.0 * basis.handle.half[0] * box.spacing[0]
    x = np.random.default_rng(0).uniform(0.5 * size, 1.0 - 0.5 * size, (40, 1))
    within = (np.arange(20000) + 0.5) / 20000 - 0.5
    hats = [np.interp(x + size * within, box.points[:, 0], hat) for hat in np.eye(6)]
    average = np.stack(hats, axis=-1).mean(axis=1)
    assert np.abs(basis.evaluate(x).matrix(6) - average).max() < 1e-8


def test_it_is_the_basis_of_that_name() -> None:
    box = Box((0.0,), (1.0,), (5,))
    x = np.random.default_rng(1).random((40, 1))
    own, built_in = (
        registry.get("basis", name)().build(box, len(x), False).evaluate(x)
        for name in ("averaged_hat", "gimp")
    )
    assert np.abs(own.matrix(6) - built_in.matrix(6)).max() < 1e-15
    assert np.abs(own.gradient_matrix(6) - built_in.gradient_matrix(6)).max() < 1e-14


@pytest.mark.slow  # tests/core/matrix/test_light.py has two handles
def test_a_handle_of_its_own_works_with_a_sparse_consistent_mass(monkeypatch) -> None:
    """Mass matrices used to know the splines' handle and took any other for stored values."""
    monkeypatch.setattr(mass, "WIDEST_BAND", 0)
    lumped, consistent = (error("gimp", 8, method__mass=kind) for kind in ("lumped", "consistent"))
    assert consistent < lumped


def test_its_nodes_stay() -> None:
    with pytest.raises(NotApplicable, match="cannot move"):
        case.read(
            compose(**(BAR | {"basis": "averaged_hat", "resolution": 8, "method__nodes": "moving"}))
        )
