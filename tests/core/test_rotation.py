"""A body that has been turned as a whole does the same, turned: in time stepping, with every objective material."""

import numpy as np
import pytest

from mpmbench.core import registry
from mpmbench.core.geometry import Box, Cloud
from mpmbench.core.geometry.triangulate import jittered, triangulation
from mpmbench.core.loops.explicit import Explicit
from mpmbench.core.particles import Particles
from mpmbench.core.simulation import Body, Solution, build_state, simulate

ANGLE = 2.0  # [rad], of the body before it starts
SPIN, STEPS = 1.5, 200  # [rad] and steps of the motion, which turns the body much further


def run(name: str, Q: np.ndarray) -> tuple[Particles, Solution]:
    """A block on triangles that has been turned by Q since its reference, spins and is sheared."""
    law = registry.get("material", name)()
    lame, shear = law.lame_parameters()
    end = 3.0 * np.sqrt(law.density / (lame + 2.0 * shear))  # three passages of a wave
    nodes = Box((0.0, 0.0), (1.0, 1.0), (4, 4)).points
    nodes = jittered(nodes, 0.25, 0.2, (nodes < 1e-9) | (nodes > 1.0 - 1e-9), 5)
    simplices = triangulation(nodes, 1.0)
    corners = nodes[simplices]
    edges = corners[:, 1:] - corners[:, :1]
    X, V0 = corners.mean(axis=1), 0.5 * np.abs(np.linalg.det(edges))

    def velocity(x: np.ndarray) -> np.ndarray:
        from_middle = x @ Q - 0.5
        shear = 0.05 * np.sin(3.0 * from_middle[:, ::-1])
        spin = SPIN * np.stack([-from_middle[:, 1], from_middle[:, 0]], axis=1)
        return (spin + shear) @ Q.T / end

    history, rate = law.history, law.rate_dependent
    p = Particles.at_rest(X @ Q.T, V0, law.density, None, history, rate)
    p.v[:], p.F[:] = velocity(p.X), Q
    cloud = Cloud(nodes @ Q.T, simplices)
    body = Body(cloud, p, lambda x: np.zeros(x.shape, dtype=bool), velocity)
    choices = Explicit(nodes="moving", transfer="nodal")
    state = build_state(body, registry.get("basis", "linear")(), law, choices)
    solution = simulate(state, end / STEPS, end)
    assert solution.status == "ok", solution.reason
    return p, solution


@pytest.mark.parametrize(
    "name",
    [
        name if name == "neo_hookean" else pytest.param(name, marks=pytest.mark.slow)
        for name in registry.names("material")
        if registry.get("material", name).symmetric
    ],
)
def test_turned_bodies_do_the_same(name: str) -> None:
    c, s = np.cos(ANGLE), np.sin(ANGLE)
    Q = np.array([[c, -s], [s, c]])
    (one, history), (other, turned) = run(name, np.eye(2)), run(name, Q)
    errors = {
        "positions": np.abs(other.x - one.x @ Q.T).max(),
        "velocities": np.abs(other.v - one.v @ Q.T).max() / np.abs(one.v).max(),
        "deformations": np.abs(other.F - Q @ one.F).max(),
        "stresses": np.abs(other.sigma - Q @ one.sigma @ Q.T).max() / np.abs(one.sigma).max(),
    }
    for key in ("kinetic_energy", "strain_energy"):
        before, after = (np.array(some.history[key]) for some in (history, turned))
        errors[key] = np.abs(after - before).max() / before.max()
    turn = np.arctan2(one.F[:, 1, 0] - one.F[:, 0, 1], np.trace(one.F, axis1=1, axis2=2))
    assert np.median(np.abs(turn)) > 0.5  # [rad]
    assert max(errors.values()) < 1e-8, errors
