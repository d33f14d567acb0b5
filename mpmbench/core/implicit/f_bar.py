"""F-bar: one change of volume for all particles of a cell, against volumetric locking.

De Souza Neto et al. (1996) replace the determinant of the increment DF of a step by one value per
cell, and Coombs et al. (2018) do so in the material point method:

    DF-bar_p = (J-bar / J_p)^(1/dim) DF_p,    J-bar = sum_p w_p J_p / sum_p w_p,

with J_p = det DF_p and the volumes w_p at the start of the step. Here J-bar is the mean over the
particles of a cell, and forces are the derivative of the energy ``sum_p V0_p W(F-bar_p)`` (Simo,
Taylor and Pister 1985), so that work is stored and the tangent of an elastic law is symmetric. With

    rho(v) = (D(v) - div v_p) / dim,    D(v) = sum_p w_p J_p div v_p / sum_p w_p J_p,

the gradient of DF-bar is ``grad v + rho(v) I``, and, with pi = tr(tau) / dim,

    f(v) = sum_p V0_p (tau - pi I) : grad v + (sum_p V0_p pi) D(v).
"""

import numpy as np

from mpmbench.core.compiled import compiled, inlined, matrix
from mpmbench.core.compiled.algebra import determinant, inverse, multiply
from mpmbench.core.implicit.assembly import (
    add_block,
    add_force,
    contract,
    displacement_gradient,
    push_forward,
)
from mpmbench.core.materials import kirchhoff_step
from mpmbench.core.state import State
from mpmbench.core.transfer.sharing import Cells, cells_of, share_pressure


def with_same_functions(size: np.ndarray, index: np.ndarray) -> Cells:
    """Cells of the particles whose functions are ``index[p, :size[p]]``; those without any are in none."""
    seen = np.where(np.arange(index.shape[1]) < size[:, None], index, -1)
    member = np.flatnonzero(size > 0)
    return cells_of(np.unique(seen[member], axis=0, return_inverse=True)[1].ravel(), member)


def with_mean_pressure(s: State, cells: Cells) -> np.ndarray:
    """The stresses that act on ``grad v`` in f(v) at the start of a step: each cell has one pressure."""
    sigma = s.particles.sigma.copy()
    share_pressure(s.axes, cells, s.particles.V, sigma, 0, len(cells.first) - 1)
    return sigma


@compiled
def equilibrium(law, phi, start, du, iterate, force, slot, blocks, cells):
    """`assembly.equilibrium` with F-bar: the same sums, and each cell's own as products of vectors.

    The second derivative of the energy is that of `assembly` for the gradients above, and

        sum_p V0_p (dim pi rho(u) rho(v) + pi tr(grad u grad v) + rho(u) tau : grad v
                    + rho(v) tau : grad u)
        + (sum_p V0_p pi) (sum_p w_p J_p (div u div v - tr(grad u grad v)) / sum_p w_p J_p
                           - D(u) D(v)).

    Parameters
    ----------
    cells : Cells
        The others are those of `assembly.equilibrium`, and so is what is returned.
    """
    axes = phi.axes
    dim = len(axes)
    width = phi.index.shape[1]
    grad, mean = np.empty((width, dim)), np.empty((width, dim))
    left, right = np.empty((width, dim)), np.empty((width, dim))
    half = np.empty((dim, dim, dim))
    moduli = np.empty((dim, dim, dim, dim))
    increment, inverse_increment = matrix(axes, axes), matrix(axes, axes)
    F_old, F_new, tau, vectors = (
        matrix(axes, axes),
        matrix(axes, axes),
        matrix(axes, axes),
        matrix(axes, axes),
    )
    for c in range(cells.first.shape[0] - 1):
        before, after = 0.0, 0.0  # volumes of the cell's particles
        mean[:] = 0.0
        for m in range(cells.first[c], cells.first[c + 1]):
            p = cells.member[m]
            displacement_gradient(phi, p, du, increment)
            copy(axes, start.F[p], F_old)
            J = determinant(axes, increment)
            if not (J > 0.0 and determinant(axes, F_old) > 0.0):
                return p
            volume = start.V0[p] * determinant(axes, F_old)
            before, after = before + volume, after + volume * J
            inverse(axes, increment, inverse_increment)
            push_forward(phi, p, inverse_increment, grad)
            for k in range(phi.size[p]):
                for a in range(dim):
                    mean[k, a] += volume * J * grad[k, a]
        mean /= after  # D(v) = sum_I v_I . mean_I
        left[:], right[:] = 0.0, 0.0
        pressure, square = 0.0, 0.0
        for m in range(cells.first[c], cells.first[c + 1]):
            p = cells.member[m]
            V0 = start.V0[p]
            displacement_gradient(phi, p, du, increment)
            inverse(axes, increment, inverse_increment)
            push_forward(phi, p, inverse_increment, grad)
            scale = (after / before / determinant(axes, increment)) ** (1.0 / dim)
            for a in range(dim):
                for b in range(dim):
                    increment[a, b] *= scale
            copy(axes, start.F[p], F_old)
            multiply(axes, increment, F_old, F_new)
            old, new = start.state[p], iterate.state[p]
            kirchhoff_step(law, axes, increment, F_new, start.dt, old, new, tau, moduli)
            pi = 0.0
            for a in range(dim):
                pi += tau[a, a] / dim
                for b in range(dim):
                    iterate.F[p, a, b], iterate.tau[p, a, b] = F_new[a, b], tau[a, b]
            pressure += V0 * pi
            mixed(axes, moduli, tau, pi, False, vectors)
            add_rows(phi, p, V0, vectors, grad, right)
            mixed(axes, moduli, tau, pi, True, vectors)
            add_rows(phi, p, V0, vectors, grad, left)
            square += V0 * (traces(axes, moduli) / dim + pi) / dim
            local_moduli(axes, moduli, tau, pi)
            for a in range(dim):
                tau[a, a] -= pi
            add_force(phi, p, V0, tau, grad, force)
            for k in range(phi.size[p]):
                contract(axes, V0, grad, k, moduli, half)
                for n in range(phi.size[p]):
                    if slot[p, k, n] >= 0:
                        add_block(axes, half, grad, n, blocks, slot[p, k, n])
        for m in range(cells.first[c], cells.first[c + 1]):
            p = cells.member[m]
            displacement_gradient(phi, p, du, increment)
            copy(axes, start.F[p], F_old)
            share = start.V0[p] * determinant(axes, F_old) * determinant(axes, increment) / after
            inverse(axes, increment, inverse_increment)
            push_forward(phi, p, inverse_increment, grad)
            for k in range(phi.size[p]):
                for n in range(phi.size[p]):
                    if slot[p, k, n] >= 0:
                        for a in range(dim):
                            for b in range(dim):
                                turned = grad[k, a] * grad[n, b] - grad[k, b] * grad[n, a]
                                blocks[slot[p, k, n], a, b] += pressure * share * turned
        p = cells.member[cells.first[c]]
        for k in range(phi.size[p]):
            for a in range(dim):
                force[phi.index[p, k], a] += pressure * mean[k, a]
            for n in range(phi.size[p]):
                s = slot[p, k, n]
                if s >= 0:
                    for a in range(dim):
                        for b in range(dim):
                            value = left[k, a] * mean[n, b] + mean[k, a] * right[n, b]
                            value += (square - pressure) * mean[k, a] * mean[n, b]
                            blocks[s, a, b] += value
    return -1


@inlined
def copy(axes, source, target):
    """``target = source``, shape (dim, dim)."""
    for a in range(len(axes)):
        for b in range(len(axes)):
            target[a, b] = source[a, b]


@inlined
def traces(axes, moduli):
    """``I : a : I``."""
    total = 0.0
    for c in range(len(axes)):
        for d in range(len(axes)):
            total += moduli[c, c, d, d]
    return total


@inlined
def mixed(axes, moduli, tau, pi, first, out):
    """What multiplies D(u) / dim and grad v, if `first`, or D(v) / dim and grad u.

    ``(a : I - (I : a : I) I / dim - pi I + tau) / dim``, or with ``I : a``.
    """
    dim = len(axes)
    mean = traces(axes, moduli) / dim
    for i in range(dim):
        for j in range(dim):
            total = tau[i, j] - (mean + pi if i == j else 0.0)
            for k in range(dim):
                total += moduli[i, j, k, k] if first else moduli[k, k, i, j]
            out[i, j] = total / dim


@inlined
def add_rows(phi, p, V0, vectors, grad, out):
    """``out_k += V0 vectors . grad N_k``, shape (K, dim)."""
    for k in range(phi.size[p]):
        for a in range(len(phi.axes)):
            for b in range(len(phi.axes)):
                out[k, a] += V0 * vectors[a, b] * grad[k, b]


@inlined
def local_moduli(axes, moduli, tau, pi):
    """Write to `moduli` what multiplies grad u and grad v.

    ``Q : a : Q + pi (I (x) I / dim + turned identity) - (I (x) tau + tau (x) I) / dim`` with
    ``Q = 1 - I (x) I / dim``.
    """
    dim = len(axes)
    above, behind = matrix(axes, axes), matrix(axes, axes)
    whole = traces(axes, moduli)
    for i in range(dim):
        for j in range(dim):
            above[i, j], behind[i, j] = 0.0, 0.0
            for k in range(dim):
                above[i, j] += moduli[k, k, i, j]
                behind[i, j] += moduli[i, j, k, k]
    for i in range(dim):
        for a in range(dim):
            for j in range(dim):
                for b in range(dim):
                    value = moduli[i, a, j, b]
                    if i == a:
                        value -= (above[j, b] + tau[j, b]) / dim
                    if j == b:
                        value -= (behind[i, a] + tau[i, a]) / dim
                    if i == a and j == b:
                        value += (whole / dim + pi) / dim
                    if i == b and j == a:
                        value += pi
                    moduli[i, a, j, b] = value
