"""What particles take from the nodes: velocities, positions, deformations and, with these, stresses."""

from typing import NamedTuple

from mpmbench.core.bases.handle import count, index, interpolate, locate, scratch, value
from mpmbench.core.compiled import inlined, lean, matrix, vector
from mpmbench.core.compiled.algebra import determinant, multiply
from mpmbench.core.materials import cauchy_stress


class Update(NamedTuple):
    """What `g2p` updates, and the weight of FLIP in the velocities, from 0 to 1."""

    velocity: bool
    strain: bool
    position: bool
    acceleration: bool
    flip: float


@lean
def g2p(phi, lanes, law, p, nodes, dt, update, cell, start, stop):
    """Update particles start to stop from nodal velocities and accelerations; `update` says what.

    velocity: ``v_p <- flip (v_p + dt sum_i phi_i a_i) + (1 - flip) sum_i phi_i v_i`` (Eqs. 27, 97;
    67, 68) strain: ``L = sum_i v_i (x) grad phi_i``, ``F <- (I + dt L) F``, ``V = det(F) V_0``, and
    the stress from the new F (Eqs. 28-30, 53-55, 98, 99 corrected) position: ``x_p += dt sum_i
    phi_i v_i`` (Eqs. 26, 52, 96)

    Particles without volume are not strained. `cell`, shape (K, lanes), holds (v_i, a_i) of the
    functions of one cell.
    """
    dim, flip = len(phi.axes), update.flip
    x, v, F, L, sigma = p.x, p.v, p.F, p.L, p.sigma
    work = scratch(phi)
    sums = matrix((0.0, *phi.axes), lanes)  # (v, a) at the particle, and their gradients
    velocity_gradient, F_j = matrix(phi.axes, phi.axes), matrix(phi.axes, phi.axes)
    sigma_j = matrix(phi.axes, phi.axes)
    last = -1
    for j in range(start, stop):
        at = locate(phi, x, j, work)
        if at != last:
            for k in range(count(phi, at)):
                i = index(phi, at, k)
                for d in range(dim):
                    cell[k, d], cell[k, dim + d] = nodes.v[i, d], nodes.a[i, d]
            last = at
        interpolate(phi, at, work, lanes, cell, sums)
        for d in range(dim):
            if update.velocity:
                v[j, d] = flip * (v[j, d] + dt * sums[0, dim + d]) + (1.0 - flip) * sums[0, d]
            if update.acceleration:
                p.a[j, d] = sums[0, dim + d]
            if update.position:
                x[j, d] += dt * sums[0, d]
            for e in range(dim):
                velocity_gradient[d, e] = sums[1 + e, d]
        if update.strain and p.V0[j] > 0.0:
            J = deform(phi.axes, velocity_gradient, dt, F, L, F_j, j)
            p.V[j] = p.V0[j] * J
            for d in range(dim):
                for e in range(dim):
                    sigma_j[d, e] = sigma[j, d, e]
            cauchy_stress(law, phi.axes, F_j, velocity_gradient, dt, p.state[j], sigma_j)
            for d in range(dim):
                for e in range(dim):
                    sigma[j, d, e] = sigma_j[d, e]


@inlined
def deform(axes, velocity_gradient, dt, F, L, F_p, p):
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
def velocity_gradients(phi, x, v_i, L):
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
