"""Kernels of smoothed particle hydrodynamics, which move with the nodes and keep their size (Eulerian kernels).

``phi_i(x) = V_i W(|x - x_i|, h)`` with the cubic spline of Monaghan and Lattanzio (Li 2009, section
2.1.1) and a volume V_i of one spacing a side: on irregular nodes and at boundaries the functions do
not even add up to one.
"""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy.spatial import cKDTree

from mpmbench.core.bases import BasisSettings, Promises, StoredBasis
from mpmbench.core.bases.handle import Stencils
from mpmbench.core.choices import Choices
from mpmbench.core.errors import NotApplicable
from mpmbench.core.geometry import Geometry
from mpmbench.core.registry import register
from mpmbench.core.setting import setting

REACH = 2.0  # radius of the support in smoothing lengths
NORM = {1: 2.0 / 3.0, 2: 10.0 / (7.0 * math.pi), 3: 1.0 / math.pi}


@register("basis", "kernel")
@dataclass(frozen=True)
class Kernel(BasisSettings):
    """Kernels of smoothed particle hydrodynamics, for method=sph only."""

    smoothing_length: float = setting(
        1.0,
        "h over the nodal spacing; the support has the radius 2 h",
        unit="-",
        above=0.5,
        most=5.0,
    )
    promises: ClassVar[Promises] = Promises(
        partition_of_unity=False, linear_completeness=False, extrapolates=True
    )

    def check(self, choices: Choices, touches_fixed_nodes: bool) -> None:
        """Refuse Galerkin methods, whose functions must reproduce constants."""
        if not choices.particles_are_nodes:
            raise NotApplicable(
                f"basis=kernel is for method=sph: it reproduces no constants, as method={choices.name} needs"
            )

    def build(self, geometry: Geometry, particles: int, moving: bool) -> "KernelBasis":
        nodes = geometry.points
        spacing = geometry.nodal_spacing
        return KernelBasis(nodes, particles, spacing, self.smoothing_length * spacing)


def cubic_spline(distance: np.ndarray, h: float, dimension: int) -> tuple[np.ndarray, np.ndarray]:
    """W [1/m^dim] and W'(r) / r [1/m^(dim + 2)] at distances r [m]."""
    q = distance / h
    outer, inner = np.maximum(2.0 - q, 0.0), np.maximum(1.0 - q, 0.0)
    scale = NORM[dimension] / h**dimension
    slope = -0.75 * outer**2 + 3.0 * inner**2
    return scale * (0.25 * outer**3 - inner**3), scale * slope / (
        h * np.maximum(distance, 1e-12 * h)
    )


class KernelBasis(StoredBasis):
    """Kernels on a set of nodes.

    Parameters
    ----------
    nodes : ndarray
        Positions [m], shape (N, dim); copied.
    particles : int
    spacing, smoothing_length : float
        Nodal spacing and h [m].
    """

    def __init__(
        self, nodes: np.ndarray, particles: int, spacing: float, smoothing_length: float
    ) -> None:
        self.nodes = np.array(nodes, dtype=float)
        self.spacing, self.smoothing_length = spacing, smoothing_length
        self.handle = Stencils.empty(particles, 1, nodes.shape[1])

    def _fill(self, x: np.ndarray, stored: Stencils) -> Stencils:
        dimension = x.shape[1]
        near = cKDTree(self.nodes).query_ball_point(
            x, REACH * self.smoothing_length, return_sorted=True
        )
        width = max(map(len, near), default=0) + 1
        if stored.width < width:
            stored = Stencils.empty(len(x), width, dimension)
        stored.size[:] = [len(found) for found in near]
        for p, found in enumerate(near):
            stored.index[p, : len(found)] = found
        difference = x[:, None, :] - self.nodes[stored.index]
        W, slope = cubic_spline(
            np.linalg.norm(difference, axis=2), self.smoothing_length, dimension
        )
        used = np.arange(stored.index.shape[1]) < stored.size[:, None]
        stored.phi[:] = self.spacing**dimension * W * used
        stored.grad_phi[:] = (self.spacing**dimension * slope * used)[:, :, None] * difference
        return stored

    def move(self, displacement: np.ndarray) -> None:
        self.nodes += displacement
