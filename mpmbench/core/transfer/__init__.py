"""Sums between particles and nodes, for any basis and any number of dimensions.

Shapes: nodal arrays (N,) and (N, dim), particle arrays (P,), (P, dim) and (P, dim, dim). Particles
of the same grid cell that follow each other share the values of their nodes: they are read once and
added once per cell.
"""

import numpy as np

from mpmbench.core.bases.handle import count, index, interpolate, locate, scratch, spread, value
from mpmbench.core.compiled import inlined, kernel, lean, matrix, threads, vector
from mpmbench.core.compiled.algebra import determinant, multiply
from mpmbench.core.compiled.rows import add_multiple, lanes_for
from mpmbench.core.materials import cauchy_stress, energy_density


class NodalSums:
    """Sums of mass, momentum and internal force on the nodes, added up in the same order for any number of threads.

    Parameters
    ----------
    nodes, particles, dimension : int
        Fix the sizes: every chunk of particles adds to an array of its own, shape (N, lanes).
    """

    def __init__(self, nodes: int, particles: int, dimension: int) -> None:
        self._lanes = lanes_for(1 + 2 * dimension)
        self._parts = np.zeros((len(threads.chunks(particles)), nodes, len(self._lanes)))
        self._touched = np.zeros((len(self._parts), 2), dtype=np.int64)
        self._cells = np.zeros((len(self._parts), 0, len(self._lanes)))

    def __call__(self, phi, x, m, v, V, sigma, m_i, q_i, f_i) -> None:  # type: ignore[no-untyped-def]
        """``m_i = sum m_p phi_i``, ``q_i = sum m_p phi_i v_p``, ``f_i = - sum V_p sigma_p grad phi_i``.

        Wobbes 2020, Eqs. 17, 20 (49, 91) and 21 (50, 92), the last with its sign corrected.
        """
        self._cells = at_least(self._cells, phi.width)

        def add(c: int, start: int, stop: int) -> None:
            p2g(
                phi,
                self._lanes,
                x,
                m,
                v,
                V,
                sigma,
                self._parts[c],
                self._cells[c],
                self._touched[c],
                start,
                stop,
            )

        threads.run(add, len(x))
        collect(self._parts, self._touched, m_i, q_i, f_i)


def at_least(cells: np.ndarray, width: int) -> np.ndarray:
    """`cells`, shape (chunks, width, columns), or a new array of zeros when it has too few rows."""
    return cells if cells.shape[1] >= width else np.zeros((cells.shape[0], width, cells.shape[2]))


@lean
def p2g(phi, lanes, x, m, v, V, sigma, sums, cell, touched, start, stop):  # type: ignore[no-untyped-def]
    """Add mass, momentum and internal force of particles start to stop to ``sums[i] = (m, q, f)``.

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
    for p in range(start, stop):
        at = locate(phi, x, p, work)
        if at != last:
            if last >= 0:
                add_cell(phi, last, lanes, cell, sums, touched)
            last = at
        columns[0, 0] = m[p]
        for d in range(dim):
            columns[0, 1 + d] = m[p] * v[p, d]
            for e in range(dim):
                columns[1 + e, 1 + dim + d] = -V[p] * sigma[p, d, e]
        spread(phi, at, work, lanes, columns, cell)
    if last >= 0:
        add_cell(phi, last, lanes, cell, sums, touched)


@lean
def add_cell(phi, at, lanes, cell, sums, touched):  # type: ignore[no-untyped-def]
    """Add the sums of one cell to its nodes and set them back to zero."""
    for k in range(count(phi, at)):
        i = index(phi, at, k)
        touched[0], touched[1] = min(touched[0], i), max(touched[1], i + 1)
        add_multiple(lanes, sums, i, 1.0, cell, k)
        for c in range(len(lanes)):
            cell[k, c] = 0.0


@kernel
def collect(parts, touched, m_i, q_i, f_i):  # type: ignore[no-untyped-def]
    """Add up the parts in their order, and set them back to zero."""
    dim = q_i.shape[1]
    m_i[:], q_i[:], f_i[:] = 0.0, 0.0, 0.0
    for c in range(parts.shape[0]):
        for i in range(touched[c, 0], touched[c, 1]):
            m_i[i] += parts[c, i, 0]
            for d in range(dim):
                q_i[i, d] += parts[c, i, 1 + d]
                f_i[i, d] += parts[c, i, 1 + dim + d]
            for k in range(1 + 2 * dim):
                parts[c, i, k] = 0.0


@lean
def p2g_mass(phi, x, m, m_i):  # type: ignore[no-untyped-def]
    """Add the row sums of the mass matrix: ``m_i += sum_p m_p phi_i(x_p)`` (Wobbes 2020, Eq. 17)."""
    work, grad_phi = scratch(phi), vector(phi.axes)
    for p in range(x.shape[0]):
        at = locate(phi, x, p, work)
        for k in range(count(phi, at)):
            m_i[index(phi, at, k)] += m[p] * value(phi, at, k, work, grad_phi)


@lean
def p2g_momentum(phi, x, m, v, q_i):  # type: ignore[no-untyped-def]
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
def p2g_internal_force(phi, x, V, sigma, f_i):  # type: ignore[no-untyped-def]
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


@lean
def g2p(  # type: ignore[no-untyped-def]
    phi,
    lanes,
    law,
    x,
    v,
    F,
    L,
    V,
    V0,
    state,
    sigma,
    v_i,
    a_i,
    flip,
    dt,
    velocity,
    strain,
    position,
    cell,
    start,
    stop,
):
    """Update particles start to stop from nodal velocities and accelerations; three switches say what is updated.

    velocity: ``v_p <- flip (v_p + dt sum_i phi_i a_i) + (1 - flip) sum_i phi_i v_i`` (Eqs. 27, 97;
    67, 68) strain: ``L = sum_i v_i (x) grad phi_i``, ``F <- (I + dt L) F``, ``V = det(F) V_0``, and
    the stress from the new F (Eqs. 28-30, 53-55, 98, 99 corrected) position: ``x_p += dt sum_i
    phi_i v_i`` (Eqs. 26, 52, 96)

    Particles without volume are not strained. `cell`, shape (K, lanes), holds (v_i, a_i) of the
    functions of one cell.
    """
    dim = len(phi.axes)
    work, sums = (
        scratch(phi),
        matrix((0.0, *phi.axes), lanes),
    )  # (v, a) at the particle, and their gradients
    velocity_gradient, F_p, sigma_p = (
        matrix(phi.axes, phi.axes),
        matrix(phi.axes, phi.axes),
        matrix(phi.axes, phi.axes),
    )
    last = -1
    for p in range(start, stop):
        at = locate(phi, x, p, work)
        if at != last:
            for k in range(count(phi, at)):
                i = index(phi, at, k)
                for d in range(dim):
                    cell[k, d], cell[k, dim + d] = v_i[i, d], a_i[i, d]
            last = at
        interpolate(phi, at, work, lanes, cell, sums)
        for d in range(dim):
            if velocity:
                v[p, d] = flip * (v[p, d] + dt * sums[0, dim + d]) + (1.0 - flip) * sums[0, d]
            if position:
                x[p, d] += dt * sums[0, d]
            for e in range(dim):
                velocity_gradient[d, e] = sums[1 + e, d]
        if strain and V0[p] > 0.0:
            J = deform(phi.axes, velocity_gradient, dt, F, L, F_p, p)
            V[p] = V0[p] * J
            for d in range(dim):
                for e in range(dim):
                    sigma_p[d, e] = sigma[p, d, e]
            cauchy_stress(law, phi.axes, F_p, velocity_gradient, dt, state[p], sigma_p)
            for d in range(dim):
                for e in range(dim):
                    sigma[p, d, e] = sigma_p[d, e]


@inlined
def deform(axes, velocity_gradient, dt, F, L, F_p, p):  # type: ignore[no-untyped-def]
    """Update F of one particle, with a copy in `F_p`, and L where it is kept; returns det F."""
    increment, old = matrix(axes, axes), matrix(axes, axes)
    for d in range(len(axes)):
        for e in range(len(axes)):
            increment[d, e] = dt * velocity_gradient[d, e] + (1.0 if d == e else 0.0)
            old[d, e] = F[p, d, e]
            if L.shape[0] > 0:
                L[p, d, e] = velocity_gradient[d, e]
    multiply(axes, increment, old, F_p)
    for d in range(len(axes)):
        for e in range(len(axes)):
            F[p, d, e] = F_p[d, e]
    return determinant(axes, F_p)


@lean
def velocity_gradients(phi, x, v_i, L):  # type: ignore[no-untyped-def]
    """``L_p = sum_i v_i (x) grad phi_i`` of all particles."""
    work, grad_phi = scratch(phi), vector(phi.axes)
    L[:] = 0.0
    for p in range(x.shape[0]):
        at = locate(phi, x, p, work)
        for k in range(count(phi, at)):
            value(phi, at, k, work, grad_phi)
            i = index(phi, at, k)
            for d in range(len(phi.axes)):
                for e in range(len(phi.axes)):
                    L[p, d, e] += v_i[i, d] * grad_phi[e]


@kernel
def strain_energy(law, axes, F, state, V0):  # type: ignore[no-untyped-def]
    """Stored energy of all particles [J]."""
    total = 0.0
    F_p = matrix(axes, axes)
    for p in range(F.shape[0]):
        if V0[p] > 0.0:
            for d in range(len(axes)):
                for e in range(len(axes)):
                    F_p[d, e] = F[p, d, e]
            total += V0[p] * energy_density(law, axes, F_p, state[p])
    return total


@kernel
def kinetic_energy(m, v):  # type: ignore[no-untyped-def]
    """``sum_p m_p |v_p|^2 / 2`` [J]."""
    total = 0.0
    for p in range(v.shape[0]):
        for d in range(v.shape[1]):
            total += 0.5 * m[p] * v[p, d] * v[p, d]
    return total


@kernel
def first_bad_volume(V, V0):  # type: ignore[no-untyped-def]
    """Number of the first particle whose volume is not positive and finite, -1 if there is none."""
    for p in range(V.shape[0]):
        if V0[p] > 0.0 and not (0.0 < V[p] < 1e300):
            return p
    return -1
