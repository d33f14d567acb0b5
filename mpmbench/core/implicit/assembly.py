"""Sums of implicit methods: internal force, tangent and mass, and what particles take back.

Shapes as in `Stencils` and `Pattern`.
"""

from typing import NamedTuple

import numpy as np

from mpmbench.core.compiled import compiled, inlined, matrix, vector
from mpmbench.core.compiled.algebra import determinant, inverse, multiply
from mpmbench.core.materials import kirchhoff_step


class Start(NamedTuple):
    """Reference volumes [m^dim], deformation gradients and history at the start of a step, and its time [s]."""

    V0: np.ndarray
    F: np.ndarray
    state: np.ndarray
    dt: float


class Iterate(NamedTuple):
    """Deformation gradients, history and Kirchhoff stresses [Pa] after an increment."""

    F: np.ndarray
    state: np.ndarray
    tau: np.ndarray


@compiled
def equilibrium(law, first, last, phi, start, du, iterate, force, slot, blocks):
    """Add the internal force of a body and its derivative by the increment of displacement.

    ``f_I += sum_p V0_p tau_p grad N_I`` and ``K_IJ += sum_p V0_p grad N_I . a_p . grad N_J`` with
    the moduli a of `kirchhoff_stress`, which hold the geometric part too (Iaconeta 2017, Eqs.
    30-36, with reference volumes).

    Parameters
    ----------
    law, first, last
        Of the material, and its particles: `first` to before `last`.
    phi : Stencils
        Functions at the start of the step.
    start : Start
    du : ndarray
        Increment of the nodal displacements [m], shape (N, dim).
    iterate : Iterate
        Written.
    force : ndarray
        Internal forces [N], shape (N, dim).
    slot, blocks : ndarray
        Of the tangent [N/m], shapes (P, K, K) and (blocks, dim, dim).

    Returns
    -------
    int
        Number of the first particle that the increment turns inside out, -1 if there is none.
    """
    axes = phi.axes
    dim = len(axes)
    grad = np.empty((phi.index.shape[1], dim))
    half = np.empty((dim, dim, dim))
    moduli = np.empty((dim, dim, dim, dim))
    increment, inverse_increment = matrix(axes, axes), matrix(axes, axes)
    F_old, F_new, tau = matrix(axes, axes), matrix(axes, axes), matrix(axes, axes)
    for p in range(first, last):
        if start.V0[p] == 0.0:
            continue
        displacement_gradient(phi, p, du, increment)
        for a in range(dim):
            for b in range(dim):
                F_old[a, b] = start.F[p, a, b]
        multiply(axes, increment, F_old, F_new)
        if not (determinant(axes, increment) > 0.0 and determinant(axes, F_new) > 0.0):
            return p
        inverse(axes, increment, inverse_increment)
        old, new = start.state[p], iterate.state[p]
        kirchhoff_step(law, axes, increment, F_new, start.dt, old, new, tau, moduli)
        for a in range(dim):
            for b in range(dim):
                iterate.F[p, a, b], iterate.tau[p, a, b] = F_new[a, b], tau[a, b]
        push_forward(phi, p, inverse_increment, grad)
        add_force(phi, p, start.V0[p], tau, grad, force)
        for k in range(phi.size[p]):
            contract(axes, start.V0[p], grad, k, moduli, half)
            for n in range(phi.size[p]):
                if slot[p, k, n] >= 0:
                    add_block(axes, half, grad, n, blocks, slot[p, k, n])
    return -1


@inlined
def displacement_gradient(phi, p, du, increment):
    """``DF = I + sum_I Du_I (x) grad_n N_I`` at particle p."""
    dim = len(phi.axes)
    for a in range(dim):
        for b in range(dim):
            increment[a, b] = 1.0 if a == b else 0.0
    for k in range(phi.size[p]):
        i = phi.index[p, k]
        for a in range(dim):
            for b in range(dim):
                increment[a, b] += du[i, a] * phi.grad_phi[p, k, b]


@inlined
def push_forward(phi, p, inverse_increment, grad):
    """``grad N_I = DF^-T grad_n N_I`` at particle p."""
    dim = len(phi.axes)
    for k in range(phi.size[p]):
        for a in range(dim):
            total = 0.0
            for b in range(dim):
                total += phi.grad_phi[p, k, b] * inverse_increment[b, a]
            grad[k, a] = total


@inlined
def add_force(phi, p, V0, tau, grad, force):
    """``f_I += V0 tau grad N_I`` of particle p."""
    dim = len(phi.axes)
    for k in range(phi.size[p]):
        i = phi.index[p, k]
        for a in range(dim):
            total = 0.0
            for b in range(dim):
                total += tau[a, b] * grad[k, b]
            force[i, a] += V0 * total


@inlined
def contract(axes, V0, grad, k, moduli, half):
    """``half_abd = V0 sum_c (grad N_k)_c a_acbd``."""
    dim = len(axes)
    for a in range(dim):
        for b in range(dim):
            for d in range(dim):
                total = 0.0
                for c in range(dim):
                    total += grad[k, c] * moduli[a, c, b, d]
                half[a, b, d] = V0 * total


@inlined
def add_block(axes, half, grad, n, blocks, s):
    """``K_ab += sum_d half_abd (grad N_n)_d`` in block s."""
    dim = len(axes)
    for a in range(dim):
        for b in range(dim):
            total = 0.0
            for d in range(dim):
                total += half[a, b, d] * grad[n, d]
            blocks[s, a, b] += total


@compiled
def add_mass(phi, m, slot, blocks):
    """``M_IJ += sum_p m_p N_I N_J`` [kg], shape (blocks,)."""
    for p in range(phi.size.shape[0]):
        for k in range(phi.size[p]):
            for n in range(phi.size[p]):
                s = slot[p, k, n]
                if s >= 0:
                    blocks[s] += m[p] * phi.phi[p, k] * phi.phi[p, n]


@compiled
def add_laplacian(phi, V0, stiffness, slot, blocks):
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


@compiled
def interpolate(phi, u, out):
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


@compiled
def internal_work(phi, V, sigma, du):
    """``sum_p V_p sigma_p : grad du``: the work of the stress on an increment, shape (N, dim) [J]."""
    work = 0.0
    for p in range(phi.size.shape[0]):
        for k in range(phi.size[p]):
            i = phi.index[p, k]
            for a in range(len(phi.axes)):
                for b in range(len(phi.axes)):
                    work += V[p] * sigma[p, a, b] * du[i, a] * phi.grad_phi[p, k, b]
    return work


@compiled
def commit(axes, V0, F_new, state_new, tau, F, state, V, sigma):
    """Take over the converged state: F, history, ``V = J V_0`` and ``sigma = tau / J``."""
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
