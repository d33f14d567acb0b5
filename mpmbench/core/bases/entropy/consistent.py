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
from mpmbench.core.compiled.algebra import inverse, multiply
from mpmbench.core.errors import NotConverged
from mpmbench.core.geometry import Cloud, Geometry
from mpmbench.core.geometry.triangulate import triangulation

TOLERANCE = 1e-6  # of the sums over particles, relative to the sums of absolute values
MOST_ITERATIONS = 2000


class ConsistentGradients:
    """The correction for nodes with simplices, or of a convex body, whose boundary is known then."""

    def __init__(self, geometry: Geometry) -> None:
        nodes = geometry.points
        simplices = geometry.simplices if isinstance(geometry, Cloud) else None
        if simplices is None:
            simplices = triangulation(nodes, None)
        self.faces, self.opposite = boundary_faces(simplices)
        # the last two solutions
        self._mu, self._before = np.zeros_like(nodes), np.zeros_like(nodes)

    def correct(self, nodes: np.ndarray, x: np.ndarray, V: np.ndarray, phi: Stencils) -> None:
        """Change the gradients of particles at x, shape (P, dim), that have a volume V [m^dim]."""
        flux = self._flux(nodes)  # over a boundary that encloses as much as the particles fill
        flux *= V.sum() * nodes.shape[1] / float(np.vdot(nodes, flux))
        total, scale, diagonal = np.zeros_like(nodes), np.zeros(len(nodes)), np.zeros(len(nodes))
        gradient_sums(phi, V, total, scale, diagonal)
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
        iterations = 0
        while np.abs(r).max() > goal:
            if iterations == MOST_ITERATIONS:
                raise NotConverged(f"consistent gradients: {iterations} iterations do not suffice")
            iterations += 1
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
    _, first, times = np.unique(
        np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True
    )
    alone = first[times == 1]
    return faces[alone], opposite[alone]


@lean
def gradient_sums(stored, V, total, scale, diagonal):
    """``sum_p V_p grad phi_i``, ``sum_p V_p |grad phi_i|``, and about the diagonal of the system.

    That is ``sum_p V_p phi_i (1 - phi_i)``.
    """
    for p in range(V.shape[0]):
        for k in range(stored.size[p]):
            i, phi, square = stored.index[p, k], stored.phi[p, k], 0.0
            for d in range(len(stored.axes)):
                total[i, d] += V[p] * stored.grad_phi[p, k, d]
                square += stored.grad_phi[p, k, d] ** 2
            scale[i] += V[p] * math.sqrt(square)
            diagonal[i] += V[p] * phi * (1.0 - phi)


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
        m[:] = 0.0
        moment[:] = 0.0
        H[:] = 0.0
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
        multiply(axes, moment, inverse_H, slope)
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
