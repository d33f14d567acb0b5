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

from mpmbench.core.compiled import inlined, lean, matrix, table, threads
from mpmbench.core.compiled.algebra import determinant, squared
from mpmbench.core.compiled.rows import BATCH, take
from mpmbench.core.geometry import search_tree
from mpmbench.core.particles import Cells
from mpmbench.core.state import State
from mpmbench.core.transfer.carry import strain, velocity_gradients


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
    member = np.argsort(nearest, kind="stable")
    counts = np.unique(nearest, return_counts=True)[1]
    first = np.concatenate([[0], np.cumsum(counts)])
    return Around(Cells(first, member), np.zeros((solid, len(s.axes), len(s.axes))))


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


@lean
def share_change(axes, cells, V, dt, L, start, stop):
    """Change L in cells start to stop: ``det(I + dt L)`` is that of all particles of a cell together."""
    dim, increment = len(axes), matrix(axes, axes)
    for c in range(start, stop):
        before, after = 0.0, 0.0
        for m in range(cells.first[c], cells.first[c + 1]):
            p = cells.member[m]
            volume = V[p]
            before += volume
            after += volume * change(axes, dt, L[p], increment)
        for m in range(cells.first[c], cells.first[c + 1]):
            p = cells.member[m]
            J = change(axes, dt, L[p], increment)
            scale = 1.0  # where one is turned inside out, as a guard will see
            if after > 0.0 and J > 0.0:
                scale = (after / before / J) ** (1.0 / dim)
            for d in range(dim):
                for e in range(dim):
                    L[p, d, e] *= scale
                L[p, d, d] += (scale - 1.0) / dt if dt > 0.0 else 0.0


@inlined
def change(axes, dt, L, increment):
    """Write ``I + dt L``; its determinant."""
    for d in range(len(axes)):
        for e in range(len(axes)):
            increment[d, e] = dt * L[d, e] + (1.0 if d == e else 0.0)
    return determinant(axes, increment)


@lean
def strain_by(axes, law, p, L, dt, start, stop):
    """Update F, V and stress of particles start to stop from their velocity gradients (Eqs. 28-30)."""
    entries, gradient = squared(axes), 2 * len(axes)
    fields = table((0.0, 0.0, *axes), axes, BATCH)
    for first in range(start, stop, len(BATCH)):
        n = min(len(BATCH), stop - first)
        take(entries, fields, gradient, L, first, n)
        strain(axes, entries, law, p, first, n, dt, fields)


@lean
def share_pressure(axes, cells, V, sigma, start, stop):
    """Give the stresses of the particles in cells start to stop the mean pressure by volume."""
    dim = len(axes)
    for c in range(start, stop):
        volume, mean = 0.0, 0.0
        for m in range(cells.first[c], cells.first[c + 1]):
            p = cells.member[m]
            volume += V[p]
            for d in range(dim):
                mean += V[p] * sigma[p, d, d] / dim
        for m in range(cells.first[c], cells.first[c + 1]):
            p = cells.member[m]
            own = 0.0
            for d in range(dim):
                own += sigma[p, d, d] / dim
            for d in range(dim):
                sigma[p, d, d] += mean / volume - own
