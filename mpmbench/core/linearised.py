"""One step of an explicit method about the current state, linearised: how a row of equal cells answers to one of them.

The step is the program's own, done by copies of the state in which one unknown is off by a little more
and a little less; so nothing of a scheme is written twice. Unknowns of a cell are places, velocities
and deformations of its particles, and place and velocity of its node where these are part of the state.
"""

from collections.abc import Callable, Iterator
from copy import deepcopy

import numpy as np

from mpmbench.core.loops.explicit import update_particles
from mpmbench.core.state import State

OFF = 1e-5  # of a cell, of the wave speed, and of the deformation gradient


def responses(s: State, dt: float) -> np.ndarray:
    """What one step `dt` [s] makes of a small change of the middle cell of a line.

    Returns
    -------
    ndarray
        ``A[R + r]`` takes changes of the unknowns of a cell to those of the r-th cell after it; shape (2 R +
        1, d, d), in units of cells, of cells per step, and of 1.

    Raises
    ------
    ValueError
        When the state is none of a line.
    """
    if s.particles.dimension != 1:
        raise ValueError("responses are those of a line of cells")
    assert s.geometry is not None
    particles, h = len(s.particles.x) - s.particles.tracers, s.geometry.nodal_spacing
    per_cell = max(1, particles // (len(s.geometry.points) - 1))
    rows = particles // per_cell
    middle, reach = rows // 2, rows // 2 - 2
    scales = {"x": h, "v": h / dt, "F": 1.0}
    changes = list(unknowns(s, per_cell, rows))
    same = {id(one): one for one in (s.mass, s.material, s.loads, s.geometry)}
    columns = []
    for kind, _, write in changes:
        ends = []
        for sign in (1.0, -1.0):
            twin = deepcopy(s, dict(same))
            write(twin, middle, sign * OFF * scales[kind])
            update_particles(twin, 0.0, strain=True)  # stresses of the new deformation
            twin.choices.step(twin, dt)
            ends.append([read(twin) / scales[other] for other, read, _ in changes])
        answer = (np.array(ends[0]) - np.array(ends[1])) / (2.0 * OFF)
        columns.append(answer[:, middle - reach : middle + reach + 1])
    return np.transpose(np.array(columns), (2, 1, 0))


Unknown = tuple[str, Callable[[State], np.ndarray], Callable[[State, int, float], None]]


def unknowns(s: State, per_cell: int, rows: int) -> Iterator[Unknown]:
    """Kind of each unknown of a cell, what reads it in all cells, and what changes it in one."""
    on_nodes = s.transfer.velocity_on_nodes
    for q in range(per_cell):
        for name in ("x", "F") if on_nodes else ("x", "v", "F"):
            yield name, _of_particles(name, q, per_cell, rows), _to_particle(name, q, per_cell)
    if s.choices.moving and not s.choices.frozen:
        yield "x", lambda s: s.basis.nodes[:rows, 0].copy(), _move_node
    if on_nodes:
        yield "v", lambda s: s.nodes.v[:rows, 0].copy(), _push_node


def _of_particles(name: str, q: int, per_cell: int, rows: int) -> Callable[[State], np.ndarray]:
    def read(s: State) -> np.ndarray:
        values = getattr(s.particles, name).reshape(len(s.particles.x))
        return np.array(values[q::per_cell][:rows])

    return read


def _to_particle(name: str, q: int, per_cell: int) -> Callable[[State, int, float], None]:
    def write(s: State, cell: int, change: float) -> None:
        getattr(s.particles, name)[cell * per_cell + q] += change

    return write


def _move_node(s: State, cell: int, change: float) -> None:
    displacement = np.zeros_like(s.basis.nodes)
    displacement[cell] = change
    s.basis.move(displacement)


def _push_node(s: State, cell: int, change: float) -> None:
    s.nodes.v[cell] += change
