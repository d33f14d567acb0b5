"""Max-ent functions with the gradient of Wobbes et al. 2020, Eqs. 84 and 86: as printed, and partly corrected."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from mpmbench.core.bases.entropy_basis import EntropyBasis
from mpmbench.core.bases.handle import Stencils
from mpmbench.core.bases.maxent import MaxEnt
from mpmbench.core.errors import require, require_option
from mpmbench.core.geometry import Geometry
from mpmbench.core.registry import register

GRADIENTS = ("corrected", "sign_corrected", "printed")


@register("basis", "maxent_printed")
@dataclass(frozen=True)
class MaxEntPrinted(MaxEnt):
    """Settings of the max-ent basis, cubic-spline prior, and which gradient it has.

    Parameters
    ----------
    gradient : {"printed", "sign_corrected", "corrected"}
        Eqs. 84 and 86 as printed; with the overall sign corrected; with the sign of A corrected too, which is the exact
        gradient and serves as a check.
    """

    gradient: str = "printed"

    def __post_init__(self) -> None:
        super().__post_init__()
        require_option("gradient", self.gradient, GRADIENTS)
        require(self.prior == "cubic_spline", "prior", self.prior, "cubic_spline")

    def build(self, geometry: Geometry, particles: int, moving: bool) -> EntropyBasis:
        basis = super().build(geometry, particles, moving)
        basis.__class__ = PrintedGradient  # the same functions, searched and solved in the same way
        basis.gradient = self.gradient  # type: ignore[attr-defined]
        return basis


class PrintedGradient(EntropyBasis):
    """An `EntropyBasis` whose gradients are replaced after each evaluation."""

    gradient: str

    def _fill(self, x: np.ndarray, stored: Stencils, *rest: Any) -> Stencils:
        stored = super()._fill(x, stored, *rest)
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
        """``x - x_i``, ``grad w_i / w_i`` of the cubic spline (Eq. 89), and phi_i; zero beyond a point's functions."""
        used = np.arange(stored.phi.shape[1]) < stored.size[:, None]
        nodes = np.where(used, stored.index, 0)
        away = x[:, None, :] - self.nodes[nodes]
        distance = np.linalg.norm(away, axis=2)
        radius = np.sqrt(self.cloud.square)[nodes]
        r = distance / radius
        w = np.where(r <= 0.5, 2.0 / 3.0 - 4.0 * r**2 + 4.0 * r**3, 4.0 / 3.0 * (1.0 - r) ** 3)
        slope = np.where(r <= 0.5, -8.0 * r + 12.0 * r**2, -4.0 * (1.0 - r) ** 2)
        factor = slope / np.maximum(w * radius * distance, 1e-300)
        inside = used & (r < 1.0) & (distance > 0.0)
        log_slope = np.where(inside[:, :, None], factor[:, :, None] * away, 0.0)
        return away, log_slope, np.where(used, stored.phi, 0.0)
