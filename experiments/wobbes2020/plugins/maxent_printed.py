"""Max-ent functions with the gradient of Wobbes et al. 2020, Eqs. 84 and 86: as printed, and partly corrected."""

from dataclasses import dataclass

import numpy as np

from mpmbench.core.bases import Basis
from mpmbench.core.bases.clouds.search import nearest_distances
from mpmbench.core.bases.entropy.maxent import MaxEnt
from mpmbench.core.bases.handle import Stencils
from mpmbench.core.errors import require
from mpmbench.core.geometry import Geometry
from mpmbench.core.registry import register
from mpmbench.core.setting import setting


@register("basis", "maxent_printed")
@dataclass(frozen=True)
class MaxEntPrinted(MaxEnt):
    """Max-ent functions with the gradient of Wobbes et al. 2020, Eqs. 84 and 86."""

    gradient: str = setting(
        "printed",
        "as printed; with its sign corrected; with that of A too, the exact gradient",
        options=("printed", "sign_corrected", "corrected"),
    )

    def check_together(self) -> None:
        require(self.prior == "cubic_spline", "prior", self.prior, "cubic_spline")

    def build(self, geometry: Geometry, particles: int, moving: bool) -> "PrintedGradient":
        """The same functions, searched and solved in the same way, with other gradients."""
        return PrintedGradient(
            super().build(geometry, particles, moving), self.gradient, self.d_max
        )


class PrintedGradient:
    """A max-ent basis whose gradients are replaced after each evaluation (fulfils `Basis`)."""

    def __init__(self, exact: Basis, gradient: str, d_max: float) -> None:
        self.exact, self.gradient, self.d_max = exact, gradient, d_max

    @property
    def nodes(self) -> np.ndarray:
        """Positions of the nodes [m], shape (N, dim)."""
        return self.exact.nodes

    @property
    def handle(self) -> Stencils:
        """Stored functions of the particles."""
        stored: Stencils = self.exact.handle
        return stored

    def evaluate(self, x: np.ndarray) -> Stencils:
        """Values and gradients at any points."""
        return self._replaced(x, self.exact.evaluate(x))

    def locate(self, x: np.ndarray) -> None:
        """Store the functions of the particles."""
        self.exact.locate(x)
        self._replaced(x, self.exact.handle)

    def first_outside(self, x: np.ndarray) -> int:
        """Number of the first point outside the hull of the nodes, -1 when all are inside."""
        return self.exact.first_outside(x)

    def move(self, displacement: np.ndarray) -> None:
        """Move the nodes."""
        self.exact.move(displacement)

    def _replaced(self, x: np.ndarray, stored: Stencils) -> Stencils:
        """Write the gradients of Eq. 84 into stored functions."""
        away, log_slope, phi = self._prior(x, stored)
        H = np.einsum("pi,pia,pib->pab", phi, away, away)  # Eq. 85
        A = np.einsum("pi,pia,pib->pab", phi, away, log_slope)  # Eq. 86, with x - x_i as printed
        mean = np.einsum("pi,pia->pa", phi, log_slope)
        inverse = np.linalg.inv(H)
        sign_of_A = -1.0 if self.gradient == "corrected" else 1.0
        bracket = np.einsum("pia,pab->pib", away, inverse - sign_of_A * inverse @ A)
        printed = phi[:, :, None] * (bracket - log_slope + mean[:, None, :])  # Eq. 84
        stored.grad_phi[:] = printed if self.gradient == "printed" else -printed
        return stored

    def _prior(self, x: np.ndarray, stored: Stencils) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """``x - x_i``, ``grad w_i / w_i`` of the cubic spline (Eq. 89) and phi_i; zero beyond a point's functions."""
        used = np.arange(stored.phi.shape[1]) < stored.size[:, None]
        nodes = np.where(used, stored.index, 0)
        away = x[:, None, :] - self.nodes[nodes]
        distance = np.linalg.norm(away, axis=2)
        radius = self.d_max * nearest_distances(self.nodes)[nodes]  # Eq. 88
        r = distance / radius
        w = np.where(r <= 0.5, 2.0 / 3.0 - 4.0 * r**2 + 4.0 * r**3, 4.0 / 3.0 * (1.0 - r) ** 3)
        slope = np.where(r <= 0.5, -8.0 * r + 12.0 * r**2, -4.0 * (1.0 - r) ** 2)
        factor = slope / np.maximum(w * radius * distance, 1e-300)
        inside = used & (r < 1.0) & (distance > 0.0)
        log_slope = np.where(inside[:, :, None], factor[:, :, None] * away, 0.0)
        return away, log_slope, np.where(used, stored.phi, 0.0)
