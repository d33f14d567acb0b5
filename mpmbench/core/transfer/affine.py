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
from mpmbench.core.bases.handle import locate_batch, room, spread_affine, take_affine
from mpmbench.core.compiled import lean, matrix, table, threads, vector
from mpmbench.core.compiled.rows import (
    BATCH,
    GROUPS,
    LANES,
    groups,
    lanes_for,
    put,
    set_product,
    take,
)
from mpmbench.core.errors import NotApplicable
from mpmbench.core.transfer import Transfer
from mpmbench.core.transfer.carry import alike, squared, velocity_gradients

if TYPE_CHECKING:
    from mpmbench.core.state import State


class Affine(Transfer):
    """Base of transfers with an affine part: `affine` in the particles' data is B_p, or C_p itself."""

    moments: ClassVar[bool]

    def check(self, choices: Any) -> None:
        """Refuse a consistent mass, for which particle velocities alone are exact already."""
        if choices.mass != "lumped":
            raise NotApplicable(f"method.transfer={choices.transfer} needs method.mass=lumped")

    def start(self, s: "State") -> None:
        """Allocate sums, and take the affine part of the initial field."""
        if s.room is None:
            nodes, dim = s.nodes.v.shape
            lanes, particles = lanes_for(dim + 1), len(s.particles.x)
            parts = threads.apart(particles, nodes, len(lanes))
            s.room = lanes, parts, threads.apart(particles, 2, dtype=np.int64)
        self.take(s)

    def to_nodes(self, s: "State", q: np.ndarray) -> None:
        """Add ``sum_p m_p phi_i C_p r_ip``."""
        p, phi, nodes = s.particles, s.basis.handle, s.basis.nodes
        affine, among, moments = p.data["affine"], places(s), self.keeps_moments(s)
        lanes, parts, touched = s.room

        def add(c: int, *part: int) -> None:
            own = parts[c], touched[c], *part
            affine_to_nodes(phi, lanes, p.x, among, nodes, p.m, affine, moments, *own)

        threads.run(add, len(p.x))
        collect(s.axes, parts, touched, q)

    def take(self, s: "State") -> None:
        """Take B_p, or C_p from the gradients of the functions."""
        p, phi, nodes, v = s.particles, s.basis.handle, s.basis.nodes, s.nodes.v
        affine, among = p.data["affine"], places(s)

        def moments(c: int, *part: int) -> None:
            affine_to_particles(phi, p.x, among, nodes, v, affine, *part)

        def gradients(c: int, start: int, stop: int) -> None:
            velocity_gradients(phi, p.x, v, affine, start, stop)

        threads.run(moments if self.keeps_moments(s) else gradients, len(p.x))

    def keeps_moments(self, s: "State") -> bool:
        """Whether `affine` is B_p, and not C_p."""
        return self.moments


def places(s: "State") -> np.ndarray:
    """Where the particles are among the nodes as the basis has them [m], shape (P, dim)."""
    return s.basis.X if isinstance(s.basis, FrozenBasis) else s.particles.x


@lean
def affine_to_particles(phi, x, among, nodes, v_i, affine, start, stop):
    """Write ``sum_i phi_i v_i (x) r_ip`` of the particles start to stop."""
    axes = phi.axes
    work, fields, places = room(phi), table(axes, axes, BATCH), matrix(axes, BATCH)
    at = vector(BATCH).view(np.int64)
    first = start
    while first < stop:
        n = locate_batch(phi, x, first, min(len(BATCH), stop - first), at, work)
        take(axes, places, 0, among, first, n)
        b = 0
        while b < n:
            same = alike(at, b, n)
            take_affine(phi, at[b], b, same, work, nodes, places, v_i, fields)
            b += same
        put(squared(axes), fields, 0, affine, first, n)
        first += n


@lean
def affine_to_nodes(phi, lanes, x, among, nodes, m, affine, moments, sums, touched, start, stop):
    """Add ``sum_p m_p phi_i C_p r_ip`` of the particles start to stop to `sums`, shape (N, lanes)."""
    axes, dim = phi.axes, len(phi.axes)
    work, columns, places = room(phi), table(axes, axes, BATCH), matrix(axes, BATCH)
    mass, at = matrix((0.0,), BATCH), vector(BATCH).view(np.int64)
    touched[0], touched[1] = sums.shape[0], 0
    first = start
    while first < stop:
        n = locate_batch(phi, x, first, min(len(BATCH), stop - first), at, work)
        take(axes, places, 0, among, first, n)
        take((0.0,), mass, 0, m, first, n)
        take(squared(axes), columns, 0, affine, first, n)
        for r in range(dim * dim):
            for g in range(groups(n)):
                i = GROUPS * r + g
                set_product(LANES, columns, i, columns, i, mass, g)
        b = 0
        while b < n:
            same = alike(at, b, n)
            spread_affine(
                phi, at[b], b, same, work, nodes, places, moments, lanes, columns, sums, touched
            )
            b += same
        first += n


@lean
def collect(axes, parts, touched, q_i):
    """Add up the parts in their order, and set them back to zero."""
    for c in range(parts.shape[0]):
        for i in range(touched[c, 0], touched[c, 1]):
            for d in range(len(axes)):
                q_i[i, d] += parts[c, i, d]
            for k in range(parts.shape[2]):
                parts[c, i, k] = 0.0


def spin(affine: np.ndarray, m: np.ndarray) -> np.ndarray:
    """Angular momentum of the affine parts, ``sum_p m_p sum_i phi_i r_ip x v_i`` [kg m^2/s], shape (3,)."""
    total = np.zeros((3, 3))
    dim = affine.shape[1]
    total[:dim, :dim] = np.tensordot(m, affine, 1)
    return np.array(
        [total[2, 1] - total[1, 2], total[0, 2] - total[2, 0], total[1, 0] - total[0, 1]]
    )
