"""Stabilised conforming nodal integration (Chen, Wu, Yoon and You 2001).

Instead of the gradient at a point x_L its mean over the Voronoi cell of the point, by its faces:

    grad~ phi_i(x_L) = 1/V_L int_{face of L} phi_i n dA,

with the trapezoidal rule along each side of the cell. Cells that share a side have opposite normals
there, so that ``sum_L V_L grad~ phi_i`` is an integral over the boundary alone: what a linear field does
to nodes whose functions vanish there is zero to round-off, which no sum over points does for functions
that are no polynomials. Cells are those of the undeformed body: F pushes the gradients forward
(`frozen`). There is no further stabilisation: in large deformation modes may grow that cells do not feel.
"""

from typing import Any

import numpy as np
from scipy.sparse import csr_matrix

from mpmbench.core.bases import Basis
from mpmbench.core.bases.handle import Stencils
from mpmbench.core.errors import NotApplicable
from mpmbench.core.geometry.voronoi import Cells, outline, voronoi_cells
from mpmbench.core.particles import Particles

SAME_VOLUME = 1e-9  # relative
SAME_CORNER = 1e-9  # of the size of the body: corners of neighbours that differ by rounding are one


class ConformingGradients(Basis):
    """The values of another basis, `within`, with gradients at the particles that are means over their cells."""

    def __init__(self, within: Basis) -> None:
        self.within, self.nodes, self.handle = within, within.nodes, within.handle
        self.solid = 0

    def follow(self, particles: Particles) -> None:
        self.within.follow(particles)
        self.solid = int(particles.material.stop)

    def evaluate(self, x: np.ndarray) -> Stencils:
        return self.within.evaluate(x)

    def evaluate_particles(self, x: np.ndarray, numbers: np.ndarray) -> Stencils:
        """Means over the cells of the particles among all of them; points without mass have derivatives."""
        plain, n = self.within.evaluate_particles(x, np.arange(len(x))), len(self.nodes)
        body = outline(self.nodes)
        values, gradients = as_matrix(plain, plain.phi, n), []
        means = mean_gradients(voronoi_cells(x[: self.solid], body), self.within, np.ptp(body))
        for d, mean in enumerate(means):
            derivative = as_matrix(plain, plain.grad_phi[:, :, d], n)
            gradients.append(stack(mean, derivative[self.solid :]))
        return stored(values[numbers], [gradient[numbers] for gradient in gradients])

    def locate(self, x: np.ndarray) -> None:
        self.within.locate(x)
        self.handle = self.within.handle

    def first_outside(self, x: np.ndarray) -> int:
        return self.within.first_outside(x)

    def move(self, displacement: np.ndarray) -> None:
        """Move to where a body that is deformed from the start begins."""
        self.within.move(displacement)
        self.nodes = self.within.nodes

    def statistics(self) -> dict[str, tuple[float, str, str]]:
        return self.within.statistics()


def mean_gradients(cells: Cells, basis: Basis, size: float) -> list[csr_matrix]:
    """Means of the gradients of all functions over cells [1/m]: a matrix (cells, nodes) for each axis."""
    count, corners, dim = cells.corners.shape
    places = cells.corners.reshape(-1, dim)
    _, first, number = np.unique(
        np.round(places / (SAME_CORNER * size)), axis=0, return_index=True, return_inverse=True
    )
    at_corners = basis.evaluate(np.ascontiguousarray(places[first]))
    phi = as_matrix(at_corners, at_corners.phi, len(basis.nodes))
    rows = np.repeat(np.arange(count), corners)
    weights = (cells.areas / cells.volumes[:, None, None]).reshape(-1, dim)
    shape = (count, len(first))
    return [csr_matrix((w, (rows, number.ravel())), shape) @ phi for w in weights.T]


def as_matrix(stencils: Stencils, entries: np.ndarray, nodes: int) -> csr_matrix:
    """Entries of stencils, shape (n, K), as a sparse matrix (n, nodes)."""
    used = np.arange(stencils.width) < stencils.size[:, None]
    row = np.nonzero(used)[0]
    shape = (len(stencils.size), nodes)
    return csr_matrix((entries[used], (row, stencils.index[used])), shape)


def stack(above: csr_matrix, below: csr_matrix) -> csr_matrix:
    """One matrix over another."""
    from scipy.sparse import vstack

    return csr_matrix(vstack([above, below]))


def stored(values: csr_matrix, gradients: list[csr_matrix]) -> Stencils:
    """Stencils of all nodes that have a value or a gradient."""
    there = csr_matrix(sum(abs(one) for one in (values, *gradients)))
    there.sort_indices()
    size = np.diff(there.indptr)
    found = Stencils.empty(len(size), int(size.max(initial=1)), len(gradients))
    found.size[:] = size
    used = np.arange(found.width) < size[:, None]
    row = np.nonzero(used)[0]
    found.index[used] = there.indices
    found.phi[used] = np.asarray(values[row, there.indices]).ravel()
    for d, gradient in enumerate(gradients):
        found.grad_phi[used, d] = np.asarray(gradient[row, there.indices]).ravel()
    return found


def refuse_other_cells(case: Any) -> None:
    """Raise `NotApplicable` unless particles fill a convex body, each with the volume of its cell."""
    choices, problem = case.choices, case.problem
    name = f"method.gradient={choices.gradient}"
    if not choices.frozen:
        raise NotApplicable(
            f"{name} takes means over cells of the undeformed body: it needs method.shape_functions=frozen"
        )
    if problem.dimension > 2:
        raise NotApplicable(f"{name} cuts cells on lines and in planes, not in space")
    if problem.bodies(case.resolution, case.particles_per_cell):
        raise NotApplicable(f"{name} is for one body")
    X, V0 = problem.seed(case.resolution, case.particles_per_cell)
    nodes = problem.nodes(case.resolution, choices).points
    volumes = voronoi_cells(X, outline(nodes)).volumes
    if np.abs(volumes - V0).max() > SAME_VOLUME * V0.max():
        raise NotApplicable(
            f"{name} needs particles that have the volumes of their Voronoi cells in the hull of the "
            "nodes, such as midpoints of equal parts, or the nodes themselves, of a convex body"
        )
