"""Small vectors and matrices, whose dimension is the length of the tuple `axes`."""

import math

import numpy as np

from mpmbench.core.compiled import inlined


@inlined
def length(axes, a):
    """Euclidean length of a vector."""
    square = 0.0
    for d in range(len(axes)):
        square += a[d] * a[d]
    return math.sqrt(square)


@inlined
def determinant(axes, A):
    """``det A``."""
    if len(axes) == 1:
        return A[0, 0]
    if len(axes) == 2:
        return A[0, 0] * A[1, 1] - A[0, 1] * A[1, 0]
    return (
        A[0, 0] * (A[1, 1] * A[2, 2] - A[1, 2] * A[2, 1])
        - A[0, 1] * (A[1, 0] * A[2, 2] - A[1, 2] * A[2, 0])
        + A[0, 2] * (A[1, 0] * A[2, 1] - A[1, 1] * A[2, 0])
    )


@inlined
def inverse(axes, A, B):
    """``B = A^-1``; returns the determinant."""
    det = determinant(axes, A)
    r = 1.0 / det
    if len(axes) == 1:
        B[0, 0] = r
    elif len(axes) == 2:
        B[0, 0], B[0, 1] = A[1, 1] * r, -A[0, 1] * r
        B[1, 0], B[1, 1] = -A[1, 0] * r, A[0, 0] * r
    else:
        for i in range(3):
            for j in range(3):
                a, b = (j + 1) % 3, (j + 2) % 3
                c, d = (i + 1) % 3, (i + 2) % 3
                B[i, j] = (A[a, c] * A[b, d] - A[a, d] * A[b, c]) * r
    return det


@inlined
def inverse_of_positive(axes, A, B):
    """``B = A^-1`` by elimination, for a symmetric A that is positive; returns the least pivot.

    Where A is nearly singular along directions that are not the axes, cofactors have lost what
    remains of it, and pivots have not.
    """
    least = np.inf
    for i in range(len(axes)):
        for j in range(len(axes)):
            B[i, j] = A[i, j]
    for k in range(len(axes)):
        least = min(least, B[k, k])
        r = 1.0 / B[k, k]
        B[k, k] = 1.0
        for j in range(len(axes)):
            B[k, j] *= r
        for i in range(len(axes)):
            if i != k:
                factor = B[i, k]
                B[i, k] = 0.0
                for j in range(len(axes)):
                    B[i, j] -= factor * B[k, j]
    return least


@inlined
def multiply(axes, A, B, C):
    """``C = A B``; C must not be A or B."""
    for i in range(len(axes)):
        for j in range(len(axes)):
            total = 0.0
            for k in range(len(axes)):
                total += A[i, k] * B[k, j]
            C[i, j] = total


@inlined
def multiply_transposed(axes, A, B, C):
    """``C = A B^T``; C must not be A or B."""
    multiply(axes, A, B.T, C)


@inlined
def transform_rows(axes, A, p, M, B):
    """``B[p] = A[p] M`` with rows of all k, shape (n, K, dim)."""
    for k in range(A.shape[1]):
        for d in range(len(axes)):
            total = 0.0
            for e in range(len(axes)):
                total += A[p, k, e] * M[e, d]
            B[p, k, d] = total


@inlined
def divide_by(axes, D, least, B):
    """``B D^-1`` in place for a symmetric D, whose lower half is overwritten by ``L^-1`` and pivots.

    ``D = L diag(pivot) L^T``; directions with a pivot of `least` or less are left out.
    """
    for j in range(len(axes)):
        for k in range(j):
            D[j, j] -= D[j, k] * D[j, k] * D[k, k]
        pivot = D[j, j]
        for i in range(j + 1, len(axes)):
            for k in range(j):
                D[i, j] -= D[i, k] * D[j, k] * D[k, k]
            D[i, j] = D[i, j] / pivot if pivot > least else 0.0
    for row in range(len(axes)):
        for j in range(len(axes)):
            for k in range(j):
                B[row, j] -= D[j, k] * B[row, k]
        for j in range(len(axes)):
            B[row, j] = B[row, j] / D[j, j] if D[j, j] > least else 0.0
        for j in range(len(axes) - 1, -1, -1):
            for k in range(j + 1, len(axes)):
                B[row, j] -= D[k, j] * B[row, k]


@inlined
def squared(axes):
    """A tuple with as many entries as a matrix has."""
    if len(axes) == 1:
        return (0.0,)
    if len(axes) == 2:
        return (0.0, 0.0, *axes)
    return (0.0, 0.0, 0.0, *axes, *axes)
