"""One run: build the state, step, guard, and keep history and snapshots."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from time import perf_counter, process_time
from typing import Any

import numpy as np

from mpmbench.core.bases import Basis, BasisSettings
from mpmbench.core.bases.affine import AffineGradients
from mpmbench.core.bases.frozen import FrozenBasis
from mpmbench.core.bases.grid.product import GridBasis, count_crossings
from mpmbench.core.bases.parted import own_functions
from mpmbench.core.bodies import Part, audit, gather, owners
from mpmbench.core.compiled import threads
from mpmbench.core.contact import ContactRule
from mpmbench.core.contact.shared import Shared
from mpmbench.core.end_state import EndState, end_state, put_back
from mpmbench.core.energies import (
    dissipated_energy,
    kinetic_energy,
    strain_energy,
)
from mpmbench.core.errors import Diverged, SolverFailure
from mpmbench.core.geometry import Geometry
from mpmbench.core.guards import guard
from mpmbench.core.kept import masses_of_start
from mpmbench.core.loads import Loads, loaded_points
from mpmbench.core.loops import TimeLoop
from mpmbench.core.loops.explicit import update_particles
from mpmbench.core.materials import Material
from mpmbench.core.matrix.mass import KeptMass, Mass, make_mass
from mpmbench.core.moved import complete
from mpmbench.core.nodes import Nodes
from mpmbench.core.particles import Particles, particle_data
from mpmbench.core.state import State
from mpmbench.core.transfer import find_transfer
from mpmbench.core.transfer.parts import NOTHING
from mpmbench.core.transfer.sums import p2g_mass

SAME_STEP = 1e-15  # relative: the step that was asked for, but for the rounding of a quotient
ENERGY_GROWTH = 10.0  # a run with this many times the energy that was put in has diverged


@dataclass(frozen=True)
class Body:
    """What a problem hands to the solver.

    Attributes
    ----------
    geometry : Geometry
        The nodes: of the whole domain for methods with fixed nodes, of the body for those that
        move.
    particles : Particles
        In their initial state, velocities included.
    fixed : callable
        ``fixed(x_i)`` marks the constrained components of nodes at x_i, shape (N, dim) of bool.
    velocity : callable
        ``velocity(x)`` is the initial velocity field [m/s], shape (n, dim).
    loads : Loads
    initial_acceleration : {"balance", "zero"}
        What the loop starts with: ``M a(0) = f(0)``, or accelerations of the particles as they are.
    displacement : callable or None
        ``displacement(x_i)`` moves the nodes of a body that is deformed from the start [m], shape
        (N, dim); `fixed`, `velocity` and `loads` are asked about the places before that.
    parts : tuple of Part
        Where there are several bodies; their particles and surface points follow each other.
    """

    geometry: Geometry
    particles: Particles
    fixed: Callable[[np.ndarray], np.ndarray]
    velocity: Callable[[np.ndarray], np.ndarray]
    loads: Loads = field(default_factory=Loads)
    initial_acceleration: str = "balance"
    displacement: Callable[[np.ndarray], np.ndarray] | None = None
    parts: tuple[Part, ...] = ()


@dataclass
class Solution:
    """What a run leaves: `status` is ``ok`` or that of the failure, and all else is what was computed until then.

    Attributes
    ----------
    history : dict of list
        Time series by name; shapes (time,), (time, dim) or (time, 3).
    snapshots : list of dict
        ``time`` [s] and copies of x, v, F, sigma, V, state, L where the material needs it,
        and further data of all particles.
    records : dict of list
        What the time loop noted about each step (`State.record`).
    end_state : callable or None
        ``end_state()`` is what a longer run can be continued from; None where there is no such run.
    """

    status: str = "ok"
    reason: str = ""
    steps: int = 0
    time_step: float = 0.0
    time_reached: float = 0.0
    solver_time: float = 0.0
    solver_cpu_time: float = 0.0  # [s], of all threads
    cell_crossings: int = 0
    history: dict[str, list[Any]] = field(default_factory=dict)
    snapshots: list[dict[str, Any]] = field(default_factory=list)
    records: dict[str, list[Any]] = field(default_factory=dict)
    body_masses: list[float] = field(default_factory=list)  # [kg]
    end_state: Callable[[], EndState] | None = None


def build_state(
    body: Body,
    basis: BasisSettings,
    material: Material,
    choices: TimeLoop,
    contact: ContactRule | None = None,
) -> State:
    """Allocate everything a run needs; without a rule of contact, several bodies share nodes."""
    p, rule = body.particles, contact or Shared()
    p.keep(particle_data(find_transfer(choices.transfer), basis, material))
    deformed = body.displacement is not None and (choices.moving or choices.frozen)
    complete(type(basis), BasisSettings)
    basis = basis.suited_to(choices)
    moving = (choices.moving and not choices.frozen) or deformed
    bodies = gather(body.parts, material, rule.surface_of_nodes(choices))
    if body.parts:
        meshes = [part.mesh for part in body.parts]
        functions = rule.functions(
            basis, body.geometry, meshes if choices.on_body else [], bodies.particle, moving
        )
    else:
        functions = basis.build(body.geometry, len(p.x), moving)
    complete(type(functions), Basis)
    if choices.gradient == "affine":
        functions = AffineGradients(functions, len(p.x))
    if choices.gradient == "conforming":
        from mpmbench.core.bases.conforming import ConformingGradients  # and sparse matrices

        functions = ConformingGradients(functions)
    reference = functions.nodes.copy()
    functions.follow(p)
    if deformed and body.displacement is not None:
        functions.move(body.displacement(reference))
    if choices.frozen:
        functions = FrozenBasis(functions, p.x, p.F)
    fixed = body.fixed(reference)
    if choices.mass == "kept":
        who = bodies.particle, len(body.parts)
        own = own_functions(basis, meshes, *who, moving) if body.parts else functions
        mass: Mass = KeptMass(fixed, choices.mass_cutoff, masses_of_start(own, p))
    else:
        mass = make_mass(choices, fixed, functions, p)
    nodes = Nodes.zeros(*functions.nodes.shape)
    state = State(p, nodes, functions, mass, material, choices, fixed, body.loads)
    if body.loads.traction is not None:
        state.traction_particle = loaded_points(p, len(body.loads.traction(0.0)), choices.traction)
    state.initial_nodes, state.geometry = reference, body.geometry
    state.smooth = basis.promises.continuous_gradient
    state.balanced = body.initial_acceleration == "balance"
    state.nodes.v[:] = body.velocity(reference)
    if body.parts:
        bodies.node = owners(body.parts, len(reference), choices.on_body, rule.own_nodes)
        for b, part in enumerate(body.parts):
            state.nodes.v[bodies.node == b] = part.velocity
        state.bodies = bodies
        state.contact = rule.build(state)
    if state.transfer.velocity_on_nodes or state.transfer.particle_data:
        functions.locate(p.x)
    if state.transfer.velocity_on_nodes:  # that of the particles is only read off
        update_particles(state, 0.0, velocity=True)
        p2g_mass(functions.handle, p.x, p.m, state.nodes.m)
    state.transfer.start(state)
    return state


def simulate(
    state: State,
    time_step: float | Callable[[State], float],
    end_time: float,
    snapshot_times: Sequence[float] = (),
    progress: Callable[[float, float], None] | None = None,
    before: EndState | None = None,
) -> Solution:
    """Run from the initial state to `end_time`; a numerical failure ends the run and is part of the solution.

    Parameters
    ----------
    state : State
    time_step : float or callable
        Constant step [s]: ``ceil(end_time / time_step)`` equal steps, never a shortened last one;
        or a function of the state for adaptive steps.
    end_time : float
        [s]
    snapshot_times : sequence of float
        Instants [s] at which particles are copied, besides the start and the end.
    progress : callable or None
        ``progress(fraction, time)``: once before the first step, then now and then.
    before : EndState or None
        The end of a shorter run with the same constant step, from which this one goes on.
    """
    adaptive = time_step if callable(time_step) else None
    planned = (
        0 if callable(time_step) else max(1, int(np.ceil(end_time / time_step * (1.0 - 1e-12))))
    )
    dt = end_time / planned if planned else 0.0
    if not callable(time_step) and abs(dt - time_step) <= SAME_STEP * dt:
        dt = time_step  # whatever the end time is, so that a longer run has the same steps
    solution = Solution(time_step=dt, records=state.records)
    own = map(state.bodies.particles, range(state.bodies.count))
    solution.body_masses = [float(state.particles.m[rows].sum()) for rows in own]
    watch = Watch(state, solution, end_time, sorted(snapshot_times))
    if progress is not None:
        progress(0.0, 0.0)
    try:
        watch.sample()
        watch.snapshot()
        if before is not None:
            first_step(state, dt)
            put_back(watch, before)
            watch.go_on()
            guard(state)
        while (solution.steps < planned) if planned else state.time < end_time * (1.0 - 1e-12):
            if adaptive is not None:
                dt = min(adaptive(state), end_time - state.time)
                solution.time_step = dt
            state.time_step = dt
            if solution.steps == 0:
                begin(state, dt)
                watch.kinetic_at_start = kinetic_energy(state.movers.m, state.movers.v)
            watch.before_step(dt)
            cpu_start = process_time()
            start = perf_counter()
            state.choices.step(state, dt)
            solution.steps += 1
            if planned:
                state.time = solution.steps * dt
            guard(state)
            solution.solver_time += perf_counter() - start
            solution.solver_cpu_time += process_time() - cpu_start
            watch.after_step(
                dt, last=solution.steps == planned or state.time >= end_time * (1.0 - 1e-12)
            )
            if progress is not None and watch.sampled:
                progress(state.time / end_time, state.time)
    except SolverFailure as failure:
        solution.status, solution.reason = (
            failure.status,
            f"{failure} (step {solution.steps}, t = {state.time:.6g} s)",
        )
    solution.time_reached = state.time
    if planned and solution.status == "ok":
        solution.end_state = partial(end_state, watch)
    return solution


def first_step(s: State, dt: float) -> None:
    """Begin, and do one step of size `dt` [s]."""
    s.time_step = dt
    begin(s, dt)
    s.choices.step(s, dt)


def begin(s: State, dt: float) -> None:
    """Bring velocities and accelerations to where the loop keeps them, when its first step is known."""
    if s.start is not None:
        s.start(s, dt)
    elif s.balanced:
        s.choices.start(s, dt)


class Watch:
    """Keeps history and snapshots during a run, outside the timed steps."""

    def __init__(
        self, state: State, solution: Solution, end_time: float, snapshot_times: list[float]
    ) -> None:
        self.state, self.solution, self.end_time = state, solution, end_time
        self.pending = [t for t in snapshot_times if 0.0 < t < end_time]
        self.next_sample = 0.0
        self.sampled = False
        self.largest_input = 0.0
        self.kinetic_at_start = 0.0  # of velocities that may live half a step before positions
        self.reference_energy = 0.0
        self.cells = np.full(len(state.particles.x) - state.particles.tracers, -1, dtype=np.int64)
        self.count_crossings()
        solution.cell_crossings = 0

    def count_crossings(self) -> None:
        """Count the particles that are in another cell of a fixed grid than after the step before."""
        s, p = self.state, self.state.particles
        self.solution.cell_crossings += s.crossed  # what the step has seen itself
        s.crossed = 0
        basis = s.basis.within if isinstance(s.basis, AffineGradients) else s.basis
        if s.watched is NOTHING and isinstance(basis, GridBasis) and not s.choices.moving:
            crossed = threads.run(
                lambda c, *part: count_crossings(basis.handle, p.x, self.cells, *part),
                len(self.cells),
            )
            self.solution.cell_crossings += sum(crossed)

    def before_step(self, dt: float) -> None:
        """Have the accelerations kept, if a sample is due after the step."""
        due = min(self.next_sample, self.end_time) * (1.0 - 1e-12)
        self.state.keep_accelerations = self.state.time + dt >= due

    def sample(self, lag: float = 0.0) -> None:
        """Add one instant to the history, and end a run whose energy has grown out of nothing.

        Energies belong to the instant of the positions: velocities that are `lag` [s] behind it
        are brought there by the accelerations of the last step. Momenta are those of the
        velocities as they are, which a leapfrog scheme conserves exactly.
        """
        s, p, history = self.state, self.state.particles, self.solution.history
        moved = s.movers
        there = moved.v + lag * moved.a if lag > 0.0 else moved.v
        kinetic = kinetic_energy(moved.m, there)
        strain, lost = 0.0, 0.0
        for material, *rows in s.bodies.laws:
            own = slice(*rows)
            strain += strain_energy(material.law, s.axes, p.F[own], p.state[own], p.V0[own])
            lost += dissipated_energy(material, p, own)
        m, x, v, *_ = s.carriers
        momentum = m @ v
        arm, velocity = np.zeros((len(x), 3)), np.zeros((len(x), 3))
        arm[:, : p.dimension], velocity[:, : p.dimension] = x, v
        spin = m @ np.cross(arm, velocity) + s.transfer.spin(s)
        values = {
            "time": s.time,
            "kinetic_energy": kinetic,
            "strain_energy": strain,
            "dissipated_energy": lost,
            "numerical_dissipation": self.lost_in_transfers(),
            "contact_energy": s.contact_energy + s.contact.stored(s),
            "external_work": s.external_work,
            "momentum": momentum,
            "angular_momentum": spin,
            **audit(s, there),
            **(s.observe(s) if s.observe is not None else {}),
        }
        for name, value in values.items():
            history.setdefault(name, []).append(value)
        if len(history["time"]) == 1:
            self.reference_energy = kinetic + strain
        self.largest_input = max(self.largest_input, abs(s.external_work))
        allowed = ENERGY_GROWTH * (self.reference_energy + self.largest_input)
        if not np.isfinite(kinetic + strain):
            raise Diverged("the energy is not finite")
        if s.material.conserves_energy and allowed > 0.0 and kinetic + strain > allowed:
            raise Diverged(
                f"the energy has grown to {kinetic + strain:.3g} J, {ENERGY_GROWTH:g} times what "
                f"was put in{s.choices.circumstances(s)}"
            )

    def lost_in_transfers(self) -> float:
        """Kinetic energy that nodes were given and what carries it has not taken [J]."""
        s = self.state
        if s.kinetic_given is None:
            return 0.0
        kinetic = kinetic_energy(s.movers.m, s.movers.v)
        return s.kinetic_given - (kinetic - self.kinetic_at_start)

    def snapshot(self) -> None:
        """Copy the particles."""
        p = self.state.particles
        arrays = {name: getattr(p, name) for name in ("x", "v", "F", "sigma", "V", "state")}
        if len(p.L):
            arrays["L"] = p.L
        copies = {name: array.copy() for name, array in {**arrays, **p.data}.items()}
        self.solution.snapshots.append({"time": self.state.time, **copies})

    def go_on(self) -> None:
        """Look forward from the end of a shorter run: what is due next, and the cells of the particles."""
        crossings = self.solution.cell_crossings
        self.count_crossings()
        self.solution.cell_crossings = crossings
        self.next_sample = self.state.time + self.end_time / self.state.samples
        del self.pending[: len(self.solution.snapshots) - 1]
        self.take_pending(self.state.time_step)

    def after_step(self, dt: float, last: bool) -> None:
        """Sample and snapshot when one is due."""
        time = self.state.time
        self.sampled = last or time >= self.next_sample
        self.count_crossings()
        if self.sampled:
            self.sample(self.state.choices.velocity_lag * dt)
            self.next_sample = time + self.end_time / self.state.samples
        self.take_pending(dt)
        if last:
            self.snapshot()

    def take_pending(self, dt: float) -> None:
        """Take the snapshots whose instants have come."""
        while self.pending and self.state.time >= self.pending[0] - 0.5 * dt:
            self.snapshot()
            self.pending.pop(0)
