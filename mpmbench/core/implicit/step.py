"""One implicit step: shape functions and pattern, Newton's iteration, and what the particles take from the nodes."""

from dataclasses import dataclass, field

import numpy as np

from mpmbench.core.bases.handle import Stencils
from mpmbench.core.bases.tensor import fill
from mpmbench.core.errors import NotConverged
from mpmbench.core.implicit import assembly
from mpmbench.core.implicit.constraints import HeldPoints, add_penalty
from mpmbench.core.implicit.ghost import GhostCells, GhostGrid, add_ghost
from mpmbench.core.implicit.linear import factorise, product
from mpmbench.core.implicit.pattern import Pattern, build_pattern
from mpmbench.core.state import State

SHORTEST_STEP = 2.0**-12  # a Newton step that must be shortened more than this leads nowhere
GROWTH = 2.0  # from the second step on, the residual may grow by this factor; the first one may do as it likes


@dataclass
class Inertia:
    """Newmark's accelerations ``a = coefficient du + start`` and the mass that they act on.

    Attributes
    ----------
    coefficient : float
        ``1 / (zeta dt^2)`` [1/s^2].
    start : ndarray
        The part that does not depend on the increment [m/s^2], shape (N, dim).
    mass : ndarray
        Consistent mass by blocks of the pattern [kg], shape (blocks,); lumped masses stand on the diagonal.
    """

    coefficient: float
    start: np.ndarray
    mass: np.ndarray


@dataclass
class Workspace:
    """What stays allocated between the steps of a run.

    Attributes
    ----------
    phi : Stencils
        Shape functions at the start of the step.
    F, state, tau : ndarray
        Deformation gradients, history and Kirchhoff stresses of the current iterate.
    held : HeldPoints or None
        Dirichlet conditions at points; without them, nodes are held directly.
    """

    phi: Stencils
    F: np.ndarray
    state: np.ndarray
    tau: np.ndarray
    pattern: Pattern | None = None
    ghost_grid: GhostGrid | None = None
    ghost: GhostCells | None = None
    held: HeldPoints | None = None
    pattern_of: tuple[np.ndarray, np.ndarray] = field(default_factory=lambda: (np.zeros(0), np.zeros(0)))


def prepare(s: State) -> Workspace:
    """Find the shape functions at the start of the step, and the pattern of the matrix unless it has not changed."""
    p = s.particles
    s.basis.locate(p.x)
    w: Workspace | None = s.workspace
    if w is None:
        width = s.basis.evaluate(p.x[:1]).index.shape[1]
        w = Workspace(Stencils.empty(len(p.x), width, p.dimension), p.F.copy(), p.state.copy(), p.sigma.copy())
        if s.choices.ghost_stiffness > 0.0:
            w.ghost_grid = GhostGrid(s.basis)
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
    same = w.pattern is not None and np.array_equal(size, w.pattern_of[0]) and np.array_equal(index, w.pattern_of[1])
    if not same:
        w.pattern = build_pattern(size, index, s.basis.nodes, s.material.symmetric_tangent)
        w.pattern_of = size, index.copy()
    return w


def _stacked(above: np.ndarray, below: np.ndarray) -> np.ndarray:
    """Two lists of node numbers as one, the narrower one padded."""
    width = max(above.shape[1], below.shape[1])
    return np.vstack([np.pad(part, ((0, 0), (0, width - part.shape[1]))) for part in (above, below)])


def external_force(s: State, w: Workspace, time: float) -> np.ndarray:
    """Body force and point loads at `time` [s], shape (N, dim); the body force is left in ``particles.b``."""
    p, force = s.particles, np.zeros_like(s.nodes.v)
    if s.loads.body_force is not None:
        s.loads.body_force(p.X, time, p.b)
        assembly.project(w.phi, p.m, p.b, force)
    if s.loads.traction is not None:
        for row, load in zip(s.traction_particle, s.loads.traction(time), strict=True):
            k = w.phi.size[row]
            force[w.phi.index[row, :k]] += w.phi.phi[row, :k, None] * load
    return force


class Equations:
    """Residual and tangent of one step as functions of the increment du, shape (N, dim)."""

    def __init__(self, s: State, w: Workspace, external: np.ndarray, dt: float, inertia: Inertia | None) -> None:
        assert w.pattern is not None
        self.s, self.w, self.external, self.inertia = s, w, external, inertia
        self.pattern = w.pattern
        dim = s.particles.dimension
        self.internal = np.zeros_like(external)
        self.blocks = np.zeros((len(self.pattern.column), dim, dim))
        self.fixed = s.fixed[self.pattern.active] & (w.held is None)
        lame, shear = s.material.lame_parameters()
        self.young_modulus = shear * (3.0 * lame + 2.0 * shear) / (lame + shear)
        if w.held is not None:
            self.G = w.held.matrix(self.pattern, dim)
            self.wanted = self._prescribed(s.time + dt)
            self.penalty = self.young_modulus * (s.choices.penalty if s.choices.dirichlet == "penalty" else 1.0)

    def _prescribed(self, time: float) -> np.ndarray:
        """Displacements that the held points should have [m], shape (C,)."""
        held, motion = self.w.held, self.s.loads.prescribed_motion
        assert held is not None
        if motion is None:
            return np.zeros(len(held.point))
        return motion(held.X, time)[held.point, held.component]

    def gap(self, du: np.ndarray) -> np.ndarray:
        """Displacements of the held points less those that are wanted [m], shape (C,)."""
        held = self.w.held
        assert held is not None
        moved = np.asarray(self.G @ du[self.pattern.active].ravel())
        return held.u[held.point, held.component] + moved - self.wanted

    def residual(self, du: np.ndarray) -> np.ndarray | None:
        """``f_ext - f_int - M a`` less the forces at held points, at all nodes [N]; None when a particle is inverted.

        The tangent at the same increment is left in `blocks`.
        """
        p, w, pattern = self.s.particles, self.w, self.pattern
        self.internal[:], self.blocks[:] = 0.0, 0.0
        iterate = w.F, w.state, w.tau, self.internal
        inverted = assembly.equilibrium(
            self.s.law, w.phi, p.V0, p.F, p.state, du, *iterate, True, pattern.slot, self.blocks
        )
        if inverted >= 0:
            return None
        residual = self.external - self.internal
        if w.ghost is not None:
            stiffness = self.s.choices.ghost_stiffness * self.young_modulus
            ghost = np.zeros_like(residual)
            add_ghost(w.phi, w.ghost.point, w.ghost.laplace, stiffness, du, ghost, True, pattern.slot, self.blocks)
            residual -= ghost
        if self.inertia is not None:
            a = (self.inertia.coefficient * du + self.inertia.start)[pattern.active]
            mass = self.inertia.mass
            residual[pattern.active] -= product(pattern.start, pattern.column, mass, pattern.lower, a)
            for d in range(du.shape[1]):
                self.blocks[:, d, d] += self.inertia.coefficient * mass
        if w.held is not None:
            slot = pattern.slot[len(p.x) :]
            add_penalty(w.held.phi, w.held.point, w.held.component, self.penalty, slot, self.blocks)
            if self.s.choices.dirichlet == "penalty":
                w.held.multiplier = self.penalty * self.gap(du)
            residual[pattern.active] -= (self.G.T @ w.held.multiplier).reshape(-1, du.shape[1])
        return residual

    def correction(self, du: np.ndarray, residual: np.ndarray) -> np.ndarray:
        """``K^-1 r``, shape (N, dim); multipliers are brought up to date."""
        solve = factorise(self.pattern, self.blocks, self.fixed)
        right = residual[self.pattern.active].ravel()
        if self.w.held is not None and self.s.choices.dirichlet == "multipliers":
            # the penalty G^T G in the matrix changes nothing on the constraint, and makes it definite
            right = right - self.penalty * (self.G.T @ self.gap(du))
            change, response = solve(right), solve(self.G.T.toarray())
            force = np.linalg.solve(self.G @ response, self.G @ change + self.gap(du))
            self.w.held.multiplier = self.w.held.multiplier + force
            change -= response @ force
        else:
            change = solve(right)
        out = np.zeros_like(residual)
        out[self.pattern.active] = change.reshape(-1, residual.shape[1])
        return out

    def size(self, du: np.ndarray, residual: np.ndarray) -> float:
        """Norm of the residual without the reactions, and of the gaps times Young's modulus [N]."""
        norm = float(np.linalg.norm(residual[self.pattern.active][~self.fixed]))
        if self.w.held is not None and self.s.choices.dirichlet == "multipliers":
            norm = float(np.hypot(norm, self.young_modulus * np.linalg.norm(self.gap(du))))
        return norm


def equilibrate(s: State, equations: Equations, du: np.ndarray) -> np.ndarray:
    """Newton's iteration from the increment `du`, which holds the prescribed motion; returns the residual.

    A step that turns a particle inside out is halved; so is one that makes the residual grow, except the first: a
    rotation makes membrane stress, which the second step removes. Norms relative to the external force are recorded.

    Raises
    ------
    NotConverged
        When the residual does not reach the tolerance.
    """
    residual = equations.residual(du)
    if residual is None:
        raise NotConverged("the prescribed motion of this step turns a particle inside out")
    norms = [equations.size(du, residual)]
    reference = float(np.linalg.norm(equations.external)) or max(norms[0], float(np.linalg.norm(equations.internal)))
    limit = s.choices.residual_tolerance * reference
    while norms[-1] > limit:
        if len(norms) > s.choices.max_iterations:
            s.record("newton_residual", np.array(norms) / reference)
            raise NotConverged(
                f"Newton's iteration: residual {norms[-1] / reference:.2e} of the external force after "
                f"{s.choices.max_iterations} iterations; {s.choices.residual_tolerance:.1e} is wanted"
            )
        change = equations.correction(du, residual)
        residual = search_line(equations, du, change, norms)
        norms.append(equations.size(du, residual))
    s.record("newton_residual", np.array(norms) / reference)
    return residual


def search_line(equations: Equations, du: np.ndarray, change: np.ndarray, norms: list[float]) -> np.ndarray:
    """Add as much of `change` to `du` as is safe; returns the residual there."""
    allowed = np.inf if len(norms) == 1 or not equations.s.choices.line_search else GROWTH * norms[-1]
    fraction = 1.0
    du += change
    while True:
        residual = equations.residual(du)
        if residual is not None and (equations.size(du, residual) <= allowed or fraction < 0.1):
            return residual
        if fraction < SHORTEST_STEP:
            raise NotConverged("Newton's iteration: every step along its direction turns a particle inside out")
        fraction *= 0.5
        du -= fraction * change


def convect(s: State, w: Workspace, du: np.ndarray) -> np.ndarray:
    """Particles take over the converged state and move; nodes follow where they belong to the material.

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
    """Tracers with a node outside the system follow the nearest particle and its deformation instead."""
    p = s.particles
    assert w.pattern is not None
    for t in range(len(p.x) - p.tracers, len(p.x)):
        seen = w.phi.index[t, : w.phi.size[t]][np.abs(w.phi.phi[t, : w.phi.size[t]]) > 1e-12]
        if np.all(w.pattern.row[seen] >= 0):
            continue
        near = int(np.argmin(np.linalg.norm(p.x[p.material] - p.x[t], axis=1)))
        increment = w.F[near] @ np.linalg.inv(p.F[near])
        moved[t] = moved[near] + (increment - np.eye(p.dimension)) @ (p.x[t] - p.x[near])


def start_increment(s: State, dt: float) -> np.ndarray:
    """Increment of displacement that Newton starts from [m], shape (N, dim): zero but for the prescribed motion."""
    du = np.zeros_like(s.nodes.v)
    motion = s.loads.prescribed_motion
    if motion is not None and s.choices.dirichlet == "direct":
        change = motion(s.initial_nodes, s.time + dt) - motion(s.initial_nodes, s.time)
        du[s.fixed] = change[s.fixed]
    return du


def reaction(s: State, w: Workspace, residual: np.ndarray) -> np.ndarray:
    """Sum of the forces that hold nodes or points [N], shape (dim,)."""
    if w.held is None:
        return -np.sum(residual * s.fixed, axis=0)
    return -np.bincount(w.held.component, w.held.multiplier, minlength=s.particles.dimension)


def work_of_loads(s: State, before: np.ndarray, moved: np.ndarray, dt: float) -> float:
    """Work of body force and point loads in a step by the trapezoidal rule [J]; `before` is the old body force."""
    p = s.particles
    work = 0.5 * float(np.sum(p.m[:, None] * (before + p.b) * moved))
    if s.loads.traction is not None:
        load = s.loads.traction(s.time) + s.loads.traction(s.time + dt)
        work += 0.5 * float(np.sum(load * moved[s.traction_particle]))
    return work
