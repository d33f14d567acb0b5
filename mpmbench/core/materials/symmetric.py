"""Isotropic functions of small symmetric tensors without their axes: logarithm and exponential as series.

A tensor is a row of six numbers, xx, yy, zz, xy, xz, yz, as in the history of plastic laws. With ``Z
= tanh(e)`` strains e and ``b - I`` belong together by ``b - I = 2 Z (I - Z)^-1`` and ``Z = (b - I)
(b + I)^-1``, because ``b = exp(2 e)``. All tensors in one formula have the same axes.
"""

from mpmbench.core.compiled import inlined, matrix, vector
from mpmbench.core.materials.principal import THREE

SIX = (0.0,) * 6
# Frobenius norm of b - I up to which the series below are exact to rounding.
SMALL = 0.1


@inlined
def norm_squared(A):
    """``A : A``."""
    off = A[3] * A[3] + A[4] * A[4] + A[5] * A[5]
    return A[0] * A[0] + A[1] * A[1] + A[2] * A[2] + 2.0 * off


@inlined
def product(A, B, C):
    """``C = A B`` of tensors with the same axes; C must not be A or B."""
    C[0] = A[0] * B[0] + A[3] * B[3] + A[4] * B[4]
    C[1] = A[3] * B[3] + A[1] * B[1] + A[5] * B[5]
    C[2] = A[4] * B[4] + A[5] * B[5] + A[2] * B[2]
    C[3] = A[0] * B[3] + A[3] * B[1] + A[4] * B[5]
    C[4] = A[0] * B[4] + A[3] * B[5] + A[4] * B[2]
    C[5] = A[3] * B[4] + A[1] * B[5] + A[5] * B[2]


@inlined
def divide(A, B, C):
    """``C = A B^-1`` of tensors with the same axes; C must not be A or B."""
    adjugate = vector(SIX)
    adjugate[0] = B[1] * B[2] - B[5] * B[5]
    adjugate[1] = B[0] * B[2] - B[4] * B[4]
    adjugate[2] = B[0] * B[1] - B[3] * B[3]
    adjugate[3] = B[4] * B[5] - B[3] * B[2]
    adjugate[4] = B[3] * B[5] - B[4] * B[1]
    adjugate[5] = B[3] * B[4] - B[5] * B[0]
    scale = 1.0 / (B[0] * adjugate[0] + B[3] * adjugate[3] + B[4] * adjugate[4])
    product(A, adjugate, C)
    for k in range(6):
        C[k] *= scale


@inlined
def odd_series(A, b1, b2, b3, b4, b5, out):
    """``A + b1 A^3 + b2 A^5 + b3 A^7 + b4 A^9 + b5 A^11``."""
    W, square, inner, outer = vector(SIX), vector(SIX), vector(SIX), vector(SIX)
    product(A, A, W)
    product(W, W, square)
    for k in range(6):
        inner[k] = b5 * W[k] + (b4 if k < 3 else 0.0)
    product(square, inner, outer)
    for k in range(6):
        inner[k] = outer[k] + b3 * W[k] + (b2 if k < 3 else 0.0)
    product(square, inner, outer)
    for k in range(6):
        inner[k] = outer[k] + b1 * W[k] + (1.0 if k < 3 else 0.0)
    product(A, inner, out)


@inlined
def strain_of(X, e):
    """Logarithmic strain ``e = ln(I + X) / 2 = artanh(X (2 I + X)^-1)`` of ``X = b - I``."""
    sum_of, Z = vector(SIX), vector(SIX)
    for k in range(6):
        sum_of[k] = X[k] + (2.0 if k < 3 else 0.0)
    divide(X, sum_of, Z)
    odd_series(Z, 1.0 / 3.0, 1.0 / 5.0, 1.0 / 7.0, 1.0 / 9.0, 1.0 / 11.0, e)


@inlined
def stretch_of(e, X):
    """``X = b - I = exp(2 e) - I`` of a logarithmic strain, by the series of tanh."""
    Z, rest = vector(SIX), vector(SIX)
    odd_series(e, -1.0 / 3.0, 2.0 / 15.0, -17.0 / 315.0, 62.0 / 2835.0, -1382.0 / 155925.0, Z)
    for k in range(6):
        rest[k] = (1.0 if k < 3 else 0.0) - Z[k]
        Z[k] *= 2.0
    divide(Z, rest, X)


@inlined
def deform(axes, L, dt, old, X):
    """``X = (I + D) (I + X_old) (I + D)^T - I`` with ``D = dt L``, without a loss of digits where strains are small.

    Missing dimensions are in plane strain.
    """
    D, B, T = matrix(THREE, THREE), matrix(THREE, THREE), matrix(THREE, THREE)
    B[0, 0], B[1, 1], B[2, 2] = old[0], old[1], old[2]
    B[0, 1], B[0, 2], B[1, 2] = old[3], old[4], old[5]
    B[1, 0], B[2, 0], B[2, 1] = old[3], old[4], old[5]
    for i in range(3):
        for j in range(3):
            D[i, j] = dt * L[i, j] if i < len(axes) and j < len(axes) else 0.0
    for i in range(3):
        for j in range(3):  # (I + D) (I + X_old) - I
            T[i, j] = D[i, j] + B[i, j]
            for k in range(3):
                T[i, j] += D[i, k] * B[k, j]
    for i in range(3):
        for j in range(i + 1):
            B[i, j] = D[j, i] + T[i, j]
            for k in range(3):
                B[i, j] += T[i, k] * D[j, k]
    X[0], X[1], X[2], X[3], X[4], X[5] = B[0, 0], B[1, 1], B[2, 2], B[1, 0], B[2, 0], B[2, 1]
