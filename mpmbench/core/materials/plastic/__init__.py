"""Plastic laws: one file each, which returns principal trial stresses to the yield surface.

Strains are logarithmic and elasticity is that of Hencky, so that the return is the one of small
strains. All else is here: trial state, history, both stresses, moduli and the stored energy.
"""

import math
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from mpmbench.core.compiled import compiled, fallback, matrix, vector
from mpmbench.core.compiled.algebra import determinant
from mpmbench.core.materials import cauchy_stress, energy_density, kirchhoff_stress
from mpmbench.core.materials.isotropic import IsotropicElastic
from mpmbench.core.materials.principal import (
    THREE,
    assemble,
    hencky_energy,
    hencky_stress,
    logarithmic_strains,
    spatial_moduli,
    trial_state,
)

PLASTIC_STRAIN = 6  # column of the history; those before hold b_e - I as xx, yy, zz, xy, xz, yz


def return_map(law: Any, trial: np.ndarray, tau: np.ndarray, moduli: np.ndarray) -> int:
    """Return principal trial stresses to the yield surface.

    Parameters
    ----------
    law : NamedTuple
        The material's numbers, among them the Lame parameters `lame` and `shear` [Pa].
    trial : ndarray
        Principal Kirchhoff stresses [Pa], descending, shape (3,).
    tau, moduli : ndarray
        Written: stresses and ``d tau / d trial strain`` [Pa], shapes (3,) and (3, 3).

    Returns
    -------
    int
        0 where the trial stress is elastic; any other number says where it returned to.
    """
    raise NotImplementedError


@dataclass(frozen=True)
class Plastic(IsotropicElastic):
    """What plastic laws share: their history, and elasticity as in `IsotropicElastic`."""

    history: ClassVar[int] = 7
    conserves_energy: ClassVar[bool] = False
    outputs: ClassVar[dict[str, tuple[int, str, str]]] = {
        "plastic_strain": (PLASTIC_STRAIN, "1", "equivalent plastic strain")
    }

    def history_of_stress(self, tau: np.ndarray) -> np.ndarray:
        """History at rest under Kirchhoff stresses tau_xx, tau_yy, tau_zz [Pa], shape (n, 3)."""
        lame, shear = self.lame_parameters()
        strain = np.linalg.solve(lame * np.ones((3, 3)) + 2.0 * shear * np.eye(3), tau.T).T
        state = np.zeros((len(tau), self.history))
        state[:, :3] = np.expm1(2.0 * strain)
        return state


@compiled
def elastic_b(state, b):
    """Elastic left Cauchy-Green tensor, shape (3, 3), from the history."""
    b[0, 0], b[1, 1], b[2, 2] = 1.0 + state[0], 1.0 + state[1], 1.0 + state[2]
    b[0, 1], b[0, 2], b[1, 2] = state[3], state[4], state[5]
    b[1, 0], b[2, 0], b[2, 1] = state[3], state[4], state[5]


@compiled
def commit(law, strain, tau, vectors, b, plastic, state):
    """Write the history: b_e of the trial state or the returned stress, and plastic strain."""
    if plastic:
        bulk = law.lame + 2.0 / 3.0 * law.shear
        mean = (tau[0] + tau[1] + tau[2]) / 3.0
        square = 0.0
        stretch = vector(THREE)
        for a in range(3):
            elastic = (tau[a] - mean) / (2.0 * law.shear) + mean / (3.0 * bulk)
            square += (strain[a] - elastic) ** 2
            stretch[a] = math.exp(2.0 * elastic)
        state[PLASTIC_STRAIN] += math.sqrt(2.0 / 3.0 * square)
        assemble(stretch, vectors, THREE, b)
    state[0], state[1], state[2] = b[0, 0] - 1.0, b[1, 1] - 1.0, b[2, 2] - 1.0
    state[3], state[4], state[5] = b[0, 1], b[0, 2], b[1, 2]


@compiled
def update(law, axes, increment, old, state, strain, tau, vectors, moduli):
    """Write principal trial strains, stresses, axes and moduli, and the new history."""
    b, trial = matrix(THREE, THREE), vector(THREE)
    elastic_b(old, b)
    trial_state(axes, increment, b, strain, vectors)
    hencky_stress(law.lame, law.shear, strain, trial)
    state[PLASTIC_STRAIN] = old[PLASTIC_STRAIN]
    plastic = return_map(law, trial, tau, moduli) != 0
    commit(law, strain, tau, vectors, b, plastic, state)


@fallback(kirchhoff_stress, given=return_map)
def _kirchhoff(law, axes, increment, F, old, state, tau, moduli):
    strain, principal = vector(THREE), vector(THREE)
    vectors, D = matrix(THREE, THREE), matrix(THREE, THREE)
    update(law, axes, increment, old, state, strain, principal, vectors, D)
    assemble(principal, vectors, axes, tau)
    spatial_moduli(axes, strain, principal, D, vectors, moduli)


@fallback(cauchy_stress, given=return_map)
def _cauchy(law, axes, F, L, dt, state, sigma):
    """The explicit step: its increment is ``I + dt L``."""
    strain, principal = vector(THREE), vector(THREE)
    vectors, D, increment = matrix(THREE, THREE), matrix(THREE, THREE), matrix(axes, axes)
    for i in range(len(axes)):
        for j in range(len(axes)):
            increment[i, j] = dt * L[i, j] + (1.0 if i == j else 0.0)
    update(law, axes, increment, state, state, strain, principal, vectors, D)
    inverse_J = 1.0 / determinant(axes, F)
    for a in range(3):
        principal[a] *= inverse_J
    assemble(principal, vectors, axes, sigma)


@fallback(energy_density, given=return_map)
def _energy(law, axes, F, state):
    """Elastic energy of b_e."""
    b, strain, vectors = matrix(THREE, THREE), vector(THREE), matrix(THREE, THREE)
    elastic_b(state, b)
    logarithmic_strains(b, strain, vectors)
    return hencky_energy(law.lame, law.shear, strain)
