"""Kernels of smoothed particle hydrodynamics, which keep their size (Eulerian kernels).

``phi_i(x) = V_i W(|x - x_i|, h)`` with the cubic spline of Monaghan and Lattanzio (Li 2009, section
2.1.1) and a volume V_i of one spacing a side: on irregular nodes and at boundaries the functions do
not even add up to one.
"""

import math
from dataclasses import dataclass
from functools import partial
from typing import ClassVar

import numpy as np

from mpmbench.core.bases import BasisSettings, Promises
from mpmbench.core.bases.clouds.cloud import CloudBasis
from mpmbench.core.bases.radial import cubic_spline
from mpmbench.core.choices import Choices
from mpmbench.core.compiled import compiled, inlined
from mpmbench.core.errors import NotApplicable
from mpmbench.core.geometry import Geometry
from mpmbench.core.registry import register
from mpmbench.core.setting import setting

REACH = 2.0  # radius of the support in smoothing lengths
NORM = (1.0, 15.0 / (7.0 * math.pi), 1.5 / math.pi)  # of the kernel, by dimension


@register("basis", "sph_kernel")
@dataclass(frozen=True)
class SmoothedKernel(BasisSettings):
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
        if not choices.particles_are_nodes:
            raise NotApplicable(
                f"basis=sph_kernel is for method=sph: it reproduces no constants, as method="
                f"{choices.name} needs"
            )

    def build(self, geometry: Geometry, particles: int, moving: bool) -> "KernelBasis":
        spacing = geometry.nodal_spacing
        radius = REACH * self.smoothing_length * spacing
        fill = partial(fill_points, radius, spacing**geometry.dimension)
        return KernelBasis(geometry.points, particles, radius, 1, fill, moving)


class KernelBasis(CloudBasis):
    """Kernels on a set of nodes, whose radius is twice the smoothing length."""


@inlined
def spline(square, radius, dim):
    """W [1/m^dim] and W'(r) / r [1/m^(dim + 2)] from r^2 [m^2]; the support's radius is 2 h."""
    value, slope = cubic_spline(min(square / (radius * radius), 1.0))
    scale = NORM[dim - 1] / (radius / REACH) ** dim
    return scale * value, scale * slope / (radius * radius)


@compiled
def fill_points(radius, volume, clouds, points, strict, stored, failed):
    """Values and gradients at some points, in the shape of `Fill`; no point fails."""
    dim = clouds.x.shape[1]
    for q in range(points.shape[0]):
        p = points[q]
        for k in range(stored.size[p]):
            i = stored.index[p, k]
            square = 0.0
            for d in range(dim):
                square += (clouds.x[p, d] - clouds.nodes[i, d]) ** 2
            value, slope = spline(square, radius, dim)
            stored.phi[p, k] = volume * value
            for d in range(dim):
                difference = clouds.x[p, d] - clouds.nodes[i, d]
                stored.grad_phi[p, k, d] = volume * slope * difference


@compiled
def pair_gradients(radius, x, i, j):
    """Gradients of ``W_ij`` at x_i [1/m^(dim + 1)] for pairs of particles, shape (n, dim)."""
    gradient = np.zeros((len(i), x.shape[1]))
    for n in range(len(i)):
        square = 0.0
        for d in range(x.shape[1]):
            gradient[n, d] = x[i[n], d] - x[j[n], d]
            square += gradient[n, d] ** 2
        _, slope = spline(square, radius, x.shape[1])
        for d in range(x.shape[1]):
            gradient[n, d] *= slope
    return gradient
