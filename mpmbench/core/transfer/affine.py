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

from mpmbench.core.bases import handle
from mpmbench.core.bases.frozen import FrozenBasis
from mpmbench.core.bases.handle import locate, scratch, spread_one, take_one
from mpmbench.core.compiled import lean
from mpmbench.core.errors import NotApplicable
from mpmbench.core.transfer import Transfer
from mpmbench.core.transfer.carry import velocity_gradients

if TYPE_CHECKING:
    from mpmbench.core.state import State


class Affine(Transfer):
    """Base of transfers with an affine part: `affine` in the particles' data is B_p, or C_p itself.

    Steps take it along with velocities, and spread it with the momentum (`parts`).
    """

    moments: ClassVar[bool]

    def check(self, choices: Any) -> None:
        """Refuse a consistent mass, for which particle velocities alone are exact already."""
        if choices.mass != "lumped":
            raise NotApplicable(f"method.transfer={choices.transfer} needs method.mass=lumped")

    def keeps_moments(self, s: "State") -> bool:
        """Whether `affine` is B_p, and not C_p."""
        return self.moments

    def part(self, s: "State") -> handle.Affine:
        """Affine parts, and the places to which they belong."""
        among = s.basis.X if isinstance(s.basis, FrozenBasis) else s.particles.x
        affine = s.particles.data["affine"]
        return handle.Affine(affine, among, s.basis.nodes, self.keeps_moments(s))

    def start(self, s: "State") -> None:
        """Take the affine part of the initial field."""
        p, part = s.particles, self.part(s)
        if part.moments:
            take_all(s.basis.handle, p.x, part, s.nodes.v)
        else:
            velocity_gradients(s.basis.handle, p.x, s.nodes.v, part.affine, 0, len(p.x))

    def to_nodes_again(self, s: "State", q: np.ndarray) -> None:
        """Add ``sum_p m_p phi_i C_p r_ip``."""
        p = s.particles
        spread_all(s.basis.handle, p.x, self.part(s), p.m, q)


@lean
def take_all(phi, x, part, v_i):
    """Take the moments of all particles."""
    work = scratch(phi)
    for p in range(x.shape[0]):
        at = locate(phi, x, p, work)
        take_one(phi, at, p, work, part, v_i)


@lean
def spread_all(phi, x, part, m, q_i):
    """Add the momentum of the affine parts of all particles, shape (N, dim)."""
    work = scratch(phi)
    for p in range(x.shape[0]):
        at = locate(phi, x, p, work)
        spread_one(phi, at, p, work, part, m, 0, q_i)


def spin(affine: np.ndarray, m: np.ndarray) -> np.ndarray:
    """Angular momentum of the affine parts, ``sum_p m_p sum_i phi_i r_ip x v_i`` [kg m^2/s], shape (3,)."""
    total = np.zeros((3, 3))
    dim = affine.shape[1]
    total[:dim, :dim] = np.tensordot(m, affine, 1)
    return np.array(
        [total[2, 1] - total[1, 2], total[0, 2] - total[2, 0], total[1, 0] - total[0, 1]]
    )
