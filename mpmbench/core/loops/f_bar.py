"""F-bar in the explicit loop: one change of volume for all particles around a node, against volumetric locking.

Formulas are those of `implicit.f_bar`; what differs is who shares. Functions on moving nodes, of
tetrahedra and of clouds, come with more particles than nodes, and so with more conditions on volume
than a body has motions left. The particles that share a change of volume and a pressure here are those
that had the same node of their body nearest at the start: one condition for each node, as with the
average nodal pressures of Bonet and Burton (1998). The increment of a step is replaced by

    DF-bar_p = (J-bar / J_p)^(1/dim) (I + dt L_p),    J-bar = sum_p V_p J_p / sum_p V_p,

and the pressure by its mean by volume, so that forces do the work that is stored.
"""

from typing import Any, NamedTuple

import numpy as np

from mpmbench.core.compiled import threads
from mpmbench.core.geometry import search_tree
from mpmbench.core.state import State
from mpmbench.core.transfer.carry import strain_by, velocity_gradients
from mpmbench.core.transfer.sharing import Cells, cells_of, share_change, share_pressure


class Around(NamedTuple):
    """The particles around each node that has any, and the velocity gradients [1/s] of all, shape (P, dim, dim)."""

    cells: Cells
    L: np.ndarray


def around_nodes(s: State) -> Around:
    """Particles by the node of their body that is nearest at the start; tracers belong to none."""
    solid = s.particles.material.stop
    nearest = np.zeros(solid, dtype=np.int64)
    for b in range(s.bodies.count):
        own = np.flatnonzero(s.bodies.node == b) if len(s.bodies.node) else slice(None)
        number, rows = np.arange(len(s.initial_nodes))[own], s.bodies.particles(b)
        found = search_tree(s.initial_nodes[own]).query(s.particles.X[rows])[1]
        nearest[rows] = number[found]
    return Around(cells_of(nearest, np.arange(solid)), np.zeros_like(s.particles.F[:solid]))


def strain_together(s: State, dt: float) -> None:
    """Strain all particles by nodal velocities, those around a node with one change of volume and one pressure."""
    if s.around is None:
        s.around = around_nodes(s)
    p, phi, v = s.particles.arrays, s.basis.handle, s.nodes.v
    (cells, L), solid = s.around, s.particles.material.stop
    count = len(cells.first) - 1
    threads.run(lambda _, *part: velocity_gradients(phi, p.x, v, L, *part), solid)
    threads.run(lambda _, *part: share_change(s.axes, cells, p.V, dt, L, *part), count)
    for material, first, last in s.bodies.laws:
        law: Any = material.law

        def part(_: int, start: int, stop: int, law: Any = law, first: int = first) -> None:
            strain_by(s.axes, law, p, L, dt, first + start, first + stop)

        threads.run(part, last - first)
    threads.run(lambda _, *part: share_pressure(s.axes, cells, p.V, p.sigma, *part), count)
