"""Before and after Newton's iteration: functions and pattern, and what particles take over."""

import numpy as np

from mpmbench.core.bases.handle import Stencils, fill
from mpmbench.core.implicit import assembly
from mpmbench.core.implicit.constraints import HeldPoints
from mpmbench.core.implicit.ghost import ghost_of
from mpmbench.core.implicit.workspace import Workspace
from mpmbench.core.matrix.pattern import build_pattern
from mpmbench.core.state import State


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
    w.F[:], w.state[:] = p.F, p.state
    if w.ghost_grid is not None:
        w.ghost = w.ghost_grid.cells(w.phi)
    size = np.where((p.V0 > 0.0) | (w.ghost is not None), w.phi.size, 0)  # tracers hold nothing
    index = w.phi.index
    if w.held is not None:
        w.held.phi = s.basis.evaluate(w.held.x)
        size, index = np.append(size, w.held.phi.size), _stacked(index, w.held.phi.index)
    same = (
        w.pattern is not None
        and np.array_equal(size, w.pattern_of[0])
        and np.array_equal(index, w.pattern_of[1])
    )
    if not same:
        w.pattern = build_pattern(size, index, s.basis.nodes, s.material.symmetric_tangent)
        w.pattern_of = size, index.copy()
    return w


def _stacked(above: np.ndarray, below: np.ndarray) -> np.ndarray:
    """Two lists of node numbers as one, the narrower one padded."""
    width = max(above.shape[1], below.shape[1])
    return np.vstack(
        [np.pad(part, ((0, 0), (0, width - part.shape[1]))) for part in (above, below)]
    )


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
        s.basis.move(du)
    return moved


def carry_tracers(s: State, w: Workspace, moved: np.ndarray) -> None:
    """Let tracers with a node outside the system follow the deformation at the nearest particle."""
    p = s.particles
    assert w.pattern is not None
    for t in range(len(p.x) - p.tracers, len(p.x)):
        seen = w.phi.index[t, : w.phi.size[t]][np.abs(w.phi.phi[t, : w.phi.size[t]]) > 1e-12]
        if np.all(w.pattern.row[seen] >= 0):
            continue
        near = int(np.argmin(np.linalg.norm(p.x[p.material] - p.x[t], axis=1)))
        increment = w.F[near] @ np.linalg.inv(p.F[near])
        moved[t] = moved[near] + (increment - np.eye(p.dimension)) @ (p.x[t] - p.x[near])


def reaction(s: State, w: Workspace, residual: np.ndarray) -> np.ndarray:
    """Sum of the forces that hold nodes or points [N], shape (dim,)."""
    if w.held is None:
        return -np.sum(residual * s.fixed, axis=0)
    return -np.bincount(w.held.component, w.held.multiplier, minlength=s.particles.dimension)
