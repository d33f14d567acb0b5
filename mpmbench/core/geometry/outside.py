"""The box around points, and which points are outside a box."""

import numpy as np

from mpmbench.core.compiled import compiled, threads


@compiled
def extent(x):
    """Smallest and largest coordinates of points [m], shape (n, dim), each of shape (dim,)."""
    lower, upper = x[0].copy(), x[0].copy()
    for p in range(1, x.shape[0]):
        for d in range(x.shape[1]):
            lower[d], upper[d] = min(lower[d], x[p, d]), max(upper[d], x[p, d])
    return lower, upper


@compiled
def first_outside(x, lower, upper, start, stop):
    """Number of the first of the points start to stop outside the box (or not a number), or -1."""
    x = x[start:stop]
    outside = 0
    for d in range(x.shape[1]):
        low, high = lower[d], upper[d]
        for p in range(x.shape[0]):  # in vector instructions
            outside += not (low <= x[p, d] <= high)
    if outside > 0:
        for p in range(x.shape[0]):
            for d in range(x.shape[1]):
                if not (lower[d] <= x[p, d] <= upper[d]):
                    return start + p
    return -1


def first_outside_box(x: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> int:
    """Number of the first point outside the box (or not a number), -1 if there is none."""
    found = threads.run(lambda c, *part: first_outside(x, lower, upper, *part), len(x))
    return threads.first(found)
