"""What particles take from the nodes: velocities, positions, deformations and, with these, stresses."""

from typing import NamedTuple

import numpy as np

from mpmbench.core.bases.handle import (
    count,
    index,
    interpolate,
    locate,
    locate_batch,
    room,
    scratch,
    value,
)
from mpmbench.core.compiled import inlined, lean, matrix, table, vector
from mpmbench.core.compiled.algebra import determinant, multiply, squared
from mpmbench.core.compiled.rows import (
    BATCH,
    GROUPS,
    LANES,
    add_multiple,
    alike,
    groups,
    put,
    put_rows,
    set_multiple,
    take,
    take_rows,
)
from mpmbench.core.materials import cauchy_stress, strain_all
from mpmbench.core.transfer.parts import also_take, watch


class Update(NamedTuple):
    """What `g2p` updates, and the weight of FLIP in the velocities, from 0 to 1."""

    velocity: bool
    strain: bool
    position: bool
    acceleration: bool
    flip: float


@lean
def g2p(phi, law, p, part, box, nodes, dt, update, solid, start, stop):
    """Update particles start to stop from nodal velocities and accelerations; `update` says what.

    What they carry besides, `part`, is taken at their old places. Returns what `watch` says of them in
    the `box`.

    velocity: ``v_p <- flip (v_p + dt sum_i phi_i a_i) + (1 - flip) sum_i phi_i v_i`` (Eqs. 27, 97;
    67, 68) strain: ``L = sum_i v_i (x) grad phi_i``, ``F <- (I + dt L) F``, ``V = det(F) V_0``, and
    the stress from the new F (Eqs. 28-30, 53-55, 98, 99 corrected) position: ``x_p += dt sum_i
    phi_i v_i`` (Eqs. 26, 52, 96)

    Particles from number `solid` on, which have no volume, are not strained.
    """
    axes, dim, flip = phi.axes, len(phi.axes), update.flip
    work, fields = room(phi), table((0.0, 0.0, *axes), axes, BATCH)
    at = vector(BATCH).view(np.int64)
    first, crossed, bad = start, 0, 0
    while first < stop:
        end = min(solid, stop) if first < solid else stop
        n = locate_batch(phi, p.x, first, min(len(BATCH), end - first), at, work)
        b = 0
        while b < n:
            same = alike(at, b, n)
            interpolate(phi, at[b], b, same, work, nodes, fields)
            also_take(part, phi, at[b], b, first + b, same, work, nodes.v, fields)
            b += same
        if update.velocity:
            change(axes, flip, p.v, first, n, flip * dt, fields, dim)
            if flip != 1.0:
                change(axes, 1.0, p.v, first, n, 1.0 - flip, fields, 0)
        if update.acceleration:
            change(axes, 0.0, p.a, first, n, 1.0, fields, dim)
        if update.position:
            change(axes, 1.0, p.x, first, n, dt, fields, 0)
        if update.strain and first < solid:
            strain(axes, squared(axes), law, p, first, n, dt, fields)
        left, wrong = watch(box, phi, p, first, n, first < solid, at, update)
        first, crossed, bad = first + n, crossed + left, bad + wrong
    return crossed, bad


@inlined
def change(axes, keep, old, first, n, factor, fields, row):
    """``old <- keep old + factor fields[row]`` for the vectors of n particles."""
    new = matrix(axes, BATCH)
    for g in range(groups(n)):
        b = len(LANES) * g
        take_rows(axes, new, g, old, first + b, n - b)
        for d in range(len(axes)):
            i = GROUPS * d + g
            set_multiple(LANES, new, i, keep, new, i)
            add_multiple(LANES, new, i, factor, fields, GROUPS * (row + d) + g)
        put_rows(axes, new, g, old, first + b, n - b)


@inlined
def strain(axes, entries, law, p, first, n, dt, fields):
    """Update F, V and stress of a batch of n particles, and L where it is kept."""
    dim, gradient = len(axes), 2 * len(axes)  # first row of the velocity gradient
    F, sigma, V = matrix(entries, BATCH), matrix(entries, BATCH), matrix((0.0,), BATCH)
    increment, old, F_b = matrix(axes, axes), matrix(axes, axes), matrix(axes, axes)
    L_b, sigma_b = matrix(axes, axes), matrix(axes, axes)
    state = p.state[first : first + n]
    take(entries, F, 0, p.F, first, n)
    take((0.0,), V, 0, p.V0, first, n)
    done = strain_all(law, axes, fields, gradient, dt, F, V, state, sigma, n)
    # Whole vectors, where there is no history of a particle that is none; in a function of its own this
    # loop is not one of vectors any more, and a linear step in 2D takes a third longer.
    most = n if state.shape[1] > 0 else len(LANES) * groups(n)
    for b in range(0 if done else most):
        for d in range(dim):
            for e in range(dim):
                L_b[d, e], old[d, e] = fields[gradient + d * dim + e, b], F[d * dim + e, b]
                increment[d, e] = dt * L_b[d, e] + (1.0 if d == e else 0.0)
        multiply(axes, increment, old, F_b)
        V[0, b] *= determinant(axes, F_b)
        cauchy_stress(law, axes, F_b, L_b, dt, state[b], sigma_b)
        for d in range(dim):
            for e in range(dim):
                F[d * dim + e, b], sigma[d * dim + e, b] = F_b[d, e], sigma_b[d, e]
    put(entries, F, 0, p.F, first, n)
    put(entries, sigma, 0, p.sigma, first, n)
    put((0.0,), V, 0, p.V, first, n)
    if p.L.shape[0] > 0:
        put(entries, fields, gradient, p.L, first, n)


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
def velocity_gradients(phi, x, v_i, L, start, stop):
    """``L_p = sum_i v_i (x) grad phi_i`` of particles start to stop."""
    work, grad_phi = scratch(phi), vector(phi.axes)
    L[start:stop] = 0.0
    for p in range(start, stop):
        at = locate(phi, x, p, work)
        for k in range(count(phi, at)):
            value(phi, at, k, work, grad_phi)
            i = index(phi, at, k)
            for d in range(len(phi.axes)):
                for e in range(len(phi.axes)):
                    L[p, d, e] += v_i[i, d] * grad_phi[e]
