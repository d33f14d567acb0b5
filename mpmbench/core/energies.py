"""What is added up over the particles for the history of a run and for its guard."""

from mpmbench.core.compiled import compiled, matrix
from mpmbench.core.materials import Material, energy_density
from mpmbench.core.particles import FINITE, Particles


@compiled
def strain_energy(law, axes, F, state, V0):
    """Stored energy of all particles [J]."""
    total = 0.0
    F_p = matrix(axes, axes)
    for p in range(F.shape[0]):
        if V0[p] > 0.0:
            for d in range(len(axes)):
                for e in range(len(axes)):
                    F_p[d, e] = F[p, d, e]
            total += V0[p] * energy_density(law, axes, F_p, state[p])
    return total


@compiled
def kinetic_energy(m, v):
    """``sum_p m_p |v_p|^2 / 2`` of particles, or of nodes with lumped masses [J]."""
    total = 0.0
    for p in range(v.shape[0]):
        for d in range(v.shape[1]):
            total += 0.5 * m[p] * v[p, d] * v[p, d]
    return total


def dissipated_energy(material: Material, p: Particles, own: slice = slice(None)) -> float:
    """What the material of the particles `own` has lost so far [J], of which its history keeps account; else 0."""
    if material.dissipated is None:
        return 0.0
    return float(p.V0[own] @ p.state[own, material.dissipated])


@compiled
def first_bad_volume(V, V0, start, stop):
    """Number of the first of the particles start to stop whose volume is not positive and finite, or -1."""
    V, V0 = V[start:stop], V0[start:stop]
    bad = 0
    for p in range(V.shape[0]):  # in vector instructions
        bad += V0[p] > 0.0 and not (0.0 < V[p] < FINITE)
    if bad > 0:
        for p in range(V.shape[0]):
            if V0[p] > 0.0 and not (0.0 < V[p] < FINITE):
                return start + p
    return -1
