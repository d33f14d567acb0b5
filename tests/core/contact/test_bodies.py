"""Several bodies: whose particles, nodes and numbers are, their materials, and that none lies in another."""

from dataclasses import replace

import numpy as np
import pytest

from mpmbench import case
from mpmbench.core.bodies import Part, audit, inertia, overlap
from mpmbench.core.errors import BadSetting
from mpmbench.core.geometry import Cloud
from mpmbench.core.geometry.surface import facet_normals, surface_of
from mpmbench.core.geometry.triangulate import ring_mesh
from mpmbench.core.loops.explicit import Update, carry
from mpmbench.core.registry import get
from tests.core.contact.checks import SMALL
from tests.core.support import compose, run


def test_bodies_add_up_to_the_whole() -> None:
    result = run("two_squares", "mpm", "linear", **SMALL)
    for name in ("momentum", "angular_momentum", "kinetic_energy", "strain_energy"):
        total, parts = result[name].values, result[f"body_{name}"].values.sum(axis=1)
        assert np.allclose(parts, total, rtol=1e-12, atol=1e-12 * np.abs(total).max())
    assert result.body.values.tolist() == [1] * 32 + [2] * 32
    speeds = [float(result[f"velocity_{b}"]) for b in (1, 2)]
    assert sum(speeds) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize(("method", "on_nodes"), (("otm", True), ("unified", False)))
def test_kinetic_energy_is_that_of_what_keeps_velocities(method: str, on_nodes: bool) -> None:
    """A pattern of the nodes that functions smooth is there, in the whole and in its body."""
    chosen = {"method__mass": "lumped"} | SMALL
    s = case.build(case.read(compose("two_squares", method, "lme", **chosen)))
    n, p, first = s.nodes, s.particles, s.bodies.node == 0
    n.v[first] += 0.1 * (-1.0) ** np.arange(first.sum())[:, None]
    s.basis.locate(p.x)
    carry(s, 0.0, Update(True, False, False, False, 0.0))
    smooth = 0.5 * float(p.m @ np.sum(p.v**2, axis=1))
    moved = s.movers
    found = 0.5 * float(moved.m @ np.sum(moved.v**2, axis=1))
    each = audit(s, moved.v)
    assert each["body_kinetic_energy"].sum() == pytest.approx(found)
    vibrates = each["body_vibration_energy"]
    assert vibrates[0] > 0.0
    if on_nodes:
        assert vibrates[1] == pytest.approx(0.0, abs=1e-9)
        assert moved.m.sum() == pytest.approx(p.m.sum()) and found > 1.003 * smooth
        assert vibrates[0] == pytest.approx(0.5 * n.m[first].sum() * 0.02, rel=0.02)
    else:
        assert found == pytest.approx(smooth)
    assert moved.a is (n.a if on_nodes else p.a)


def test_vibration_is_what_rigid_motion_leaves() -> None:
    rng = np.random.default_rng(0)
    for dim in (2, 3):
        x, m = rng.standard_normal((20, dim)), rng.uniform(1.0, 2.0, 20)
        spin = rng.standard_normal((dim, dim))
        rigid = x @ (spin - spin.T) + rng.standard_normal(dim)
        assert inertia(m, x, rigid)[2] < 1e-25
        other = rigid + 0.1 * rng.standard_normal(x.shape)
        least = inertia(m, x, other)[2]
        assert 0.0 < least <= 0.5 * float(m @ np.sum((other - rigid) ** 2, axis=1))


def test_normals_of_a_surface_point_outwards_whichever_way_it_runs() -> None:
    nodes, triangles = ring_mesh(2.0, 6)
    surface = surface_of(Cloud(nodes, triangles, spacing=1.0))
    corners = nodes[surface.row][surface.facet]
    normal, size = facet_normals(corners)
    middle = corners.mean(axis=1)
    assert np.allclose(normal, middle / np.linalg.norm(middle, axis=1)[:, None], atol=1e-12)
    chord = 2.0 * 36 * 2.0 * np.sin(np.pi / 36)
    assert [size.sum(), surface.area.sum()] == pytest.approx([chord, chord])


def test_overlap_is_refused_with_names_and_depth() -> None:
    settings = case.read(compose("two_squares", "mpm", "linear")).problem.bodies(4, 1)
    first, second = settings
    assert overlap(settings) is None
    touching = replace(second, mesh=moved(second, -0.375), X=second.X - [0.375, 0.0])
    assert overlap((first, touching)) is None
    deep = replace(second, mesh=moved(second, -0.4), X=second.X - [0.4, 0.0])
    one, other, depth = overlap((first, deep)) or ("", "", 0.0)
    assert {one, other} == {"moving", "resting"} and depth == pytest.approx(0.025)
    config = compose("colliding_disks", "mpm", "linear", problem__radius=0.29)
    assert case.read(config).problem.radius == 0.29
    with pytest.raises(BadSetting, match=r"upper and lower.*overlap by 0\.02"):
        big = {"problem__radius": 0.299, "problem__centre": 0.3}
        case.read(compose("colliding_disks", "mpm", "linear", **big))


def moved(part: Part, shift: float) -> Cloud:
    return replace(part.mesh, nodes=part.mesh.nodes + np.array([shift, 0.0]))


def test_each_body_has_its_own_material() -> None:
    law = get("material", "neo_hookean")
    soft, hard = (law(young_modulus=E, poisson_ratio=0.3, density=1.0) for E in (1e3, 1e5))
    state = case.build(case.read(compose("two_squares", "mpm", "linear", **SMALL)))
    p = state.particles
    p.F[: p.material.stop] *= 1.01
    state.basis.locate(p.x)
    for materials, ratio in (((soft, soft), 1.0), ((soft, hard), 100.0)):
        state.bodies = replace(state.bodies, materials=materials)
        carry(state, 0.0, Update(False, True, False, False, 1.0))
        pressed = np.trace(p.sigma, axis1=1, axis2=2)
        assert np.allclose(pressed[32:64], ratio * pressed[:32])
        assert pressed[0] == pytest.approx(
            2.0 * (soft.lame_parameters()[0] * 2.0 * np.log(1.01) / 1.01**2)
            + 2.0 * soft.lame_parameters()[1] * (1.0 - 1.01**-2)
        )
