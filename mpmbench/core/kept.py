"""Masses of nodes at the start, which they may keep: each body's on its own nodes, whoever sees them later."""

import numpy as np

from mpmbench.core.bases import Basis
from mpmbench.core.particles import Particles
from mpmbench.core.transfer.sums import p2g_mass


def masses_of_start(functions: Basis, p: Particles) -> np.ndarray:
    """Lumped masses of the nodes of these functions [kg], shape (N,), where the particles are now."""
    m_i = np.zeros(len(functions.nodes))
    functions.follow(p)
    functions.locate(p.x)
    p2g_mass(functions.handle, p.x, p.m, m_i)
    return m_i
