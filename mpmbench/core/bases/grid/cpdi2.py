"""Convected domains of the second order (Sadeghirad, Brannon and Guilkey 2013): their corners move with the grid.

Domains are intervals, quadrilaterals or hexahedra of a mesh, whose corners neighbours have in common:
``x_c += dt sum_i N_i(x_c) v_i`` with hats N_i. With the multilinear functions M_c of a domain

    phi_i = sum_c w_c N_i(x_c),         w_c = (1/V) int M_c dx,
    grad phi_i = sum_c g_c N_i(x_c),    g_c = (1/V) int grad M_c dx,    V = int dx,

which two Gauss points along each axis give exactly. Domains of a mesh fill the body whatever its
motion: in uniform stress no force is left inside. In an affine motion they are the parallelograms of
`cpdi`. Linear fields have their exact gradients, and values are those at the centroid of the domain.

The mesh is made of the boxes of the first particles, as large as these with the proportions of a
cell: corners that coincide are one. A lattice of particles gives a mesh without gaps; particles on
circles keep boxes of their own, whose corners are their own too. Volumes of particles are those of
F, as in all methods here, and not those of the domains.
"""

from dataclasses import dataclass

import numpy as np

from mpmbench.core.bases.grid.cpdi import ConvectedDomains, Cpdi, corner_hats
from mpmbench.core.bases.handle import Stencils
from mpmbench.core.compiled import lean, matrix, vector
from mpmbench.core.compiled.algebra import inverse
from mpmbench.core.errors import NotApplicable
from mpmbench.core.geometry import Box, Geometry, tensor_points
from mpmbench.core.particles import Particles
from mpmbench.core.registry import register

SAME = 1e-8  # of a cell: corners that are nearer to each other are one
EIGHT = (0.0,) * 8  # corners of a hexahedron
GAUSS = 3.0**-0.5


@lean
def average_on_mesh(grid, x, corner, domain, stored, start, stop):
    """Store the functions of domains start to stop; returns one that has lost its volume, else -1.

    Parameters
    ----------
    corner : ndarray
        Places [m], shape (C, dim).
    domain : ndarray of int
        Corners of each domain, shape (n, 2^dim): the e-th bit of a column says on which side along e.
    """
    dim = len(grid.axes)
    corners = 1 << dim
    J, inverse_J = matrix(grid.axes, grid.axes), matrix(grid.axes, grid.axes)
    M, slope = vector(EIGHT), matrix(EIGHT, grid.axes)
    weight, g = vector(EIGHT), matrix(EIGHT, grid.axes)
    for p in range(start, stop):
        volume = 0.0
        for c in range(corners):
            weight[c] = 0.0
            for d in range(dim):
                g[c, d] = 0.0
        for q in range(corners):  # Gauss points have the signs of corners
            for d in range(dim):
                for e in range(dim):
                    J[d, e] = 0.0
            for c in range(corners):
                M[c] = 1.0
                for e in range(dim):
                    slope[c, e] = 1.0
                for a in range(dim):
                    sign = 2.0 * ((c >> a) & 1) - 1.0
                    at = 0.5 * (1.0 + sign * GAUSS * (2.0 * ((q >> a) & 1) - 1.0))
                    M[c] *= at
                    for e in range(dim):
                        slope[c, e] *= 0.5 * sign if e == a else at
                for d in range(dim):
                    for e in range(dim):
                        J[d, e] += corner[domain[p, c], d] * slope[c, e]
            det = inverse(grid.axes, J, inverse_J)
            if not det > 0.0:
                return p
            volume += det
            for c in range(corners):
                weight[c] += det * M[c]
                for d in range(dim):
                    for e in range(dim):
                        g[c, d] += det * inverse_J[e, d] * slope[c, e]
        found = 0
        for c in range(corners):
            for d in range(dim):
                g[c, d] /= volume
            weight[c] /= volume
            place = corner[domain[p, c]]
            found = corner_hats(grid, place, weight[c], g[c], p, found, stored)
            if found < 0:
                return p
        stored.size[p] = found
    return -1


@lean
def carry_corners(grid, v, dt, corner, stored):
    """Move corners with the hats of the nodal velocities; `stored` is room for one point."""
    nothing = vector(grid.axes)
    for d in range(len(grid.axes)):
        nothing[d] = 0.0
    for c in range(corner.shape[0]):
        found = corner_hats(grid, corner[c], 1.0, nothing, 0, 0, stored)
        for k in range(found):
            for d in range(len(grid.axes)):
                corner[c, d] += dt * stored.phi[0, k] * v[stored.index[0, k], d]


class MeshedDomains(ConvectedDomains):
    """Averages of hats over the domains of a mesh that moves with the grid."""

    def follow(self, particles: Particles) -> None:
        """Make the mesh of the boxes of the particles; corners lie where F puts them, on average."""
        super().follow(particles)
        p, dim = particles, particles.dimension
        side = tensor_points([np.array([-1.0, 1.0])] * dim)[
            :, ::-1
        ]  # the first axis is the fastest
        box = self._initial[:, None, :] * side
        first = (p.X[:, None, :] + box).reshape(-1, dim)
        # an offset, so that round-off does not part what lies between two whole numbers
        keys = np.floor(first / (SAME * self._spacing) + 0.314).astype(np.int64)
        _, owner = np.unique(keys, axis=0, return_inverse=True)
        owner = owner.ravel()
        self._domain, shared = owner.reshape(len(p.x), -1), np.bincount(owner)
        now = (p.x[:, None, :] + np.einsum("pde,pce->pcd", p.F, box)).reshape(-1, dim)
        self._corner = np.zeros((len(shared), dim))
        np.add.at(self._corner, owner, now)
        self._corner /= shared[:, None]
        self._one = Stencils.empty(1, 2**dim, dim)

    def locate(self, x: np.ndarray) -> None:
        if self._particles is None:
            super().locate(x)
        else:
            self._all(x, average_on_mesh, self._corner, self._domain, self.handle)

    def evaluate_particles(self, x: np.ndarray, numbers: np.ndarray) -> Stencils:
        if self._particles is None:
            return self.evaluate(x[numbers])
        stored = Stencils.empty(len(numbers), self.handle.width, x.shape[1])
        return self._all(x[numbers], average_on_mesh, self._corner, self._domain[numbers], stored)

    def carry(self, v: np.ndarray, dt: float) -> None:
        carry_corners(self._grid, v, dt, self._corner, self._one)


@register("basis", "cpdi2")
@dataclass(frozen=True)
class Cpdi2(Cpdi):
    """Hats averaged over quadrilaterals or hexahedra whose corners move with the grid, Sadeghirad et al. 2013."""

    def build(self, geometry: Geometry, particles: int, moving: bool) -> MeshedDomains:
        if not isinstance(geometry, Box):
            raise NotApplicable("cpdi2 needs a grid: this problem has an unstructured set of nodes")
        return MeshedDomains(geometry, particles)
