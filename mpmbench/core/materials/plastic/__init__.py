"""Plastic laws: one file each, which returns principal trial strains or stresses to the yield surface.

Strains are logarithmic, so that the return is the one of small strains; plastic flow is along the
principal axes of the trial state. All else is here: trial state, history, both stresses, moduli and
the stored energy. Laws of von Mises need `radial.hardening` and nothing else.
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

# Columns of the history; those before hold b_e - I as xx, yy, zz, xy, xz, yz.
PLASTIC_STRAIN, PLASTIC_WORK = 6, 7


def return_strains(
    law: Any,
    strain: np.ndarray,
    dt: float,
    state: np.ndarray,
    elastic: np.ndarray,
    tau: np.ndarray,
    moduli: np.ndarray,
) -> bool:
    """Return principal trial strains to the yield surface.

    Parameters
    ----------
    law : NamedTuple
        The material's numbers.
    strain : ndarray
        Principal logarithmic trial strains, descending, shape (3,).
    dt : float
        Time step [s]; infinite where time does not count.
    state : ndarray
        History, whose columns from `PLASTIC_STRAIN` on are updated.
    elastic, tau, moduli : ndarray
        Written: elastic strains, where they are not those of the trial, Kirchhoff stresses [Pa] and
        ``d tau / d strain`` [Pa], shapes (3,), (3,) and (3, 3).

    Returns
    -------
    bool
        Whether there was plastic flow.
    """
    raise NotImplementedError


def return_map(law: Any, trial: np.ndarray, tau: np.ndarray, moduli: np.ndarray) -> int:
    """Return principal trial stresses to a yield surface that stays as it is, on Hencky elasticity.

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


def hardening(law: Any, strain: float) -> tuple[float, float, float]:
    """Flow stress g of slow, cold flow [Pa], its derivative, and its integral from 0 [J/m^3]: see `radial`."""
    raise NotImplementedError


@dataclass(frozen=True)
class Plastic(IsotropicElastic):
    """What plastic laws share: their history, and elasticity as in `IsotropicElastic`."""

    history: ClassVar[int] = 8
    dissipated: ClassVar[int | None] = PLASTIC_WORK
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
def elastic_strains(state, strain):
    """Principal elastic strains, descending, from the history."""
    b, vectors = matrix(THREE, THREE), matrix(THREE, THREE)
    elastic_b(state, b)
    logarithmic_strains(b, strain, vectors)


@fallback(return_strains, given=return_map)
def _return_stresses(law, strain, dt, state, elastic, tau, moduli):
    trial = vector(THREE)
    hencky_stress(law.lame, law.shear, strain, trial)
    if return_map(law, trial, tau, moduli) == 0:
        return False
    bulk = law.lame + 2.0 / 3.0 * law.shear
    mean = (tau[0] + tau[1] + tau[2]) / 3.0
    square = 0.0
    for a in range(3):
        elastic[a] = (tau[a] - mean) / (2.0 * law.shear) + mean / (3.0 * bulk)
        square += (strain[a] - elastic[a]) ** 2
        state[PLASTIC_WORK] += tau[a] * (strain[a] - elastic[a])
    state[PLASTIC_STRAIN] += math.sqrt(2.0 / 3.0 * square)
    return True


@compiled
def update(law, axes, increment, dt, old, state, strain, tau, vectors, moduli):
    """Write principal trial strains, stresses, axes and moduli, and the new history."""
    b, elastic = matrix(THREE, THREE), vector(THREE)
    elastic_b(old, b)
    trial_state(axes, increment, b, strain, vectors)
    for n in range(PLASTIC_STRAIN, state.shape[0]):
        state[n] = old[n]
    if return_strains(law, strain, dt, state, elastic, tau, moduli):
        for a in range(3):
            elastic[a] = math.exp(2.0 * elastic[a])
        assemble(elastic, vectors, THREE, b)
    state[0], state[1], state[2] = b[0, 0] - 1.0, b[1, 1] - 1.0, b[2, 2] - 1.0
    state[3], state[4], state[5] = b[0, 1], b[0, 2], b[1, 2]


@compiled
def step(law, axes, increment, F, dt, old, state, tau, moduli):
    """As `kirchhoff_step`."""
    strain, principal = vector(THREE), vector(THREE)
    vectors, D = matrix(THREE, THREE), matrix(THREE, THREE)
    update(law, axes, increment, dt, old, state, strain, principal, vectors, D)
    assemble(principal, vectors, axes, tau)
    spatial_moduli(axes, strain, principal, D, vectors, moduli)


@fallback(kirchhoff_stress, given=return_strains)
def _kirchhoff(law, axes, increment, F, old, state, tau, moduli):
    """The step of infinite time."""
    step(law, axes, increment, F, math.inf, old, state, tau, moduli)


@fallback(cauchy_stress, given=return_strains, unless=hardening)
def _cauchy(law, axes, F, L, dt, state, sigma):
    explicit_step(law, axes, F, L, dt, state, sigma)


@compiled
def explicit_step(law, axes, F, L, dt, state, sigma):
    """As `cauchy_stress`; its increment is ``I + dt L``."""
    strain, principal = vector(THREE), vector(THREE)
    vectors, D, increment = matrix(THREE, THREE), matrix(THREE, THREE), matrix(axes, axes)
    for i in range(len(axes)):
        for j in range(len(axes)):
            increment[i, j] = dt * L[i, j] + (1.0 if i == j else 0.0)
    update(law, axes, increment, dt, state, state, strain, principal, vectors, D)
    inverse_J = 1.0 / determinant(axes, F)
    for a in range(3):
        principal[a] *= inverse_J
    assemble(principal, vectors, axes, sigma)


@fallback(energy_density, given=return_map)
def _energy(law, axes, F, state):
    """Elastic energy of b_e."""
    strain = vector(THREE)
    elastic_strains(state, strain)
    return hencky_energy(law.lame, law.shear, strain)
