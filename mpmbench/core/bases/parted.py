"""Functions of several bodies, each on nodes of its own: any basis, built once for each body."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from mpmbench.core.bases import Basis, BasisSettings
from mpmbench.core.bases.grid.fields import FieldsBasis
from mpmbench.core.bases.grid.product import GridBasis
from mpmbench.core.bases.handle import Stencils
from mpmbench.core.compiled import lean
from mpmbench.core.geometry import Geometry, search_tree
from mpmbench.core.particles import Particles

FOLLOWED = ("x", "F", "V")  # what a basis may read of its particles, besides X, and that changes


@lean
def put_rows(rows, first, part, whole):
    """Copy stencils of a body to the rows of all, with node numbers from `first` on."""
    for n in range(rows.shape[0]):
        p = rows[n]
        whole.size[p] = part.size[n]
        for k in range(part.size[n]):
            whole.index[p, k] = part.index[n, k] + first
            whole.phi[p, k] = part.phi[n, k]
            for d in range(len(whole.axes)):
                whole.grad_phi[p, k, d] = part.grad_phi[n, k, d]


def own_functions(
    settings: BasisSettings,
    places: Sequence[Geometry],
    body: np.ndarray,
    bodies: int,
    moving: bool,
) -> Basis:
    """The basis with nodes for each of several bodies: on its own place, or copies on the one place that there is.

    `body` is that of each particle and tracer, shape (P,).
    """
    if len(places) == 1:
        shared = settings.build(places[0], len(body), moving)
        if isinstance(shared, GridBasis):
            return FieldsBasis(shared, body, bodies)
        places = [places[0]] * bodies
    points = np.bincount(body, minlength=bodies).tolist()
    built = [settings.build(place, n, moving) for place, n in zip(places, points, strict=True)]
    return PartedBasis(built, body)


class PartedBasis(Basis):
    """Bases of the bodies, of which a particle sees that of its body.

    Parameters
    ----------
    bases : list of Basis
        One for each body, for as many particles as it has.
    body : ndarray of int
        Body of each particle and tracer, shape (P,).
    """

    def __init__(self, bases: list[Basis], body: np.ndarray) -> None:
        self.bases, self.body = bases, body
        self.rows = [np.flatnonzero(body == b) for b in range(len(bases))]
        sizes = [len(basis.nodes) for basis in bases]
        self.first = np.cumsum([0, *sizes])
        self.nodes = np.vstack([basis.nodes for basis in bases])
        self.constant_values = all(basis.constant_values for basis in bases)
        self.handle = Stencils.empty(len(body), 1, self.nodes.shape[1])
        self._places = [np.zeros((len(rows), self.nodes.shape[1])) for rows in self.rows]
        self._particles: Particles | None = None
        self._parts: list[Particles] = []

    def follow(self, particles: Particles) -> None:
        self._particles = particles
        solid = particles.material.stop
        for rows in self.rows:
            tracers = int(np.count_nonzero(rows >= solid))
            part = Particles.at_rest(particles.X[rows], np.zeros(len(rows)), 0.0)
            part.V0[:], part.m[:], part.tracers = particles.V0[rows], particles.m[rows], tracers
            self._parts.append(part)
        self._refresh()
        for basis, part in zip(self.bases, self._parts, strict=True):
            basis.follow(part)

    def _refresh(self) -> None:
        """Copy what bases may read of their particles."""
        if self._particles is not None:
            for part, rows in zip(self._parts, self.rows, strict=True):
                for name in FOLLOWED:
                    np.take(getattr(self._particles, name), rows, axis=0, out=getattr(part, name))

    def locate(self, x: np.ndarray) -> None:
        self._refresh()
        width = 0
        for basis, rows, places in zip(self.bases, self.rows, self._places, strict=True):
            basis.locate(np.take(x, rows, axis=0, out=places))
            width = max(width, basis.handle.width)
        if width > self.handle.width:
            self.handle = Stencils.empty(len(x), width, x.shape[1])
        for b, (basis, rows) in enumerate(zip(self.bases, self.rows, strict=True)):
            put_rows(rows, int(self.first[b]), basis.handle, self.handle)

    def evaluate(self, x: np.ndarray) -> Stencils:
        """As any basis; points other than the first particles belong to the body of the nearest one."""
        owner = self._owner(x)
        found = []
        for b, basis in enumerate(self.bases):
            rows = np.flatnonzero(owner == b)
            if len(rows):
                found.append((rows, int(self.first[b]), basis.evaluate(x[rows])))
        width = max(part.width for _, _, part in found)
        stored = Stencils.empty(len(x), width, x.shape[1])
        for rows, first, part in found:
            put_rows(rows, first, part, stored)
        return stored

    def _owner(self, x: np.ndarray) -> np.ndarray:
        """Body of each point."""
        p = self._particles
        if p is None or len(x) == len(p.x):
            return self.body
        if len(x) == p.material.stop:
            return self.body[: len(x)]
        return np.asarray(self.body[search_tree(p.x).query(x)[1]])

    def first_outside(self, x: np.ndarray) -> int:
        owner, outside = self._owner(x), []
        for b, basis in enumerate(self.bases):
            rows = self.rows[b] if owner is self.body else np.flatnonzero(owner == b)
            found = basis.first_outside(x[rows]) if len(rows) else -1
            if found >= 0:
                outside.append(int(rows[found]))
        return min(outside, default=-1)

    def carry(self, v: np.ndarray, dt: float) -> None:
        for b, basis in enumerate(self.bases):
            basis.carry(v[self.first[b] : self.first[b + 1]], dt)

    def move(self, displacement: np.ndarray) -> None:
        for b, basis in enumerate(self.bases):
            own = slice(self.first[b], self.first[b + 1])
            basis.move(displacement[own])
            self.nodes[own] = basis.nodes

    def statistics(self) -> dict[str, tuple[float, str, str]]:
        """Means of the bodies' numbers, the largest of those that are called so."""
        each = [basis.statistics() for basis in self.bases]
        out: dict[str, tuple[float, str, str]] = {}
        for name, (_, unit, text) in each[0].items():
            values: list[Any] = [one[name][0] for one in each if name in one]
            combined = max(values) if name.endswith("_max") else float(np.mean(values))
            out[name] = (combined, unit, text)
        return out
