"""Sums over the particles: internal force and tangent, mass, external force. Shapes as in `Stencils` and `Pattern`."""

import numpy as np

from mpmbench.core.compiled import kernel, matrix, vector
from mpmbench.core.compiled.algebra import determinant, inverse, multiply
from mpmbench.core.materials import kirchhoff_stress


@kernel
def equilibrium(law, phi, V0, F_old, state_old, du, F, state, tau, force, tangent, slot, blocks):  # type: ignore[no-untyped-def]
    """Add the internal force and, if wanted, its derivative by the increment of displacement.

    ``f_I += sum_p V0_p tau_p grad N_I`` and ``K_IJ += sum_p V0_p grad N_I . a_p . grad N_J`` with
    the moduli a of `kirchhoff_stress`, which hold the geometric part too (Iaconeta 2017, Eqs.
    30-36, with reference volumes).

    Parameters
    ----------
    phi : Stencils
        Functions at the start of the step.
    F_old, state_old : ndarray
        Deformation gradients and history at the start of the step, shapes (P, dim, dim) and (P, n).
    du : ndarray
        Increment of the nodal displacements [m], shape (N, dim).
    F, state, tau : ndarray
        Written: deformation gradients, history and Kirchhoff stresses [Pa] for this increment.
    force : ndarray
        Internal forces [N], shape (N, dim).
    tangent : bool
        Whether `blocks`, shape (blocks, dim, dim), is summed.

    Returns
    -------
    int
        Number of the first particle that the increment turns inside out, -1 if there is none.
    """
    axes = phi.axes
    dim = len(axes)
    width = phi.index.shape[1]
    grad = np.empty((width, dim))
    half = np.empty((dim, dim, dim))
    moduli = np.empty((dim, dim, dim, dim))
    increment, inverse_increment = matrix(axes, axes), matrix(axes, axes)
    F_p, new, tau_p = matrix(axes, axes), matrix(axes, axes), matrix(axes, axes)
    for p in range(phi.size.shape[0]):
        if V0[p] == 0.0:
            continue
        for a in range(dim):
            for b in range(dim):
                increment[a, b] = 1.0 if a == b else 0.0
                F_p[a, b] = F_old[p, a, b]
        for k in range(phi.size[p]):
            i = phi.index[p, k]
            for a in range(dim):
                for b in range(dim):
                    increment[a, b] += du[i, a] * phi.grad_phi[p, k, b]
        multiply(axes, increment, F_p, new)
        if not (determinant(axes, increment) > 0.0 and determinant(axes, new) > 0.0):
            return p
        inverse(axes, increment, inverse_increment)
        kirchhoff_stress(law, axes, increment, new, state_old[p], state[p], tau_p, moduli)
        for a in range(dim):
            for b in range(dim):
                F[p, a, b], tau[p, a, b] = new[a, b], tau_p[a, b]
        for k in range(phi.size[p]):
            i = phi.index[p, k]
            for a in range(dim):
                total = 0.0
                for b in range(dim):
                    total += phi.grad_phi[p, k, b] * inverse_increment[b, a]
                grad[k, a] = total
            for a in range(dim):
                total = 0.0
                for b in range(dim):
                    total += tau_p[a, b] * grad[k, b]
                force[i, a] += V0[p] * total
        if tangent:
            for k in range(phi.size[p]):
                for a in range(dim):
                    for b in range(dim):
                        for d in range(dim):
                            total = 0.0
                            for c in range(dim):
                                total += grad[k, c] * moduli[a, c, b, d]
                            half[a, b, d] = V0[p] * total
                for n in range(phi.size[p]):
                    s = slot[p, k, n]
                    if s >= 0:
                        for a in range(dim):
                            for b in range(dim):
                                total = 0.0
                                for d in range(dim):
                                    total += half[a, b, d] * grad[n, d]
                                blocks[s, a, b] += total
    return -1


@kernel
def add_mass(phi, m, slot, blocks):  # type: ignore[no-untyped-def]
    """``M_IJ += sum_p m_p N_I N_J`` [kg], shape (blocks,)."""
    for p in range(phi.size.shape[0]):
        for k in range(phi.size[p]):
            for n in range(phi.size[p]):
                s = slot[p, k, n]
                if s >= 0:
                    blocks[s] += m[p] * phi.phi[p, k] * phi.phi[p, n]


@kernel
def add_laplacian(phi, V0, stiffness, slot, blocks):  # type: ignore[no-untyped-def]
    """``K_IJ += stiffness sum_p V0_p (grad N_I . grad N_J) I``, shape (blocks, dim, dim)."""
    for p in range(phi.size.shape[0]):
        for k in range(phi.size[p]):
            for n in range(phi.size[p]):
                s = slot[p, k, n]
                if s >= 0:
                    total = 0.0
                    for d in range(len(phi.axes)):
                        total += phi.grad_phi[p, k, d] * phi.grad_phi[p, n, d]
                    for d in range(len(phi.axes)):
                        blocks[s, d, d] += stiffness * V0[p] * total


@kernel
def interpolate(phi, u, out):  # type: ignore[no-untyped-def]
    """``out_p = sum_I N_I u_I``, shape (P, dim)."""
    total = vector(phi.axes)
    for p in range(phi.size.shape[0]):
        for d in range(len(phi.axes)):
            total[d] = 0.0
        for k in range(phi.size[p]):
            for d in range(len(phi.axes)):
                total[d] += phi.phi[p, k] * u[phi.index[p, k], d]
        for d in range(len(phi.axes)):
            out[p, d] = total[d]


@kernel
def commit(axes, V0, F_new, state_new, tau, F, state, V, sigma):  # type: ignore[no-untyped-def]
    """Take over the converged state: F, history, ``V = J V_0`` and the Cauchy stress ``sigma = tau / J``."""
    for p in range(V0.shape[0]):
        if V0[p] == 0.0:
            continue
        J = determinant(axes, F_new[p])
        V[p] = J * V0[p]
        for a in range(len(axes)):
            for b in range(len(axes)):
                F[p, a, b] = F_new[p, a, b]
                sigma[p, a, b] = tau[p, a, b] / J
        for n in range(state.shape[1]):
            state[p, n] = state_new[p, n]
