"""Conjugate gradients with a symmetric Gauss-Seidel sweep, for a matrix as in `sparse`."""

import numpy as np

from mpmbench.core.compiled import compiled, lean

# Of the residual, relative to the right-hand side, in the norm of the preconditioner.
TOLERANCE = 1e-13
MOST_ITERATIONS = 2000


@lean
def matrix_product(columns, values, a, out):
    """``out = M a`` for each column of `a`, shape (N, dim)."""
    for i in range(a.shape[0]):
        for d in range(a.shape[1]):
            out[i, d] = 0.0
        for k in range(columns.shape[1]):
            j = columns[i, k]
            for d in range(a.shape[1]):
                out[i, d] += values[i, k] * a[j, d]


@lean
def solve_lower(columns, values, diagonal, free, b, z):
    """``z = (D + L)^-1 b`` on the free components, zero elsewhere; `z` may be `b`."""
    n, dim = b.shape
    for i in range(n):
        inverse = 1.0 / values[i, diagonal[i]]
        for d in range(dim):
            total = b[i, d]
            for k in range(diagonal[i]):
                total -= values[i, k] * z[columns[i, k], d]
            z[i, d] = total * inverse if free[i, d] else 0.0


@lean
def solve_upper(columns, values, diagonal, free, s, t, rest):
    """``t = (D + U)^-1 s`` on the free components, zero elsewhere, and ``rest = s - D t``."""
    n, dim = s.shape
    for i in range(n - 1, -1, -1):
        diagonal_i = values[i, diagonal[i]]
        inverse = 1.0 / diagonal_i
        for d in range(dim):
            total = s[i, d]
            # what the last row has given comes last
            for k in range(columns.shape[1] - 1, diagonal[i], -1):
                total -= values[i, k] * t[columns[i, k], d]
            t[i, d] = total * inverse if free[i, d] else 0.0
            rest[i, d] = s[i, d] - diagonal_i * t[i, d]


@compiled
def conjugate_gradients(columns, values, diagonal, free, rhs, out, r, t, w, s):
    """Solve ``M out = rhs`` on the free components, given `out` on the others.

    Each component iterates by itself; they share one pass over M. The preconditioner is a symmetric
    Gauss-Seidel sweep, ``(D + L) D^-1 (D + U)``. Since its factors sum up to ``M + D``, the product
    with M costs nothing beside the sweep (Eisenstat 1981): for ``t = (D + U)^-1 s``,
    ``(D + L)^-1 M t = t + (D + L)^-1 (s - D t)``.

    Returns the number of iterations, -1 when they do not converge or M is not positive definite.
    """
    n, dim = rhs.shape
    for i in range(n):
        for d in range(dim):
            if free[i, d]:
                out[i, d] = 0.0
    matrix_product(columns, values, out, w)
    for i in range(n):
        for d in range(dim):
            w[i, d] = rhs[i, d] - w[i, d]
    solve_lower(columns, values, diagonal, free, w, r)
    rr = np.zeros(dim)  # r D r, which is residual P^-1 residual
    alpha, beta = np.zeros(dim), np.zeros(dim)
    for i in range(n):
        for d in range(dim):
            s[i, d] = values[i, diagonal[i]] * r[i, d]
            rr[d] += r[i, d] * s[i, d]
    goal = TOLERANCE**2 * rr
    for iteration in range(MOST_ITERATIONS):
        if np.all(rr <= goal):
            return iteration
        solve_upper(columns, values, diagonal, free, s, t, w)
        solve_lower(columns, values, diagonal, free, w, w)
        alpha[:] = 0.0
        for i in range(n):
            for d in range(dim):
                w[i, d] += t[i, d]
                alpha[d] += s[i, d] * w[i, d]
        for d in range(dim):
            if rr[d] > goal[d]:
                if not alpha[d] > 0.0:
                    return -1
                alpha[d] = rr[d] / alpha[d]
            else:
                alpha[d] = 0.0
        beta[:] = 0.0
        for i in range(n):
            for d in range(dim):
                if free[i, d]:
                    out[i, d] += alpha[d] * t[i, d]
                r[i, d] -= alpha[d] * w[i, d]
                beta[d] += values[i, diagonal[i]] * r[i, d] * r[i, d]
        for d in range(dim):
            previous = rr[d]
            rr[d] = beta[d]
            beta[d] = rr[d] / previous if previous > 0.0 else 0.0
        for i in range(n):
            for d in range(dim):
                s[i, d] = values[i, diagonal[i]] * r[i, d] + beta[d] * s[i, d]
    return -1
