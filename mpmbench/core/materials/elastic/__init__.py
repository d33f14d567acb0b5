"""Elastic laws: one file each, which gives the Kirchhoff stress and its moduli as functions of F.

From them follow the stresses of explicit methods, ``sigma = tau / J``, and of implicit ones, unless
a law implements these itself.
"""

from typing import Any

import numpy as np

from mpmbench.core.compiled import fallback, inlined
from mpmbench.core.compiled.algebra import determinant
from mpmbench.core.materials import cauchy_stress, kirchhoff_stress


def elastic_stress(law: Any, axes: Any, F: np.ndarray, tau: np.ndarray) -> None:
    """Write the Kirchhoff stress [Pa] to `tau`, shape (dim, dim)."""
    raise NotImplementedError


def elastic_moduli(law: Any, axes: Any, F: np.ndarray, tau: np.ndarray, moduli: np.ndarray) -> None:
    """Write the moduli of `kirchhoff_stress` [Pa], shape (dim,) * 4, at F with the stress `tau`."""
    raise NotImplementedError


@fallback(cauchy_stress, given=elastic_stress)
def _cauchy(law, axes, F, L, dt, state, sigma):
    elastic_stress(law, axes, F, sigma)
    inverse_J = 1.0 / determinant(axes, F)
    for i in range(len(axes)):
        for j in range(len(axes)):
            sigma[i, j] *= inverse_J


@fallback(kirchhoff_stress, given=elastic_stress)
def _kirchhoff(law, axes, increment, F, old, state, tau, moduli):
    elastic_stress(law, axes, F, tau)
    elastic_moduli(law, axes, F, tau, moduli)


@inlined
def isotropic_moduli(axes, lame, shear, tau, moduli):
    """``c = lame I (x) I + 2 shear I_sym`` and the geometric part."""
    dim = len(axes)
    for i in range(dim):
        for c in range(dim):
            for j in range(dim):
                for d in range(dim):
                    value = tau[c, d] if i == j else 0.0
                    if i == c and j == d:
                        value += lame
                    if i == j and c == d:
                        value += shear
                    if i == d and c == j:
                        value += shear
                    moduli[i, c, j, d] = value
