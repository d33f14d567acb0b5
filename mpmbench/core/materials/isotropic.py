"""The constants of isotropic elasticity, shared by the elastic laws."""

from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

from mpmbench.core.materials import Material
from mpmbench.core.setting import setting


class Lame(NamedTuple):
    """First Lame parameter and shear modulus [Pa]; each law derives a class of its own."""

    lame: float
    shear: float


@dataclass(frozen=True)
class IsotropicElastic(Material):
    """Constants of an isotropic elastic law.

    Attributes
    ----------
    constants : type
        What the law is made of, unless it says so itself.
    """

    young_modulus: float = setting(
        4000.0, "E; 3 K (1 - 2 nu) for a bulk modulus K", unit="Pa", above=0.0
    )
    poisson_ratio: float = setting(0.0, "nu", unit="-", above=-1.0, below=0.5)
    density: float = setting(1.0, "of the undeformed body", unit="kg/m3", above=0.0)
    constants: ClassVar[type[Lame]] = Lame

    @property
    def law(self) -> Any:
        return self.constants(*self.lame_parameters())

    def lame_parameters(self) -> tuple[float, float]:
        E, nu = self.young_modulus, self.poisson_ratio
        return E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)), E / (2.0 * (1.0 + nu))
