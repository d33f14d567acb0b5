"""Maximum-entropy shape functions with a prior: the compiled part that `maxent` and `lme` share.

At a point x the functions are ``phi_i = w_i(x) exp(-lambda . dx_i) / Z`` with ``dx_i = x_i - x``
and the multipliers lambda that minimise ``log Z`` (Wobbes 2020, Eqs. 79-86, Arroyo and Ortiz 2006).
The priors w_i are radial, which makes their gradients ``grad w_i = -g_i dx_i`` with a scalar g_i,
and nothing is ever divided by w_i.
"""

import math

import numpy as np

from mpmbench.core.compiled.exponentials import LANES, exponentials, lean, matrix, vector

DONE, TOO_NARROW, OUTSIDE, FLAT, STALLED = 0, 1, 2, 3, 4  # what becomes of a point

LAST_MOVE = 1e-5  # a Newton step (in exponents) below this, with its third-order correction, errs by its cube
COUNTED_MOVE = 1e-7  # the same for a plain Newton step, which errs by its square
SAFE_MOVE = 0.85  # a step with exponents in a range of twice this always lessens log Z
FAR = 30.0  # exponents that Newton's method reaches only on its way to infinity, near the hull and beyond
HULL_CONDITION = (
    1e9  # inverse variance, in supports, of points closer than about 1e-9 h to the hull
)


@lean
def inverse(axes, A, B):  # type: ignore[no-untyped-def]
    """``B = A^-1`` of a symmetric matrix; returns the determinant."""
    if len(axes) == 1:
        determinant = A[0, 0]
        B[0, 0] = 1.0 / determinant
    elif len(axes) == 2:
        determinant = A[0, 0] * A[1, 1] - A[1, 0] * A[1, 0]
        scale = 1.0 / determinant
        B[0, 0], B[1, 1], B[1, 0] = A[1, 1] * scale, A[0, 0] * scale, -A[1, 0] * scale
        B[0, 1] = B[1, 0]
    else:
        a = A[1, 1] * A[2, 2] - A[2, 1] * A[2, 1]
        b = A[2, 1] * A[2, 0] - A[1, 0] * A[2, 2]
        c = A[1, 0] * A[2, 1] - A[1, 1] * A[2, 0]
        determinant = A[0, 0] * a + A[1, 0] * b + A[2, 0] * c
        scale = 1.0 / determinant
        B[0, 0], B[1, 0], B[2, 0] = a * scale, b * scale, c * scale
        B[1, 1] = (A[0, 0] * A[2, 2] - A[2, 0] * A[2, 0]) * scale
        B[2, 1] = (A[1, 0] * A[2, 0] - A[0, 0] * A[2, 1]) * scale
        B[2, 2] = (A[0, 0] * A[1, 1] - A[1, 0] * A[1, 0]) * scale
        B[0, 1], B[0, 2], B[1, 2] = B[1, 0], B[2, 0], B[2, 1]
    return determinant


@lean
def moments(axes, found, work, r, H):  # type: ignore[no-untyped-def]
    """Z, the mean r of dx and its covariance H under w_i e_i: the slope of log Z in lambda is -r, its curvature H."""
    Z = 0.0
    for d in range(len(axes)):
        r[d] = 0.0
        for b in range(d + 1):
            H[d, b] = 0.0
    for k in range(found):
        phi = work.w[k] * work.e[k]
        Z += phi
        for d in range(len(axes)):
            moment = phi * work.dx[d, k]
            r[d] += moment
            for b in range(d + 1):
                H[d, b] += moment * work.dx[b, k]
    scale = 1.0 / Z
    for d in range(len(axes)):
        r[d] *= scale
        for b in range(d + 1):
            H[d, b] = H[d, b] * scale - r[d] * r[b]
            H[b, d] = H[d, b]
    return Z


@lean
def largest_exponent(axes, found, multiplier, work):  # type: ignore[no-untyped-def]
    """Largest of ``-lambda . dx_i``."""
    largest = -np.inf
    for k in range(found):
        total = 0.0
        for d in range(len(axes)):
            total -= multiplier[d] * work.dx[d, k]
        largest = max(largest, total)
    return largest


@lean
def length(axes, a):  # type: ignore[no-untyped-def]
    """Length of a vector."""
    square = 0.0
    for d in range(len(axes)):
        square += a[d] * a[d]
    return math.sqrt(square)


@lean
def correct(axes, found, work, inverse_H, Z, third, step):  # type: ignore[no-untyped-def]
    """Add to a Newton step half of ``H^-1 E[dx (step . dx)^2]``: Chebyshev's method, of third order."""
    for d in range(len(axes)):
        third[d] = 0.0
    for k in range(found):
        t = 0.0
        for d in range(len(axes)):
            t += step[d] * work.dx[d, k]
        weight = work.w[k] * work.e[k] * t * t
        for d in range(len(axes)):
            third[d] += weight * work.dx[d, k]
    for d in range(len(axes)):
        for b in range(len(axes)):
            step[d] += 0.5 / Z * inverse_H[d, b] * third[b]


@lean
def newton(cloud, found, reach, last_move, work, step):  # type: ignore[no-untyped-def]
    """Minimise log Z over the multipliers by Newton's method from lambda = 0.

    Leaves e_i, and in `step` what a last step would still add to lambda. Steps that could be too
    long are checked afterwards. Where log Z has not fallen enough, the parabola through what is
    known tells a shorter one, but never shorter than ``log(1 + n) / n`` of the whole, n the range
    of its exponents: that much always lessens log Z, because its third derivative is at most n
    times its second.

    Returns
    -------
    status, iterations, on_hull
        Number of steps until the residual met the tolerance (the last step is not counted); whether
        the point lies on the hull, where lambda is infinite and only the residual can converge.
    """
    axes = cloud.axes
    multiplier, origin, taken = vector(axes), vector(axes), vector(axes)
    r = vector(axes)
    H, inverse_H = matrix(axes, axes), matrix(axes, axes)
    smallest_residual = cloud.tolerance * cloud.spacing * reach
    padded = (found + LANES - 1) // LANES * LANES
    work.e[:found] = 1.0
    for d in range(len(axes)):
        multiplier[d] = 0.0
    on_trial = False
    height = slope = spread = size = 0.0
    fraction = 1.0
    steps, counted = 0, -1
    for iteration in range(cloud.max_iterations + 1):
        shift = 0.0
        size = length(axes, multiplier) * reach
        if size > 300.0:  # else no exponential can overflow
            shift = largest_exponent(axes, found, multiplier, work)
        if iteration > 0:
            exponentials(axes, multiplier, work.dx, shift, work.e, padded)
        Z = moments(axes, found, work, r, H)
        if on_trial:
            now = math.log(Z) + shift
            if not now <= height - 1e-4 * fraction * slope:
                surely = math.log(1.0 + spread) / spread
                parabola = (
                    0.5 * fraction * fraction * slope / (now - height + fraction * slope)
                )  # where it is lowest
                fraction = max(surely, min(parabola, 0.5 * fraction) if parabola > 0.0 else 0.0)
                on_trial = fraction > surely
                for d in range(len(axes)):
                    multiplier[d] = origin[d] + fraction * taken[d]
                continue
            on_trial = False
        residual = length(axes, r)
        if residual <= smallest_residual and counted < 0:
            counted = steps
        determinant = inverse(axes, H, inverse_H)
        trace = 0.0
        for d in range(len(axes)):
            trace += inverse_H[d, d]
            step[d] = 0.0
            for b in range(len(axes)):
                step[d] += inverse_H[d, b] * r[b]
        move = length(axes, step) * reach
        if move <= last_move and determinant > 0.0:
            correct(axes, found, work, inverse_H, Z, r, step)
            return DONE, (steps + 1 if counted < 0 else counted), False
        if residual <= smallest_residual and not trace * reach * reach < HULL_CONDITION:
            return DONE, counted, True
        if not (determinant > 0.0 and move < 1e300):
            if not cloud.line_search:
                return STALLED, steps, False
            return (OUTSIDE if size > FAR else FLAT), steps, False
        if cloud.line_search and move > SAFE_MOVE:
            on_trial = True
            fraction = 1.0
            height = math.log(Z) + shift
            low, high = np.inf, -np.inf
            slope = 0.0
            for d in range(len(axes)):
                origin[d], taken[d] = multiplier[d], step[d]
                slope += step[d] * r[d]
            for k in range(found):
                total = 0.0
                for d in range(len(axes)):
                    total += step[d] * work.dx[d, k]
                low, high = min(low, total), max(high, total)
            spread = high - low
        steps += 1
        for d in range(len(axes)):
            multiplier[d] += step[d]
    return (OUTSIDE if size > FAR else STALLED), steps, False


@lean
def finish(axes, found, work, step, row, index, phi, grad_phi):  # type: ignore[no-untyped-def]
    """Take the last Newton step and write values and gradients to row `row` of `phi` and `grad_phi`.

    ``grad phi_i = phi_i (M dx_i + b) - psi_i dx_i`` with ``psi_i = g_i e_i / Z`` (which is phi_i
    grad w_i / w_i along -dx_i), ``b = sum_j psi_j dx_j`` and ``M = (I + sum_j psi_j dx_j (x) dx_j)
    H^-1``: Wobbes 2020, Eqs. 84-86, with the signs corrected. Returns the residual.
    """
    b, r = vector(axes), vector(axes)
    H, inverse_H, B, M = (
        matrix(axes, axes),
        matrix(axes, axes),
        matrix(axes, axes),
        matrix(axes, axes),
    )
    Z = 0.0
    for d in range(len(axes)):
        b[d] = r[d] = 0.0
        for c in range(d + 1):
            B[d, c] = H[d, c] = 0.0
    for k in range(found):
        t = 0.0
        for d in range(len(axes)):
            t += step[d] * work.dx[d, k]
        e = work.e[k] * (1.0 - t + 0.5 * t * t)  # exp(-t) of so small a step
        value, psi = work.w[k] * e, work.g[k] * e
        work.w[k], work.g[k] = value, psi
        Z += value
        for d in range(len(axes)):
            moment, slope = value * work.dx[d, k], psi * work.dx[d, k]
            r[d] += moment
            b[d] += slope
            for c in range(d + 1):
                H[d, c] += moment * work.dx[c, k]
                B[d, c] += slope * work.dx[c, k]
    scale = 1.0 / Z
    for d in range(len(axes)):
        r[d] *= scale
        b[d] *= scale
        for c in range(d + 1):
            H[d, c] *= scale
            B[d, c] *= scale
            B[c, d] = B[d, c]
        B[d, d] += 1.0
    inverse(axes, H, inverse_H)
    for d in range(len(axes)):
        for c in range(len(axes)):
            total = 0.0
            for a in range(len(axes)):
                total += B[d, a] * inverse_H[a, c]
            M[d, c] = total
    for k in range(found):
        value, psi = work.w[k] * scale, work.g[k] * scale
        phi[row, k] = value
        index[row, k] = work.number[k]
        for d in range(len(axes)):
            total = b[d]
            for c in range(len(axes)):
                total += M[d, c] * work.dx[c, k]
            grad_phi[row, k, d] = value * total - psi * work.dx[d, k]
    return length(axes, r)
