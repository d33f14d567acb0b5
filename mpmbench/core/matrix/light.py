"""Light nodes: with too little mass to be accelerated, they follow their neighbours and hand them all they get.

A light node l takes ``z_l = sum_j w_lj z_j`` (velocity, acceleration) from the nodes j that share a
particle with it and are not light, with ``sum_j w_lj = 1``, and gives them its mass, momentum and
force with the same weights. With T, the identity but for these rows, that is ``T^T M T z = T^T f``:
translation, free fall and momentum stay exact, whatever is left out.
"""

from typing import TYPE_CHECKING

import numpy as np

from mpmbench.core.bases import Basis
from mpmbench.core.bases.handle import count, index, locate, scratch, value
from mpmbench.core.compiled import compiled, lean, vector
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
        self.light = np.zeros(len(fixed), dtype=np.bool_)
        self.node = self.neighbour = np.zeros(0, dtype=np.int64)
        self.weight = np.zeros(0)
        self.lightest = np.inf
        self._heaviest = np.zeros(len(fixed))
        self._nothing_fixed = np.zeros((len(fixed), 1), dtype=np.bool_)

    def find(self, basis: Basis, p: Particles, m_i: np.ndarray, mass: np.ndarray) -> bool:
        """Find the light nodes of the particles where they are.

        Parameters
        ----------
        m_i : ndarray
            Row sums of the mass matrix [kg], shape (N,), not zero where a point sees the node.
        mass : ndarray
            Its diagonal [kg], shape (N,), which decides.

        Returns
        -------
        bool
            Whether there are any.
        """
        self.node, self.neighbour, self.weight = self.node[:0], self.neighbour[:0], self.weight[:0]
        self.light[:] = False
        least = least_mass(m_i, mass, self.fixed)
        if least > max(self.cutoff * p.m.max(initial=0.0), 2.0 * SEEN):
            self.lightest = min(self.lightest, least)
            return False
        phi = basis.handle
        heaviest_seen(phi, p.x, p.m, self._heaviest)
        self.light[:] = (m_i != 0.0) & ~(
            mass > np.maximum(self.cutoff * self._heaviest, 2.0 * SEEN)
        )
        self.light &= ~self.fixed.all(axis=1)
        key, share = shared_points(phi, p.x, p.m, self.light)
        key, place = np.unique(key, return_inverse=True)
        share = np.bincount(place, weights=share, minlength=len(key))
        self.node, self.neighbour = np.divmod(key, len(mass))
        total = np.bincount(self.node, weights=share, minlength=len(mass))
        self.light &= total > 0.0  # without a neighbour a node stays on its own
        kept = (mass > 0.0) & ~(self.light | self.fixed.all(axis=1))
        self.lightest = min(self.lightest, mass[kept].min(initial=np.inf))
        self.weight = share / total[self.node]
        return len(key) > 0

    def matrix(self) -> "csr_array":
        """T, shape (N, N)."""
        from scipy.sparse import csr_array, diags_array

        n = len(self.light)
        follow = csr_array((self.weight, (self.node, self.neighbour)), shape=(n, n))
        return csr_array(diags_array(1.0 - self.light) + follow)

    def gathered(self, f: np.ndarray, room: np.ndarray) -> np.ndarray:
        """``T^T f`` in `room`, or `f` itself where no node is light."""
        if not len(self.node):
            return f
        room[:] = f
        return self.gather(room)

    def gather(self, f: np.ndarray) -> np.ndarray:
        """``T^T f`` in place: what light nodes were given, shape (N,) or (N, dim), goes to their neighbours."""
        if len(self.node):
            scalar = f.ndim == 1
            fixed = self._nothing_fixed if scalar else self.fixed
            hand_over(self.node, self.neighbour, self.weight, fixed, f[:, None] if scalar else f)
        return f

    def scatter(self, z: np.ndarray) -> np.ndarray:
        """``T z`` in place: light nodes, shape (N, dim), follow their neighbours."""
        if len(self.node):
            take_over(self.node, self.neighbour, self.weight, self.fixed, z)
        return z


@lean
def least_mass(m_i, mass, fixed):
    """Smallest of `mass`, shape (N,), over the nodes that are seen and not held."""
    least = np.inf
    for i in range(mass.shape[0]):
        if m_i[i] != 0.0 and not mass[i] >= least:
            for d in range(fixed.shape[1]):
                if not fixed[i, d]:
                    least = mass[i]
    return least


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


@compiled
def shared_points(phi, x, m, light):
    """All pairs of a light node l and another node j at some point: ``l N + j`` and ``m_p |phi_j|``."""
    work, grad_phi = scratch(phi), vector(phi.axes)
    keys, shares = [], []
    for p in range(x.shape[0]):
        at = locate(phi, x, p, work)
        for k in range(count(phi, at)):
            l = index(phi, at, k)
            if light[l]:
                for n in range(count(phi, at)):
                    j = index(phi, at, n)
                    if not light[j]:
                        phi_j = value(phi, at, n, work, grad_phi)
                        keys.append(l * light.shape[0] + j)
                        shares.append((m[p] + MASSLESS) * abs(phi_j))
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
