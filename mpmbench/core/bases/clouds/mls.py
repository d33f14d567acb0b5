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
from mpmbench.core.bases.radial import (
    GAUSSIAN,
    QUARTIC_SPLINE,
    WEIGHTS,
    cubic_spline,
    quartic_spline,
)
from mpmbench.core.choices import Choices
from mpmbench.core.compiled import compiled, inlined, lean, matrix, summing, vector
from mpmbench.core.compiled.exponentials import exponential, whole_lanes
from mpmbench.core.errors import BadSetting, NotApplicable
from mpmbench.core.geometry import Geometry
from mpmbench.core.registry import register
from mpmbench.core.setting import setting

DIRECT_RADIUS = math.sqrt(2.0) * (1.0 + 1e-6)  # in nodal spacings, on regular nodes
SMALLEST_PIVOT = 1e-10  # of M, scaled to a unit diagonal: below it the cloud takes in another node
# Of |N_I|: more has a point outside the nodes that carry weight; its cloud takes in another node.
LARGEST_SUM = 2.0


class Recipe(NamedTuple):
    """Which polynomials there are, kind of weight, and R_eff / R."""

    axes: tuple[float, ...]  # one entry per dimension, and per polynomial (values unused)
    terms: tuple[float, ...]
    degree: int
    weight: int
    effective: float


class Work(NamedTuple):
    """Working memory for one point; rows are padded to a multiple of LANES."""

    P: np.ndarray  # polynomials at the nodes, shape (m, K)
    W: np.ndarray  # weights; zero behind the last node
    slope: np.ndarray  # of the weights by ``x / R``: ``grad W_I = slope_I P_I[1:]``
    value: np.ndarray  # c . P_I


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
        refuse_direct_constraints("mls", self.relative_radius, choices, touches_fixed_nodes)

    def build(self, geometry: Geometry, particles: int, moving: bool) -> CloudBasis:
        h = self.spacing or geometry.nodal_spacing
        radius = self.radius or self.relative_radius * h
        if radius <= h:
            raise BadSetting("radius", self.radius, f"more than the nodal spacing of {h:.6g} m")
        polynomials = math.comb(geometry.dimension + self.degree, self.degree)
        if self.mixed_terms and self.degree == 1:
            polynomials += math.comb(geometry.dimension, 2)
        weight = WEIGHTS[self.weight]
        axes, terms = (0.0,) * geometry.dimension, (0.0,) * polynomials
        recipe = Recipe(axes, terms, self.degree, weight, self.effective_radius)
        least = max(self.minimum_nodes, polynomials)
        fill = partial(fill_points, recipe)
        return CloudBasis(geometry.points, particles, radius, least, fill, moving)


def refuse_direct_constraints(
    name: str, relative_radius: float, choices: Choices, touches_fixed_nodes: bool
) -> None:
    """Raise `NotApplicable` where single nodes would be held though functions of others do not vanish there."""
    if (
        not touches_fixed_nodes
        and choices.dirichlet == "direct"
        and relative_radius > DIRECT_RADIUS
    ):
        raise NotApplicable(
            f"basis.relative_radius={relative_radius:g} with method.dirichlet=direct: {name} "
            "does not interpolate, so nodes can be held directly up to sqrt(2) only: use "
            "method.dirichlet=multipliers"
        )


@inlined
def weigh(kind, effective, square):
    """Weight, and its slope over ``q = r / R``, from q^2; both vanish from q = 1 on."""
    if kind == GAUSSIAN:
        c = 1.0 / (effective * effective)
        rim = math.exp(-c)
        bell = exponential(-c * square)
        value, slope, rest = (bell - rim) / (1.0 - rim), -2.0 * c * bell / (1.0 - rim), 1.0 - square
    else:
        scale = 0.25 / (effective * effective)
        rest = 1.0 - max(square, square * scale)  # a spline may end before R, or behind it
        value, slope = (
            quartic_spline(square * scale)
            if kind == QUARTIC_SPLINE
            else cubic_spline(square * scale)
        )
        slope *= scale
    return (value, slope) if rest > 0.0 else (0.0, 0.0)


@inlined
def expand(recipe, clouds, p, stored, work):
    """Polynomials and weights of the nodes around point `p`; returns their number, padded.

    The polynomials are all up to the degree, with more `terms` than these the products of two
    coordinates too.
    """
    axes, count, P = recipe.axes, stored.size[p], work.P
    padded, scale = whole_lanes(count), 1.0 / clouds.radius[p]
    for k in range(padded):
        P[0, k] = 1.0
    for d in range(len(axes)):
        for k in range(count):
            P[1 + d, k] = (clouds.nodes[stored.index[p, k], d] - clouds.x[p, d]) * scale
        for k in range(count, padded):
            P[1 + d, k] = 0.0
    for k in range(padded):
        square = 0.0
        for d in range(len(axes)):
            square += P[1 + d, k] * P[1 + d, k]
        work.W[k], slope = weigh(recipe.weight, recipe.effective, square)
        work.slope[k] = -slope  # the relative coordinate falls when x grows
    for k in range(count, padded):
        work.W[k] = work.slope[k] = 0.0
    if len(recipe.terms) > 1 + len(axes):
        row = 1 + len(axes)
        for a in range(len(axes)):
            for b in range(a if recipe.degree == 2 else a + 1, len(axes)):
                for k in range(padded):
                    P[row, k] = P[1 + a, k] * P[1 + b, k]
                row += 1
    return padded


@summing
def moments(terms, padded, work, M):
    """Write ``sum_I P_I (x) P_I W_I`` to the lower half of M."""
    sums = matrix(terms, terms)
    for a in range(len(terms)):
        for b in range(a + 1):
            sums[a, b] = 0.0
    for k in range(padded):
        for a in range(len(terms)):
            weighted = work.P[a, k] * work.W[k]
            for b in range(a + 1):
                sums[a, b] += weighted * work.P[b, k]
    for a in range(len(terms)):
        for b in range(a + 1):
            M[a, b] = sums[a, b]


@inlined
def cholesky(terms, M):
    """Factorise M in place (lower half), one over the diagonal; returns the smallest pivot over its entry."""
    smallest = np.inf
    for i in range(len(terms)):
        scale = M[i, i]
        for j in range(i + 1):
            total = M[i, j]
            for k in range(j):
                total -= M[i, k] * M[j, k]
            if i == j:
                smallest = min(smallest, total / scale if scale > 0.0 and total > 0.0 else 0.0)
                M[i, i] = 1.0 / math.sqrt(total)
            else:
                M[i, j] = total * M[j, j]
    return smallest


@inlined
def substitute(terms, M, b):
    """Solve with the factor of `cholesky`, in place."""
    for i in range(len(terms)):
        for k in range(i):
            b[i] -= M[i, k] * b[k]
        b[i] *= M[i, i]
    for i in range(len(terms) - 1, -1, -1):
        for k in range(i + 1, len(terms)):
            b[i] -= M[k, i] * b[k]
        b[i] *= M[i, i]


@summing
def change(terms, d, padded, work, out):
    """Take ``(dM / dx_d) c = sum_I P_I (c . P_I) dW_I / dx_d`` from `out`, where `work.value` is c . P_I."""
    sums = vector(terms)
    for a in range(len(terms)):
        sums[a] = 0.0
    for k in range(padded):
        weighted = work.value[k] * work.slope[k] * work.P[1 + d, k]
        for a in range(len(terms)):
            sums[a] += weighted * work.P[a, k]
    for a in range(len(terms)):
        out[a] -= sums[a]


@summing
def combine(terms, c, padded, work):
    """``c . P_I`` to `work.value`; returns the sum of their weighted absolute values."""
    total = 0.0
    for k in range(padded):
        value = 0.0
        for a in range(len(terms)):
            value += c[a] * work.P[a, k]
        work.value[k] = value
        total += abs(value * work.W[k])
    return total


@lean
def evaluate(recipe, clouds, points, strict, work, stored, failed):
    """Functions and full gradients (weights included) at some points.

    The polynomials stand still while x moves off its place, so that ``N_I = P(x) . M^-1 P_I W_I``
    has the gradient ``P_I . g_d W_I + c . P_I dW_I / dx_d`` with ``c = M^-1 P(x)`` and ``g_d = M^-1
    (dP / dx_d - (dM / dx_d) c)``.
    """
    axes, terms = recipe.axes, recipe.terms
    M, c = matrix(terms, terms), vector(terms)
    for q in range(points.shape[0]):
        p = points[q]
        padded = expand(recipe, clouds, p, stored, work)
        moments(terms, padded, work, M)
        failed[p] = not cholesky(terms, M) > SMALLEST_PIVOT
        if failed[p]:
            continue
        for a in range(len(terms)):
            c[a] = 1.0 if a == 0 else 0.0
        substitute(terms, M, c)
        failed[p] = combine(terms, c, padded, work) > LARGEST_SUM and strict
        if failed[p]:
            continue
        scale = 1.0 / clouds.radius[p]
        for k in range(stored.size[p]):
            stored.phi[p, k] = work.value[k] * work.W[k]
        for d in range(len(axes)):
            for a in range(len(terms)):
                c[a] = 1.0 if a == 1 + d else 0.0
            change(terms, d, padded, work, c)
            substitute(terms, M, c)
            for k in range(stored.size[p]):
                value = 0.0
                for a in range(len(terms)):
                    value += c[a] * work.P[a, k]
                slope = work.slope[k] * work.P[1 + d, k]
                stored.grad_phi[p, k, d] = scale * (value * work.W[k] + work.value[k] * slope)


@compiled
def fill_points(recipe, clouds, points, strict, stored, failed):
    """The same, in the shape of `Fill`."""
    width = whole_lanes(stored.index.shape[1])
    rows = max(len(recipe.terms), 1 + len(recipe.axes))  # slopes need the coordinates in any case
    room = np.zeros((rows, width)), np.zeros(width), np.zeros(width), np.zeros(width)
    evaluate(recipe, clouds, points, strict, Work(*room), stored, failed)
