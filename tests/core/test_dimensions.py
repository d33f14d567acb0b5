"""A bar whose sides are held by rollers is the same in one, two and three dimensions."""

from typing import Any

import numpy as np
import pytest

from mpmbench.core import registry
from mpmbench.core.geometry import Box
from mpmbench.core.loops.explicit import Explicit
from mpmbench.core.particles import Particles, seed_cells
from mpmbench.core.simulation import Body, simulate
from mpmbench.core.simulation import build_state as built
from tests.support import slow_if

H = 0.25  # cell size [m]
CELLS, AROUND = 3, 2  # of the bar along its axis, and empty ones behind it


def bar(dim: int, choices: Explicit) -> dict[str, Any]:
    """Fields along one row of particles, and energies per cross-section, of a bar that vibrates freely at one end."""
    length = CELLS if choices.moving else CELLS + AROUND
    body = Box((0.0,) * dim, (CELLS * H, *(H,) * (dim - 1)), (CELLS, *(1,) * (dim - 1)))
    nodes = Box((0.0,) * dim, (length * H, *(H,) * (dim - 1)), (length, *(1,) * (dim - 1)))
    law = registry.get("material", "neo_hookean")(
        young_modulus=1e4, poisson_ratio=0.3, density=10.0
    )
    X, V0 = seed_cells(body, 3**dim)
    p = Particles.at_rest(X, V0, law.density)

    def velocity(x: np.ndarray) -> np.ndarray:
        along = np.zeros_like(x)
        along[:, 0] = 3.0 * np.sin(2.0 * x[:, 0])
        return along

    def rollers(x: np.ndarray) -> np.ndarray:
        held = np.ones(x.shape, dtype=bool)
        held[:, 0] = x[:, 0] < 1e-9
        return held

    p.v[:] = velocity(X)
    state = built(
        Body(nodes, p, rollers, velocity), registry.get("basis", "linear")(), law, choices
    )
    solution = simulate(state, 5e-4, 0.02)
    assert solution.status == "ok", solution.reason
    p = state.particles
    row = np.flatnonzero(np.all(np.abs(X[:, 1:] - 0.5 * H) < 1e-9, axis=1))
    row = row[np.argsort(X[row, 0])]
    area = H ** (dim - 1)
    return {
        "position": p.x[row, 0],
        "velocity": p.v[row, 0],
        "stretch": p.F[row, 0, 0],
        "stress": p.sigma[row, 0, 0],
        "kinetic": np.array(solution.history["kinetic_energy"]) / area,
        "stored": np.array(solution.history["strain_energy"]) / area,
    }


@pytest.mark.parametrize(  # a consistent mass is compiled anew for each dimension
    "mass", ("lumped", slow_if(True, "consistent"))
)
@pytest.mark.parametrize("nodes", ("fixed", "moving"))
def test_one_bar_in_all_dimensions(nodes: str, mass: str) -> None:
    choices = Explicit(nodes=nodes, mass=mass)
    line = bar(1, choices)
    assert np.abs(line["stress"]).max() > 100.0 and np.ptp(line["stretch"]) > 0.01
    for dim in (2, 3):
        for name, values in bar(dim, choices).items():
            scale = np.abs(line[name]).max()
            assert np.allclose(values, line[name], rtol=0.0, atol=1e-10 * scale), (dim, name)
