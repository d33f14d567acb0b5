"""What a geometry says about its nodes."""

import numpy as np
import pytest

from mpmbench.core.errors import BadSetting
from mpmbench.core.geometry import Box, Cloud
from mpmbench.core.geometry.triangulate import seed_triangles
from tests.core.test_maxent import jittered


def test_spacing_of_nodes() -> None:
    assert Box((0.0, 0.0), (1.0, 2.0), (4, 10)).nodal_spacing == 0.25
    assert jittered(2, 0.3).nodal_spacing == pytest.approx(1.0 / 8.0)
    assert jittered(1, 0.3).nodal_spacing == pytest.approx(1.0 / 12.0)
    simplices = np.array([[0, 1, 3], [0, 3, 2]])
    unit = np.array([[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0]])
    assert Cloud(unit, simplices).nodal_spacing == pytest.approx(1.0)
    for flat in ([[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]], np.tile(np.arange(5.0)[:, None], (1, 2))):
        with pytest.raises(BadSetting, match="volume"):
            _ = Cloud(np.array(flat)).nodal_spacing


@pytest.mark.parametrize("points", (0, 2, 4))
def test_a_triangle_has_one_point_or_three(points: int) -> None:
    with pytest.raises(BadSetting, match=f"particles_per_cell = {points}: 1 or 3"):
        seed_triangles(np.eye(3, 2), np.array([[0, 1, 2]]), points)


def test_boxes_and_clouds_name_their_nodes_alike() -> None:
    box = Box((0.0, 1.0), (1.0, 2.0), (2, 1))
    corners = [[0.0, 1.0], [0.0, 2.0], [0.5, 1.0], [0.5, 2.0], [1.0, 1.0], [1.0, 2.0]]
    assert np.array_equal(box.points, corners)
    assert np.array_equal(Cloud(box.points).points, corners)
    with pytest.raises(ValueError, match="read-only"):
        box.points[0] = 7.0
    moved = box.nodes()  # as plug-ins of version 0.1 ask for them: theirs to change
    moved += 1.0
    assert np.array_equal(box.points, corners)
