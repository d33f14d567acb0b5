"""A penalty on points of a surface that are behind a facet of another body's, with Coulomb friction.

A point x behind the nearest place y on the surface of another body has the energy

    U = k A |x - y|^2 / 4,   k = stiffness (lambda + 2 mu) / h,

with the share A of the point in its surface at the start, the spacing h of the nodes and the stiffer
of both materials. It is behind when (x - y) . n < 0 with the mean outward normal n of the facets at
y. All points of each body meet all facets of
each other one, so that every pair of surfaces is seen from both sides, at half the stiffness, and the
order of the bodies does not matter. The force is -dU/dx on the point and shares of its opposite on
the corners of the facet, and goes to the nodes by their functions there: momentum and angular
momentum are conserved, and so is the energy with U.

On a grid, points of a surface see nodes that particles have hardly reached. Nodes too light for the
step follow their neighbours and hand them the forces (`mpmbench.core.stability.spare_light_nodes`).
A point that only nodes without mass see was torn off the material: it holds nothing, and its facets
neither, since no node could take the force.

With friction a point sticks to its facet by a spring of the same stiffness, which slides when its
force exceeds mu times the normal one.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from mpmbench.core.bases.clouds.search import cell_of, fill_buckets, make_buckets
from mpmbench.core.bases.handle import count, index, locate, scratch, value
from mpmbench.core.bodies import Part
from mpmbench.core.compiled import compiled, lean, vector
from mpmbench.core.contact import Contact, ContactRule
from mpmbench.core.errors import NotApplicable
from mpmbench.core.geometry.surface import facet_normals
from mpmbench.core.particles import SEEN
from mpmbench.core.registry import register
from mpmbench.core.setting import setting
from mpmbench.core.stability import spare_light_nodes
from mpmbench.core.state import State


@register("contact", "penalty")
@dataclass(frozen=True)
class Penalty(ContactRule):
    """A stiffness between points and facets of surfaces, with friction; its energy is in the balance."""

    friction: float = setting(0.0, "coefficient of Coulomb friction", unit="-", least=0.0)
    stiffness: float = setting(
        1.0,
        "in moduli of uniaxial strain over the nodal spacing",
        unit="-",
        above=0.0,
        most=1000.0,
    )
    depth: float = setting(
        1.0,
        "at which a point is not held any more, in nodal spacings",
        unit="-",
        above=0.0,
        most=5.0,
    )
    at_surfaces: ClassVar[bool] = True

    def check(self, case: Any, parts: Sequence[Part]) -> None:
        """Refuse bodies on a line, which have no facets."""
        if case.problem.dimension == 1:
            raise NotApplicable("contact=penalty needs surfaces with facets, in 2D or 3D")

    def build(self, s: State) -> "SurfaceContact":
        return SurfaceContact(s, self)


class SurfaceContact(Contact):
    """The surfaces of a simulation, and the springs between them.

    Attributes
    ----------
    stuck : ndarray
        Stretch of the spring along the facet at each point [m], shape (S, dim); 0 without friction.
    torn : ndarray of bool
        Whether a point sees no mass any more, shape (S,).
    energy : ndarray
        What is stored in all springs now, and what friction has taken so far [J].
    """

    def __init__(self, s: State, rule: Penalty) -> None:
        assert s.geometry is not None
        surface, self.dimension = s.bodies.surface, s.particles.dimension
        self.surface, self.friction = surface, rule.friction
        h = s.geometry.nodal_spacing
        self.deepest = rule.depth * h
        moduli = [lame + 2.0 * shear for lame, shear in map(lame_of, s.bodies.materials)]
        self.stiffness = rule.stiffness / h * np.maximum.outer(moduli, moduli)
        points = len(surface.row)
        self.x, self.v = np.zeros((points, self.dimension)), np.zeros((points, self.dimension))
        self.force = np.zeros((points, self.dimension))
        self.stuck = np.zeros((points, self.dimension))
        self.normal = np.zeros((points, self.dimension))
        self.torn = np.zeros(points, dtype=np.bool_)
        self.nodal_force = np.zeros_like(s.nodes.v)
        self.energy = np.zeros(2)
        self._facet_body = surface.body[surface.facet[:, 0]]
        self._take(s)
        middle, reach = self._facets()
        self._buckets = make_buckets(middle, reach, True)

    def _take(self, s: State) -> None:
        """Where the points are, and how fast."""
        np.take(s.particles.x, self.surface.row, axis=0, out=self.x)
        np.take(s.particles.v, self.surface.row, axis=0, out=self.v)

    def _facets(self) -> tuple[np.ndarray, np.ndarray]:
        """Middles of the facets, and the distances within which they hold a point [m]."""
        corners = self.x[self.surface.facet]
        middle = corners.mean(axis=1)
        radius = np.sqrt(np.sum((corners - middle[:, None]) ** 2, axis=2).max(axis=1))
        return middle, radius + self.deepest

    def push(self, s: State) -> None:
        spare_light_nodes(s)
        self._take(s)
        self.nodal_force[:] = 0.0
        mark_torn(s.basis.handle, s.particles.x, self.surface.row, s.nodes.m, self.torn)
        if self.find(s, s.time_step):
            row = self.surface.row
            spread_points(s.basis.handle, s.particles.x, row, self.force, self.nodal_force)
            s.nodes.f += self.nodal_force

    def power(self, v: np.ndarray) -> float:
        return float(np.vdot(self.nodal_force, v))

    def stored(self, s: State) -> float:
        self._take(s)
        kept = self.stuck.copy(), self.energy.copy()
        self.find(s, 0.0)
        found = float(self.energy.sum())
        self.stuck[:], self.energy[:] = kept
        return found

    def find(self, s: State, dt: float) -> bool:
        """Forces on the points where they are, after a step of the size dt [s]; whether there may be any."""
        self.force[:], self.energy[0] = 0.0, 0.0
        if not boxes_touch(self.x, self.surface.body, s.bodies.count):
            self.stuck[:] = 0.0
            return False
        middle, reach = self._facets()
        self._buckets = fill_buckets(self._buckets, middle, reach)
        surface = self.surface
        normal, _ = facet_normals(self.x[surface.facet])
        self.normal[:] = 0.0
        for corner in surface.facet.T:
            np.add.at(self.normal, corner, normal)
        springs(
            (0.0,) * self.dimension,
            self._buckets,
            (surface.body, surface.facet, surface.area, self._facet_body, self.normal),
            (self.x, self.v, self.stuck, self.force, self.torn),
            self.stiffness,
            self.friction,
            self.deepest,
            dt,
            self.energy,
        )
        return True


def lame_of(material: Any) -> tuple[float, float]:
    """Lame parameters of a material [Pa]."""
    first, second = material.lame_parameters()
    return float(first), float(second)


@compiled
def boxes_touch(x, body, bodies):
    """Whether the boxes around the points of any two bodies meet."""
    dim = x.shape[1]
    lower, upper = np.full((bodies, dim), np.inf), np.full((bodies, dim), -np.inf)
    for p in range(x.shape[0]):
        b = body[p]
        for d in range(dim):
            lower[b, d], upper[b, d] = min(lower[b, d], x[p, d]), max(upper[b, d], x[p, d])
    for a in range(bodies):
        for b in range(a):
            meet = True
            for d in range(dim):
                meet = meet and lower[a, d] <= upper[b, d] and lower[b, d] <= upper[a, d]
            if meet:
                return True
    return False


@lean
def nearest_on_segment(axes, x, a, b, p, first, second, share):
    """Shares of the ends a and b in the point of a segment that is nearest to p, at `first` and `second`.

    The others are set to 0.
    """
    along, length = 0.0, 0.0
    for d in range(len(axes)):
        edge = x[b, d] - x[a, d]
        along += (x[p, d] - x[a, d]) * edge
        length += edge * edge
        share[d] = 0.0
    share[second] = min(max(along / length, 0.0), 1.0)
    share[first] = 1.0 - share[second]


@lean
def nearest_on_triangle(axes, x, corner, p, share, other):
    """Shares of the corners in the point of a triangle that is nearest to p."""
    a, b, c = corner[0], corner[1], corner[2]
    uu, uw, ww, ru, rw = 0.0, 0.0, 0.0, 0.0, 0.0
    for d in range(3):
        u, w, r = x[b, d] - x[a, d], x[c, d] - x[a, d], x[p, d] - x[a, d]
        uu, uw, ww = uu + u * u, uw + u * w, ww + w * w
        ru, rw = ru + r * u, rw + r * w
    area = uu * ww - uw * uw
    share[1], share[2] = (ru * ww - rw * uw) / area, (rw * uu - ru * uw) / area
    share[0] = 1.0 - share[1] - share[2]
    if share[0] >= 0.0 and share[1] >= 0.0 and share[2] >= 0.0:
        return
    nearest = np.inf
    for k in range(3):
        m = (k + 1) % 3
        nearest_on_segment(axes, x, corner[k], corner[m], p, k, m, other)
        square = square_from(axes, x, corner, p, other)
        if square < nearest:
            nearest = square
            for d in range(3):
                share[d] = other[d]


@lean
def square_from(axes, x, corner, p, share):
    """Square of the distance of a point from the point of a facet with these shares [m^2]."""
    square = 0.0
    for d in range(len(axes)):
        away = x[p, d]
        for e in range(len(axes)):
            away -= share[e] * x[corner[e], d]
        square += away * away
    return square


@lean
def any_of(axes, marked, corner):
    """Whether a corner of a facet is marked."""
    found = False
    for e in range(len(axes)):
        found = found or marked[corner[e]]
    return found


@lean
def springs(axes, buckets, surface, points, stiffness, friction, deepest, dt, energy):
    """Add the forces between points and facets [N], shape (S, dim), and their energies [J].

    A point meets the nearest place on the surfaces of other bodies, if it is behind it.
    """
    body, facet, area, facet_body, normal = surface
    x, v, stuck, force, torn = points
    dim = len(axes)
    share, best, other = vector(axes), vector(axes), vector(axes)
    away, slip = vector(axes), vector(axes)
    for p in range(x.shape[0]):
        cell, found, square = cell_of(buckets, dim, x, p), -1, deepest * deepest
        for c in range(buckets.first[cell], buckets.first[cell + 1]):
            f = buckets.entry[c]
            if torn[p] or facet_body[f] == body[p] or any_of(axes, torn, facet[f]):
                continue
            if dim == 2:
                nearest_on_segment(axes, x, facet[f, 0], facet[f, 1], p, 0, 1, share)
            else:
                nearest_on_triangle(axes, x, facet[f], p, share, other)
            distance = square_from(axes, x, facet[f], p, share)
            if distance < square:
                found, square = f, distance
                for d in range(dim):
                    best[d] = share[d]
        height = 0.0
        if found >= 0:
            for d in range(dim):
                away[d] = x[p, d]
                for e in range(dim):
                    away[d] -= best[e] * x[facet[found, e], d]
                for e in range(dim):
                    height += away[d] * best[e] * normal[facet[found, e], d]
        if not height < 0.0:
            for d in range(dim):
                stuck[p, d] = 0.0
            continue
        k = 0.5 * stiffness[body[p], facet_body[found]] * area[p]
        energy[0] += 0.5 * k * square
        if friction > 0.0:
            corner = facet[found]
            slide(
                axes,
                k,
                friction,
                np.sqrt(square),
                dt,
                p,
                corner,
                v,
                stuck,
                best,
                away,
                slip,
                energy,
            )
        for d in range(dim):
            push = -k * away[d] - (k * stuck[p, d] if friction > 0.0 else 0.0)
            force[p, d] += push
            for e in range(dim):
                force[facet[found, e], d] -= best[e] * push


@lean
def slide(axes, k, friction, depth, dt, p, corner, v, stuck, share, away, slip, energy):
    """Stretch the spring along a surface by the motion of the last step, let it slide, and add its energies [J]."""
    dim, along, size = len(axes), 0.0, 0.0
    for d in range(dim):
        slip[d] = stuck[p, d] + dt * v[p, d]
        for e in range(dim):
            slip[d] -= dt * share[e] * v[corner[e], d]
        along += slip[d] * away[d] / depth
    for d in range(dim):
        slip[d] -= along * away[d] / depth
        size += slip[d] * slip[d]
    size = np.sqrt(size)
    factor = min(1.0, friction * depth / size) if size > 0.0 else 1.0
    for d in range(dim):
        stuck[p, d] = factor * slip[d]
    energy[0] += 0.5 * k * (factor * size) ** 2
    energy[1] += k * factor * size * (1.0 - factor) * size


@lean
def spread_points(phi, x, row, force, nodal):
    """Add forces at some of the points x, shape (S, dim), to the nodes: ``f_i += phi_i(x_p) F_p``."""
    work, grad_phi = scratch(phi), vector(phi.axes)
    for n in range(row.shape[0]):
        at = locate(phi, x, row[n], work)
        for k in range(count(phi, at)):
            phi_i = value(phi, at, k, work, grad_phi)
            i = index(phi, at, k)
            for d in range(len(phi.axes)):
                nodal[i, d] += phi_i * force[n, d]


@lean
def mark_torn(phi, x, row, m, torn):
    """Mark the points x[row] that see no mass: ``sum_i |phi_i(x_p)| m_i`` is that of seen nodes alone."""
    work, grad_phi = scratch(phi), vector(phi.axes)
    for n in range(row.shape[0]):
        at, total = locate(phi, x, row[n], work), 0.0
        for k in range(count(phi, at)):
            total += abs(value(phi, at, k, work, grad_phi)) * m[index(phi, at, k)]
        torn[n] = not total > 2.0 * SEEN
