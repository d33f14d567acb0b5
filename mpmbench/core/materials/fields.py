"""What results keep of particles besides the state itself: derived here, and nowhere else.

``pressure`` and ``von_mises`` of all materials, and what a material keeps in its history by the
names of `Material.fields`, such as ``plastic_strain`` and ``temperature``.
"""

from typing import Any

import numpy as np

from mpmbench.core.compiled import compiled, matrix
from mpmbench.core.materials import Fields, Material, cauchy_stress

THREE = (0.0, 0.0, 0.0)


@compiled
def stress_in_space(law, F, L, state, sigma):
    """Cauchy stresses [Pa] of all particles, shapes (P, 3, 3), with what is out of the plane.

    Nothing moves: a step of no time leaves plastic particles as they are.
    """
    F_p, L_p, sigma_p = matrix(THREE, THREE), matrix(THREE, THREE), matrix(THREE, THREE)
    for p in range(F.shape[0]):
        for i in range(3):
            for j in range(3):
                F_p[i, j], L_p[i, j], sigma_p[i, j] = F[p, i, j], L[p, i, j], sigma[p, i, j]
        cauchy_stress(law, THREE, F_p, L_p, 0.0, state[p], sigma_p)
        for i in range(3):
            for j in range(3):
                sigma[p, i, j] = sigma_p[i, j]


def in_space(tensors: np.ndarray, missing: float) -> np.ndarray:
    """Tensors of shape (P, dim, dim) as (P, 3, 3), with `missing` on the rest of the diagonal."""
    n, dim = tensors.shape[:2]
    whole = np.zeros((n, 3, 3))
    whole[:, :dim, :dim] = tensors
    for d in range(dim, 3):
        whole[:, d, d] = missing
    return whole


def derived_fields(material: Material, particles: dict[str, Any]) -> Fields:
    """Fields of particles in a snapshot: values of shape (P,), unit, and what it is, by name.

    Parameters
    ----------
    material : Material
    particles : dict of ndarray
        ``F``, ``sigma`` [Pa], shape (P, dim, dim), ``state``, shape (P, history), and ``L`` [1/s]
        where the material depends on it.
    """
    sigma, state = particles["sigma"], particles["state"]
    dim = sigma.shape[1]
    whole = in_space(sigma, 0.0)
    if dim < 3:
        L = in_space(particles.get("L", np.zeros_like(sigma)), 0.0)
        stress_in_space(material.law, in_space(particles["F"], 1.0), L, state.copy(), whole)
        whole[:, :dim, :dim] = sigma
    pressure = -np.trace(whole, axis1=1, axis2=2) / 3.0
    deviator = 0.5 * (whole + whole.transpose(0, 2, 1)) + pressure[:, None, None] * np.eye(3)
    mises = np.sqrt(1.5 * np.sum(deviator**2, axis=(1, 2)))
    return {
        "pressure": (pressure, "Pa", "pressure"),
        "von_mises": (mises, "Pa", "von Mises stress"),
        **material.fields(state),
    }
