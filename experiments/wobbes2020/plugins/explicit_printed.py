"""The explicit time loop with an equation as it is printed, or with constraints as they are often imposed."""

from dataclasses import dataclass

import numpy as np

from mpmbench.core.bases import Basis
from mpmbench.core.loops.explicit import Explicit
from mpmbench.core.matrix.mass import Mass, make_mass
from mpmbench.core.particles import Particles
from mpmbench.core.registry import register
from mpmbench.core.state import State


@register("method", "explicit_eq99")
@dataclass(frozen=True)
class CompoundVolumes(Explicit):
    """Volumes ``V^{s+1} = det(F^{s+1}) V^s``, Wobbes et al. 2020, Eq. 99, where V^0 belongs."""

    def step(self, s: State, dt: float) -> None:
        """Do the explicit step, then multiply the volumes from before it."""
        before = s.particles.V.copy()
        super().step(s, dt)
        s.particles.V[:] = np.linalg.det(s.particles.F) * before


@register("method", "explicit_late_constraints")
@dataclass(frozen=True)
class LateConstraints(Explicit):
    """Constrained components are set to zero after the solve with the complete mass matrix."""

    def step(self, s: State, dt: float) -> None:
        """Do the explicit step with a mass matrix that knows no constraints."""
        if not isinstance(s.mass, CompleteMass):
            free = np.zeros_like(s.fixed)
            s.mass = CompleteMass(make_mass(self, free, s.basis, s.particles), s.fixed)
        super().step(s, dt)


class CompleteMass:
    """A mass matrix that keeps the rows and columns of constrained components (fulfils `Mass`)."""

    def __init__(self, complete: Mass, fixed: np.ndarray) -> None:
        self.complete, self.fixed = complete, fixed

    def assemble(self, basis: Basis, p: Particles, m_i: np.ndarray) -> None:
        """Sum the complete matrix."""
        self.complete.assemble(basis, p, m_i)

    def multiply(self, a: np.ndarray) -> np.ndarray:
        """``M a``."""
        return self.complete.multiply(a)

    def solve(self, rhs: np.ndarray, out: np.ndarray) -> None:
        """Solve for all components, then set the constrained ones to zero."""
        self.complete.solve(rhs, out)
        out[self.fixed] = 0.0
