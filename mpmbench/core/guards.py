"""What is looked at after each step: positions, volumes, and points without mass."""

import numpy as np

from mpmbench.core.bases.handle import Stencils
from mpmbench.core.compiled import threads
from mpmbench.core.energies import first_bad_volume
from mpmbench.core.errors import BrokeDown, Diverged
from mpmbench.core.state import State
from mpmbench.core.transfer.parts import NOTHING

STEEP = 1e3  # gradients of functions, over the nodal spacing, that explain a lost volume


def guard(s: State) -> None:
    """End a run that has gone wrong.

    Points without mass end nothing: those that have left the nodes are put back.

    Raises
    ------
    Diverged
        When a position, volume or other data of a particle is not finite.
    BrokeDown
        When a volume is not positive or a particle is outside the basis.
    """
    p, fine = s.particles, s.watched is not NOTHING and s.bad == 0
    s.bad = None
    if not fine:
        guard_volumes(s)
    for name, array in p.data.items():
        if not np.isfinite(array[p.material]).all():
            bad = int(np.argmin(np.isfinite(array).reshape(len(array), -1).all(axis=1)))
            raise Diverged(f"{name} of particle {bad} is not finite")
    if not fine:
        guard_places(s)


def guard_volumes(s: State) -> None:
    """Look for volumes that are not finite or not positive."""
    p = s.particles
    bad = threads.first(threads.run(lambda c, *part: first_bad_volume(p.V, p.V0, *part), len(p.V)))
    if bad >= 0:
        if not np.isfinite(p.V[bad]):
            raise Diverged(f"the volume of particle {bad} is not finite")
        raise BrokeDown(
            f"particle {bad} has the volume {p.V[bad]:.3g}, which is not positive"
            f"{s.choices.circumstances(s)}{steepness(s, bad)}"
        )


def guard_places(s: State) -> None:
    """Look for particles that have left the basis, and put those without mass back."""
    p, solid = s.particles, s.particles.material
    bad = s.basis.first_outside(p.x)
    if 0 <= bad < solid.stop:
        if not np.isfinite(p.x[bad]).all():
            raise Diverged(f"the position of particle {bad} is not finite")
        raise BrokeDown(
            f"particle {bad} at {p.x[bad]} m has lost its basis: it left the nodes' domain"
            f"{s.choices.circumstances(s)}"
        )
    if bad >= solid.stop:
        put_back(s)


def steepness(s: State, particle: int) -> str:
    """That the functions of a particle were all but discontinuous when its volume was lost, if so.

    At the straight edge of a hull max-ent functions are those of its nodes; if these bend it by b,
    one of them is a corner, where its function is 1. In between the gradient is about 1/b.
    """
    phi = s.basis.handle
    if not isinstance(phi, Stencils) or s.geometry is None:
        return ""
    gradients = np.abs(phi.grad_phi[particle, : phi.size[particle]])
    steepest = float(gradients.max(initial=0.0)) * s.geometry.nodal_spacing
    if not steepest > STEEP:
        return ""
    return (
        f"; its functions had gradients of {steepest:.1e} over the nodal spacing, which have no bound "
        "next to the hull of nodes that bend it"
    )


def put_back(s: State) -> None:
    """Put massless points outside the nodes on the way to their nearest particles, just inside."""
    p = s.particles
    for t in range(p.material.stop, len(p.x)):
        near = p.x[np.argmin(np.linalg.norm(p.X[p.material] - p.X[t], axis=1))]
        if not np.isfinite(p.x[t]).all():
            p.x[t] = near
        way = p.x[t] - near
        for fraction in (1.0, 0.5, 0.25, 0.125, 0.0):
            p.x[t] = near + fraction * way
            if s.basis.first_outside(p.x[t : t + 1]) < 0:
                break
