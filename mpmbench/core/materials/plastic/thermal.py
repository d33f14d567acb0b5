"""What metals share whose plastic work heats them, adiabatically: temperature, and pressure.

The temperature ``T = T_i + beta W / (rho_0 c)`` follows the plastic work W per reference volume:
work per deformed volume over the deformed density is the same. A step has the temperature of its
start, from the reference to the melting temperature.

The pressure is that of ``U = K (ln J)^2 / 2``, or Mie and Grueneisen's ``p = p_H (1 - Gamma x / 2) +
Gamma E`` with ``x = 1 - J``, Hugoniot's ``p_H = K x / (1 - s x)^2`` (K x in tension) and the energy E
per reference volume without that in shear. As ``dE = - p dJ + dQ`` with the heat ``Q = beta W``, E is
``exp(Gamma x) (H + int p_H (1 - Gamma y / 2) exp(-Gamma y) dy)`` with y from 0 to x and ``dH =
exp(-Gamma x) dQ``. What is stored is ``E - Q``, as all of W counts as lost.
"""

import math
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np

from mpmbench.core.compiled import compiled, implements
from mpmbench.core.errors import require
from mpmbench.core.materials import Fields, kirchhoff_step
from mpmbench.core.materials.plastic import PLASTIC_WORK, Plastic, step
from mpmbench.core.materials.plastic.radial import softening, volumetric, warm
from mpmbench.core.setting import setting

HEAT = 8  # column of the history: H [J/m^3]
# Gauss' rule on [0, 1], with which the integral is exact to rounding where s x < 0.7.
POINTS, WEIGHTS = (
    tuple((0.5 * values + shift).tolist())
    for values, shift in zip(np.polynomial.legendre.leggauss(16), (0.5, 0.0), strict=True)
)


class Heat(NamedTuple):
    """Temperatures at the start, of reference and of melting [K], softening, heating, and pressure."""

    initial: float
    reference: float
    melting: float
    exponent: float
    heating: float  # temperature by plastic work [K m^3 / J]
    taylor_quinney: float
    mie_grueneisen: bool
    grueneisen: float
    slope: float


@dataclass(frozen=True)
class ThermoPlastic(Plastic):
    """Settings of heat and pressure."""

    specific_heat: float = setting(477.0, "c", unit="J/(kg K)", above=0.0)
    taylor_quinney: float = setting(
        0.9, "beta, part of the plastic work that is heat", unit="-", least=0.0, most=1.0
    )
    initial_temperature: float = setting(300.0, "at the start", unit="K", least=0.0)
    reference_temperature: float = setting(300.0, "below it nothing softens", unit="K", least=0.0)
    melting_temperature: float = setting(1777.0, "without strength from here", unit="K", above=0.0)
    softening_exponent: float = setting(1.17, "of (T - T_0) / (T_m - T_0)", unit="-", above=0.0)
    equation_of_state: str = setting(
        "logarithmic",
        "pressure of K (ln J)^2 / 2, or of Mie and Grueneisen, which heat raises",
        options=("logarithmic", "mie_grueneisen"),
    )
    grueneisen: float = setting(2.0, "Gamma of mie_grueneisen", unit="-", least=0.0)
    hugoniot_slope: float = setting(
        1.5, "s of mie_grueneisen, of the velocities of shock and particle", unit="-", least=0.0
    )
    history: ClassVar[int] = 9

    def check_together(self) -> None:
        require(
            self.melting_temperature > self.reference_temperature,
            "melting_temperature",
            self.melting_temperature,
            "more than reference_temperature",
        )

    @property
    def heat(self) -> Heat:
        """What the law knows of heat."""
        return Heat(
            self.initial_temperature,
            self.reference_temperature,
            self.melting_temperature,
            self.softening_exponent,
            self.taylor_quinney / (self.density * self.specific_heat),
            self.taylor_quinney,
            self.equation_of_state == "mie_grueneisen",
            self.grueneisen,
            self.hugoniot_slope,
        )

    def fields(self, state: np.ndarray) -> Fields:
        heat = self.heat
        rise = heat.heating * state[..., PLASTIC_WORK]
        temperature = np.minimum(heat.initial + rise, max(heat.melting, heat.initial))
        return super().fields(state) | {"temperature": (temperature, "K", "temperature")}


def heated(law: Any) -> Any:
    """Decorate the class of a law that has a field `heat`."""
    implements(softening, law)(_softening)
    implements(volumetric, law)(_volumetric)
    implements(warm, law)(_warm)
    implements(kirchhoff_step, law)(_kirchhoff_step)
    return law


def _kirchhoff_step(law, axes, increment, F, dt, old, state, tau, moduli):
    step(law, axes, increment, F, dt, old, state, tau, moduli)


def _softening(law, state):
    heat = law.heat
    T = heat.initial + heat.heating * state[PLASTIC_WORK]
    hot = (T - heat.reference) / (heat.melting - heat.reference)
    return 1.0 - min(max(hot, 0.0), 1.0) ** heat.exponent


def _warm(law, log_J, work, state):
    heat = law.heat
    x = 1.0 - math.exp(log_J)
    state[HEAT] += math.exp(-heat.grueneisen * x) * heat.taylor_quinney * work


def _volumetric(law, log_J, state):
    bulk = law.lame + 2.0 / 3.0 * law.shear
    if not law.heat.mie_grueneisen:
        return 0.5 * bulk * log_J * log_J, bulk * log_J, bulk
    heat = law.heat
    J = math.exp(log_J)
    x = 1.0 - J
    energy = state[HEAT]
    for k in range(16):
        y = POINTS[k] * x
        part = hugoniot(bulk, heat.slope, y)[0] * (1.0 - 0.5 * heat.grueneisen * y)
        energy += WEIGHTS[k] * x * part * math.exp(-heat.grueneisen * y)
    energy *= math.exp(heat.grueneisen * x)
    shock, per_x = hugoniot(bulk, heat.slope, x)
    pressure = shock * (1.0 - 0.5 * heat.grueneisen * x) + heat.grueneisen * energy
    slope = per_x * (1.0 - 0.5 * heat.grueneisen * x) - 0.5 * heat.grueneisen * shock
    slope += heat.grueneisen * pressure  # dE/dx = p
    stored = energy - heat.taylor_quinney * state[PLASTIC_WORK]
    return stored, -J * pressure, J * (J * slope - pressure)


@compiled
def hugoniot(bulk, slope, x):
    """Hugoniot's pressure [Pa] at ``x = 1 - J`` and its derivative; infinite from ``s x = 1`` on."""
    if x < 0.0:
        return bulk * x, bulk
    rest = max(1.0 - slope * x, 0.0)
    return bulk * x / rest**2, bulk * (1.0 + slope * x) / rest**3
