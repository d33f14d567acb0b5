"""Walls in implicit steps: which nodes they hold is found together with the displacements.

A node is open, sticks or slides. What it is follows from the iterate (semi-smooth Newton's method):
an open node that has passed the wall is held on it; a held one that the wall would have to pull is
let go; one whose friction exceeds the bound slides, and one that slides back with its friction
sticks. Walls are normal to an axis, so that what they hold are components. On a wall where nothing
slides a step may have no solution (open, the node passes; held by all its components, it is
pulled): what such a wall has taken in a step it lets go in the next.
"""

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from mpmbench.core.state import State

OPEN, STICKS, SLIDES = 0, 1, 2
ROUNDING = 1e-10  # of the force that residuals are compared with, and of the nodal spacing
SLID = 1e-6  # a node with so little friction to spare has slid


class WallContact:
    """The nodes that walls hold in one step.

    Parameters
    ----------
    s : State
    active : ndarray of int
        Numbers of the nodes that have equations, shape (A,).
    fixed : ndarray of bool
        Components that the problem holds, shape (A, dim).
    prescribed : ndarray
        Their increments [m], shape (A, dim).

    Attributes
    ----------
    fixed, prescribed : ndarray
        The same, with what the walls hold.
    force : ndarray
        Friction of nodes that slide [N], shape (A, dim).
    """

    def __init__(
        self, s: "State", active: np.ndarray, fixed: np.ndarray, prescribed: np.ndarray
    ) -> None:
        walls, self.active = s.walls, active
        self.friction = walls.friction
        self.axis = np.abs(walls.normal).argmax(axis=1)
        self.sign = walls.normal[np.arange(len(self.axis)), self.axis]
        self.gap = walls.gap(s.basis.nodes)[:, active]
        spacing = s.geometry.nodal_spacing if s.geometry is not None else 1.0
        self.near = ROUNDING * spacing
        self.held_before, self.prescribed_before = fixed, prescribed
        self.force = np.zeros(fixed.shape)
        self.direction = np.zeros((len(self.axis), *fixed.shape))
        self.taken = np.zeros((len(self.axis), len(active)), dtype=bool)
        self._remember(walls.nodal_impulse[:, active] / max(s.time_step, 1e-300))
        self.hold()

    def _remember(self, force: np.ndarray) -> None:
        """Begin with what the walls did in the last step [N], shape (W, A, dim)."""
        held = force.any(axis=2)
        self.state = np.where(held, np.where(self.friction > 0.0, STICKS, SLIDES)[:, None], OPEN)
        for w in np.flatnonzero(np.isfinite(self.friction)):
            along = force[w] * (np.arange(force.shape[2]) != self.axis[w])
            size = np.linalg.norm(along, axis=1)
            bound = self.friction[w] * np.abs(force[w, :, self.axis[w]])
            slid = (size > 0.0) & (size >= (1.0 - SLID) * bound)
            self.state[w, slid] = SLIDES
            self.direction[w, slid] = along[slid] / size[slid, None]
            self.force[slid] += along[slid]

    def hold(self) -> None:
        """Hold the components of the nodes that are not open."""
        self.fixed, self.prescribed = self.held_before.copy(), self.prescribed_before.copy()
        for w, axis in enumerate(self.axis):
            held = (self.state[w] != OPEN) & ~self.held_before[:, axis]
            self.fixed[held, axis] = True
            self.prescribed[held, axis] = -self.sign[w] * self.gap[w, held]
            self.fixed[self.state[w] == STICKS] = True

    def meet(self, du: np.ndarray, reaction: np.ndarray, reference: float) -> bool:
        """Decide anew what each node is; whether anything has changed.

        Parameters
        ----------
        du, reaction : ndarray
            Increments [m] and forces that are lacking [N], shapes (A, dim).
        reference : float
            The force that residuals are compared with [N].
        """
        small = ROUNDING * reference
        state, force = self.state.copy(), np.zeros_like(self.force)
        for w, axis in enumerate(self.axis):
            pressed, past = self.sign[w] * reaction[:, axis], self.sign[w] * du[:, axis]
            met = (self.state[w] == OPEN) & (past < -self.gap[w] - self.near)
            pulled = pressed < -small
            if np.isinf(self.friction[w]):
                state[w, met] = STICKS
                self.taken[w] |= met
                state[w, (self.state[w] == STICKS) & pulled & ~self.taken[w]] = OPEN
            else:
                along = np.arange(du.shape[1]) != axis
                bound = self.friction[w] * np.maximum(pressed, 0.0)
                self._slide(w, state[w], met, du * along, reaction * along, bound, small)
                state[w, (self.state[w] == SLIDES) & pulled] = OPEN
                sliding = state[w] == SLIDES
                force[sliding] += bound[sliding, None] * self.direction[w, sliding]
        changed = not np.array_equal(state, self.state)
        changed |= bool(np.abs(force - self.force).max(initial=0.0) > 100.0 * small)
        self.state, self.force = state, force
        self.hold()
        return changed

    def _slide(
        self,
        w: int,
        state: np.ndarray,
        met: np.ndarray,
        moved: np.ndarray,
        reaction: np.ndarray,
        bound: np.ndarray,
        small: float,
    ) -> None:
        """Decide which nodes on a wall slide, with moves and reactions along it, shapes (A, dim), and whereto."""
        far, size = np.linalg.norm(moved, axis=1), np.linalg.norm(reaction, axis=1)
        moves = far > self.near
        starts = (state == STICKS) & (size > bound + small)
        state[starts] = SLIDES
        self.direction[w, starts] = reaction[starts] / size[starts, None]
        back = np.sum(moved * self.direction[w], axis=1) > self.near
        if self.friction[w] > 0.0:
            state[(state == SLIDES) & ~starts & back] = STICKS
        state[met] = np.where(moves[met] | (self.friction[w] == 0.0), SLIDES, STICKS)
        on = ~starts & (state == SLIDES) & moves
        self.direction[w, on] = -moved[on] / far[on, None]

    def finish(self, s: "State", du: np.ndarray, residual: np.ndarray, dt: float) -> None:
        """Note what the walls gave in the step, and its work by the trapezoidal rule."""
        reaction = self.force - residual[self.active]
        before = s.walls.nodal_impulse[:, self.active].sum(axis=0) / s.walls.duration
        s.contact_energy -= 0.5 * float(np.sum(before * du[self.active]))
        s.walls.nodal_impulse[:], s.walls.duration = 0.0, dt
        if s.choices.frozen:
            s.walls.moved += du
        for w, axis in enumerate(self.axis):
            own = np.zeros_like(reaction)
            held, sticks = self.state[w] != OPEN, self.state[w] == STICKS
            own[held, axis] = reaction[held, axis]
            own[sticks] = reaction[sticks]
            sliding = self.state[w] == SLIDES
            along = np.arange(reaction.shape[1]) != axis
            own[np.ix_(sliding, along)] = self.force[np.ix_(sliding, along)]
            s.walls.nodal_impulse[w, self.active] = dt * own
            s.contact_energy -= 0.5 * float(np.sum(own * du[self.active]))
