"""Dense granular flow, the local mu(I) rheology (Jop, Forterre and Pouliquen 2006), on Hencky elasticity.

With the pressure p, ``q = sqrt(s : s / 2)`` of the deviator s and the rate of shear ``g = sqrt(2 d : d)``
of the flow,

    q = mu(I) p,    mu(I) = mu_s + (mu_2 - mu_s) / (I_0 / I + 1),    I = g d / sqrt(p / rho_s),

for grains of the diameter d and the density rho_s; below ``mu_s p`` it is elastic. Flow keeps the
volume, so that a step returns q alone, and the rate is that of the flow in it: ``q = q_trial - G g dt``
makes a quadratic equation (Dunatunga and Kamrin 2015), whose smaller root is q. Cohesion c adds
``c / mu_s`` to p. Grains that are pulled apart carry nothing until they have come together again, and
then stick as before: `OPENED` is the logarithm of the volume by which they are apart.
"""

import math
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

from mpmbench.core.compiled import compiled, implements, vector
from mpmbench.core.errors import require
from mpmbench.core.materials import energy_density, kirchhoff_step
from mpmbench.core.materials.plastic import (
    PLASTIC_STRAIN,
    PLASTIC_WORK,
    Plastic,
    elastic_strains,
    return_strains,
    step,
)
from mpmbench.core.materials.principal import THREE, hencky_energy
from mpmbench.core.registry import register
from mpmbench.core.setting import setting

OPENED = 8  # column of the history


class MuILaw(NamedTuple):
    """Lame parameters [Pa], mu_s and mu_2, ``I_0 / (d sqrt(rho_s))`` [1/(s sqrt(Pa))], and c / mu_s [Pa]."""

    lame: float
    shear: float
    slow: float
    fast: float
    rate: float
    tension: float


@register("material", "mu_i")
@dataclass(frozen=True)
class MuI(Plastic):
    """Granular flow whose friction grows with its rate, mu(I), Jop et al. 2006; grains apart carry nothing."""

    young_modulus: float = 1.0e6
    poisson_ratio: float = 0.3
    density: float = 1500.0
    cohesion: float = setting(1000.0, "c, at rest and without pressure", unit="Pa", least=0.0)
    static_friction_angle: float = setting(
        21.0, "whose tangent is mu_s, at rest", unit="degrees", above=0.0, below=90.0
    )
    limiting_friction_angle: float = setting(
        33.0, "whose tangent is mu_2, in fast flow", unit="degrees", above=0.0, below=90.0
    )
    inertial_number: float = setting(0.3, "I_0", unit="-", above=0.0, most=100.0)
    grain_diameter: float = setting(1.0e-3, "d", unit="m", above=0.0, most=1.0)
    grain_density: float = setting(2500.0, "rho_s", unit="kg/m3", above=0.0)
    history: ClassVar[int] = 9
    symmetric_tangent: ClassVar[bool] = False

    def check_together(self) -> None:
        require(
            self.limiting_friction_angle >= self.static_friction_angle,
            "limiting_friction_angle",
            self.limiting_friction_angle,
            "at least static_friction_angle",
        )

    @property
    def law(self) -> MuILaw:
        slow, fast = (
            math.tan(math.radians(angle))
            for angle in (self.static_friction_angle, self.limiting_friction_angle)
        )
        rate = self.inertial_number / (self.grain_diameter * math.sqrt(self.grain_density))
        return MuILaw(*self.lame_parameters(), slow, fast, rate, self.cohesion / slow)


@compiled
def shear_stress(law, trial, pressure, dt):
    """The stress q that is left of a trial one beyond ``mu_s p`` [Pa], and its derivatives by both.

    The smaller root of ``q^2 - (q_trial + mu_2 p + a) q + mu_2 p q_trial + a mu_s p`` with ``a = G dt
    I_0 sqrt(p / rho_s) / d``, written without a difference of large numbers.
    """
    slow, fast = law.slow * pressure, law.fast * pressure
    a = law.shear * dt * law.rate * math.sqrt(pressure)
    if a == math.inf:  # no hurry
        return slow, 0.0, law.slow
    middle, product = trial + fast + a, fast * trial + a * slow
    root = math.sqrt(middle * middle - 4.0 * product)
    q = 2.0 * product / (middle + root)
    by_pressure = -q * (law.fast + 0.5 * a / pressure) + law.fast * trial + 1.5 * a * law.slow
    return q, (fast - q) / root, by_pressure / root


@implements(return_strains, MuILaw)
def _return_strains(law, strain, dt, state, elastic, tau, moduli):
    bulk = law.lame + 2.0 / 3.0 * law.shear
    log_J = strain[0] + strain[1] + strain[2]
    opened = state[OPENED]
    together = opened == 0.0
    pressure = (law.tension if together else 0.0) - bulk * (log_J + opened)
    s, square = vector(THREE), 0.0
    for i in range(3):
        s[i] = 2.0 * law.shear * (strain[i] - log_J / 3.0)
        square += 0.5 * s[i] * s[i]
    trial = math.sqrt(square)
    if pressure <= 0.0:  # the grains are apart, and what they had stored is lost
        state[OPENED] += log_J
        if together:
            state[PLASTIC_WORK] += hencky_energy(law.lame, law.shear, strain)
            state[PLASTIC_STRAIN] += trial / (math.sqrt(3.0) * law.shear)
        for i in range(3):
            elastic[i] = tau[i] = 0.0
            for j in range(3):
                moduli[i, j] = 0.0
        return True
    state[OPENED] = 0.0
    mean = bulk * (log_J + opened)
    pressure = law.tension - mean
    q, by_trial, by_pressure = trial, 1.0, 0.0
    if trial > law.slow * pressure:
        q, by_trial, by_pressure = shear_stress(law, trial, pressure, dt)
        sheared = (trial - q) / law.shear
        state[PLASTIC_STRAIN] += sheared / math.sqrt(3.0)
        state[PLASTIC_WORK] += q * sheared
    kept = q / trial if trial > 0.0 else 1.0
    along = law.shear * (by_trial - kept) / square if square > 0.0 else 0.0
    across = bulk * by_pressure / trial if trial > 0.0 else 0.0
    for i in range(3):
        tau[i] = mean + kept * s[i]
        elastic[i] = (log_J + opened) / 3.0 + kept * s[i] / (2.0 * law.shear)
        for j in range(3):
            shear = 2.0 * law.shear * kept * ((1.0 if i == j else 0.0) - 1.0 / 3.0)
            moduli[i, j] = bulk + shear + s[i] * (along * s[j] - across)
    return q < trial or not together


@implements(kirchhoff_step, MuILaw)
def _kirchhoff_step(law, axes, increment, F, dt, old, state, tau, moduli):
    step(law, axes, increment, F, dt, old, state, tau, moduli)


@implements(energy_density, MuILaw)
def _energy(law, axes, F, state):
    strain = vector(THREE)
    elastic_strains(state, strain)
    return hencky_energy(law.lame, law.shear, strain)
