"""Before and after Newton's iteration: functions and pattern, and what particles take over."""

import numpy as np

from mpmbench.core.bases.handle import Stencils, fill
from mpmbench.core.compiled import compiled
from mpmbench.core.implicit import assembly
from mpmbench.core.implicit.constraints import HeldPoints
from mpmbench.core.implicit.f_bar import with_mean_pressure, with_same_functions
from mpmbench.core.implicit.ghost import ghost_of
from mpmbench.core.implicit.workspace import Workspace
from mpmbench.core.loads import external_force
from mpmbench.core.matrix.pattern import build_pattern
from mpmbench.core.state import State
from mpmbench.core.transfer.sums import p2g_mass


def prepare(s: State) -> Workspace:
    """Find the functions at the start of the step, and the pattern where it has changed."""
    p = s.particles
    s.basis.locate(p.x)
    w: Workspace | None = s.workspace
    if w is None:
        width = s.basis.evaluate(p.x[:1]).index.shape[1]
        w = Workspace(
            Stencils.empty(len(p.x), width, p.dimension), p.F.copy(), p.state.copy(), p.sigma.copy()
        )
        if s.choices.ghost_stiffness > 0.0:
            w.ghost_grid = ghost_of(s.basis)
        if s.choices.dirichlet != "direct" and s.fixed.any():
            w.held = HeldPoints.at_nodes(s.basis, s.fixed)
        s.workspace = w
    if isinstance(s.basis.handle, Stencils):
        w.phi = s.basis.handle
    else:
        fill(s.basis.handle, p.x, w.phi.size, w.phi.index, w.phi.phi, w.phi.grad_phi)
        if w.ghost_grid is None:
            drop_zeros(w.phi.size, w.phi.index, w.phi.phi, w.phi.grad_phi)
    w.F[:], w.state[:] = p.F, p.state
    if w.ghost_grid is not None:
        w.ghost = w.ghost_grid.cells(w.phi)
    size = np.where((p.V0 > 0.0) | (w.ghost is not None), w.phi.size, 0)  # tracers hold nothing
    index = w.phi.index
    if w.held is not None:
        if not s.choices.frozen:
            w.held.phi = s.basis.evaluate(w.held.x)
        size, index = np.append(size, w.held.phi.size), _stacked(index, w.held.phi.index)
    same = (
        w.pattern is not None
        and np.array_equal(size, w.pattern_of[0])
        and np.array_equal(index, w.pattern_of[1])
    )
    if not same:
        symmetric = all(one.symmetric_tangent for one in s.bodies.materials)
        w.pattern = build_pattern(size, index, s.basis.nodes, symmetric, w.pattern)
        w.pattern_of = size, index.copy()
        if s.choices.volumetric == "f_bar":
            w.cells = with_same_functions(np.where(p.V0 > 0.0, w.phi.size, 0), w.phi.index)
    return w


def _stacked(above: np.ndarray, below: np.ndarray) -> np.ndarray:
    """Two lists of node numbers as one, the narrower one padded."""
    width = max(above.shape[1], below.shape[1])
    return np.vstack(
        [np.pad(part, ((0, 0), (0, width - part.shape[1]))) for part in (above, below)]
    )


@compiled
def drop_zeros(size, index, phi, grad_phi):
    """Leave out functions that vanish at a point with their gradients: on the corners of cells.

    A node that only such points see would have neither stiffness nor mass.
    """
    for p in range(size.shape[0]):
        kept = 0
        for k in range(size[p]):
            if phi[p, k] != 0.0 or np.any(grad_phi[p, k] != 0.0):
                index[p, kept], phi[p, kept] = index[p, k], phi[p, k]
                grad_phi[p, kept] = grad_phi[p, k]
                kept += 1
        size[p] = kept


def apply_loads(s: State, w: Workspace, time: float) -> None:
    """Write the external force at `time` [s]; at nodes that no particle holds it goes to neighbours."""
    p, n = s.particles, s.nodes
    external_force(s, w.phi, time, n.f_external)
    if s.loads.traction is not None and not s.choices.on_body:
        n.m[:] = 0.0
        p2g_mass(w.phi, p.x, p.m, n.m)
        s.mass.assemble(s.basis, p, n.m)
        s.mass.light_nodes.gather(n.f_external)


def given_by_mapping(
    s: State, w: Workspace, old: tuple[np.ndarray, np.ndarray], du: np.ndarray
) -> float:
    """Energy that a step has from accelerations that are not those of the forces at its start [J].

    The trapezoidal rule keeps energy because it takes half of the momentum from the forces at the
    start, ``M a = f``. Accelerations that are mapped from particles (Iaconeta 2017, Eq. 41) are others,
    and the step is given ``du . (M a - f) / 2``: where bodies meet, a good part of what moves.

    Parameters
    ----------
    old : pair of ndarray
        Accelerations [m/s2] and forces [N] of loads and walls on the nodes at the start, each of shape (N, dim).
    """
    p, (a, f_external) = s.particles, old
    if s.choices.mass == "lumped":
        inertia = float(s.nodes.m @ np.sum(a * du, axis=1))
    else:
        carried, moved = np.zeros_like(p.x), np.zeros_like(p.x)
        assembly.interpolate(w.phi, a, carried)
        assembly.interpolate(w.phi, du, moved)
        inertia = float(p.m @ np.sum(carried * moved, axis=1))
    sigma = p.sigma if w.cells is None else with_mean_pressure(s, w.cells)
    work = float(np.sum(f_external * du)) - assembly.internal_work(w.phi, p.V, sigma, du)
    return 0.5 * (inertia - work)


def convect(s: State, w: Workspace, du: np.ndarray) -> np.ndarray:
    """Move the particles in the converged state, and the nodes that belong to the material.

    Returns
    -------
    ndarray
        Displacements of the points in this step [m], shape (P, dim).
    """
    p = s.particles
    moved = np.zeros_like(p.x)
    assembly.interpolate(w.phi, du, moved)
    carry_tracers(s, w, moved)
    assembly.commit(s.axes, p.V0, w.F, w.state, w.tau, p.F, p.state, p.V, p.sigma)
    p.x += moved
    if w.held is not None:
        step = np.zeros_like(w.held.x)
        assembly.interpolate(w.held.phi, du, step)
        w.held.x += step
        w.held.u += step
    if s.choices.moving and not s.choices.frozen:
        s.basis.move(du if w.held is None else at_nodes(s, du))
    return moved


def at_nodes(s: State, du: np.ndarray) -> np.ndarray:
    """The field of the increments at the nodes [m], shape (N, dim): where functions do not interpolate, it is another.

    Conditions at points hold the field. Nodes that went by their own values would leave the points
    that they began at, and in the end the material: those under a sphere had come out of its plate.
    """
    field = np.zeros_like(du)
    assembly.interpolate(s.basis.evaluate(s.basis.nodes), du, field)
    return field


def carry_tracers(s: State, w: Workspace, moved: np.ndarray) -> None:
    """Let massless points on a grid follow the deformation at the nearest particle.

    At a free surface their own nodes are those that hardly any particle sees.
    """
    if s.choices.on_body:
        return
    p = s.particles
    for t in range(p.material.stop, len(p.x)):
        near = int(np.argmin(np.linalg.norm(p.x[p.material] - p.x[t], axis=1)))
        increment = w.F[near] @ np.linalg.inv(p.F[near])
        moved[t] = moved[near] + (increment - np.eye(p.dimension)) @ (p.x[t] - p.x[near])


def reaction(s: State, w: Workspace, residual: np.ndarray) -> np.ndarray:
    """Sum of the forces that hold nodes or points [N], shape (dim,)."""
    if w.held is None:
        return -np.sum(residual * s.fixed, axis=0)
    return -np.bincount(w.held.component, w.held.multiplier, minlength=s.particles.dimension)
