"""Maximum-entropy shape functions with a prior: the compiled part that `maxent` and `lme` share.

At a point x the functions are ``phi_i = w_i(x) exp(-lambda . dx_i) / Z`` with ``dx_i = x_i - x`` and the multipliers
lambda that minimise ``log Z`` (Wobbes 2020, Eqs. 79-86, Arroyo and Ortiz 2006). The priors w_i are radial, which makes
their gradients ``grad w_i = -g_i dx_i`` with a scalar g_i, and nothing is ever divided by w_i.
"""

import math
from typing import NamedTuple

import numpy as np

from mpmbench.core.bases.lean import LANES, exponentials, exponentiate, lean, matrix, vector
from mpmbench.core.bases.search import Buckets, cell_of
from mpmbench.core.compiled import kernel

CUBIC_SPLINE, QUARTIC_SPLINE, GAUSSIAN = 0, 1, 2
DONE, TOO_NARROW, OUTSIDE, FLAT, STALLED = 0, 1, 2, 3, 4  # what becomes of a point

LAST_MOVE = 1e-5  # a Newton step (in exponents) below this, with its third-order correction, errs by its cube
COUNTED_MOVE = 1e-7  # the same for a plain Newton step, which errs by its square
SAFE_MOVE = 0.85  # a step with exponents in a range of twice this always lessens log Z
FAR = 30.0  # exponents that Newton's method reaches only on its way to infinity, near the hull and beyond
HULL_CONDITION = 1e9  # inverse variance, in supports, of points closer than about 1e-9 h to the hull
INWARDS = 2.0**-23  # how far, relative to the support, the gradient of a point on the hull is taken inside it


class NodeCloud(NamedTuple):
    """What the kernels know of nodes and priors.

    Attributes
    ----------
    axes : tuple of float
        One entry per dimension (values unused).
    nodes : ndarray
        Positions [m], shape (N, dim).
    square, inverse_square : ndarray
        Squares of the radii of the supports d_i [m2] and one over them [1/m2], shape (N,).
    buckets : Buckets
        Which supports reach which cells.
    prior : int
        CUBIC_SPLINE, QUARTIC_SPLINE or GAUSSIAN.
    rim_exponent : float
        The Gaussian at the rim of its support is exp(-rim_exponent).
    spacing : float
        Nodal spacing h as a fraction of the support's radius.
    tolerance : float
        Largest residual ``|sum_i phi_i dx_i| / h``.
    line_search : bool
        Shorten Newton steps that do not lessen log Z; without it the iteration is the undamped one of Li (2009).
    max_iterations : int
    """

    axes: tuple[float, ...]
    nodes: np.ndarray
    square: np.ndarray
    inverse_square: np.ndarray
    buckets: Buckets
    prior: int
    rim_exponent: float
    spacing: float
    tolerance: float
    line_search: bool
    max_iterations: int


class Work(NamedTuple):
    """Working memory for one point; rows are padded with zeros to whole lanes of vector instructions.

    Attributes
    ----------
    offset, distance : ndarray
        x_i - x and its square for all candidates, shapes (dim, K) and (K,).
    number, inverse_square, rr, dx : ndarray
        Node numbers, 1/d_i^2, (|x_i - x| / d_i)^2 and x_i - x of the nodes whose supports cover the point.
    w, g, e : ndarray
        Priors, their slopes, and exp(-lambda . dx_i) of the same nodes, shape (K,).
    """

    offset: np.ndarray
    distance: np.ndarray
    number: np.ndarray
    inverse_square: np.ndarray
    rr: np.ndarray
    dx: np.ndarray
    w: np.ndarray
    g: np.ndarray
    e: np.ndarray


@kernel
def make_work(cloud):  # type: ignore[no-untyped-def]
    """Room for the longest list of candidates."""
    width = 1
    first = cloud.buckets.first
    for c in range(first.shape[0] - 1):
        width = max(width, first[c + 1] - first[c])
    width = (width // LANES + 1) * LANES
    dimension = len(cloud.axes)
    return Work(
        np.zeros((dimension, width)),
        np.zeros(width),
        np.zeros(width, np.int64),
        np.zeros(width),
        np.zeros(width),
        np.zeros((dimension, width)),
        np.zeros(width),
        np.zeros(width),
        np.zeros(width),
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
def gather(cloud, x, p, work):  # type: ignore[no-untyped-def]
    """Number of nodes whose supports cover point `p`, and the largest of these supports."""
    cell = cell_of(cloud.buckets, len(cloud.axes), x, p)
    first = cloud.buckets.first[cell]
    candidates = cloud.buckets.first[cell + 1] - first
    entry = cloud.buckets.entry[first:]
    for c in range(candidates):
        square = 0.0
        for d in range(len(cloud.axes)):
            difference = cloud.nodes[entry[c], d] - x[p, d]
            work.offset[d, c] = difference
            square += difference * difference
        work.distance[c] = square
    found = 0
    largest = 0.0
    for c in range(candidates):  # no branches: each is written, and the next overwrites it if it does not count
        i = entry[c]
        work.number[found] = i
        work.inverse_square[found] = cloud.inverse_square[i]
        work.rr[found] = work.distance[c] * cloud.inverse_square[i]
        for d in range(len(cloud.axes)):
            work.dx[d, found] = work.offset[d, c]
        covers = work.distance[c] < cloud.square[i]
        largest = max(largest, cloud.square[i] if covers else 0.0)
        found += covers
    for k in range(found, (found + LANES - 1) // LANES * LANES):
        work.inverse_square[k] = work.rr[k] = 0.0
        for d in range(len(cloud.axes)):
            work.dx[d, k] = 0.0
    return found, math.sqrt(largest)


@lean
def weigh(cloud, found, work):  # type: ignore[no-untyped-def]
    """Priors w_i and their slopes g_i at distance r = |dx_i| / d_i (Wobbes 2020, Eqs. 87-90)."""
    w, g, rr, inverse_square = work.w, work.g, work.rr, work.inverse_square
    padded = (found + LANES - 1) // LANES * LANES
    if cloud.prior == CUBIC_SPLINE:
        for k in range(padded):
            r = math.sqrt(rr[k])
            rest = 1.0 - r
            inner = r <= 0.5
            w[k] = 2.0 / 3.0 - 4.0 * rr[k] * rest if inner else 4.0 / 3.0 * rest * rest * rest
            g[k] = inverse_square[k] * (12.0 * r - 8.0 if inner else -4.0 * rest * rest / max(r, 0.5))
    elif cloud.prior == QUARTIC_SPLINE:
        for k in range(padded):
            r = math.sqrt(rr[k])
            w[k] = 1.0 - rr[k] * (6.0 - 8.0 * r + 3.0 * rr[k])
            g[k] = -12.0 * inverse_square[k] * (1.0 - r) * (1.0 - r)
    else:  # a Gaussian less its tangent at the rim in r^2, so that value and slope vanish there
        a = cloud.rim_exponent
        rim = math.exp(-a)
        for k in range(padded):
            w[k] = -a * rr[k]
        for block in range(0, padded, LANES):
            exponentiate(w, block)
        for k in range(padded):
            bell = w[k]
            w[k] = bell - rim * (1.0 + a * (1.0 - rr[k]))
            g[k] = -2.0 * a * inverse_square[k] * (bell - rim)


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

    Leaves e_i, and in `step` what a last Newton step would still add to lambda. Steps that could be too long are
    checked afterwards and, where log Z has not fallen, replaced by ``log(1 + n) / n`` of them, n the range of their
    exponents: that one always lessens log Z, because its third derivative is at most n times its second.

    Returns
    -------
    status, iterations, on_hull
        Number of steps until the residual met the tolerance (the last step is not counted); whether the point lies on
        the hull, where lambda is infinite and only the residual can converge.
    """
    axes = cloud.axes
    multiplier, origin, taken = vector(axes), vector(axes), vector(axes)
    r = vector(axes)
    H, inverse_H = matrix(axes, axes), matrix(axes, axes)
    smallest_residual = cloud.tolerance * cloud.spacing * reach
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
        for block in range(0, found if iteration > 0 else 0, LANES):
            exponentials(axes, multiplier, work.dx, shift, work.e, block)
        Z = moments(axes, found, work, r, H)
        if on_trial:
            now = math.log(Z) + shift
            if not now <= height - 1e-4 * fraction * slope:
                surely = math.log(1.0 + spread) / spread
                parabola = 0.5 * fraction * fraction * slope / (now - height + fraction * slope)  # where it is lowest
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

    ``grad phi_i = phi_i (M dx_i + b) - psi_i dx_i`` with ``psi_i = g_i e_i / Z`` (which is phi_i grad w_i / w_i along
    -dx_i), ``b = sum_j psi_j dx_j`` and ``M = (I + sum_j psi_j dx_j (x) dx_j) H^-1``: Wobbes 2020, Eqs. 84-86, with the
    signs corrected. Returns the residual.
    """
    b, r = vector(axes), vector(axes)
    H, inverse_H, B, M = matrix(axes, axes), matrix(axes, axes), matrix(axes, axes), matrix(axes, axes)
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


@lean
def evaluate_inside(cloud, x, p, work, row, index, phi, grad_phi):  # type: ignore[no-untyped-def]
    """Functions at point `p` of `x`, written to row `row`; returns status, number of functions or of steps, on_hull."""
    found, reach = gather(cloud, x, p, work)
    if found == 0:
        return OUTSIDE, 0, 0, False
    if found > index.shape[1]:
        return TOO_NARROW, found, 0, False
    step = vector(cloud.axes)
    weigh(cloud, found, work)
    status, iterations, on_hull = newton(cloud, found, reach, LAST_MOVE, work, step)
    if status != DONE or on_hull:
        return status, found, iterations, on_hull
    residual = finish(cloud.axes, found, work, step, row, index, phi, grad_phi)
    if not residual <= cloud.tolerance * cloud.spacing * reach:
        return STALLED, found, iterations, False
    return DONE, found, iterations, False


@lean
def evaluate_on_hull(cloud, x, p, found, work, row, index, phi, grad_phi):  # type: ignore[no-untyped-def]
    """The same for a point on the hull: values of the limit, and gradients from a little inside.

    On a face of the hull only the nodes of that face have non-zero functions, and lambda is infinite. The values there
    are within the tolerance; the gradient exists only as a limit, taken on the way to the middle of the support.
    """
    inside = matrix((0.0,), cloud.axes)
    for d in range(len(cloud.axes)):
        inside[0, d] = x[p, d]
    for k in range(found):
        for d in range(len(cloud.axes)):
            inside[0, d] += INWARDS / found * work.dx[d, k]
    status, size, _, again = evaluate_inside(cloud, inside, 0, work, row, index, phi, grad_phi)
    if status != DONE or again:
        return (TOO_NARROW if status == TOO_NARROW else FLAT), max(size, found)

    step = vector(cloud.axes)
    found, reach = gather(cloud, x, p, work)
    weigh(cloud, found, work)
    newton(cloud, found, reach, LAST_MOVE, work, step)
    most = total = 0.0
    for k in range(found):
        work.w[k] *= work.e[k]
        most += work.w[k]
    for k in range(found):
        work.w[k] = 0.0 if work.w[k] <= cloud.tolerance * most else work.w[k]
        total += work.w[k]
    near = 0
    for k in range(size):
        while near < found and work.number[near] < index[row, k]:
            near += 1
        same = near < found and work.number[near] == index[row, k]
        phi[row, k] = work.w[near] / total if same else 0.0
    return DONE, size


@lean
def evaluate_range(cloud, work, x, first, last, size, index, phi, grad_phi, iterations):  # type: ignore[no-untyped-def]
    """Store the functions of points ``first <= p < last``; any split into ranges gives the same bits.

    Returns
    -------
    status, point, found
        DONE, or what became of the first point that failed, with the number of nodes around it.
    """
    for p in range(first, last):
        status, found, steps, on_hull = evaluate_inside(cloud, x, p, work, p, index, phi, grad_phi)
        if status == DONE and on_hull:
            status, found = evaluate_on_hull(cloud, x, p, found, work, p, index, phi, grad_phi)
        iterations[p] = steps
        if status != DONE:
            return status, p, found
        size[p] = found
    return DONE, -1, 0


@lean
def widest(cloud, work, x):  # type: ignore[no-untyped-def]
    """Largest number of nodes whose supports cover one of the points."""
    most = 0
    for p in range(x.shape[0]):
        most = max(most, gather(cloud, x, p, work)[0])
    return most


@lean
def count_steps(cloud, work, x, iterations):  # type: ignore[no-untyped-def]
    """Newton steps at each point until the residual meets the tolerance, -1 where the iteration fails."""
    step = vector(cloud.axes)
    for p in range(x.shape[0]):
        iterations[p] = -1
        found, reach = gather(cloud, x, p, work)
        if found > 0:
            weigh(cloud, found, work)
            status, steps, _ = newton(cloud, found, reach, COUNTED_MOVE, work, step)
            if status == DONE:
                iterations[p] = steps
