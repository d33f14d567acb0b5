"""Bodies whose size is a key: what follows from it, and that twice the size is the same problem."""

import numpy as np
import pytest

from mpmbench.core import registry
from mpmbench.core.choices import Choices
from mpmbench.core.errors import BadSetting
from mpmbench.core.geometry import divided
from tests.core.support import run


def test_square_cells_fill_a_rectangle() -> None:
    assert divided(4.0, 2.0, 6).cells == (6, 3)
    assert divided(0.3, 0.1, 9).cells == (9, 3)
    assert divided(2.0, 5.0, 4).cells == (4, 10)
    with pytest.raises(BadSetting, match=r"multiple of 8 .whole cells over a height of 1 m"):
        divided(8.0, 1.0, 12)
    with pytest.raises(BadSetting, match=r"simple fraction of the length, not 2.71828"):
        divided(1.0, np.e, 12)


@pytest.mark.parametrize(
    ("name", "along"),
    (
        ("soil_column", "width"),
        ("dam_break", "width"),
        ("friction_slope", "length"),
        ("cantilever_dynamic", "length"),
        ("cantilever_self_weight", "length"),
    ),
)
def test_nodes_and_particles_follow_the_size(name: str, along: str) -> None:
    problem = registry.get("problem", name)(**{along: 3.0, "height": 1.5})
    X, V = problem.seed(8, 4)
    assert V.sum() == pytest.approx(4.5) and problem.reference_length == 3.0
    assert X.max(axis=0) == pytest.approx([3.0, 1.5], rel=0.1)
    grid = problem.nodes(8, Choices()).points
    assert (grid.min(axis=0) <= 0.0).all() and (grid.max(axis=0) >= [3.0, 1.5]).all()


def test_half_a_beam_under_twice_its_weight_bends_half_as_far() -> None:
    """Strains are the same when gravity times length is."""
    whole = run("cantilever_self_weight", "implicit_mpm", "linear", resolution=8)
    size = {"problem__length": 4.0, "problem__height": 0.5, "problem__gravity": 2.0 * 9.81}
    half = run("cantilever_self_weight", "implicit_mpm", "linear", resolution=8, **size)
    assert float(half.tip_deflection) == pytest.approx(0.5 * float(whole.tip_deflection), rel=1e-9)
    assert "error_tip" in whole and "error_tip" not in half
