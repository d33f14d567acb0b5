"""Mohr-Coulomb plasticity at finite strain, by a return of principal Kirchhoff stresses.

Tension is positive and ``tau_1 >= tau_2 >= tau_3``. The yield function is ``f = k tau_1 - tau_3 -
s`` with ``k = (1 + sin phi) / (1 - sin phi)`` and ``s = 2 c sqrt(k)``; the flow potential has the
dilatancy angle in place of the friction angle. Trial stresses return to the plane, to one of its
two edges, or to the apex (Clausen, Damkilde and Andersen 2006, 2007), exactly and in one step
because everything is linear in logarithmic strains.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

from mpmbench.core.compiled import compiled, implements, matrix, vector
from mpmbench.core.errors import require
from mpmbench.core.materials.plastic import Plastic, return_map
from mpmbench.core.materials.principal import THREE, principal_moduli
from mpmbench.core.registry import register
from mpmbench.core.setting import setting

# where a trial stress returns to
ELASTIC, PLANE, COMPRESSION_EDGE, EXTENSION_EDGE, APEX = range(5)


class MohrCoulombLaw(NamedTuple):
    """Lame parameters [Pa], slopes k and m of yield function and potential, and strength s [Pa]."""

    lame: float
    shear: float
    friction: float
    dilatancy: float
    strength: float


@register("material", "mohr_coulomb")
@dataclass(frozen=True)
class MohrCoulomb(Plastic):
    """Mohr-Coulomb plasticity at finite strain on Hencky elasticity, return in principal axes."""

    young_modulus: float = 1.8e6
    poisson_ratio: float = 0.3
    density: float = 1850.0
    cohesion: float = setting(5000.0, "c", unit="Pa", least=0.0)
    friction_angle: float = setting(25.0, "phi", unit="degrees", least=0.0, below=90.0)
    dilatancy_angle: float = setting(0.0, "psi, at most friction_angle", unit="degrees", least=0.0)

    def check_together(self) -> None:
        phi, psi = self.friction_angle, self.dilatancy_angle
        require(psi <= phi, "dilatancy_angle", psi, "a number of degrees from 0 to friction_angle")
        require(
            self.cohesion > 0.0 or phi > 0.0,
            "cohesion",
            self.cohesion,
            "more than 0 when friction_angle is 0",
        )

    @property
    def symmetric_tangent(self) -> bool:  # type: ignore[override]
        """Only associated flow has a symmetric tangent."""
        return self.dilatancy_angle == self.friction_angle

    @property
    def law(self) -> MohrCoulombLaw:
        k, m = (
            (1.0 + math.sin(math.radians(angle))) / (1.0 - math.sin(math.radians(angle)))
            for angle in (self.friction_angle, self.dilatancy_angle)
        )
        return MohrCoulombLaw(*self.lame_parameters(), k, m, 2.0 * self.cohesion * math.sqrt(k))


@compiled
def yield_function(law, tau):
    """``k tau_1 - tau_3 - s`` [Pa]; positive outside."""
    return law.friction * tau[0] - tau[2] - law.strength


@compiled
def _pull_back(D, A, B, count, excess, tau, moduli):
    """Return along ``D B`` to where the `count` planes with normals in the columns of A meet.

    ``tau -= D B (A^T D B)^-1 f`` and ``moduli = D - D B (A^T D B)^-1 A^T D``.
    """
    DB, AD, S = matrix(THREE, (0.0, 0.0)), matrix((0.0, 0.0), THREE), matrix((0.0, 0.0), (0.0, 0.0))
    for p in range(count):
        for i in range(3):
            DB[i, p] = 0.0
            AD[p, i] = 0.0
            for j in range(3):
                DB[i, p] += D[i, j] * B[j, p]
                AD[p, i] += A[j, p] * D[j, i]
    for p in range(count):
        for q in range(count):
            S[p, q] = 0.0
            for i in range(3):
                S[p, q] += A[i, p] * DB[i, q]
    if count == 1:
        S[0, 0] = 1.0 / S[0, 0]
    else:
        scale = 1.0 / (S[0, 0] * S[1, 1] - S[0, 1] * S[1, 0])
        first = S[0, 0]
        S[0, 0], S[1, 1] = S[1, 1] * scale, first * scale
        S[0, 1], S[1, 0] = -S[0, 1] * scale, -S[1, 0] * scale
    for i in range(3):
        for j in range(3):
            moduli[i, j] = D[i, j]
        for p in range(count):
            for q in range(count):
                tau[i] -= DB[i, p] * S[p, q] * excess[q]
                for j in range(3):
                    moduli[i, j] -= DB[i, p] * S[p, q] * AD[q, j]


@implements(return_map, MohrCoulombLaw)
def _return_map(law, trial, tau, moduli):
    """ELASTIC, PLANE, COMPRESSION_EDGE (tau_1 = tau_2), EXTENSION_EDGE (tau_2 = tau_3) or APEX."""
    k, m = law.friction, law.dilatancy
    D = matrix(THREE, THREE)
    A, B, excess = matrix(THREE, (0.0, 0.0)), matrix(THREE, (0.0, 0.0)), vector((0.0, 0.0))
    principal_moduli(law.lame, law.shear, D)
    for i in range(3):
        tau[i] = trial[i]
        for j in range(3):
            moduli[i, j] = D[i, j]
    excess[0] = yield_function(law, trial)
    if excess[0] <= 0.0:
        return ELASTIC
    A[0, 0], A[1, 0], A[2, 0] = k, 0.0, -1.0
    B[0, 0], B[1, 0], B[2, 0] = m, 0.0, -1.0
    _pull_back(D, A, B, 1, excess, tau, moduli)
    upper, lower = tau[1] > tau[0], tau[2] > tau[1]
    if not (upper or lower):
        return PLANE
    for edge in range(2):
        if not (upper if edge == 0 else lower):
            continue
        if edge == 0:  # with the plane of tau_2 and tau_3
            A[0, 1], A[1, 1], A[2, 1] = 0.0, k, -1.0
            B[0, 1], B[1, 1], B[2, 1] = 0.0, m, -1.0
            excess[1] = k * trial[1] - trial[2] - law.strength
        else:  # with the plane of tau_1 and tau_2
            A[0, 1], A[1, 1], A[2, 1] = k, -1.0, 0.0
            B[0, 1], B[1, 1], B[2, 1] = m, -1.0, 0.0
            excess[1] = k * trial[0] - trial[1] - law.strength
        for i in range(3):
            tau[i] = trial[i]
        _pull_back(D, A, B, 2, excess, tau, moduli)
        if tau[0] >= tau[2]:
            return COMPRESSION_EDGE if edge == 0 else EXTENSION_EDGE
    tau[:] = law.strength / (k - 1.0)
    moduli[:] = 0.0
    return APEX
