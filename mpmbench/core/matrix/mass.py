"""The lumped mass matrix, and the choice of a solver for the consistent one."""

from typing import Protocol

import numpy as np

from mpmbench.core.bases import Basis
from mpmbench.core.bases.handle import Stencils
from mpmbench.core.choices import Choices
from mpmbench.core.compiled import compiled
from mpmbench.core.matrix.band import BandMass, assemble_band
from mpmbench.core.matrix.mass_checks import refuse_too_few_particles, refuse_unseen_patterns
from mpmbench.core.matrix.sparse import DirectMass, SparseMass
from mpmbench.core.particles import Particles

# Beyond this band conjugate gradients cost less than a banded factorisation in every step.
WIDEST_BAND = 40
DIRECT_NODES = 40_000  # a constant matrix up to this size is factorised once


class Mass(Protocol):
    """A mass matrix that is assembled in every step and solved a few times.

    `fixed`, shape (N, dim), marks constrained components: their rows and columns leave the system,
    one component at a time. Degrees of freedom with a mass below `threshold` [kg] are left out too:
    near-empty cells otherwise break a consistent mass (the last active function is seen by one
    particle near the edge of its support).
    """

    def assemble(self, basis: Basis, p: Particles, m_i: np.ndarray) -> None:
        """Sum the matrix over the particles, whose row sums `m_i`, shape (N,), are known.

        Raises
        ------
        BrokeDown
            When the matrix is singular.
        """
        ...

    def solve(self, rhs: np.ndarray, out: np.ndarray) -> None:
        """Solve ``M out = rhs`` on the free components; `out` holds the others; shapes (N, dim)."""
        ...

    def multiply(self, a: np.ndarray) -> np.ndarray:
        """``M a``, shape (N, dim)."""
        ...


def mass_threshold(p: Particles, cutoff: float) -> float:
    """Nodal mass [kg] below which a node is left out: `cutoff` masses of the first particle."""
    return cutoff * float(p.m[0])


def make_mass(choices: Choices, fixed: np.ndarray, basis: Basis, p: Particles) -> Mass:
    """The mass matrix that the method asks for, with the solver that its size asks for."""
    threshold = mass_threshold(p, choices.mass_cutoff)
    # implicit loops sum a consistent mass into their tangent
    if choices.mass == "lumped" or choices.implicit:
        return LumpedMass(fixed, threshold)
    basis.locate(p.x)
    if choices.moving and isinstance(basis.handle, Stencils):
        refuse_unseen_patterns(basis, p, fixed)
    if assemble_band(basis.handle, p.x, p.m, np.zeros((len(fixed), 1))) <= WIDEST_BAND:
        refuse_too_few_particles(basis, p, fixed)
        return BandMass(fixed, threshold)
    if basis.constant_values and len(basis.nodes) <= DIRECT_NODES:
        return DirectMass(fixed, threshold)
    return SparseMass(fixed, threshold)


class LumpedMass:
    """Row-sum lumped mass (Wobbes 2020, Eq. 17)."""

    def __init__(self, fixed: np.ndarray, threshold: float) -> None:
        self.fixed, self.threshold = fixed, threshold
        self.m_i = np.zeros(len(fixed))

    def assemble(self, basis: Basis, p: Particles, m_i: np.ndarray) -> None:
        self.m_i = m_i

    def multiply(self, a: np.ndarray) -> np.ndarray:
        return self.m_i[:, None] * a

    def solve(self, rhs: np.ndarray, out: np.ndarray) -> None:
        divide(self.m_i, self.threshold, self.fixed, rhs, out)


@compiled
def divide(m_i, threshold, fixed, rhs, out):
    """``out = rhs / m_i`` on free components with mass."""
    for i in range(rhs.shape[0]):
        for d in range(rhs.shape[1]):
            if not fixed[i, d]:
                out[i, d] = rhs[i, d] / m_i[i] if m_i[i] > threshold else 0.0
