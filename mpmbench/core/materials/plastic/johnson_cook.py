"""Johnson and Cook's metal (1983): ``sigma = (A + B e^n) (1 + C ln max(rate / rate_0, 1)) (1 - T*^m)``.

``T* = (T - T_0) / (T_m - T_0)`` from 0 to 1. The default is oxygen-free copper.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

from mpmbench.core.compiled import implements
from mpmbench.core.materials.plastic.radial import hardening, rate_factor
from mpmbench.core.materials.plastic.thermal import Heat, ThermoPlastic, heated
from mpmbench.core.registry import register
from mpmbench.core.setting import setting


@heated
class JohnsonCookLaw(NamedTuple):
    """Lame parameters, A and B [Pa], n, C, reference rate [1/s], and heat."""

    lame: float
    shear: float
    yield_stress: float
    modulus: float
    exponent: float
    sensitivity: float
    reference_rate: float
    heat: Heat


@register("material", "johnson_cook")
@dataclass(frozen=True)
class JohnsonCook(ThermoPlastic):
    """Von Mises metal of Johnson and Cook: flow stress by strain, rate and temperature."""

    young_modulus: float = 124.0e9
    poisson_ratio: float = 0.34
    density: float = 8960.0
    specific_heat: float = 383.0
    initial_temperature: float = 298.0
    reference_temperature: float = 298.0
    melting_temperature: float = 1356.0
    softening_exponent: float = 1.09
    yield_stress: float = setting(90.0e6, "A, at first, slow and cold", unit="Pa", above=0.0)
    hardening_modulus: float = setting(292.0e6, "B of B e^n", unit="Pa", least=0.0)
    hardening_exponent: float = setting(0.31, "n of B e^n", unit="-", above=0.0, most=1.0)
    rate_sensitivity: float = setting(0.025, "C of 1 + C ln(rate / rate_0)", unit="-", least=0.0)
    reference_rate: float = setting(
        1.0, "rate_0 of plastic strain, below which the rate is of no effect", unit="1/s", above=0.0
    )

    @property
    def law(self) -> JohnsonCookLaw:
        flow = self.yield_stress, self.hardening_modulus, self.hardening_exponent
        rates = self.rate_sensitivity, self.reference_rate
        return JohnsonCookLaw(*self.lame_parameters(), *flow, *rates, self.heat)


@implements(hardening, JohnsonCookLaw)
def _hardening(law, strain):
    harder = law.modulus * strain**law.exponent
    slope = law.exponent * harder / strain if strain > 0.0 else math.inf
    integral = (law.yield_stress + harder / (law.exponent + 1.0)) * strain
    return law.yield_stress + harder, slope, integral


@implements(rate_factor, JohnsonCookLaw)
def _rate_factor(law, rate):
    if rate <= law.reference_rate:
        return 1.0, 0.0
    return 1.0 + law.sensitivity * math.log(rate / law.reference_rate), law.sensitivity / rate
