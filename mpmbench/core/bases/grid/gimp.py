"""Generalized interpolation: hats averaged over the particles' domains (Bardenhagen and Kober 2004).

``phi_i(x_p) = (1 / V_p) int chi_p N_i dx`` with hats N_i and a characteristic function chi_p that is 1
on a box around the particle, so that the functions are products along the axes. The average of a
ramp ``max(s, 0)`` over a domain of half the length l is

    R(s) = 0 for s < -l,  (s + l)^2 / (4 l) for |s| <= l,  s for s > l,

and its slope that of the average. A hat is a sum of ramps that begin at nodes.

At the edge of the grid hats go on straight, beyond it too, so that a domain may reach out. That is
the same as a layer of nodes outside whose values continue those of the last two nodes linearly: where
the node on the edge stands still, as on a roller, the one outside mirrors, -v. So sums of linear
functions are exact up to the edge. A grid of one or two cells along an axis is continued instead.

Domains (Steffen et al. 2008, section 2): `uniform` ones keep their size, those of `contiguous`
stretch by the diagonal of F, which is meant for stretches along the axes and fails under rotation;
those of `finite` by the diagonal of U, of ``F = R U``, which is not changed by a rotation.
"""

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np

from mpmbench.core.bases import BasisSettings, Promises
from mpmbench.core.bases.grid.product import GridBasis, product, product_fields
from mpmbench.core.bases.handle import Stencils, fill
from mpmbench.core.compiled import compiled, inlined, matrix, vector
from mpmbench.core.compiled.algebra import inverse
from mpmbench.core.errors import BrokeDown, NotApplicable
from mpmbench.core.geometry import Box, Geometry
from mpmbench.core.particles import Particles
from mpmbench.core.registry import register
from mpmbench.core.setting import setting

USUAL = 0.25  # half a domain over the cell, where no particles are known: two along each axis
POINT = 1e-6  # that of points without a volume, whose functions are the hats themselves
ROUND_OFF = 1e-9  # by which a particle may be wider than the functions reach
FEWEST = 4  # nodes along an axis
MOST_ITERATIONS = 50  # for a rotation; ten are many


class GimpGrid(NamedTuple):
    """What kernels see; the first four fields are `product_fields`."""

    axes: tuple[float, ...]
    order: tuple[float, ...]  # 3 functions reach over domains of one cell, 4 over those of two
    lanes: tuple[float, ...]
    shape: np.ndarray
    lower: np.ndarray  # corner of the grid [m], shape (dim,)
    half: np.ndarray  # half the domains over the cells, shape (P, dim)


@inlined
def ramp(s, half):
    """Average of ``max(s, 0)`` over a domain, and of its slope."""
    reach = min(max(s + half, 0.0), 2.0 * half)
    return max(s - half, 0.0) + reach * reach / (4.0 * half), reach / (2.0 * half)


@product(GimpGrid)
def averaged_hats(grid, x, p, d, phi, slope):
    """Ramps up and down to the outer nodes; the inner functions follow from sums of 1 and of x."""
    place, half, per_metre = (x - grid.lower[d]) * grid.axes[d], grid.half[p, d], grid.axes[d]
    if len(grid.order) == 3:  # around the nearest node inside
        i = min(max(int(place + 0.5), 1), grid.shape[d] - 2)
        phi[d, 0], left = ramp(i - place, half)
        phi[d, 2], right = ramp(place - i, half)
        phi[d, 1] = 1.0 - phi[d, 0] - phi[d, 2]
        slope[d, 0], slope[d, 2] = -per_metre * left, per_metre * right
        slope[d, 1] = -slope[d, 0] - slope[d, 2]
        return i - 1
    i = min(max(int(place), 1), grid.shape[d] - 3)  # around the nearest cell inside
    t = place - i
    phi[d, 0], left = ramp(-t, half)
    phi[d, 3], right = ramp(t - 1.0, half)
    phi[d, 1] = 1.0 - t - 2.0 * phi[d, 0] + phi[d, 3]
    phi[d, 2] = t + phi[d, 0] - 2.0 * phi[d, 3]
    slope[d, 0], slope[d, 3] = -per_metre * left, per_metre * right
    slope[d, 1] = per_metre * (2.0 * left + right - 1.0)
    slope[d, 2] = per_metre * (1.0 - left - 2.0 * right)
    return i - 1


@inlined
def right_stretch(axes, F, R, other, stretch):
    """Diagonal of U, of ``F = R U`` with ``det F > 0``, and R by Newton's method, ``R <- (R + R^-T) / 2``."""
    dim = len(axes)
    for d in range(dim):
        for e in range(dim):
            R[d, e] = F[d, e]
    for _ in range(MOST_ITERATIONS):
        inverse(axes, R, other)
        change = 0.0
        for d in range(dim):
            for e in range(dim):
                half = 0.5 * (other[e, d] - R[d, e])
                R[d, e] += half
                change = max(change, abs(half))
        if change < 1e-14:
            break
    for d in range(dim):
        stretch[d] = 0.0
        for e in range(dim):
            stretch[d] += R[e, d] * F[e, d]


@compiled
def stretch_domains(axes, F, initial, finite, half):
    """Write the halves of the stretched domains; returns a particle without a length, else -1."""
    R, other, stretch = matrix(axes, axes), matrix(axes, axes), vector(axes)
    for p in range(F.shape[0]):
        if finite:
            right_stretch(axes, F[p], R, other, stretch)
        else:
            for d in range(len(axes)):
                stretch[d] = F[p, d, d]
        for d in range(len(axes)):
            if not stretch[d] > 0.0:
                return p
            half[p, d] = max(initial[p, d] * stretch[d], POINT)
    return -1


class GimpBasis(GridBasis):
    """Averages of hats over domains of the particles that it follows."""

    def __init__(self, box: Box, particles: int, domain: str) -> None:
        order = 3 if domain == "uniform" else 4
        more = np.maximum(FEWEST - 1 - np.array(box.cells), 0)
        upper = tuple(np.array(box.upper) + more * box.spacing)
        whole = Box(box.lower, upper, tuple(np.array(box.cells) + more)) if more.any() else box
        half = np.full((particles, box.dimension), USUAL)
        handle = GimpGrid(**product_fields(whole, order, 1), lower=np.array(box.lower), half=half)
        super().__init__(box, handle, whole.points)
        self.domain, self.cell, self._usual = domain, float(np.prod(box.spacing)), USUAL
        self._initial = half.copy()
        self._particles: Particles | None = None

    def follow(self, particles: Particles) -> None:
        """Domains are as large as the particles, with the proportions of a cell."""
        self._particles, solid = particles, particles.material
        self._initial[:] = 0.5 * (particles.V0[:, None] / self.cell) ** (1.0 / particles.dimension)
        self._usual = float(np.median(self._initial[solid]))
        np.maximum(self._initial, POINT, out=self._initial)  # tracers
        self.handle.half[:] = self._initial
        if self.domain == "uniform" and self._initial.max() > 0.5 + ROUND_OFF:
            raise NotApplicable(
                "basis.domain=uniform has functions for particles of one cell, and these are larger"
            )

    def locate(self, x: np.ndarray) -> None:
        """Domains follow the particles of now."""
        if self.domain == "uniform" or self._particles is None:
            return
        F, half = self._particles.F, self.handle.half
        lost = stretch_domains(self.handle.axes, F, self._initial, self.domain == "finite", half)
        if lost >= 0:
            raise BrokeDown(
                f"the domain of particle {lost} has lost its length with basis.domain={self.domain}"
            )
        if half.max(initial=0.0) > 1.0 + ROUND_OFF:
            p, d = np.unravel_index(int(half.argmax()), half.shape)
            raise BrokeDown(
                f"the domain of particle {p} is {2.0 * half[p, d]:.3g} cells long along axis {d}, "
                "and there are functions for two"
            )

    def evaluate(self, x: np.ndarray) -> Stencils:
        """At the followed particles with their domains, at any other points with the usual one."""
        if self._particles is not None and x is self._particles.x:
            return self._evaluate(x, self.handle.half)
        return self._evaluate(x, np.full(x.shape, self._usual))

    def evaluate_particles(self, x: np.ndarray, numbers: np.ndarray) -> Stencils:
        return self._evaluate(x[numbers], self.handle.half[numbers])

    def _evaluate(self, x: np.ndarray, half: np.ndarray) -> Stencils:
        if (outside := self.first_outside(x)) >= 0:
            raise BrokeDown(f"point {outside} at {x[outside]} m is outside the grid")
        handle = self.handle._replace(half=half)
        stored = Stencils.empty(len(x), handle.width, x.shape[1])
        fill(handle, x, stored.size, stored.index, stored.phi, stored.grad_phi)
        return stored


@register("basis", "gimp")
@dataclass(frozen=True)
class Gimp(BasisSettings):
    """Hats averaged over the domains of the particles, Bardenhagen and Kober 2004; Steffen et al. 2008."""

    domain: str = setting(
        "uniform",
        "boxes of their first size, stretched by the diagonal of F (fails under rotation), or of U",
        options=("uniform", "contiguous", "finite"),
    )
    promises: ClassVar[Promises] = Promises(kronecker="hull", grid=True, moves=False)

    def build(self, geometry: Geometry, particles: int, moving: bool) -> GimpBasis:
        if not isinstance(geometry, Box):
            raise NotApplicable("gimp needs a grid: this problem has an unstructured set of nodes")
        return GimpBasis(geometry, particles, self.domain)
