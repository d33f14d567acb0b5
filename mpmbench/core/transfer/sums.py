"""Sums over particles on the nodes, for any basis and any number of dimensions.

Shapes: nodal arrays (N,) and (N, dim), particle arrays (P,), (P, dim) and (P, dim, dim). Particles
of the same grid cell that follow each other share the values of their nodes, to which they are
added once per cell.
"""

from typing import Any

import numpy as np

from mpmbench.core.bases.handle import count, index, locate, scratch, spread, value
from mpmbench.core.compiled import compiled, lean, matrix, threads, vector
from mpmbench.core.compiled.rows import add_multiple, lanes_for
from mpmbench.core.particles import SEEN


class NodalSums:
    """Sums of mass, momentum and internal force on the nodes, added up in the same order for any number of threads.

    Parameters
    ----------
    nodes, particles, dimension : int
        Fix the sizes: every chunk of particles adds to an array of its own, shape (N, lanes).
    """

    def __init__(self, nodes: int, particles: int, dimension: int) -> None:
        self._lanes = lanes_for(2 + 2 * dimension)
        self._parts = threads.apart(particles, nodes, len(self._lanes))
        self._touched = threads.apart(particles, 2, dtype=np.int64)
        self._cells = threads.apart(particles, 0, len(self._lanes))

    def __call__(self, phi: Any, p: Any, m_i: np.ndarray, q_i: np.ndarray, f_i: np.ndarray) -> None:
        """``m_i = sum m_p phi_i``, ``q_i = sum m_p phi_i v_p``, ``f_i = - sum V_p sigma_p grad phi_i``.

        Wobbes 2020, Eqs. 17, 20 (49, 91) and 21 (50, 92), the last with its sign corrected.
        """
        self._cells = at_least(self._cells, phi.width, len(p.x))

        def add(c: int, start: int, stop: int) -> None:
            sums, cell, touched = self._parts[c], self._cells[c], self._touched[c]
            p2g(phi, self._lanes, p, sums, cell, touched, start, stop)

        threads.run(add, len(p.x))
        collect(self._parts, self._touched, m_i, q_i, f_i)


def at_least(cells: np.ndarray, width: int, particles: int) -> np.ndarray:
    """`cells`, shape (chunks, width, columns), or a new array of zeros when it has too few rows."""
    enough = cells.shape[1] >= width
    return cells if enough else threads.apart(particles, width, cells.shape[2])


@lean
def p2g(phi, lanes, p, sums, cell, touched, start, stop):
    """Add mass, momentum and internal force of the particles `p`, start to stop, to ``sums[i] = (m, q, f)``.

    `sums` has the shape (N, lanes); `cell` holds the same for the functions of one cell; `touched`
    returns the range of node numbers that were added to.
    """
    dim = len(phi.axes)
    work, columns = scratch(phi), matrix((0.0, *phi.axes), lanes)
    for r in range(1 + dim):
        for c in range(len(lanes)):
            columns[r, c] = 0.0
    touched[0], touched[1] = sums.shape[0], 0
    last = -1
    x, m, v, V, sigma = p.x, p.m, p.v, p.V, p.sigma
    for j in range(start, stop):
        at = locate(phi, x, j, work)
        if at != last:
            if last >= 0:
                add_cell(phi, last, lanes, cell, sums, touched)
            last = at
        columns[0, 0] = m[j]
        for d in range(dim):
            columns[0, 1 + d] = m[j] * v[j, d]
            for e in range(dim):
                columns[1 + e, 1 + dim + d] = -V[j] * sigma[j, d, e]
        spread(phi, at, work, lanes, columns, cell)
    if last >= 0:
        add_cell(phi, last, lanes, cell, sums, touched)


@lean
def add_cell(phi, at, lanes, cell, sums, touched):
    """Add the sums of one cell to its nodes and set them back to zero."""
    for k in range(count(phi, at)):
        i = index(phi, at, k)
        touched[0], touched[1] = min(touched[0], i), max(touched[1], i + 1)
        add_multiple(lanes, sums, i, 1.0, cell, k)
        sums[i, len(lanes) - 1] = 1.0  # a lane to spare: the node is seen
        for c in range(len(lanes)):
            cell[k, c] = 0.0


@compiled
def collect(parts, touched, m_i, q_i, f_i):
    """Add up the parts in their order, and set them back to zero; seen nodes have a mass."""
    dim = q_i.shape[1]
    m_i[:], q_i[:], f_i[:] = 0.0, 0.0, 0.0
    for c in range(parts.shape[0]):
        for i in range(touched[c, 0], touched[c, 1]):
            m_i[i] += parts[c, i, 0]
            if m_i[i] == 0.0 and parts[c, i, parts.shape[2] - 1] > 0.0:
                m_i[i] = SEEN
            for d in range(dim):
                q_i[i, d] += parts[c, i, 1 + d]
                f_i[i, d] += parts[c, i, 1 + dim + d]
            for k in range(parts.shape[2]):
                parts[c, i, k] = 0.0


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
