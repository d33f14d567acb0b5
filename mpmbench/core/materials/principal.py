"""Isotropic laws in principal axes: logarithmic strains, and spatial moduli of a stress.

Matrices are 3 x 3 in every dimension; missing dimensions are in plane strain. Simo (1998), Clausen
et al. (2006).
"""

import math

from mpmbench.core.compiled import compiled, matrix

THREE = (0.0, 0.0, 0.0)
# Principal strains closer than this share their limit: the quotient has lost its digits.
EQUAL = 1e-7


@compiled
def identity(out):
    """``out = I``, shape (3, 3)."""
    for i in range(3):
        for j in range(3):
            out[i, j] = 1.0 if i == j else 0.0


@compiled
def congruence(A, B, out):
    """``out = A B A^T`` of 3 x 3 matrices with B symmetric."""
    for i in range(3):
        for j in range(3):
            total = 0.0
            for k in range(3):
                for n in range(3):
                    total += A[i, k] * B[k, n] * A[j, n]
            out[i, j] = total


@compiled
def eigensystem(B, values, vectors):
    """Eigenvalues of a symmetric 3 x 3 matrix, descending, and eigenvectors as columns; B is lost.

    By Jacobi's method: small eigenvalues keep their relative precision, and a matrix that is
    diagonal costs nothing.
    """
    identity(vectors)
    for _ in range(30):
        rest = abs(B[0, 1]) + abs(B[0, 2]) + abs(B[1, 2])
        if rest <= 1e-17 * (abs(B[0, 0]) + abs(B[1, 1]) + abs(B[2, 2])):
            break
        for p in range(2):
            for q in range(p + 1, 3):
                if B[p, q] == 0.0:
                    continue
                theta = 0.5 * (B[q, q] - B[p, p]) / B[p, q]
                t = (1.0 if theta >= 0.0 else -1.0) / (abs(theta) + math.sqrt(theta * theta + 1.0))
                c = 1.0 / math.sqrt(t * t + 1.0)
                s = t * c
                for k in range(3):
                    first, second = B[k, p], B[k, q]
                    B[k, p], B[k, q] = c * first - s * second, s * first + c * second
                for k in range(3):
                    first, second = B[p, k], B[q, k]
                    B[p, k], B[q, k] = c * first - s * second, s * first + c * second
                    first, second = vectors[k, p], vectors[k, q]
                    vectors[k, p], vectors[k, q] = c * first - s * second, s * first + c * second
                B[p, q] = 0.0
                B[q, p] = 0.0
    for i in range(3):
        values[i] = B[i, i]
    for i in range(2):
        for j in range(2 - i):
            if values[j] < values[j + 1]:
                values[j], values[j + 1] = values[j + 1], values[j]
                for k in range(3):
                    vectors[k, j], vectors[k, j + 1] = vectors[k, j + 1], vectors[k, j]


@compiled
def logarithmic_strains(b, strain, vectors):
    """Principal strains ``ln(b) / 2``, descending, and axes of a tensor b, which is lost."""
    eigensystem(b, strain, vectors)
    for a in range(3):
        strain[a] = 0.5 * math.log(strain[a])


@compiled
def trial_state(axes, increment, b, strain, vectors):
    """``b <- DF b DF^T``, and its principal strains and axes."""
    full, work = matrix(THREE, THREE), matrix(THREE, THREE)
    identity(full)  # plane strain in missing dimensions
    for i in range(len(axes)):
        for j in range(len(axes)):
            full[i, j] = increment[i, j]
    congruence(full, b, work)
    for i in range(3):
        for j in range(3):
            b[i, j] = work[i, j]
    logarithmic_strains(work, strain, vectors)


@compiled
def assemble(values, vectors, axes, out):
    """``sum_A values_A n_A (x) n_A``, the leading (dim, dim) part."""
    for i in range(len(axes)):
        for j in range(len(axes)):
            total = 0.0
            for a in range(3):
                total += values[a] * vectors[i, a] * vectors[j, a]
            out[i, j] = total


@compiled
def spatial_moduli(axes, strain, tau, D, vectors, moduli):
    """Moduli of `kirchhoff_stress` from principal ones, ``D_AB = d tau_A / d strain_B``.

    The shear terms ``(tau_A l_B^2 - tau_B l_A^2) / (l_A^2 - l_B^2)`` with stretches l = exp(strain)
    are written as ``(tau_A - tau_B) / g  g coth(g) / 2 - (tau_A + tau_B) / 2`` with ``g = strain_A
    - strain_B``, which has a limit.
    """
    dim = len(axes)
    for c in range(dim):
        for d in range(dim):
            total = 0.0
            for a in range(3):
                total += tau[a] * vectors[c, a] * vectors[d, a]
            for i in range(dim):
                for j in range(dim):
                    moduli[i, c, j, d] = total if i == j else 0.0
    for a in range(3):
        if dim < 3 and abs(vectors[2, a]) > 0.5:  # of the axis out of the plane nothing is left
            continue
        for b in range(3):
            if dim < 3 and abs(vectors[2, b]) > 0.5:
                continue
            normal = D[a, b] - (2.0 * tau[a] if a == b else 0.0)
            shear = 0.0
            if a != b:
                gap = strain[a] - strain[b]
                if abs(gap) > EQUAL:
                    shear = 0.5 * (tau[a] - tau[b]) / math.tanh(gap)
                else:
                    shear = 0.25 * (D[a, a] - D[a, b] - D[b, a] + D[b, b])
                shear -= 0.5 * (tau[a] + tau[b])
            for i in range(dim):
                for c in range(dim):
                    for j in range(dim):
                        for d in range(dim):
                            value = normal * vectors[i, a] * vectors[c, a]
                            value = value * vectors[j, b] * vectors[d, b]
                            pair = vectors[j, a] * vectors[d, b] + vectors[j, b] * vectors[d, a]
                            value += shear * vectors[i, a] * vectors[c, b] * pair
                            moduli[i, c, j, d] += value


@compiled
def principal_moduli(lame, shear, D):
    """``d tau_A / d strain_B`` of Hencky elasticity, shape (3, 3)."""
    for a in range(3):
        for b in range(3):
            D[a, b] = lame + (2.0 * shear if a == b else 0.0)


@compiled
def hencky_stress(lame, shear, strain, tau):
    """``tau_A = lambda tr(strain) + 2 mu strain_A``."""
    trace = strain[0] + strain[1] + strain[2]
    for a in range(3):
        tau[a] = lame * trace + 2.0 * shear * strain[a]


@compiled
def hencky_energy(lame, shear, strain):
    """``lambda tr(strain)^2 / 2 + mu strain : strain`` [J/m^3]."""
    trace = strain[0] + strain[1] + strain[2]
    square = strain[0] ** 2 + strain[1] ** 2 + strain[2] ** 2
    return 0.5 * lame * trace * trace + shear * square
