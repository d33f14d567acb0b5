"""Local max-ent functions of a point's nearest nodes: the Gaussian is cut off at the search radius (Iaconeta 2017).

``N_I = exp(-beta |dx_I|^2 + lambda . dx_I) / Z`` with ``dx_I = x_I - x`` and the lambda that
minimises log Z. The cut makes values jump when a node enters or leaves a cloud, by exp(-beta R^2):
2.7 % with gamma = 1.8 and R = sqrt(2) h.
"""

import math

import numpy as np

from mpmbench.core.bases import Promises
from mpmbench.core.bases.clouds.cloud import CloudBasis
from mpmbench.core.bases.handle import Stencils
from mpmbench.core.compiled import kernel, matrix, vector
from mpmbench.core.compiled.algebra import inverse

PROMISES = Promises(kronecker="hull", continuous_gradient=False, gradient_on_hull=False)
LARGEST_CONDITION = 1e6  # of the Hessian of log Z; beyond it the cloud takes in another node
ITERATIONS = (
    200  # multipliers of points on the hull are infinite: each step takes them a little farther
)


def truncated_basis(
    nodes: np.ndarray, particles: int, radius: float, beta: float, tolerance: float
) -> CloudBasis:
    """Local max-ent functions with locality `beta` [1/m^2] of the nodes closer than `radius` [m]; fulfils `Basis`.

    `tolerance` is the largest ``|sum_I N_I dx_I|`` over the radius.
    """
    axes = (0.0,) * nodes.shape[1]

    def fill(
        nodes: np.ndarray,
        x: np.ndarray,
        points: np.ndarray,
        near: np.ndarray,
        count: np.ndarray,
        radii: np.ndarray,
        strict: bool,
        stored: Stencils,
        failed: np.ndarray,
    ) -> None:
        fill_points(
            axes, nodes, x, points, near, count, beta, tolerance * radius, strict, stored, failed
        )

    return CloudBasis(nodes, particles, radius, nodes.shape[1] + 1, fill, PROMISES)


@kernel
def partition(axes, dx, found, beta, multiplier, weight, r, H):  # type: ignore[no-untyped-def]
    """Log Z by the log-sum-exp rule, its slope r and Hessian H, and the normalised functions in `weight`."""
    largest = -np.inf
    for k in range(found):
        exponent = 0.0
        for d in range(len(axes)):
            exponent += dx[k, d] * (multiplier[d] - beta * dx[k, d])
        weight[k] = exponent
        largest = max(largest, exponent)
    Z = 0.0
    for k in range(found):
        weight[k] = math.exp(weight[k] - largest)
        Z += weight[k]
    for a in range(len(axes)):
        r[a] = 0.0
        for b in range(len(axes)):
            H[a, b] = 0.0
    for k in range(found):
        weight[k] /= Z
        for a in range(len(axes)):
            r[a] += weight[k] * dx[k, a]
            for b in range(len(axes)):
                H[a, b] += weight[k] * dx[k, a] * dx[k, b]
    for a in range(len(axes)):
        for b in range(len(axes)):
            H[a, b] -= r[a] * r[b]
    return math.log(Z) + largest


@kernel
def length(axes, r):  # type: ignore[no-untyped-def]
    """Euclidean norm."""
    total = 0.0
    for d in range(len(axes)):
        total += r[d] * r[d]
    return math.sqrt(total)


@kernel
def minimise(axes, dx, found, beta, tolerance, multiplier, weight, H):  # type: ignore[no-untyped-def]
    """Newton's method with backtracking for the multipliers; whether the residual has met the tolerance [m].

    One step is taken beyond it, because gradients lose half of the digits. Only the residual is
    asked: at points on the hull the multipliers have no limit, but the functions do.
    """
    r, step, start = vector(axes), vector(axes), vector(axes)
    inverse_H = matrix(axes, axes)
    for d in range(len(axes)):
        multiplier[d] = 0.0
    height = partition(axes, dx, found, beta, multiplier, weight, r, H)
    for _ in range(ITERATIONS):
        met = length(axes, r) <= tolerance
        determinant = inverse(axes, H, inverse_H)
        if not (determinant > 0.0 and determinant < 1e300):
            return met
        slope = 0.0
        for a in range(len(axes)):
            start[a] = multiplier[a]
            step[a] = 0.0
            for b in range(len(axes)):
                step[a] -= inverse_H[a, b] * r[b]
            slope += step[a] * r[a]
        if not slope < 0.0:
            return met
        fraction = 1.0
        while True:
            for d in range(len(axes)):
                multiplier[d] = start[d] + fraction * step[d]
            trial = partition(axes, dx, found, beta, multiplier, weight, r, H)
            if met or trial <= height + 1e-4 * fraction * slope or -slope < 1e-13:
                break
            fraction *= 0.5
            if fraction < 1e-12:
                return length(axes, r) <= tolerance
        height = trial
        if met:
            return length(axes, r) <= tolerance
    return False


@kernel
def fill_points(axes, nodes, x, points, near, count, beta, tolerance, strict, stored, failed):  # type: ignore[no-untyped-def]
    """Functions and gradients ``grad N_I = N_I H^-1 (dx_I - r)`` at ``x[points]``; marks points that fail."""
    width, dim = near.shape[1], len(axes)
    dx, weight = np.zeros((width, dim)), np.zeros(width)
    multiplier = vector(axes)
    H, inverse_H = matrix(axes, axes), matrix(axes, axes)
    for q in range(points.shape[0]):
        p = points[q]
        for k in range(count[p]):
            for d in range(dim):
                dx[k, d] = nodes[near[p, k], d] - x[p, d]
        if not minimise(axes, dx, count[p], beta, tolerance, multiplier, weight, H):
            failed[p] = True
            continue
        size, inverse_size = 0.0, 0.0
        for d in range(dim):
            size += H[d, d]
        # points on the hull: the gradient is that of a Hessian with a floor, and its use there is
        # limited
        floor = 1e-14 * size
        for d in range(dim):
            H[d, d] += floor
        inverse(axes, H, inverse_H)
        for d in range(dim):
            inverse_size += inverse_H[d, d]
        if strict and not size * inverse_size < LARGEST_CONDITION:
            failed[p] = True
            continue
        stored.size[p] = count[p]
        for k in range(count[p]):
            stored.index[p, k], stored.phi[p, k] = near[p, k], weight[k]
            for a in range(dim):
                total = 0.0
                for b in range(dim):
                    total += inverse_H[a, b] * dx[k, b]
                stored.grad_phi[p, k, a] = weight[k] * total
