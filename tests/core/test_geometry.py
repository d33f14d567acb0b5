"""What a geometry says about its nodes."""

import numpy as np
import pytest

from mpmbench.core.errors import BadSetting
from mpmbench.core.geometry import Box, Cloud
from mpmbench.core.geometry.inside import inside_surface
from mpmbench.core.geometry.surface import inside_mesh, surface_of
from mpmbench.core.geometry.triangulate import annulus, extruded, seed_triangles
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


@pytest.mark.parametrize("dimension", (2, 3))
def test_what_is_inside_a_surface_is_in_one_of_its_simplices(dimension: int) -> None:
    """Of a tube, which is not convex, its nodes moved off every plane that they share."""
    rng = np.random.default_rng(4)
    mesh = Cloud(*annulus(1.0, 2.0, 2))
    if dimension == 3:
        mesh = extruded(mesh, np.linspace(-1.0, 1.0, 4))
    mesh = Cloud(mesh.nodes + 0.05 * rng.standard_normal(mesh.nodes.shape), mesh.simplices)
    surface = surface_of(mesh)
    corners = mesh.nodes[surface.row][surface.facet]
    points = rng.uniform(-2.2, 2.2, (600, dimension))
    found = inside_surface(points, corners)
    assert np.array_equal(found, inside_mesh(points, mesh)) and 100 < found.sum() < 400
    mixed = corners[rng.permutation(len(corners))][:, ::-1]
    assert np.array_equal(inside_surface(points, mixed), found)
    assert not inside_surface(np.full((1, dimension), np.nan), corners).any()


def test_rays_through_edges_and_corners_count_once() -> None:
    """Of a cube in prisms: rays from points over its nodes, edges and along its sides."""
    nodes = np.array([[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0], [0.5, 0.5]])
    triangles = np.array([[0, 1, 4], [1, 3, 4], [3, 2, 4], [2, 0, 4]])
    cube = extruded(Cloud(nodes, triangles), np.linspace(0.0, 1.0, 3))
    surface = surface_of(cube)
    corners = cube.nodes[surface.row][surface.facet]
    for height in (-0.1, 0.25, 0.6, 1.1):
        for y in (0.0, 0.25, 0.5, 1.0):
            for z in (0.0, 0.25, 0.5, 1.0):
                wanted = 0.0 < height < 1.0 and y < 1.0 and z < 1.0  # lower ends are taken in
                point = np.array([[height, y, z]])
                assert inside_surface(point, corners).tolist() == [wanted], point
