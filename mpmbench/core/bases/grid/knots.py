"""Open knot vectors: polynomials on their spans, Greville abscissae, and how knots move.

Knots are given by their distinct values, `breaks`, shape (dim, A + 1), of which the first and the
last along an axis count degree + 1 times; `shape` holds the numbers of functions along the axes.
"""

import numpy as np

from mpmbench.core.compiled import compiled


@compiled
def tabulate(breaks, shape, coefficients, inverse_width, nodes):
    """Fill in what follows from the knots; returns the first axis along which they cross, else -1.

    Nodes are the Greville abscissae [m] of all functions, shape (N, dim): with ``g_i = (xi_{i+1} +
    ... + xi_{i+d}) / d`` ``sum_i g_i phi_i(x) = x`` holds for every degree d.
    """
    dim, degree = breaks.shape[0], coefficients.shape[2] - 1
    abscissae = np.zeros((dim, breaks.shape[1] + degree))
    for d in range(dim):
        spans = shape[d] - degree
        for s in range(spans):
            if not breaks[d, s + 1] > breaks[d, s]:
                return d
        polynomials(breaks[d, : spans + 1], degree, coefficients[d], inverse_width[d])
        for i in range(shape[d]):
            for j in range(i + 1, i + degree + 1):
                abscissae[d, i] += breaks[d, min(max(j - degree, 0), spans)] / degree
    for i in range(nodes.shape[0]):
        rest = i
        for d in range(dim - 1, -1, -1):
            nodes[i, d] = abscissae[d, rest % shape[d]]
            rest //= shape[d]
    return -1


@compiled
def polynomials(breaks, degree, coefficients, inverse_width):
    """Polynomials of open B-splines on each span, by Cox and de Boor (Wobbes 2020, section 6.2).

    They go to `coefficients`, shape (n, degree + 1, lanes), for n spans.
    """
    spans = breaks.shape[0] - 1
    polynomial = np.zeros((degree + 1, degree + 1))
    lower = np.zeros((degree + 1, degree + 1))
    for s in range(spans):
        width = breaks[s + 1] - breaks[s]
        inverse_width[s] = 1.0 / width
        polynomial[:] = 0.0
        polynomial[0, 0] = 1.0  # degree 0: the one function that is 1 on this span
        for r in range(1, degree + 1):
            lower, polynomial = polynomial, lower
            polynomial[:] = 0.0
            # the r functions of degree r - 1; the a-th has support [left, right] around span s
            for a in range(r):
                left = breaks[min(max(s - r + 1 + a, 0), spans)]
                right = breaks[min(max(s + 1 + a, 0), spans)]
                inverse = 1.0 / (right - left)
                for k in range(r):
                    c = lower[a, k]
                    polynomial[a + 1, k] += c * (breaks[s] - left) * inverse
                    polynomial[a + 1, k + 1] += c * width * inverse
                    polynomial[a, k] += c * (right - breaks[s]) * inverse
                    polynomial[a, k + 1] -= c * width * inverse
        for a in range(degree + 1):
            for k in range(degree + 1):
                coefficients[s, k, a] = polynomial[a, k]


@compiled
def advect(breaks, shape, coefficients, displacement):
    """Advect the knots by displacements of the nodes [m]: ``xi_j += sum_i phi_i(xi_j) dx_i``.

    Knots are lines in 2D and planes in 3D: the displacement normal to a line is averaged along it
    (by integration), so only axis-aligned motion is followed exactly. Recovering knots from moved
    Greville points instead would be overdetermined, with an undamped (-1)^j mode.
    """
    dim, order = breaks.shape[0], coefficients.shape[2]
    # the integral of each function over the length of its axis
    weight = np.zeros((dim, breaks.shape[1] + order - 1))
    for d in range(dim):
        spans = shape[d] - order + 1
        for i in range(shape[d]):
            support = breaks[d, min(i + 1, spans)] - breaks[d, max(i - order + 1, 0)]
            weight[d, i] = support / (order * (breaks[d, spans] - breaks[d, 0]))
    line = np.zeros(weight.shape)  # averages over the other axes
    for i in range(displacement.shape[0]):
        for d in range(dim):
            rest, k, share = i, 0, 1.0
            for e in range(dim - 1, -1, -1):
                if e == d:
                    k = rest % shape[e]
                else:
                    share *= weight[e, rest % shape[e]]
                rest //= shape[e]
            line[d, k] += share * displacement[i, d]
    for d in range(dim):
        spans = shape[d] - order + 1
        for j in range(spans + 1):
            s = min(j, spans - 1)
            for a in range(order):
                phi = coefficients[d, s, 0, a]  # at t = 0
                if j == spans:  # at t = 1
                    for k in range(1, order):
                        phi += coefficients[d, s, k, a]
                breaks[d, j] += phi * line[d, s + a]
