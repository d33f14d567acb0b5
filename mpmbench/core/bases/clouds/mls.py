"""Moving least squares of degree 1 or 2 (Lancaster, Salkauskas 1981; Iaconeta 2017, Eqs. 50-58).

``N_I = P(0) . M^-1 P_I W_I`` with ``M = sum_I P_I (x) P_I W_I`` and the polynomials P in
coordinates relative to the point, in units of the radius. The paper prints 1, x, y, xy and further
terms as P, and gives neither degree nor weight. The weight here is a spline or a Gaussian of the
distance over the effective radius R_eff. Functions have no Kronecker delta and may be negative;
where they would be large, because the nodes that carry weight lie to one side of the point, its
cloud takes in further nodes.
"""

import math
from dataclasses import dataclass
from functools import partial
from typing import ClassVar, NamedTuple

import numpy as np

from mpmbench.core.bases import BasisSettings, Promises
from mpmbench.core.bases.clouds.cloud import CloudBasis
from mpmbench.core.bases.radial import GAUSSIAN, QUARTIC_SPLINE, WEIGHTS
from mpmbench.core.choices import Choices
from mpmbench.core.compiled import compiled
from mpmbench.core.errors import BadSetting, NotApplicable
from mpmbench.core.geometry import Geometry
from mpmbench.core.registry import register
from mpmbench.core.setting import setting

DIRECT_RADIUS = math.sqrt(2.0) * (1.0 + 1e-6)  # in nodal spacings, on regular nodes
SMALLEST_PIVOT = 1e-10  # of M, scaled to a unit diagonal: below it the cloud takes in another node
# Of |N_I|: more has a point outside the nodes that carry weight; its cloud takes in another node.
LARGEST_SUM = 2.0


class Recipe(NamedTuple):
    """Degree, products beside it, number of polynomials, kind of weight, and R_eff / R."""

    degree: int
    mixed_terms: bool
    polynomials: int
    weight: int
    effective: float


@register("basis", "mls")
@dataclass(frozen=True)
class MovingLeastSquares(BasisSettings):
    """Moving least squares on a cloud of nodes, Iaconeta et al. 2017.

    The Gaussian is ``exp(-(r / R_eff)^2)``, lowered to vanish at the search radius. Where a cloud has
    fewer nodes than `minimum_nodes`, its radius grows.
    """

    degree: int = setting(1, "of the polynomials that are reproduced", unit="-", options=(1, 2))
    mixed_terms: bool = setting(
        False, "degree 1 has products of two coordinates too: 1, x, y, xy as in Eq. 50"
    )
    weight: str = setting(
        "cubic_spline",
        "of a node by its distance",
        options=("cubic_spline", "quartic_spline", "gaussian"),
    )
    relative_radius: float = setting(
        1.4142135623730951,
        "search radius R over the nodal spacing h",
        unit="-",
        above=1.0,
        most=20.0,
    )
    radius: float = setting(0.0, "search radius R; 0: relative_radius decides", unit="m", least=0.0)
    spacing: float = setting(
        0.0, "nodal spacing h; 0: that of the nodes at the start", unit="m", least=0.0
    )
    effective_radius: float = setting(
        0.5, "R_eff / R; splines vanish at 2 R_eff", unit="-", least=0.1, most=10.0
    )
    minimum_nodes: int = setting(
        0, "least number of nodes of a cloud; 0: number of polynomials", unit="-", least=0, most=100
    )
    promises: ClassVar[Promises] = Promises(non_negative=False, extrapolates=True)

    def check(self, choices: Choices, touches_fixed_nodes: bool) -> None:
        """Refuse to hold single nodes where functions of their neighbours do not vanish.

        Where the fixed nodes are no part of the body (`touches_fixed_nodes`), nothing else can be
        held.
        """
        if self.mixed_terms and self.degree > 1:
            raise NotApplicable(
                f"basis.mixed_terms=true with basis.degree={self.degree}: these polynomials have the "
                "products of two coordinates already: leave it out"
            )
        if (
            not touches_fixed_nodes
            and choices.dirichlet == "direct"
            and self.relative_radius > DIRECT_RADIUS
        ):
            raise NotApplicable(
                f"basis.relative_radius={self.relative_radius:g} with method.dirichlet=direct: mls "
                "does not interpolate, so nodes can be held directly up to sqrt(2) only: use "
                "method.dirichlet=multipliers"
            )

    def build(self, geometry: Geometry, particles: int, moving: bool) -> CloudBasis:
        h = self.spacing or geometry.nodal_spacing
        radius = self.radius or self.relative_radius * h
        if radius <= h:
            raise BadSetting("radius", self.radius, f"more than the nodal spacing of {h:.6g} m")
        polynomials = math.comb(geometry.dimension + self.degree, self.degree)
        if self.mixed_terms and self.degree == 1:
            polynomials += math.comb(geometry.dimension, 2)
        weight = WEIGHTS[self.weight]
        recipe = Recipe(self.degree, self.mixed_terms, polynomials, weight, self.effective_radius)
        least = max(self.minimum_nodes, polynomials)
        fill = partial(fill_points, recipe)
        return CloudBasis(geometry.points, particles, radius, least, fill, moving)


@compiled
def weigh(kind, effective, q):
    """Weight and its derivative by ``q = r / R``, 0 <= q; both vanish beyond q = 1."""
    if q >= 1.0:
        return 0.0, 0.0
    if kind == GAUSSIAN:
        c = 1.0 / (effective * effective)
        rim = math.exp(-c)
        bell = math.exp(-c * q * q)
        return (bell - rim) / (1.0 - rim), -2.0 * c * q * bell / (1.0 - rim)
    t = q / (2.0 * effective)  # 1 at the rim of the spline
    if t >= 1.0:
        return 0.0, 0.0
    scale = 1.0 / (2.0 * effective)
    if kind == QUARTIC_SPLINE:
        slope = -12.0 * t * (1.0 - t) * (1.0 - t) * scale
        return 1.0 - t * t * (6.0 - 8.0 * t + 3.0 * t * t), slope
    if t <= 0.5:
        return 2.0 / 3.0 - 4.0 * t * t * (1.0 - t), (-8.0 * t + 12.0 * t * t) * scale
    return 4.0 / 3.0 * (1.0 - t) ** 3, -4.0 * (1.0 - t) * (1.0 - t) * scale


@compiled
def polynomials_at(degree, mixed_terms, xi, P, dP):
    """Monomials at xi, to P, shape (m,), and their derivatives to dP, shape (m, dim).

    All up to the degree, and with `mixed_terms` the products of two coordinates.
    """
    dim = xi.shape[0]
    P[0] = 1.0
    dP[:] = 0.0
    for d in range(dim):
        P[1 + d] = xi[d]
        dP[1 + d, d] = 1.0
    if degree == 2 or mixed_terms:
        row = 1 + dim
        for a in range(dim):
            for b in range(a if degree == 2 else a + 1, dim):
                P[row] = xi[a] * xi[b]
                dP[row, a] += xi[b]
                dP[row, b] += xi[a]
                row += 1


@compiled
def cholesky(M):
    """Factorise M in place (lower half); returns the smallest pivot over its diagonal entry."""
    smallest = np.inf
    for i in range(M.shape[0]):
        scale = M[i, i]
        for j in range(i + 1):
            total = M[i, j]
            for k in range(j):
                total -= M[i, k] * M[j, k]
            if i == j:
                smallest = min(smallest, total / scale if scale > 0.0 else 0.0)
                if not total > 0.0:
                    return 0.0
                M[i, i] = math.sqrt(total)
            else:
                M[i, j] = total / M[j, j]
    return smallest


@compiled
def substitute(M, b):
    """Solve with the factor of `cholesky`, in place."""
    m = M.shape[0]
    for i in range(m):
        for k in range(i):
            b[i] -= M[i, k] * b[k]
        b[i] /= M[i, i]
    for i in range(m - 1, -1, -1):
        for k in range(i + 1, m):
            b[i] -= M[k, i] * b[k]
        b[i] /= M[i, i]


@compiled
def expand(recipe, clouds, p, P, dP, W, dW, M):
    """Polynomials and weights of the nodes around point `p`, their derivatives by x, and M."""
    dim, m = clouds.x.shape[1], recipe.polynomials
    R, x = clouds.radius[p], clouds.x[p]
    xi, gradient = np.zeros(dim), np.zeros((m, dim))
    M[:] = 0.0
    for k in range(clouds.size[p]):
        square = 0.0
        for d in range(dim):
            xi[d] = (clouds.nodes[clouds.near[p, k], d] - x[d]) / R
            square += xi[d] * xi[d]
        distance = math.sqrt(square)
        W[k], slope = weigh(recipe.weight, recipe.effective, distance)
        polynomials_at(recipe.degree, recipe.mixed_terms, xi, P[k], gradient)
        for d in range(dim):  # the relative coordinate falls when x grows
            dW[k, d] = -slope * xi[d] / (distance * R) if distance > 0.0 else 0.0
            for a in range(m):
                dP[k, a, d] = -gradient[a, d] / R
        for a in range(m):
            for b in range(a + 1):
                M[a, b] += P[k, a] * P[k, b] * W[k]


@compiled
def fill_points(recipe, clouds, points, strict, stored, failed):
    """Functions and full gradients (weights included) at some points, in the shape of `Fill`.

    With ``c = M^-1 P(0)``: ``grad N_I = (P_I . grad c + c . grad P_I) W_I + c . P_I grad W_I`` and
    ``grad c = -M^-1 (grad M) c``.
    """
    width, dim, m = clouds.near.shape[1], clouds.x.shape[1], recipe.polynomials
    P, dP = np.zeros((width, m)), np.zeros((width, m, dim))
    W, dW = np.zeros(width), np.zeros((width, dim))
    M, c, dc = np.zeros((m, m)), np.zeros(m), np.zeros(m)
    for q in range(points.shape[0]):
        p = points[q]
        count = clouds.size[p]
        expand(recipe, clouds, p, P, dP, W, dW, M)
        if not cholesky(M) > SMALLEST_PIVOT:
            failed[p] = True
            continue
        c[:] = 0.0
        c[0] = 1.0
        substitute(M, c)
        stored.size[p] = count
        total = 0.0
        for k in range(count):
            value = 0.0
            for a in range(m):
                value += c[a] * P[k, a]
            stored.index[p, k] = clouds.near[p, k]
            stored.phi[p, k] = value * W[k]
            total += abs(stored.phi[p, k])
        if strict and total > LARGEST_SUM:
            failed[p] = True
            continue
        for d in range(dim):
            dc[:] = 0.0
            for k in range(count):
                value, change = 0.0, 0.0
                for a in range(m):
                    value += c[a] * P[k, a]
                    change += c[a] * dP[k, a, d]
                for a in range(m):
                    carried = (dP[k, a, d] * value + P[k, a] * change) * W[k]
                    dc[a] -= carried + P[k, a] * value * dW[k, d]
                stored.grad_phi[p, k, d] = change * W[k] + value * dW[k, d]
            substitute(M, dc)
            for k in range(count):
                value = 0.0
                for a in range(m):
                    value += dc[a] * P[k, a]
                stored.grad_phi[p, k, d] += value * W[k]
