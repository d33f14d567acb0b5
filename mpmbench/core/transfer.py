"""Sums between particles and nodes, for any basis and any number of dimensions.

Shapes: nodal arrays (N,) and (N, dim), particle arrays (P,), (P, dim) and (P, dim, dim). Sums run over the particles in
their order, so a result does not depend on anything but the input.
"""

from mpmbench.core.algebra import determinant, multiply
from mpmbench.core.bases.handle import count, locate, node, scratch
from mpmbench.core.compiled import kernel, matrix, vector
from mpmbench.core.materials import cauchy_stress, energy_density


@kernel
def p2g_mass(phi, x, m, m_i):  # type: ignore[no-untyped-def]
    """Add the row sums of the mass matrix: ``m_i += sum_p m_p phi_i(x_p)`` (Wobbes 2020, Eq. 17)."""
    work, grad_phi = scratch(phi), vector(phi.axes)
    for p in range(x.shape[0]):
        at = locate(phi, x, p, work)
        for k in range(count(phi, at)):
            i, phi_i = node(phi, at, k, work, grad_phi)
            m_i[i] += m[p] * phi_i


@kernel
def p2g_momentum(phi, x, m, v, q_i):  # type: ignore[no-untyped-def]
    """Add the momentum: ``q_i += sum_p m_p phi_i(x_p) v_p`` (Eqs. 20, 49, 91)."""
    work, grad_phi = scratch(phi), vector(phi.axes)
    for p in range(x.shape[0]):
        at = locate(phi, x, p, work)
        for k in range(count(phi, at)):
            i, phi_i = node(phi, at, k, work, grad_phi)
            for d in range(len(phi.axes)):
                q_i[i, d] += m[p] * phi_i * v[p, d]


@kernel
def p2g_internal_force(phi, x, V, sigma, f_i):  # type: ignore[no-untyped-def]
    """Add the internal force: ``f_i -= sum_p V_p sigma_p grad phi_i`` (Eqs. 21, 50, 92 with the sign corrected)."""
    work, grad_phi = scratch(phi), vector(phi.axes)
    for p in range(x.shape[0]):
        at = locate(phi, x, p, work)
        for k in range(count(phi, at)):
            i, phi_i = node(phi, at, k, work, grad_phi)
            for d in range(len(phi.axes)):
                traction = 0.0
                for e in range(len(phi.axes)):
                    traction += sigma[p, d, e] * grad_phi[e]
                f_i[i, d] -= V[p] * traction


@kernel
def p2g(phi, x, m, v, V, sigma, m_i, q_i, f_i):  # type: ignore[no-untyped-def]
    """`p2g_mass`, `p2g_momentum` and `p2g_internal_force` in one pass: the hot loop of the lumped methods."""
    work, grad_phi = scratch(phi), vector(phi.axes)
    momentum, stress = vector(phi.axes), matrix(phi.axes, phi.axes)
    for p in range(x.shape[0]):
        at = locate(phi, x, p, work)
        for d in range(len(phi.axes)):
            momentum[d] = m[p] * v[p, d]
            for e in range(len(phi.axes)):
                stress[d, e] = V[p] * sigma[p, d, e]
        for k in range(count(phi, at)):
            i, phi_i = node(phi, at, k, work, grad_phi)
            m_i[i] += m[p] * phi_i
            for d in range(len(phi.axes)):
                traction = 0.0
                for e in range(len(phi.axes)):
                    traction += stress[d, e] * grad_phi[e]
                q_i[i, d] += phi_i * momentum[d]
                f_i[i, d] -= traction


@kernel
def g2p_velocity(phi, x, v, v_i, a_i, flip, dt):  # type: ignore[no-untyped-def]
    """Update particle velocities; `flip` is the weight of FLIP (Eqs. 27, 97) against PIC (Eqs. 67, 68).

    ``v_p <- flip (v_p + dt sum_i phi_i a_i) + (1 - flip) sum_i phi_i v_i``
    """
    work, grad_phi = scratch(phi), vector(phi.axes)
    increment, interpolated = vector(phi.axes), vector(phi.axes)
    for p in range(x.shape[0]):
        at = locate(phi, x, p, work)
        for d in range(len(phi.axes)):
            increment[d] = 0.0
            interpolated[d] = 0.0
        for k in range(count(phi, at)):
            i, phi_i = node(phi, at, k, work, grad_phi)
            for d in range(len(phi.axes)):
                increment[d] += phi_i * a_i[i, d]
                interpolated[d] += phi_i * v_i[i, d]
        for d in range(len(phi.axes)):
            v[p, d] = flip * (v[p, d] + dt * increment[d]) + (1.0 - flip) * interpolated[d]


@kernel
def g2p_position(phi, x, v_i, dt):  # type: ignore[no-untyped-def]
    """Move the particles: ``x_p += dt sum_i phi_i v_i`` (Eqs. 26, 52, 96)."""
    work, grad_phi, step = scratch(phi), vector(phi.axes), vector(phi.axes)
    for p in range(x.shape[0]):
        at = locate(phi, x, p, work)
        for d in range(len(phi.axes)):
            step[d] = 0.0
        for k in range(count(phi, at)):
            i, phi_i = node(phi, at, k, work, grad_phi)
            for d in range(len(phi.axes)):
                step[d] += phi_i * v_i[i, d]
        for d in range(len(phi.axes)):
            x[p, d] += dt * step[d]


@kernel
def g2p_strain(phi, x, F, L, V, V0, v_i, dt):  # type: ignore[no-untyped-def]
    """Update deformation: ``L = sum_i v_i (x) grad phi_i``, ``F <- (I + dt L) F``, ``V = det(F) V_0``.

    Wobbes 2020, Eqs. 28-30, 55, 98 and 99, corrected. Particles without volume are skipped.
    """
    work, grad_phi = scratch(phi), vector(phi.axes)
    velocity_gradient = matrix(phi.axes, phi.axes)
    for p in range(x.shape[0]):
        if V0[p] == 0.0:
            continue
        at = locate(phi, x, p, work)
        for d in range(len(phi.axes)):
            for e in range(len(phi.axes)):
                velocity_gradient[d, e] = 0.0
        for k in range(count(phi, at)):
            i, phi_i = node(phi, at, k, work, grad_phi)
            for d in range(len(phi.axes)):
                for e in range(len(phi.axes)):
                    velocity_gradient[d, e] += v_i[i, d] * grad_phi[e]
        V[p] = V0[p] * deform(phi.axes, velocity_gradient, dt, F, L, p)


@kernel
def deform(axes, velocity_gradient, dt, F, L, p):  # type: ignore[no-untyped-def]
    """Store L of one particle and update its F; returns det F."""
    increment, old, new = matrix(axes, axes), matrix(axes, axes), matrix(axes, axes)
    for d in range(len(axes)):
        for e in range(len(axes)):
            L[p, d, e] = velocity_gradient[d, e]
            increment[d, e] = dt * velocity_gradient[d, e] + (1.0 if d == e else 0.0)
            old[d, e] = F[p, d, e]
    multiply(axes, increment, old, new)
    for d in range(len(axes)):
        for e in range(len(axes)):
            F[p, d, e] = new[d, e]
    return determinant(axes, new)


@kernel
def g2p(phi, x, v, F, L, V, V0, v_i, a_i, flip, dt):  # type: ignore[no-untyped-def]
    """`g2p_velocity`, `g2p_strain` and `g2p_position` in one pass: the hot loop of update stress last."""
    work, grad_phi = scratch(phi), vector(phi.axes)
    increment, interpolated = vector(phi.axes), vector(phi.axes)
    velocity_gradient = matrix(phi.axes, phi.axes)
    for p in range(x.shape[0]):
        at = locate(phi, x, p, work)
        for d in range(len(phi.axes)):
            increment[d] = 0.0
            interpolated[d] = 0.0
            for e in range(len(phi.axes)):
                velocity_gradient[d, e] = 0.0
        for k in range(count(phi, at)):
            i, phi_i = node(phi, at, k, work, grad_phi)
            for d in range(len(phi.axes)):
                increment[d] += phi_i * a_i[i, d]
                interpolated[d] += phi_i * v_i[i, d]
                for e in range(len(phi.axes)):
                    velocity_gradient[d, e] += v_i[i, d] * grad_phi[e]
        for d in range(len(phi.axes)):
            v[p, d] = flip * (v[p, d] + dt * increment[d]) + (1.0 - flip) * interpolated[d]
            x[p, d] += dt * interpolated[d]
        if V0[p] > 0.0:
            V[p] = V0[p] * deform(phi.axes, velocity_gradient, dt, F, L, p)


@kernel
def update_stress(law, axes, F, L, dt, state, V0, sigma):  # type: ignore[no-untyped-def]
    """Cauchy stress of every particle from its deformation gradient and history."""
    F_p, L_p, sigma_p = matrix(axes, axes), matrix(axes, axes), matrix(axes, axes)
    for p in range(F.shape[0]):
        if V0[p] == 0.0:
            continue
        for d in range(len(axes)):
            for e in range(len(axes)):
                F_p[d, e], L_p[d, e], sigma_p[d, e] = F[p, d, e], L[p, d, e], sigma[p, d, e]
        cauchy_stress(law, axes, F_p, L_p, dt, state[p], sigma_p)
        for d in range(len(axes)):
            for e in range(len(axes)):
                sigma[p, d, e] = sigma_p[d, e]


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
