"""Sums over particles on the nodes, for any basis and any number of dimensions.

Shapes: nodal arrays (N,) and (N, dim), particle arrays (P,), (P, dim) and (P, dim, dim). Particles
of the same grid cell that follow each other are added to its nodes together.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from mpmbench.core.bases.handle import (
    count,
    index,
    locate,
    locate_batch,
    room,
    scratch,
    spread,
    value,
)
from mpmbench.core.compiled import inlined, lean, matrix, table, threads, vector
from mpmbench.core.compiled.algebra import squared
from mpmbench.core.compiled.rows import (
    BATCH,
    GROUPS,
    LANES,
    alike,
    groups,
    lanes_for,
    set_multiple,
    set_product,
    take,
)
from mpmbench.core.nodes import over
from mpmbench.core.particles import SEEN
from mpmbench.core.transfer.parts import NOTHING, also_spread


class NodalSums:
    """Sums of mass, momentum and forces on the nodes, added up in the same order for any number of threads.

    Parameters
    ----------
    nodes, particles, dimension : int
        Fix the sizes: every chunk of particles adds to an array of its own, shape (N, lanes).
    body_force : bool
        There is one, which is added up with the rest.
    """

    def __init__(self, nodes: int, particles: int, dimension: int, body_force: bool) -> None:
        self._values = (0.0,) * (1 + dimension * (2 if body_force else 1))
        self._lanes = lanes_for(dimension + len(self._values))
        self._parts = threads.apart(particles, nodes, len(self._lanes))
        self._marks = threads.apart(particles, -(-nodes // 8) * 8, dtype=np.uint8)

    def __call__(
        self,
        phi: Any,
        p: Any,
        n: Any,
        body_force: Callable[[int, int], Any],
        part: Any = NOTHING,
    ) -> None:
        """Write sums over the particles `p` to the nodes `n`; Wobbes 2020, Eqs. 17, 20 (49, 91) and 21 (50, 92).

        ``m_i = sum m_p phi_i``, ``q_i = sum m_p phi_i v_p``, ``f_internal = - sum V_p sigma_p grad
        phi_i`` (its sign is corrected) and ``f_external = sum m_p phi_i b_p``, where
        ``body_force(start, stop)`` writes b of some particles just before they are added. What
        particles carry besides, `part`, is added to the momentum.
        """

        def add(c: int, start: int, stop: int) -> None:
            body_force(start, stop)
            values, lanes, own = self._values, self._lanes, (self._parts[c], self._marks[c])
            p2g(phi, values, lanes, p, part, *own, start, stop)

        threads.run(add, len(p.x))
        n.look(self._marks)
        sums = n.m, n.q, n.f_internal, n.f_external, n.f
        rows = self._values, self._lanes, self._parts, self._marks
        over(collect, n.seen, n.axes, *rows, *sums, n.v, n.v_old)


@lean
def p2g(phi, values, lanes, p, part, sums, marks, start, stop):
    """Add what the particles start to stop give to ``sums[i] = (f, m, q)`` or (f, m, q, f_external).

    `sums` has the shape (N, lanes); nodes that the particles see get a mark in `marks`, shape (N,) or longer.
    There is a body force if `values` is as long as (m, q, f_external).
    """
    axes, dim = phi.axes, len(phi.axes)
    mass = dim * dim  # row of the mass; before it is the stress times the volume, then the momentum
    work, columns = room(phi), table((0.0, *axes), (0.0, *axes), BATCH)
    volume, at = matrix((0.0,), BATCH), vector(BATCH).view(np.int64)
    first = start
    while first < stop:
        n = locate_batch(phi, p.x, first, min(len(BATCH), stop - first), at, work)
        take(squared(axes), columns, 0, p.sigma, first, n)
        take((0.0,), volume, 0, p.V, first, n)
        take((0.0,), columns, mass, p.m, first, n)
        take(axes, columns, mass + 1, p.v, first, n)
        if len(values) > 1 + dim:
            take(axes, columns, mass + 1 + dim, p.b, first, n)
        for g in range(groups(n)):
            set_multiple(LANES, volume, g, -1.0, volume, g)
            for c in range(mass):
                scale(columns, c, volume, 0, g)
            for c in range(1, len(values)):
                scale(columns, mass + c, columns, mass, g)
        b = 0
        while b < n:
            same = alike(at, b, n)
            spread(phi, at[b], b, same, work, values, lanes, columns, sums, marks)
            also_spread(part, phi, at[b], first + b, same, work, p.m, dim + 1, sums)
            b += same
        first += n


@inlined
def scale(columns, row, factors, other, g):
    """Multiply the g-th group of a row by that of another."""
    i = GROUPS * row + g
    set_product(LANES, columns, i, columns, i, factors, GROUPS * other + g)


@lean
def collect(seen, axes, values, lanes, parts, marks, m, q, f_internal, f_external, f, v, v_old):
    """Add up the parts in their order, and clear them; seen nodes have a mass, and their velocities become old ones."""
    dim, total = len(axes), vector(lanes)
    for n in range(seen.shape[0]):
        for i in range(seen[n, 0], seen[n, 1]):
            for k in range(len(lanes)):
                total[k] = 0.0
            for c in range(parts.shape[0]):
                if marks[c, i] != 0:
                    marks[c, i] = 0
                    for k in range(len(lanes)):
                        total[k] += parts[c, i, k]
                        parts[c, i, k] = 0.0
            m[i] = total[dim] if total[dim] != 0.0 else SEEN
            for d in range(dim):
                f_internal[i, d], q[i, d] = total[d], total[dim + 1 + d]
                f_external[i, d] = total[2 * dim + 1 + d] if len(values) > 1 + dim else 0.0
                f[i, d], v_old[i, d] = f_internal[i, d] + f_external[i, d], v[i, d]


@lean
def p2g_mass(phi, x, m, m_i):
    """Add the row sums of the mass matrix: ``m_i += sum_p m_p phi_i(x_p)`` (Wobbes 2020, Eq. 17).

    Nodes that are seen without any mass get next to none, `SEEN`.
    """
    work, grad_phi = scratch(phi), vector(phi.axes)
    for p in range(x.shape[0]):
        at = locate(phi, x, p, work)
        for k in range(count(phi, at)):
            i = index(phi, at, k)
            m_i[i] += m[p] * value(phi, at, k, work, grad_phi)
            if m_i[i] == 0.0:
                m_i[i] = SEEN


@lean
def p2g_momentum(phi, x, m, v, q_i):
    """Add the momentum: ``q_i += sum_p m_p phi_i(x_p) v_p``; with b for v, the body force."""
    work, grad_phi = scratch(phi), vector(phi.axes)
    for p in range(x.shape[0]):
        at = locate(phi, x, p, work)
        for k in range(count(phi, at)):
            phi_i = value(phi, at, k, work, grad_phi)
            i = index(phi, at, k)
            for d in range(len(phi.axes)):
                q_i[i, d] += m[p] * phi_i * v[p, d]


@lean
def p2g_internal_force(phi, x, V, sigma, f_i):
    """Add the internal force: ``f_i -= sum_p V_p sigma_p grad phi_i``."""
    work, grad_phi = scratch(phi), vector(phi.axes)
    for p in range(x.shape[0]):
        at = locate(phi, x, p, work)
        for k in range(count(phi, at)):
            value(phi, at, k, work, grad_phi)
            i = index(phi, at, k)
            for d in range(len(phi.axes)):
                traction = 0.0
                for e in range(len(phi.axes)):
                    traction += sigma[p, d, e] * grad_phi[e]
                f_i[i, d] -= V[p] * traction
