"""Uniform GIMP (Bardenhagen and Kober 2004): hat functions, averaged over a particle of fixed size."""

from typing import ClassVar, NamedTuple

import numpy as np

from mpmbench import BasisSettings, GridBasis, Promises, product, product_fields, register


class GimpGrid(NamedTuple):  # besides what products have: lower corner [m], half a particle [cells]
    axes: tuple[float, ...]
    order: tuple[float, ...]
    lanes: tuple[float, ...]
    shape: np.ndarray
    lower: np.ndarray
    half: np.ndarray


@product(GimpGrid)
def line(grid, x, p, d, phi, slope):
    place, half = (x - grid.lower[d]) * grid.axes[d], grid.half[d]
    i = min(max(int(place + 0.5), 1), grid.shape[d] - 2)  # the nearest node inside
    for a in (0, 2):  # a kink is averaged to a parabola
        t = (a - 1) * (place - i)
        phi[d, a] = t if t > half else max(t + half, 0.0) ** 2 / (4.0 * half)
        slope[d, a] = (a - 1) * grid.axes[d] * min(max(t + half, 0.0) / (2.0 * half), 1.0)
    phi[d, 1], slope[d, 1] = 1.0 - phi[d, 0] - phi[d, 2], -slope[d, 0] - slope[d, 2]
    return i - 1


class Gimp(GridBasis):
    def follow(self, particles):
        size = particles.V0[particles.material].mean() ** (1.0 / particles.dimension)
        self.handle.half[:] = 0.5 * size * np.array(self.handle.axes)


@register("basis", "averaged_hat")
class AveragedHat(BasisSettings):
    promises: ClassVar[Promises] = Promises(kronecker="hull", grid=True, moves=False)

    def build(self, geometry, particles, moving):
        own = {"lower": np.array(geometry.lower), "half": np.full(geometry.dimension, 0.25)}
        return Gimp(geometry, GimpGrid(**product_fields(geometry, 3, 1), **own), geometry.points)
