"""The consistent mass matrix as a band, by Cholesky's method: for 1D and narrow grids."""

import numpy as np

from mpmbench.core.bases import Basis
from mpmbench.core.bases.handle import count, index, locate, scratch, value
from mpmbench.core.compiled import compiled, lean, vector
from mpmbench.core.errors import BrokeDown
from mpmbench.core.matrix.light import LightNodes
from mpmbench.core.particles import Particles

SINGULAR = 1e-13  # a pivot below this fraction of its diagonal entry is round-off


class BandMass:
    """``M_ij = sum_p m_p phi_i phi_j`` (Wobbes 2020, Eqs. 19, 48, 90) as a band."""

    def __init__(self, fixed: np.ndarray, light_nodes: LightNodes) -> None:
        self.fixed, self.light_nodes = fixed, light_nodes
        self._factored = False
        self._group: list[int] = []  # the first component that is constrained like each one
        self._band = self._system = np.zeros((len(fixed), 1))
        self._force = np.zeros(fixed.shape)
        self._factor = np.zeros((0, len(fixed), 1))

    def assemble(
        self, basis: Basis, p: Particles, m_i: np.ndarray, seen: list[np.ndarray] | None = None
    ) -> None:
        if self._factored and basis.constant_values:
            return
        self._factored = True
        while (width := assemble_band(basis.handle, p.x, p.m, self._band)) >= self._band.shape[1]:
            self._band = np.zeros((len(self.fixed), width + 1))
        self._system = self._band
        if self.light_nodes.find(basis, p, m_i, self._band[:, 0], seen):
            self._system = self._condensed()
        if self._factor.shape[2] != self._system.shape[1]:
            self._factor = np.zeros((self.fixed.shape[1], *self._system.shape))
        # components that are constrained alike share one factor
        masks: list[bytes] = [self.fixed[:, d].tobytes() for d in range(self.fixed.shape[1])]
        self._group = [masks.index(mask) for mask in masks]
        for d in sorted(set(self._group)):
            pivot = factorise(self._system, self.fixed[:, d], self._factor[d])
            if pivot >= 0:
                raise BrokeDown(
                    f"singular consistent mass matrix at node {pivot} ({basis.nodes[pivot]} m): "
                    "too few particles for the number of nodes, or a nearly empty cell"
                )

    def _condensed(self) -> np.ndarray:
        """The band without light nodes, as wide as it must be."""
        # neighbours of two light nodes that are coupled are three widths apart at most
        band = np.pad(self._band, ((0, 0), (0, 2 * (self._band.shape[1] - 1))))
        pairs = self.light_nodes
        condense(band, pairs.node, pairs.neighbour, pairs.weight)
        return np.ascontiguousarray(band[:, : 1 + int(np.flatnonzero(band.any(axis=0)).max())])

    def multiply(self, a: np.ndarray) -> np.ndarray:
        return band_product(self._band, a)

    def solve(self, rhs: np.ndarray, out: np.ndarray) -> None:
        force = self.light_nodes.gathered(rhs, self._force)
        for d, group in enumerate(self._group):
            known, f, z = self.fixed[:, d], force[:, d], out[:, d]
            substitute(self._system, self._factor[group], known, f, z)
        self.light_nodes.scatter(out)


@lean
def assemble_band(phi, x, m, band):
    """Sum the lower band of the mass matrix: ``band[i, i - j] = sum_p m_p phi_i phi_j`` for j <= i.

    Returns the largest i - j that was met; when that does not fit, the band must be widened and
    summed again.
    """
    work, grad_phi = scratch(phi), vector(phi.axes)
    widest = 0
    band[:] = 0.0
    for p in range(x.shape[0]):
        at = locate(phi, x, p, work)
        for k in range(count(phi, at)):
            i, weight = index(phi, at, k), m[p] * value(phi, at, k, work, grad_phi)
            for n in range(count(phi, at)):
                j, phi_j = index(phi, at, n), value(phi, at, n, work, grad_phi)
                widest = max(widest, i - j)
                if 0 <= i - j < band.shape[1]:
                    band[i, i - j] += weight * phi_j
    return widest


@lean
def condense(band, node, neighbour, weight):
    """``T^T M T``: rows of the light nodes `node` join those of their neighbours, and become zero.

    `band` must be wide enough for pairs of neighbours of light nodes that are coupled.
    """
    n, width = band.shape
    start = 0
    while start < node.shape[0]:
        light, end = node[start], start
        while end < node.shape[0] and node[end] == light:
            end += 1
        for s in range(start, end):
            a = neighbour[s]
            for b in range(max(0, light - width + 1), min(n, light + width)):
                coupling = band[max(light, b), abs(light - b)]
                if b != light and coupling != 0.0:
                    share = weight[s] * coupling
                    band[max(a, b), abs(a - b)] += 2.0 * share if a == b else share
        for s in range(start, end):
            for t in range(start, s + 1):
                a, b = neighbour[s], neighbour[t]
                band[max(a, b), abs(a - b)] += weight[s] * weight[t] * band[light, 0]
        for b in range(max(0, light - width + 1), min(n, light + width)):
            band[max(light, b), abs(light - b)] = 0.0
        start = end


@compiled
def band_product(band, a):
    """Product of the symmetric band with each column of `a`."""
    out = np.zeros_like(a)
    for i in range(a.shape[0]):
        for k in range(min(i + 1, band.shape[1])):
            for d in range(a.shape[1]):
                out[i, d] += band[i, k] * a[i - k, d]
                if k > 0:
                    out[i - k, d] += band[i, k] * a[i, d]
    return out


@lean
def factorise(band, fixed, factor):
    """Cholesky factor of the band; fixed and massless rows become those of the identity.

    For bands of a few entries these loops take two thirds of the time of a call of LAPACK.

    Returns the row of the first pivot that is zero but for round-off, -1 if there is none.
    """
    width = band.shape[1]
    for i in range(band.shape[0]):
        left_out = fixed[i] or not band[i, 0] > 0.0
        for k in range(min(i, width - 1), -1, -1):
            j = i - k
            total = 0.0
            if left_out:
                total = 1.0 if k == 0 else 0.0
            elif not (fixed[j] or not band[j, 0] > 0.0):
                total = band[i, k]
            for n in range(max(0, i - width + 1), j):
                total -= factor[i, i - n] * factor[j, j - n] if j - n < width else 0.0
            if k > 0:
                factor[i, k] = total / factor[j, 0]
            else:
                if not total > SINGULAR * (1.0 if left_out else band[i, 0]):
                    return i
                factor[i, 0] = np.sqrt(total)
    return -1


@lean
def substitute(band, factor, fixed, rhs, out):
    """Forward and back substitution; fixed entries of `out` are known and move to the right."""
    n, width = band.shape
    for i in range(n):
        if not fixed[i]:
            if not band[i, 0] > 0.0:
                out[i] = 0.0
                continue
            total = rhs[i]
            for j in range(max(0, i - width + 1), min(n, i + width)):
                if fixed[j]:
                    total -= (band[i, i - j] if j <= i else band[j, j - i]) * out[j]
            out[i] = total
    for i in range(n):
        if not fixed[i] and band[i, 0] > 0.0:
            for j in range(max(0, i - width + 1), i):
                if not fixed[j]:
                    out[i] -= factor[i, i - j] * out[j]
            out[i] /= factor[i, 0]
    for i in range(n - 1, -1, -1):
        if not fixed[i] and band[i, 0] > 0.0:
            for j in range(i + 1, min(n, i + width)):
                if not fixed[j]:
                    out[i] -= factor[j, j - i] * out[j]
            out[i] /= factor[i, 0]
