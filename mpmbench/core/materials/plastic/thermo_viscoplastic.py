"""Metal in which rate and temperature count, as in Li 2009, Eqs. 5.3 to 5.9, corrected.

Flow is at the rate ``rate_0 ((sigma / g)^m - 1)`` (Eq. 5.4a), that is ``sigma = g (1 + rate /
rate_0)^(1/m)``. The stored ``int g de`` has the hardening; the dual potential is that of the rest,
``sigma - g``: ``g (m rate_0 / (m + 1) ((1 + rate / rate_0)^((m + 1) / m) - 1) - rate)``, with g of
the step's start (Eq. 3.103).
"""

from dataclasses import dataclass
from typing import NamedTuple

from mpmbench.core.compiled import implements
from mpmbench.core.materials.plastic.j2 import power_hardening
from mpmbench.core.materials.plastic.radial import hardening, rate_factor
from mpmbench.core.materials.plastic.thermal import Heat, ThermoPlastic, heated
from mpmbench.core.registry import register
from mpmbench.core.setting import setting


@heated
class ThermoViscoplasticLaw(NamedTuple):
    """Lame parameters and initial yield stress [Pa], 1/n, e_0, 1/m, reference rate [1/s], and heat."""

    lame: float
    shear: float
    yield_stress: float
    exponent: float
    reference: float
    sensitivity: float
    reference_rate: float
    heat: Heat


@register("material", "thermo_viscoplastic")
@dataclass(frozen=True)
class ThermoViscoplastic(ThermoPlastic):
    """Von Mises metal: power laws of hardening and rate, softening by its own heat (Li 2009, 5.2.2)."""

    young_modulus: float = 200.0e9
    poisson_ratio: float = 0.29
    density: float = 7850.0
    yield_stress: float = setting(1.5e9, "sigma_y, at first, slow and cold", unit="Pa", above=0.0)
    hardening_exponent: float = setting(
        22.0, "n of sigma_y (1 + e / e_0)^(1/n)", unit="-", least=1.0
    )
    reference_strain: float = setting(0.001, "e_0 of hardening", unit="-", above=0.0)
    rate_exponent: float | None = setting(
        None, "m of (1 + rate / rate_0)^(1/m); null: the rate is of no effect", unit="-", least=1.0
    )
    reference_rate: float = setting(1000.0, "rate_0 of plastic strain", unit="1/s", above=0.0)

    @property
    def law(self) -> ThermoViscoplasticLaw:
        sensitivity = 0.0 if self.rate_exponent is None else 1.0 / self.rate_exponent
        flow = self.yield_stress, 1.0 / self.hardening_exponent, self.reference_strain
        rates = sensitivity, self.reference_rate
        return ThermoViscoplasticLaw(*self.lame_parameters(), *flow, *rates, self.heat)


@implements(hardening, ThermoViscoplasticLaw)
def _hardening(law, strain):
    return power_hardening(law.yield_stress, law.exponent, law.reference, strain)


@implements(rate_factor, ThermoViscoplasticLaw)
def _rate_factor(law, rate):
    if law.sensitivity == 0.0:
        return 1.0, 0.0
    base = 1.0 + rate / law.reference_rate
    factor = base**law.sensitivity
    return factor, factor * law.sensitivity / (base * law.reference_rate)
