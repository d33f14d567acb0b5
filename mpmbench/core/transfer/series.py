"""Velocities beyond PIC by a series in ``1 - S+ S`` (Hammerquist and Nairn 2017; Nairn and Hammerquist 2021).

S takes nodal values to the particles, ``S_pi = phi_i(x_p)``, and ``S+ = M^-1 S^T m`` takes them to the
nodes with the lumped mass. ``sum_{l < k} (1 - S+ S)^l`` goes to the inverse of ``S+ S``, the lumped
over the consistent mass matrix, for large k, but only where particles tell its functions apart.
"""

from typing import TYPE_CHECKING, Any

import numpy as np

from mpmbench.core.bases.handle import count, index, locate, scratch, value
from mpmbench.core.compiled import lean, vector
from mpmbench.core.errors import NotApplicable
from mpmbench.core.transfer import Transfer

if TYPE_CHECKING:
    from mpmbench.core.state import State


class Series(Transfer):
    """Base of the transfers by ``method.transfer_order`` terms of the series."""

    def check(self, choices: Any) -> None:
        """Refuse a consistent mass, of which each term but the first is zero."""
        if choices.mass != "lumped":
            raise NotApplicable(
                f"method.transfer={choices.transfer} needs method.mass=lumped: with a consistent mass "
                "each term but the first is zero, and it is pic"
            )

    def start(self, s: "State") -> None:
        """Allocate a term, its image and the sum, each of shape (N, dim)."""
        if s.room is None:
            s.room = tuple(np.zeros_like(s.nodes.v) for _ in range(3))

    def higher_terms(self, s: "State", v: np.ndarray) -> np.ndarray:
        """``sum_{0 < l < k} (1 - S+ S)^l v`` of nodal velocities [m/s], shape (N, dim).

        What is held has its value in `v`, so that its further terms are zero: components that are
        fixed, and those that walls hold.
        """
        term, image, total = s.room
        term[:], total[:] = v, 0.0
        for _ in range(1, s.choices.transfer_order):
            momentum = s.nodes.q
            momentum[:] = 0.0
            there_and_back(s.basis.handle, s.particles.x, s.particles.m, term, momentum)
            image[:] = term
            s.mass.solve(momentum, image)  # fixed components keep their values
            term -= image
            leave_held(s, term)
            total += term
        return total


def leave_held(s: "State", term: np.ndarray) -> None:
    """Take out of a term what walls hold: it is across frictionless ones, and all where nothing slides."""
    for normal, friction, impulse in zip(
        s.walls.normal, s.walls.friction, s.walls.nodal_impulse, strict=True
    ):
        held = impulse.any(axis=1)
        if np.isinf(friction):
            term[held] = 0.0
        else:
            term[held] -= (term[held] @ normal)[:, None] * normal


@lean
def there_and_back(phi, x, m, v_i, q_i):
    """Add ``S^T m S v`` to the momentum, shape (N, dim)."""
    work, grad_phi, v = scratch(phi), vector(phi.axes), vector(phi.axes)
    for p in range(x.shape[0]):
        if m[p] == 0.0:
            continue
        at = locate(phi, x, p, work)
        for d in range(len(phi.axes)):
            v[d] = 0.0
        for k in range(count(phi, at)):
            phi_i = value(phi, at, k, work, grad_phi)
            i = index(phi, at, k)
            for d in range(len(phi.axes)):
                v[d] += phi_i * v_i[i, d]
        for k in range(count(phi, at)):
            phi_i = value(phi, at, k, work, grad_phi)
            i = index(phi, at, k)
            for d in range(len(phi.axes)):
                q_i[i, d] += m[p] * phi_i * v[d]


@lean
def add_interpolated(phi, x, v_i, v):
    """Add ``S v_i`` to the values at the particles, shape (P, dim)."""
    work, grad_phi = scratch(phi), vector(phi.axes)
    for p in range(x.shape[0]):
        at = locate(phi, x, p, work)
        for k in range(count(phi, at)):
            phi_i = value(phi, at, k, work, grad_phi)
            i = index(phi, at, k)
            for d in range(len(phi.axes)):
                v[p, d] += phi_i * v_i[i, d]
