"""Von Mises plasticity at finite strain: isotropic hardening, exact radial return (Simo 1998)."""

import math
from dataclasses import dataclass
from typing import NamedTuple

from mpmbench.core.compiled import compiled, implements
from mpmbench.core.errors import require
from mpmbench.core.materials.plastic import Plastic
from mpmbench.core.materials.plastic.radial import hardening
from mpmbench.core.registry import register
from mpmbench.core.setting import setting

LINEAR, POWER, VOCE = range(3)  # kinds of hardening
KINDS = ("linear", "power", "voce")


class J2Law(NamedTuple):
    """Lame parameters [Pa], initial yield stress [Pa], and the kind of hardening with its numbers."""

    lame: float
    shear: float
    yield_stress: float
    kind: int
    modulus: float
    exponent: float
    reference: float


@register("material", "j2")
@dataclass(frozen=True)
class J2(Plastic):
    """Von Mises plasticity at finite strain, logarithmic strains, isotropic hardening."""

    young_modulus: float = 117.0e9
    poisson_ratio: float = 0.35
    density: float = 8930.0
    yield_stress: float = setting(400.0e6, "sigma_y, at first", unit="Pa", above=0.0)
    hardening: str = setting(
        "linear",
        "of the yield stress: H e, sigma_y (1 + e / e_0)^(1/n), or to a limit as exp(-e / e_0)",
        options=("linear", "power", "voce"),
    )
    hardening_modulus: float = setting(100.0e6, "H of linear hardening", unit="Pa", least=0.0)
    hardening_exponent: float = setting(4.0, "n of power hardening", unit="-", least=1.0)
    saturation_stress: float = setting(600.0e6, "limit of voce hardening", unit="Pa", above=0.0)
    reference_strain: float = setting(
        0.01, "plastic strain e_0 of power and voce hardening", unit="-", above=0.0
    )

    def check_together(self) -> None:
        require(
            self.hardening != "voce" or self.saturation_stress >= self.yield_stress,
            "saturation_stress",
            self.saturation_stress,
            "at least yield_stress",
        )

    @property
    def law(self) -> J2Law:
        kind = KINDS.index(self.hardening)
        modulus = (
            self.saturation_stress - self.yield_stress
            if self.hardening == "voce"
            else self.hardening_modulus
        )
        numbers = modulus, 1.0 / self.hardening_exponent, self.reference_strain
        return J2Law(*self.lame_parameters(), self.yield_stress, kind, *numbers)


@compiled
def power_hardening(yield_stress, exponent, reference, strain):
    """``sigma_y (1 + e / e_0)^(1/n)`` with the exponent 1/n, as in `hardening` (Li 2009, Eq. 5.4b)."""
    base = 1.0 + strain / reference
    g = yield_stress * base**exponent
    integral = reference * (g * base - yield_stress) / (1.0 + exponent)
    return g, g * exponent / (base * reference), integral


@implements(hardening, J2Law)
def _hardening(law, strain):
    if law.kind == POWER:
        return power_hardening(law.yield_stress, law.exponent, law.reference, strain)
    if law.kind == VOCE:
        decay = math.exp(-strain / law.reference)
        g = law.yield_stress + law.modulus * (1.0 - decay)
        stored = law.modulus * law.reference * (1.0 - decay)
        integral = (law.yield_stress + law.modulus) * strain - stored
        return g, law.modulus * decay / law.reference, integral
    g = law.yield_stress + law.modulus * strain
    return g, law.modulus, law.yield_stress * strain + 0.5 * law.modulus * strain * strain
