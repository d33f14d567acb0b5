"""Light nodes: with too little mass to be accelerated, they follow their neighbours and hand them all they get.

A light node l takes ``z_l = sum_j w_lj z_j`` (velocity, acceleration) from the nodes j that share a
particle with it and are not light, with ``sum_j w_lj = 1``, and gives them its mass, momentum and
force with the same weights. With T, the identity but for these rows, that is ``T^T M T z = T^T f``:
translation, free fall and momentum stay exact, whatever is left out.
"""

from typing import TYPE_CHECKING, Any

import numpy as np

from mpmbench.core.bases import Basis
from mpmbench.core.bases.handle import count, index, locate, scratch, value
from mpmbench.core.compiled import compiled, lean, vector
from mpmbench.core.nodes import copy, over, stretches
from mpmbench.core.particles import SEEN, Particles

if TYPE_CHECKING:
    from scipy.sparse import csr_array  # a tenth of a second, which lumped masses do without

# What a massless point weighs in a choice of neighbours: nothing, where particles see the node.
MASSLESS = 1e-200


class LightNodes:
    """The light nodes of one step, and what their neighbours are worth to them.

    Parameters
    ----------
    cutoff : float
        A node is light when its mass is at most so many times that of the heaviest particle that
        sees it.
    fixed : ndarray of bool
        Constrained components, shape (N, dim), which keep their values; a node with all of them is
        never light.

    Attributes
    ----------
    light : ndarray of bool
        Shape (N,).
    lightest : float
        Smallest mass of a node that was accelerated so far [kg].
    node, neighbour : ndarray of int
        The pairs (l, j) in ascending order, shape (n,).
    weight : ndarray
        ``w_lj``, shape (n,).
    """

    def __init__(self, cutoff: float, fixed: np.ndarray) -> None:
        self.cutoff, self.fixed = cutoff, fixed
        self.axes = (0.0,) * fixed.shape[1]
        self.light = np.zeros(len(fixed), dtype=np.bool_)
        self.node = self.neighbour = np.zeros(0, dtype=np.int64)
        self.weight = np.zeros(0)
        self.lightest = np.inf
        self._heaviest, self._points = np.zeros(len(fixed)), np.zeros(0, dtype=np.int64)
        self._nothing_fixed = np.zeros((len(fixed), 1), dtype=np.bool_)

    def find(
        self,
        basis: Basis,
        p: Particles,
        m_i: np.ndarray,
        mass: np.ndarray,
        seen: list[np.ndarray] | None = None,
    ) -> bool:
        """Find the light nodes of the particles where they are.

        Parameters
        ----------
        m_i : ndarray
            Row sums of the mass matrix [kg], shape (N,), not zero where a point sees the node.
        mass : ndarray
            Its diagonal [kg], shape (N,), which decides.
        seen : list of ndarray of int or None
            Stretches of the nodes that a point sees, as of `Nodes`, where they are known.

        Returns
        -------
        bool
            Whether there are any.
        """
        self.node, self.neighbour, self.weight = self.node[:0], self.neighbour[:0], self.weight[:0]
        self.light[:] = False
        if seen is None:
            seen = stretches(m_i != 0.0)
        most = max(self.cutoff * p.heaviest, 2.0 * SEEN)
        found = over(may_be_light, seen, self.axes, mass, self.fixed, most, self.light)
        lightest = min((smallest for _, smallest in found), default=np.inf)
        if any(some for some, _ in found):
            lightest = self._find(basis.handle, p, mass, seen)
        self.lightest = min(self.lightest, lightest)
        return len(self.node) > 0

    def _find(self, phi: Any, p: Particles, mass: np.ndarray, seen: list[np.ndarray]) -> float:
        """The same where there may be some; returns the smallest mass of the others that are not held."""
        if len(self._points) != len(p.x):
            self._points = np.zeros(len(p.x), dtype=np.int64)
        self._heaviest[:] = 0.0
        found = points_at(phi, p.x, p.m, self.light, self._heaviest, self._points)
        over(are_light, seen, mass, self.cutoff, self._heaviest, self.light)
        near, room = self._points[:found], np.zeros(phi.width)
        key, share = shared_points(phi, p.x, p.m, near, self.light, room)
        key, place = np.unique(key, return_inverse=True)
        share = np.bincount(place, weights=share, minlength=len(key))
        key, share = key[share > 0.0], share[share > 0.0]  # at edges of supports functions are 0
        self.node, self.neighbour = np.divmod(key, len(mass))
        total = np.bincount(self.node, weights=share, minlength=len(mass))
        self.weight = share / total[self.node]
        left = over(are_alone, seen, self.axes, mass, self.fixed, total, self.light)
        return float(min(left, default=np.inf))

    def matrix(self) -> "csr_array":
        """T, shape (N, N)."""
        from scipy.sparse import csr_array, diags_array

        n = len(self.light)
        follow = csr_array((self.weight, (self.node, self.neighbour)), shape=(n, n))
        return csr_array(diags_array(1.0 - self.light) + follow)

    def gathered(
        self, f: np.ndarray, room: np.ndarray, seen: list[np.ndarray] | None = None
    ) -> np.ndarray:
        """``T^T f`` in `room`, there where nodes are `seen`, or `f` itself where no node is light."""
        if not len(self.node):
            return f
        if seen is None:
            room[:] = f
        else:
            axes = (0.0,) if f.ndim == 1 else self.axes
            over(copy, seen, axes, as_columns(f), as_columns(room))
        return self.gather(room)

    def gather(self, f: np.ndarray) -> np.ndarray:
        """``T^T f`` in place: what light nodes were given, shape (N,) or (N, dim), goes to their neighbours."""
        if len(self.node):
            fixed = self._nothing_fixed if f.ndim == 1 else self.fixed
            hand_over(self.node, self.neighbour, self.weight, fixed, as_columns(f))
        return f

    def scatter(self, z: np.ndarray) -> np.ndarray:
        """``T z`` in place: light nodes, shape (N, dim), follow their neighbours."""
        if len(self.node):
            take_over(self.node, self.neighbour, self.weight, self.fixed, z)
        return z


def as_columns(f: np.ndarray) -> np.ndarray:
    """Numbers of nodes as vectors, shape (N, 1), and vectors as they are."""
    return f[:, None] if f.ndim == 1 else f


@lean
def may_be_light(seen, axes, mass, fixed, most, light):
    """Mark nodes whose `mass`, shape (N,), is at most `most`, and which are not held; returns whether there are any.

    The smallest mass of the others that are not held is returned, too.
    """
    some, lightest = False, np.inf
    for n in range(seen.shape[0]):
        for i in range(seen[n, 0], seen[n, 1]):
            if is_free(axes, fixed, i):
                if mass[i] > most:
                    lightest = min(lightest, mass[i])
                else:
                    light[i] = some = True
    return some, lightest


@lean
def is_free(axes, fixed, i):
    """Whether a node has a component that is not constrained."""
    free = False
    for d in range(len(axes)):
        free = free or not fixed[i, d]
    return free


@lean
def are_light(seen, mass, cutoff, heaviest, light):
    """Unmark nodes that are too heavy for the heaviest particle that sees them."""
    for n in range(seen.shape[0]):
        for i in range(seen[n, 0], seen[n, 1]):
            if light[i] and mass[i] > max(cutoff * heaviest[i], 2.0 * SEEN):
                light[i] = False


@lean
def are_alone(seen, axes, mass, fixed, total, light):
    """Unmark nodes without a share of a neighbour; returns the smallest mass that is left without light nodes."""
    lightest = np.inf
    for n in range(seen.shape[0]):
        for i in range(seen[n, 0], seen[n, 1]):
            light[i] = light[i] and total[i] > 0.0
            if mass[i] > 0.0 and not light[i] and is_free(axes, fixed, i):
                lightest = min(lightest, mass[i])
    return lightest


@lean
def heaviest_seen(phi, x, m, heaviest):
    """Write the mass of the heaviest particle that sees each node [kg], shape (N,)."""
    work = scratch(phi)
    heaviest[:] = 0.0
    for p in range(x.shape[0]):
        at = locate(phi, x, p, work)
        for k in range(count(phi, at)):
            i = index(phi, at, k)
            heaviest[i] = max(heaviest[i], m[p])


@lean
def points_at(phi, x, m, light, heaviest, points):
    """List the points that see a marked node; returns how many, and writes the heaviest of each such node [kg]."""
    work, found, last, near = scratch(phi), 0, -1, False
    for p in range(x.shape[0]):
        at = locate(phi, x, p, work)
        if at != last:  # points in a cell see the same
            last, near = at, False
            for k in range(count(phi, at)):
                near = near or light[index(phi, at, k)]
        if near:
            points[found] = p
            found += 1
            for k in range(count(phi, at)):
                i = index(phi, at, k)
                heaviest[i] = max(heaviest[i], m[p])
    return found


@compiled
def shared_points(phi, x, m, points, light, share):
    """Pairs of a light node l and another node j at some of these points: ``l N + j`` and ``m_p |phi_j|``.

    Points in the same cell that follow each other are taken together, by `share` of each function.
    """
    work, grad_phi = scratch(phi), vector(phi.axes)
    keys, shares, last = [], [], -1
    for n in range(points.shape[0]):
        at = locate(phi, x, points[n], work)
        for k in range(count(phi, at)):
            weight = (m[points[n]] + MASSLESS) * abs(value(phi, at, k, work, grad_phi))
            share[k] = share[k] + weight if at == last else weight
        last = at
        if n + 1 < points.shape[0] and locate(phi, x, points[n + 1], work) == at:
            continue
        for k in range(count(phi, at)):
            l = index(phi, at, k)
            if light[l]:
                for other in range(count(phi, at)):
                    j = index(phi, at, other)
                    if not light[j]:
                        keys.append(l * light.shape[0] + j)
                        shares.append(share[other])
    return np.array(keys), np.array(shares)


@lean
def hand_over(node, neighbour, weight, fixed, f):
    """``f_j += w_lj f_l``, and then ``f_l = 0``, on free components."""
    for n in range(node.shape[0]):
        for d in range(f.shape[1]):
            if not fixed[node[n], d]:
                f[neighbour[n], d] += weight[n] * f[node[n], d]
    for n in range(node.shape[0]):
        for d in range(f.shape[1]):
            if not fixed[node[n], d]:
                f[node[n], d] = 0.0


@lean
def take_over(node, neighbour, weight, fixed, z):
    """``z_l = sum_j w_lj z_j`` on free components."""
    for n in range(node.shape[0]):
        for d in range(z.shape[1]):
            if not fixed[node[n], d]:
                z[node[n], d] = 0.0
    for n in range(node.shape[0]):
        for d in range(z.shape[1]):
            if not fixed[node[n], d]:
                z[node[n], d] += weight[n] * z[neighbour[n], d]
