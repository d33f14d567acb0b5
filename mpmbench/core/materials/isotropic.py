"""The constants of isotropic elasticity, shared by the elastic laws."""

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

from mpmbench.core.errors import require


class Lame(NamedTuple):
    """First Lame parameter and shear modulus [Pa]; each law derives its own class, on which kernels dispatch."""

    lame: float
    shear: float


@dataclass(frozen=True)
class IsotropicElastic:
    """Settings of an isotropic elastic law.

    Parameters
    ----------
    young_modulus : float
        Young's modulus E [Pa].
    poisson_ratio : float
        Poisson's ratio nu, in (-1, 0.5).
    density : float
        Initial density rho_0 [kg/m^3].
    """

    young_modulus: float = 1.0e6
    poisson_ratio: float = 0.3
    density: float = 1000.0
    history: ClassVar[int] = 0
    rate_dependent: ClassVar[bool] = False
    symmetric: ClassVar[bool] = True
    conserves_energy: ClassVar[bool] = True
    symmetric_tangent: ClassVar[bool] = True

    def __post_init__(self) -> None:
        require(
            self.young_modulus > 0.0, "young_modulus", self.young_modulus, "a positive number [Pa]"
        )
        allowed = "a number greater than -1 and less than 0.5"
        require(-1.0 < self.poisson_ratio < 0.5, "poisson_ratio", self.poisson_ratio, allowed)
        require(self.density > 0.0, "density", self.density, "a positive number [kg/m^3]")

    def lame_parameters(self) -> tuple[float, float]:
        """First Lame parameter and shear modulus [Pa]."""
        E, nu = self.young_modulus, self.poisson_ratio
        return E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)), E / (2.0 * (1.0 + nu))
