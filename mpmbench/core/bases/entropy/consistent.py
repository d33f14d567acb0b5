"""Gradients that integrate exactly, with which meshfree functions pass the patch test.

Particles at barycentres of an irregular cloud violate ``sum_p V_p grad phi_i(x_p) = integral of
phi_i n dS``, which is zero for inner nodes: a constant stress then pushes nodes about. The smallest
change of the gradients, weighted with V_p / phi_i(x_p), that restores it and leaves their partition
of unity and linear completeness as they are, is ``phi_i (mu_i - m_p - b_p . (x_i - x_p))`` with one
vector mu_i per node and its linear fit m_p, b_p at each particle.
"""

import math

import numpy as np

from mpmbench.core.bases.handle import Stencils
from mpmbench.core.compiled import lean, matrix, vector
from mpmbench.core.compiled.algebra import inverse
from mpmbench.core.errors import NotConverged
from mpmbench.core.geometry import Box, Geometry
from mpmbench.core.geometry.triangulate import triangulation

TOLERANCE = 1e-6  # of the sums over particles, relative to the sums of absolute values
MOST_ITERATIONS = 2000


class ConsistentGradients:
    """The correction for one set of nodes, whose boundary is that of a triangulation.

    Parameters
    ----------
    geometry : Geometry
        With simplices, or a convex body.
    """

    def __init__(self, geometry: Geometry) -> None:
        nodes = geometry.points
        if isinstance(geometry, Box):
            sides = np.array(geometry.upper) - np.array(geometry.lower)
            simplices = triangulation(nodes, float(np.prod(sides)))
        elif geometry.simplices is not None:
            simplices = geometry.simplices
        else:
            simplices = triangulation(nodes, None)
        self.faces, self.opposite = boundary_faces(simplices)
        # the last two solutions
        self._mu, self._before = np.zeros_like(nodes), np.zeros_like(nodes)
        self.iterations = 0

    def correct(self, nodes: np.ndarray, x: np.ndarray, V: np.ndarray, phi: Stencils) -> None:
        """Change the gradients of particles at x, shape (P, dim), with volumes V [m^dim].

        Those of particles without volume stay.

        Raises
        ------
        NotConverged
        """
        flux = self._flux(nodes)  # over a boundary that encloses as much as the particles fill
        flux *= V.sum() * nodes.shape[1] / float(np.vdot(nodes, flux))
        total, scale = np.zeros_like(nodes), np.zeros(len(nodes))
        gradient_sums(phi, V, total, scale)
        diagonal = np.zeros(len(nodes))
        weights(phi, V, diagonal)
        diagonal = np.where(diagonal > 0.0, 1.0 / np.maximum(diagonal, 1e-300), 0.0)[:, None]
        goal = TOLERANCE * float(scale.max())

        def product(mu: np.ndarray) -> np.ndarray:
            out = np.zeros_like(mu)
            corrections(phi, nodes, x, V, mu, out, False)
            return out

        mu = 2.0 * self._mu - self._before
        self._before, self._mu = self._mu, mu
        r = flux - total - product(mu)
        z = diagonal * r
        s, rz = z.copy(), float(np.vdot(r, z))
        self.iterations = 0
        while np.abs(r).max() > goal:
            if self.iterations == MOST_ITERATIONS:
                raise NotConverged(
                    f"consistent gradients: {MOST_ITERATIONS} iterations do not suffice"
                )
            self.iterations += 1
            As = product(s)
            alpha = rz / float(np.vdot(s, As))
            mu += alpha * s
            r -= alpha * As
            z = diagonal * r
            rz, previous = float(np.vdot(r, z)), rz
            s = z + rz / previous * s
        corrections(phi, nodes, x, V, mu, total, True)

    def _flux(self, nodes: np.ndarray) -> np.ndarray:
        """Integral of ``phi_i n`` over the boundary [m^(dim-1)], shape (N, dim)."""
        dimension = nodes.shape[1]
        corners = nodes[self.faces]
        if dimension == 1:
            normal = np.ones((len(corners), 1))
        elif dimension == 2:
            edge = corners[:, 1] - corners[:, 0]
            normal = np.stack([edge[:, 1], -edge[:, 0]], axis=1)
        else:
            normal = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        inwards = np.einsum("fd,fd->f", normal, nodes[self.opposite] - corners[:, 0])
        share = np.where(inwards > 0.0, -1.0, 1.0)[:, None] * normal / dimension
        flux = np.zeros_like(nodes)
        for k in range(dimension):
            np.add.at(flux, self.faces[:, k], share)
        return flux


def boundary_faces(simplices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Faces of one simplex only, shape (B, dim), and the corner of it opposite to each, (B,)."""
    corners = simplices.shape[1]
    faces = np.concatenate([np.delete(simplices, k, axis=1) for k in range(corners)])
    opposite = np.concatenate([simplices[:, k] for k in range(corners)])
    _, first, count = np.unique(
        np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True
    )
    alone = first[count == 1]
    return faces[alone], opposite[alone]


@lean
def gradient_sums(stored, V, total, scale):
    """``sum_p V_p grad phi_i`` and ``sum_p V_p |grad phi_i|``."""
    for p in range(V.shape[0]):
        for k in range(stored.size[p]):
            i, square = stored.index[p, k], 0.0
            for d in range(len(stored.axes)):
                total[i, d] += V[p] * stored.grad_phi[p, k, d]
                square += stored.grad_phi[p, k, d] ** 2
            scale[i] += V[p] * math.sqrt(square)


@lean
def weights(stored, V, total):
    """``sum_p V_p phi_i (1 - phi_i)``: about the diagonal of the system."""
    for p in range(V.shape[0]):
        for k in range(stored.size[p]):
            phi = stored.phi[p, k]
            total[stored.index[p, k]] += V[p] * phi * (1.0 - phi)


@lean
def corrections(stored, nodes, x, V, mu, total, apply):
    """Add ``phi_i (mu_i - m_p - b_p . y_i)`` to the gradients, or times V_p to `total`.

    Here ``y_i = x_i - x_p``, and m and b are the fit of mu weighted with phi: ``m = sum phi mu``,
    ``b = (sum phi mu (x) y) (sum phi y (x) y)^-1``, because ``sum phi y = 0``.
    """
    axes, size, index, phi = stored.axes, stored.size, stored.index, stored.phi
    dim = len(axes)
    m, y = vector(axes), vector(axes)
    moment, slope = matrix(axes, axes), matrix(axes, axes)
    H, inverse_H = matrix(axes, axes), matrix(axes, axes)
    for p in range(V.shape[0]):
        if V[p] == 0.0:
            continue
        for d in range(dim):
            m[d] = 0.0
            for e in range(dim):
                moment[d, e], H[d, e] = 0.0, 0.0
        for k in range(size[p]):
            i = index[p, k]
            for d in range(dim):
                y[d] = nodes[i, d] - x[p, d]
            for d in range(dim):
                m[d] += phi[p, k] * mu[i, d]
                for e in range(dim):
                    moment[d, e] += phi[p, k] * mu[i, d] * y[e]
                    H[d, e] += phi[p, k] * y[d] * y[e]
        inverse(axes, H, inverse_H)
        for d in range(dim):
            for e in range(dim):
                slope[d, e] = 0.0
                for c in range(dim):
                    slope[d, e] += moment[d, c] * inverse_H[c, e]
        for k in range(size[p]):
            i = index[p, k]
            for d in range(dim):
                y[d] = nodes[i, d] - x[p, d]
            for d in range(dim):
                change = mu[i, d] - m[d]
                for e in range(dim):
                    change -= slope[d, e] * y[e]
                change *= phi[p, k]
                if apply:
                    stored.grad_phi[p, k, d] += change
                else:
                    total[i, d] += V[p] * change
