"""The minimisation behind maximum-entropy functions: multipliers, values, gradients at a point.

At a point x the functions are ``phi_i = w_i(x) exp(-lambda . dx_i) / Z`` with ``dx_i = x_i - x``
and the multipliers lambda that minimise ``log Z`` (Wobbes 2020, Eqs. 79-86, Arroyo and Ortiz 2006).
The priors w_i are radial, which makes their gradients ``grad w_i = -g_i dx_i`` with a scalar g_i,
and nothing is ever divided by w_i.
"""

import math

import numpy as np

from mpmbench.core.compiled import inlined, lean, matrix, summing, vector
from mpmbench.core.compiled.algebra import inverse_of_positive, length, multiply
from mpmbench.core.compiled.exponentials import exponentials, whole_lanes

DONE, TOO_NARROW, OUTSIDE, FLAT, STALLED = 0, 1, 2, 3, 4  # what becomes of a point

# Lengths of Newton steps, in exponents.
LAST_MOVE = 1e-5  # with its third-order correction, a shorter step errs by its cube
COUNTED_MOVE = 1e-7  # the same for a plain Newton step, which errs by its square
SMALL_MOVE = 4e-3  # a shorter one changes exponentials by their series to the fifth power
SAFE_MOVE = 0.85  # a step with exponents in a range of twice this always lessens log Z
FAR = 30.0  # exponents that are reached only on the way to infinity, near the hull and beyond
# Inverse variance, in supports, of points closer than about 1e-9 h to the hull.
HULL_CONDITION = 1e9
SIXTH = 1.0 / 6.0


@summing
def moments(axes, found, work, r, H):
    """Z, and the mean r of dx and its covariance H under w_i e_i.

    The slope of log Z in lambda is -r, its curvature H.
    """
    mean, square = vector(axes), matrix(axes, axes)
    Z = 0.0
    for d in range(len(axes)):
        mean[d] = 0.0
        for b in range(d + 1):
            square[d, b] = 0.0
    for k in range(whole_lanes(found)):
        phi = work.w[k] * work.e[k]
        Z += phi
        for d in range(len(axes)):
            moment = phi * work.dx[d, k]
            mean[d] += moment
            for b in range(d + 1):
                square[d, b] += moment * work.dx[b, k]
    scale = 1.0 / Z
    for d in range(len(axes)):
        r[d] = mean[d] * scale
        for b in range(d + 1):
            H[d, b] = square[d, b] * scale - r[d] * r[b]
            H[b, d] = H[d, b]
    return Z


@summing
def exponent_range(axes, found, vector, work):
    """Smallest and largest of ``vector . dx_i``."""
    low, high = np.inf, -np.inf
    for k in range(found):
        total = 0.0
        for d in range(len(axes)):
            total += vector[d] * work.dx[d, k]
        low, high = min(low, total), max(high, total)
    return low, high


@inlined
def tilt(axes, found, reach, multiplier, work):
    """Fill e_i for these multipliers; returns the logarithm that they lack."""
    shift = 0.0
    if length(axes, multiplier) * reach > 300.0:  # else no exponential can overflow
        shift = -exponent_range(axes, found, multiplier, work)[0]
    exponentials(axes, multiplier, work.dx, shift, work.e, whole_lanes(found))
    return shift


@inlined
def nudge(axes, found, step, work):
    """Change e_i by a step of the multipliers that is at most `SMALL_MOVE` long: exp(-t) by its series."""
    for k in range(whole_lanes(found)):
        t = 0.0
        for d in range(len(axes)):
            t -= step[d] * work.dx[d, k]
        s = t * t
        work.e[k] *= (1.0 + t) + s * ((0.5 + t * SIXTH) + s * (0.25 * SIXTH + t * (0.05 * SIXTH)))


@summing
def correct(axes, found, work, inverse_H, Z, third, step):
    """Add half of ``H^-1 E[dx (step . dx)^2]`` to a step: Chebyshev's method, of third order."""
    for d in range(len(axes)):
        third[d] = 0.0
    for k in range(whole_lanes(found)):
        t = 0.0
        for d in range(len(axes)):
            t += step[d] * work.dx[d, k]
        weight = work.w[k] * work.e[k] * t * t
        for d in range(len(axes)):
            third[d] += weight * work.dx[d, k]
    for d in range(len(axes)):
        for b in range(len(axes)):
            step[d] += 0.5 / Z * inverse_H[d, b] * third[b]


@summing
def partition(found, work):
    """``Z = sum_i w_i e_i``."""
    Z = 0.0
    for k in range(whole_lanes(found)):
        Z += work.w[k] * work.e[k]
    return Z


@lean
def take_safely(axes, found, reach, height, multiplier, step, r, work):
    """Take a Newton step that may be too long, and shorten it where log Z does not fall enough.

    The parabola through what is known tells by how much, but never to less than ``log(1 + n) / n``
    of the whole, n the range of its exponents: that much always lessens log Z, because its third
    derivative is at most n times its second. `height` is log Z at the start; returns what `tilt`
    returns.
    """
    origin = vector(axes)
    slope = 0.0
    for d in range(len(axes)):
        origin[d] = multiplier[d]
        slope += step[d] * r[d]
    low, high = exponent_range(axes, found, step, work)
    surely = math.log(1.0 + (high - low)) / (high - low)
    fraction = 1.0
    while True:
        for d in range(len(axes)):
            multiplier[d] = origin[d] + fraction * step[d]
        shift = tilt(axes, found, reach, multiplier, work)
        change = math.log(partition(found, work)) + shift - height
        if fraction <= surely or change <= -1e-4 * fraction * slope:
            return shift
        lowest = 0.5 * fraction * fraction * slope / (change + fraction * slope)
        fraction = max(surely, min(lowest, 0.5 * fraction) if lowest > 0.0 else 0.0)


@inlined
def newton(form, found, reach, last_move, work, multiplier, step):
    """Minimise log Z by Newton's method from the multipliers lambda that are given.

    Leaves lambda, e_i, and in `step` what a last step would still add to lambda. Returns what
    becomes of the point, the number of steps until the residual met the tolerance, and whether the
    point lies on the hull, where lambda is infinite and only the residual can converge.
    """
    axes = form.axes
    r, H, inverse_H = vector(axes), matrix(axes, axes), matrix(axes, axes)
    goal = form.tolerance * form.spacing * reach
    for d in range(len(axes)):
        multiplier[d], step[d] = 0.0, multiplier[d]
    work.e[: whole_lanes(found)] = 1.0
    move, height, shift = length(axes, step) * reach, 0.0, 0.0
    size, counted = 0.0, -1
    for steps in range(form.most_steps + 1):
        if steps > 0 and form.line_search and move > SAFE_MOVE:
            shift = take_safely(axes, found, reach, height, multiplier, step, r, work)
        else:
            for d in range(len(axes)):
                multiplier[d] += step[d]
            if move > SMALL_MOVE:
                shift = tilt(axes, found, reach, multiplier, work)
            elif move > 0.0:
                nudge(axes, found, step, work)
        Z = moments(axes, found, work, r, H)
        height = math.log(Z) + shift
        size = length(axes, multiplier) * reach
        residual = length(axes, r)
        if residual <= goal and counted < 0:
            counted = steps
        least = inverse_of_positive(axes, H, inverse_H)
        trace = 0.0
        for d in range(len(axes)):
            trace += inverse_H[d, d]
            step[d] = 0.0
            for b in range(len(axes)):
                step[d] += inverse_H[d, b] * r[b]
        move = length(axes, step) * reach
        if move <= last_move and least > 0.0:
            correct(axes, found, work, inverse_H, Z, r, step)
            return DONE, (steps + 1 if counted < 0 else counted), False
        if residual <= goal and not trace * reach * reach < HULL_CONDITION:
            return DONE, counted, True
        if not (least > 0.0 and move < 1e300):
            if not form.line_search:
                return STALLED, steps, False
            return (OUTSIDE if size > FAR else FLAT), steps, False
    return (OUTSIDE if size > FAR else STALLED), form.most_steps + 1, False


@inlined
def divide(axes, B, H, floor, M):
    """``M = B (H + floor tr(H) I)^-1``; returns the product of the traces of H and of the inverse."""
    inverse_H = matrix(axes, axes)
    trace, inverse_trace = 0.0, 0.0
    for d in range(len(axes)):
        trace += H[d, d]
    for d in range(len(axes)):
        H[d, d] += floor * trace
    inverse_of_positive(axes, H, inverse_H)
    for d in range(len(axes)):
        inverse_trace += inverse_H[d, d]
    multiply(axes, B, inverse_H, M)
    return trace * inverse_trace


@summing
def last_sums(axes, found, work, step, r, b, H, B):
    """Take the last Newton step in w and g, which become values and psi_i times Z; returns Z.

    Sums over them times dx, and times dx (x) dx, go to r and H, b and B (lower halves).
    """
    Z = 0.0
    for d in range(len(axes)):
        b[d] = r[d] = 0.0
        for c in range(d + 1):
            B[d, c] = H[d, c] = 0.0
    for k in range(whole_lanes(found)):
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
    return Z


@inlined
def finish(axes, found, work, step, floor, pull, row, stored):
    """Take the last Newton step and write values and gradients to row `row` of `stored`.

    ``grad phi_i = phi_i (M dx_i + b) - psi_i dx_i`` with ``psi_i = g_i e_i / Z`` (which is phi_i
    grad w_i / w_i along -dx_i), ``b = sum_j psi_j dx_j`` and ``M = (I + sum_j psi_j dx_j (x) dx_j)
    H^-1``: Wobbes 2020, Eqs. 84-86, with the signs corrected; where dx are in the metric of the
    point, times ``S^-T``, the transposed of `pull`. For points on the hull, where H is singular,
    its diagonal is raised by `floor` times its trace. Returns the residual ``|sum_i phi_i dx_i|``
    [m], and the traces of H and its inverse multiplied.
    """
    b, r, c = vector(axes), vector(axes), vector(axes)
    H, B, M, N = matrix(axes, axes), matrix(axes, axes), matrix(axes, axes), matrix(axes, axes)
    Z = last_sums(axes, found, work, step, r, b, H, B)
    scale = 1.0 / Z
    for d in range(len(axes)):
        r[d] *= scale
        b[d] *= scale
        for e in range(d + 1):
            H[d, e] *= scale
            B[d, e] *= scale
            H[e, d], B[e, d] = H[d, e], B[d, e]
        B[d, d] += 1.0
    condition = divide(axes, B, H, floor, M)
    multiply(axes, pull.T, M, N)
    for d in range(len(axes)):
        c[d] = 0.0
        for e in range(len(axes)):
            c[d] += pull[e, d] * b[e]
    write_gradients(axes, found, work, scale, N, c, pull)
    for k in range(found):
        stored.phi[row, k] = work.w[k]
        stored.index[row, k] = work.number[k]
        for d in range(len(axes)):
            stored.grad_phi[row, k, d] = work.offset[d, k]
    return length(axes, r), condition


@inlined
def write_gradients(axes, found, work, scale, N, c, pull):
    """Values times `scale` in w, and in `offset` ``phi_i (N dx_i + c) - psi_i S^-T dx_i``."""
    for k in range(whole_lanes(found)):
        value, psi = work.w[k] * scale, work.g[k] * scale
        work.w[k] = value
        for d in range(len(axes)):
            along, across = c[d], 0.0
            for e in range(len(axes)):
                along += N[d, e] * work.dx[e, k]
                across += pull[e, d] * work.dx[e, k]
            work.offset[d, k] = value * along - psi * across
