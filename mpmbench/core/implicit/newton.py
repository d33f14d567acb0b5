"""Newton's iteration for one step: residual, tangent, line search, and a stiffer second attempt."""

import math
from dataclasses import dataclass

import numpy as np

from mpmbench.core.errors import BrokeDown, NotConverged
from mpmbench.core.implicit import assembly, f_bar
from mpmbench.core.implicit.constraints import add_augmentation
from mpmbench.core.implicit.contact import WallContact
from mpmbench.core.implicit.ghost import add_ghost
from mpmbench.core.implicit.workspace import Workspace
from mpmbench.core.materials import Material
from mpmbench.core.matrix.blocks import factorise, product, whole
from mpmbench.core.state import State

# What each attempt adds to the tangent at the start, in Young's moduli.
STIFFENINGS = (0.0, 0.1, 1.0)
MOST_ITERATIONS = 30
PATIENCE = 8  # iterations without a smaller residual: then an attempt goes in circles
SHORTEST_STEP = 2.0**-12  # a Newton step that must be shortened more than this leads nowhere
# Below this fraction of a step, the line search takes the best that it has seen.
SHORTEST_SEARCH = 0.1
# From the second step on, the residual may grow by this factor; in the first one by any.
GROWTH = 2.0


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
        Consistent mass by blocks of the pattern [kg], shape (blocks,); lumped masses stand on the
        diagonal.
    """

    coefficient: float
    start: np.ndarray
    mass: np.ndarray


class Equations:
    """Residual and tangent of one step as functions of the increment du, shape (N, dim)."""

    def __init__(
        self, s: State, w: Workspace, external: np.ndarray, dt: float, inertia: Inertia | None
    ) -> None:
        assert w.pattern is not None
        self.s, self.w, self.external, self.inertia = s, w, external, inertia
        self.time = dt if inertia is not None else math.inf  # in statics only the order counts
        self.pattern = w.pattern
        dim = s.particles.dimension
        self.internal = np.zeros_like(external)
        self.blocks = np.zeros((len(self.pattern.column), dim, dim))
        self.fixed = s.fixed[self.pattern.active] & (w.held is None)
        X = s.initial_nodes[self.pattern.active]
        self.prescribed = np.where(self.fixed, s.loads.increment(X, s.time, dt), 0.0)
        self.contact: WallContact | None = None
        if s.loads.walls:
            self.contact = WallContact(s, self.pattern.active, self.fixed, self.prescribed)
            self.fixed, self.prescribed = self.contact.fixed, self.contact.prescribed
        self.young_modulus = max(map(young_modulus, s.bodies.materials))
        if w.held is not None:
            self.G = w.held.matrix(self.pattern, dim)
            wanted = s.loads.displacement(w.held.X, s.time + dt)
            self.wanted = wanted[w.held.point, w.held.component]

    def hold_still(self) -> None:
        """Let what is held make no step."""
        self.prescribed[:] = 0.0
        if self.w.held is not None:
            self.wanted = self.w.held.u[self.w.held.point, self.w.held.component]

    def meet(self, du: np.ndarray, residual: np.ndarray, reference: float) -> bool:
        """Let walls take and let go; whether that changed anything. The residual is brought up to date."""
        if self.contact is None:
            return False
        active, before = self.pattern.active, self.contact.force
        changed = self.contact.meet(du[active], -residual[active], reference)
        residual[active] += self.contact.force - before
        self.fixed, self.prescribed = self.contact.fixed, self.contact.prescribed
        return changed

    def left(self, du: np.ndarray) -> np.ndarray:
        """Increments that the fixed components have yet to make [m], shape (A, dim)."""
        return np.where(self.fixed, self.prescribed - du[self.pattern.active], 0.0)

    def multiplier(self) -> np.ndarray | None:
        """Forces at the held points, shape (C,)."""
        return None if self.w.held is None else self.w.held.multiplier.copy()

    def start_again(self, multiplier: np.ndarray | None) -> None:
        """Set the forces at the held points back."""
        if self.w.held is not None and multiplier is not None:
            self.w.held.multiplier = multiplier.copy()

    def gap(self, du: np.ndarray) -> np.ndarray:
        """Displacements of the held points less those that are wanted [m], shape (C,)."""
        held = self.w.held
        assert held is not None
        moved = np.asarray(self.G @ du[self.pattern.active].ravel())
        return held.u[held.point, held.component] + moved - self.wanted

    def residual(self, du: np.ndarray) -> np.ndarray | None:
        """``f_ext - f_int - M a`` less the forces at held points [N], shape (N, dim).

        None when a particle is inside out. The tangent at the same increment is left in `blocks`.
        """
        p, w, pattern = self.s.particles, self.w, self.pattern
        self.internal[:], self.blocks[:] = 0.0, 0.0
        start = assembly.Start(p.V0, p.F, p.state, self.time)
        iterate = assembly.Iterate(w.F, w.state, w.tau)
        tangent = pattern.slot, self.blocks
        sums = w.phi, start, du, iterate, self.internal, *tangent
        if w.cells is not None:
            inverted = f_bar.equilibrium(self.s.law, *sums, w.cells) >= 0
        else:
            bodies = self.s.bodies.laws
            inverted = any(assembly.equilibrium(one.law, *own, *sums) >= 0 for one, *own in bodies)
        if inverted:
            return None
        residual = self.external - self.internal
        if self.contact is not None:
            residual[pattern.active] += self.contact.force
        if w.ghost is not None:
            stiffness = self.s.choices.ghost_stiffness * self.young_modulus
            ghost = np.zeros_like(residual)
            cells = w.ghost.point, w.ghost.laplace
            add_ghost(w.phi, *cells, stiffness, du, ghost, *tangent)
            residual -= ghost
        if self.inertia is not None:
            a = (self.inertia.coefficient * du + self.inertia.start)[pattern.active]
            mass = self.inertia.mass
            residual[pattern.active] -= product(
                pattern.start, pattern.column, mass, pattern.lower, a
            )
            for d in range(du.shape[1]):
                self.blocks[:, d, d] += self.inertia.coefficient * mass
        if w.held is not None:
            slot = pattern.slot[len(p.x) :]
            held = w.held.phi, w.held.point, w.held.component
            add_augmentation(*held, self.young_modulus, slot, self.blocks)
            residual[pattern.active] -= (self.G.T @ w.held.multiplier).reshape(-1, du.shape[1])
        return residual

    def stiffen(self, stiffening: float) -> None:
        """Add the stiffness of a Laplacian, in Young's moduli, to the tangent only."""
        stiffness = stiffening * self.young_modulus
        assembly.add_laplacian(
            self.w.phi, self.s.particles.V0, stiffness, self.pattern.slot, self.blocks
        )

    def correction(self, du: np.ndarray, residual: np.ndarray) -> np.ndarray:
        """``K^-1 r``, shape (N, dim); multipliers are brought up to date."""
        try:
            solve = factorise(self.pattern, self.blocks, self.fixed, self.w.memory)
        except BrokeDown as failure:
            if self.s.choices.on_body or self.w.ghost is not None:
                raise
            raise BrokeDown(f"{failure} (method.ghost_stiffness > 0 helps)") from None
        left = self.left(du)
        right = residual[self.pattern.active].ravel()
        if left.any():
            right = right - whole(self.pattern, self.blocks) @ left.ravel()
        if self.w.held is not None:
            right = right - self.young_modulus * (self.G.T @ self.gap(du))
            change, response = solve(right), solve(self.G.T.toarray())
            force = np.linalg.solve(self.G @ response, self.G @ change + self.gap(du))
            self.w.held.multiplier = self.w.held.multiplier + force
            change -= response @ force
        else:
            change = solve(right)
        out = np.zeros_like(residual)
        out[self.pattern.active] = change.reshape(-1, residual.shape[1]) + left
        return out

    def reference(self, du: np.ndarray, residual: np.ndarray) -> float:
        """The force that residuals are compared with [N]: the external, or else the largest one."""
        external = float(np.linalg.norm(self.external))
        return external or max(self.size(du, residual), float(np.linalg.norm(self.internal))) or 1.0

    def size(self, du: np.ndarray, residual: np.ndarray) -> float:
        """Norm of the residual without reactions, and of gaps times Young's modulus [N]."""
        norm = float(np.linalg.norm(residual[self.pattern.active][~self.fixed]))
        norm = float(np.hypot(norm, self.young_modulus * np.linalg.norm(self.left(du))))
        if self.w.held is not None:
            norm = float(np.hypot(norm, self.young_modulus * np.linalg.norm(self.gap(du))))
        return norm


def young_modulus(material: Material) -> float:
    """Young's modulus [Pa], by which stiffnesses of walls, held points and empty cells are measured."""
    lame, shear = material.lame_parameters()
    return float(shear * (3.0 * lame + 2.0 * shear) / (lame + shear))


def equilibrate(s: State, equations: Equations) -> tuple[np.ndarray, np.ndarray]:
    """Newton's iteration from rest: the increment [m] and the residual [N], shapes (N, dim).

    Where it fails it starts again with a stiffer tangent. Norms relative to the external force are
    recorded.

    Raises
    ------
    NotConverged
        When the residual does not reach the tolerance.
    """
    multiplier = equations.multiplier()
    du = np.zeros_like(equations.external)
    for stiffening in STIFFENINGS:
        du[:] = 0.0
        norms: list[float] = []
        equations.start_again(multiplier)
        try:
            residual = newton(s, equations, du, stiffening, norms)
        except NotConverged:
            if stiffening == STIFFENINGS[-1]:
                equations.start_again(multiplier)
                s.record("newton_residual", np.array(norms))
                raise
        else:
            if stiffening:
                s.record("stiffened_at", s.time)
            s.record("newton_residual", np.array(norms))
            return du, residual
    raise AssertionError("the last attempt returns or raises")


def newton(
    s: State, equations: Equations, du: np.ndarray, stiffening: float, norms: list[float]
) -> np.ndarray:
    """Newton's iteration; returns the residual.

    A step that turns a particle inside out is halved; so is one that makes the residual grow,
    except the first: a rotation makes membrane stress, which the second step removes. Relative
    norms on the way are added to `norms`.

    A particle at the apex of a yield surface has no stiffness, and nodes that only it holds are
    thrown far away. With `stiffening` the tangent has more, in proportion to the residual, so that
    the last steps are Newton's own and converge quadratically (Fan and Yuan 2005, on the
    Levenberg-Marquardt method).
    """
    residual = equations.residual(du)
    if residual is None:
        raise NotConverged("a particle is inside out before the first step of Newton's iteration")
    reference = equations.reference(du, residual)
    norms.append(equations.size(du, residual) / reference)
    since = 1  # what walls hold is the same since this iteration
    while True:
        iterations = len(norms) - 1
        if iterations > 0 or norms[-1] <= s.choices.residual_tolerance:
            if equations.meet(du, residual, reference):
                norms[-1], since = equations.size(du, residual) / reference, len(norms)
            elif norms[-1] <= s.choices.residual_tolerance:
                return residual
        best = since - 1 + int(np.argmin(norms[since:] or [0.0]))
        if iterations == MOST_ITERATIONS or iterations - best > PATIENCE:
            raise NotConverged(
                f"Newton's iteration: residual {norms[-1]:.2e} of the external force after "
                f"{iterations} iterations; {s.choices.residual_tolerance:.1e} is wanted"
            )
        if stiffening:
            equations.stiffen(stiffening * min(1.0, norms[-1]))
        change = equations.correction(du, residual)
        grow = s.choices.line_search and len(norms) > 1
        allowed = (1.0 if stiffening else GROWTH) * norms[-1] * reference if grow else np.inf
        residual = search_line(equations, du, change, allowed)
        norms.append(equations.size(du, residual) / reference)


def search_line(
    equations: Equations, du: np.ndarray, change: np.ndarray, allowed: float
) -> np.ndarray:
    """Add so much of `change` to `du` that the residual, which is returned, is `allowed` [N]."""
    fraction, best, best_size = 1.0, 0.0, np.inf
    start = du.copy()
    while True:
        du[:] = start + fraction * change
        residual = equations.residual(du)
        size = np.inf if residual is None else equations.size(du, residual)
        if residual is not None and size <= allowed:
            return residual
        if size < best_size:
            best, best_size = fraction, size
        if best > 0.0 and fraction < SHORTEST_SEARCH:
            du[:] = start + best * change
            residual = equations.residual(du)
            assert residual is not None
            return residual
        if fraction < SHORTEST_STEP:
            raise NotConverged(
                "Newton's iteration: every step along its direction turns a particle inside out"
            )
        fraction *= 0.5
