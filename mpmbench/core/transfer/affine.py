"""What particles carry besides their velocity: the affine part of the field around them.

In the notation of Jiang et al. 2017 ("An angular momentum conserving affine-particle-in-cell
method"), with ``r_ip = x_i - x_p``:

    B_p = sum_i phi_i v_i (x) r_ip             from the nodes, at the places before the step
    D_p = sum_i phi_i r_ip (x) r_ip            to the nodes, at the places of then
    m_i v_i = sum_p m_p phi_i (v_p + C_p r_ip)     with C_p = B_p D_p^-1

Particles with frozen functions keep their places among the nodes; ``r_ip`` is then that of the
reference configuration, in which a field is affine as well.
"""

from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from mpmbench.core.bases.frozen import FrozenBasis
from mpmbench.core.bases.handle import count, index, locate, scratch, value
from mpmbench.core.compiled import inlined, lean, matrix, threads, vector
from mpmbench.core.errors import NotApplicable
from mpmbench.core.transfer import Transfer

if TYPE_CHECKING:
    from mpmbench.core.state import State

# Of the largest r_ip^2: directions in which D_p is less have no affine part that nodes could see.
FLAT = 1e-10


class Affine(Transfer):
    """Base of transfers with an affine part: `affine` in the particles' data is B_p, or C_p itself."""

    moments: ClassVar[bool]

    def check(self, choices: Any) -> None:
        """Refuse a consistent mass, for which particle velocities alone are exact already."""
        if choices.mass != "lumped":
            raise NotApplicable(f"method.transfer={choices.transfer} needs method.mass=lumped")

    def start(self, s: "State") -> None:
        """Take the affine part of the initial field."""
        self.to_particles(s, 0.0)

    def to_nodes(self, s: "State", q: np.ndarray) -> None:
        """Add ``sum_p m_p phi_i C_p r_ip``."""
        p, basis = s.particles, s.basis
        affine = p.data["affine"]
        add_affine(basis.handle, p.x, places(s), basis.nodes, p.m, affine, self.keeps_moments(s), q)

    def to_particles(self, s: "State", dt: float) -> None:
        """Take B_p, or C_p from the gradients of the functions."""
        p, phi, nodes, v = s.particles, s.basis.handle, s.basis.nodes, s.nodes.v
        affine, among, moments = p.data["affine"], places(s), self.keeps_moments(s)
        threads.run(
            lambda c, *part: take_affine(phi, p.x, among, nodes, v, moments, affine, *part),
            len(p.x),
        )

    def keeps_moments(self, s: "State") -> bool:
        """Whether `affine` is B_p, and not C_p."""
        return self.moments


def places(s: "State") -> np.ndarray:
    """Where the particles are among the nodes as the basis has them [m], shape (P, dim)."""
    return s.basis.X if isinstance(s.basis, FrozenBasis) else s.particles.x


@lean
def take_affine(phi, x, among, nodes, v_i, moments, affine, start, stop):
    """Write ``sum_i phi_i v_i (x) r_ip`` or ``sum_i v_i (x) grad phi_i`` of the particles start to stop."""
    work, arm = scratch(phi), vector(phi.axes)
    for p in range(start, stop):
        at = locate(phi, x, p, work)
        affine[p] = 0.0
        for k in range(count(phi, at)):
            phi_i = value(phi, at, k, work, arm)
            i = index(phi, at, k)
            for e in range(len(phi.axes)):
                if moments:
                    arm[e] = phi_i * (nodes[i, e] - among[p, e])
                for d in range(len(phi.axes)):
                    affine[p, d, e] += v_i[i, d] * arm[e]


@lean
def add_affine(phi, x, among, nodes, m, affine, moments, q_i):
    """Add ``sum_p m_p phi_i C_p r_ip`` to the momentum, shape (N, dim)."""
    work, grad_phi, arm = scratch(phi), vector(phi.axes), vector(phi.axes)
    C, D = matrix(phi.axes, phi.axes), matrix(phi.axes, phi.axes)
    for p in range(x.shape[0]):
        if m[p] == 0.0:
            continue
        at = locate(phi, x, p, work)
        for d in range(len(phi.axes)):
            for e in range(len(phi.axes)):
                C[d, e], D[d, e] = affine[p, d, e], 0.0
        if moments:
            farthest = 0.0
            for k in range(count(phi, at)):
                phi_i = value(phi, at, k, work, grad_phi)
                i = index(phi, at, k)
                for d in range(len(phi.axes)):
                    arm[d] = nodes[i, d] - among[p, d]
                    farthest = max(farthest, arm[d] * arm[d])
                for d in range(len(phi.axes)):
                    for e in range(d + 1):
                        D[d, e] += phi_i * arm[d] * arm[e]
            divide_by(phi.axes, D, FLAT * farthest, C)
        for k in range(count(phi, at)):
            phi_i = value(phi, at, k, work, grad_phi)
            i = index(phi, at, k)
            for d in range(len(phi.axes)):
                field = 0.0
                for e in range(len(phi.axes)):
                    field += C[d, e] * (nodes[i, e] - among[p, e])
                q_i[i, d] += m[p] * phi_i * field


@inlined
def divide_by(axes, D, least, B):
    """``B D^-1`` in place for a symmetric D, whose lower half is overwritten by ``L^-1`` and pivots.

    ``D = L diag(pivot) L^T``; directions with a pivot of `least` or less are left out.
    """
    for j in range(len(axes)):
        for k in range(j):
            D[j, j] -= D[j, k] * D[j, k] * D[k, k]
        pivot = D[j, j]
        for i in range(j + 1, len(axes)):
            for k in range(j):
                D[i, j] -= D[i, k] * D[j, k] * D[k, k]
            D[i, j] = D[i, j] / pivot if pivot > least else 0.0
    for row in range(len(axes)):
        for j in range(len(axes)):
            for k in range(j):
                B[row, j] -= D[j, k] * B[row, k]
        for j in range(len(axes)):
            B[row, j] = B[row, j] / D[j, j] if D[j, j] > least else 0.0
        for j in range(len(axes) - 1, -1, -1):
            for k in range(j + 1, len(axes)):
                B[row, j] -= D[k, j] * B[row, k]


def spin(affine: np.ndarray, m: np.ndarray) -> np.ndarray:
    """Angular momentum of the affine parts, ``sum_p m_p sum_i phi_i r_ip x v_i`` [kg m^2/s], shape (3,)."""
    total = np.zeros((3, 3))
    dim = affine.shape[1]
    total[:dim, :dim] = np.tensordot(m, affine, 1)
    return np.array(
        [total[2, 1] - total[1, 2], total[0, 2] - total[2, 0], total[1, 0] - total[0, 1]]
    )
