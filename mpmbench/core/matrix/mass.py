"""The lumped mass matrix, of each step or of the start, and the choice of a solver for the consistent one."""

from typing import Protocol

import numpy as np

from mpmbench.core.bases import Basis
from mpmbench.core.bases.handle import Stencils
from mpmbench.core.choices import Choices
from mpmbench.core.compiled import lean
from mpmbench.core.matrix.band import BandMass, assemble_band
from mpmbench.core.matrix.light import LightNodes, heaviest_seen
from mpmbench.core.nodes import over, stretches
from mpmbench.core.particles import Particles

# Beyond this band conjugate gradients cost less than a banded factorisation in every step.
WIDEST_BAND = 40
DIRECT_NODES = 40_000  # a constant matrix up to this size is factorised once


class Mass(Protocol):
    """A mass matrix that is assembled in every step and solved a few times.

    `fixed`, shape (N, dim), marks constrained components: their rows and columns leave the system,
    one component at a time. Light nodes leave it too and follow their neighbours (`LightNodes`):
    near-empty cells otherwise break a consistent mass (the last active function is seen by one
    particle near the edge of its support), and are thrown about by forces with a lumped one.
    """

    light_nodes: LightNodes

    def assemble(
        self, basis: Basis, p: Particles, m_i: np.ndarray, seen: list[np.ndarray] | None = None
    ) -> None:
        """Sum the matrix over the particles, whose row sums `m_i`, shape (N,), are known, and so may be who is `seen`.

        Raises
        ------
        BrokeDown
            When the matrix is singular.
        """
        ...

    def solve(self, rhs: np.ndarray, out: np.ndarray) -> None:
        """Solve ``M out = rhs`` on the free components of what is seen; `out` holds the others; shapes (N, dim)."""
        ...

    def multiply(self, a: np.ndarray) -> np.ndarray:
        """``M a``, shape (N, dim)."""
        ...


def make_mass(choices: Choices, fixed: np.ndarray, basis: Basis, p: Particles) -> Mass:
    """The mass matrix that the method asks for, with the solver that its size asks for."""
    light_nodes = LightNodes(choices.mass_cutoff, fixed)
    # implicit loops sum a consistent mass into their tangent
    if choices.mass == "lumped" or choices.implicit:
        return LumpedMass(fixed, light_nodes)
    # a third of the time of all imports, which lumped masses do without
    from mpmbench.core.matrix.mass_checks import refuse_too_few_particles, refuse_unseen_patterns
    from mpmbench.core.matrix.sparse import DirectMass, SparseMass

    basis.locate(p.x)
    if choices.moving and isinstance(basis.handle, Stencils):
        refuse_unseen_patterns(basis, p, fixed)
    diagonal, seen = np.zeros((len(fixed), 1)), np.zeros(len(fixed))
    if assemble_band(basis.handle, p.x, p.m, diagonal) <= WIDEST_BAND:
        heaviest_seen(basis.handle, p.x, p.m, seen)
        light_nodes.find(basis, p, seen, diagonal[:, 0])
        refuse_too_few_particles(basis, p, fixed, light_nodes)
        return BandMass(fixed, light_nodes)
    if basis.constant_values and len(basis.nodes) <= DIRECT_NODES:
        return DirectMass(fixed, light_nodes)
    return SparseMass(fixed, light_nodes)


class LumpedMass:
    """Row-sum lumped mass (Wobbes 2020, Eq. 17)."""

    def __init__(self, fixed: np.ndarray, light_nodes: LightNodes) -> None:
        self.fixed, self.light_nodes = fixed, light_nodes
        self.seen = stretches(np.ones(len(fixed), dtype=np.bool_))
        self.m_i = np.zeros(len(fixed))
        self._system = self.m_i
        self._with_light, self._force = np.zeros(len(fixed)), np.zeros(fixed.shape)

    def assemble(
        self, basis: Basis, p: Particles, m_i: np.ndarray, seen: list[np.ndarray] | None = None
    ) -> None:
        self.m_i = self._system = m_i
        self.seen = stretches(m_i != 0.0) if seen is None else seen
        if self.light_nodes.find(basis, p, m_i, m_i, self.seen):
            self._system = self.light_nodes.gathered(m_i, self._with_light, self.seen)

    def multiply(self, a: np.ndarray) -> np.ndarray:
        return self.m_i[:, None] * a

    def solve(self, rhs: np.ndarray, out: np.ndarray) -> None:
        force = self.light_nodes.gathered(rhs, self._force, self.seen)
        over(divide, self.seen, self.light_nodes.axes, self._system, self.fixed, force, out)
        self.light_nodes.scatter(out)

    def divide_at(self, node: np.ndarray, rhs: np.ndarray) -> np.ndarray:
        """What `solve` gives at some nodes that are not light, where all else is zero; shapes (C,), (C, dim)."""
        out = rhs / self._system[node, None]
        out[self.fixed[node]] = 0.0
        return np.asarray(out)


class KeptMass(LumpedMass):
    """Lumped masses of the start, which nodes that move with the material keep as finite elements do.

    Masses that are lumped anew leave nodes their velocities and change what these weigh. With those
    of the particles, ``v_p = sum_i phi_i v_i``, a lumped kinetic energy is

        1/2 sum_i m_i v_i^2 = 1/2 sum_p m_p (v_p^2 + sum_i phi_i (v_i - v_p)^2),

    and the last sum grows where new functions bring together nodes that differ in velocity: between
    bodies that collide. Constant masses leave the work of forces as all that changes it.

    Parameters
    ----------
    cutoff : float
        As of `LightNodes`.
    kept : ndarray
        Masses at the start [kg], shape (N,).
    """

    def __init__(self, fixed: np.ndarray, cutoff: float, kept: np.ndarray) -> None:
        super().__init__(fixed, LightNodes(cutoff, fixed))
        self.kept = kept
        self.m_i = self._system = kept

    def assemble(
        self, basis: Basis, p: Particles, m_i: np.ndarray, seen: list[np.ndarray] | None = None
    ) -> None:
        m_i[:] = self.kept
        super().assemble(basis, p, m_i, seen)


@lean
def divide(seen, axes, m_i, fixed, rhs, out):
    """``out = rhs / m_i`` on free components with mass."""
    for n in range(seen.shape[0]):
        for i in range(seen[n, 0], seen[n, 1]):
            for d in range(len(axes)):
                if not fixed[i, d]:
                    out[i, d] = rhs[i, d] / m_i[i] if m_i[i] > 0.0 else 0.0
