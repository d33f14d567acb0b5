"""What a time loop works on: particles, nodes, basis, mass, material and loads, allocated once."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from mpmbench.core.bases import Basis
from mpmbench.core.bodies import Bodies
from mpmbench.core.contact import Contact
from mpmbench.core.geometry import Geometry
from mpmbench.core.loads import Loads
from mpmbench.core.materials import Material
from mpmbench.core.matrix.mass import KeptMass, Mass
from mpmbench.core.nodes import Nodes
from mpmbench.core.particles import Particles
from mpmbench.core.transfer import Transfer, find_transfer
from mpmbench.core.transfer.sums import NodalSums
from mpmbench.core.walls import Walls


class Carriers(NamedTuple):
    """Masses [kg], shape (n,), and places, velocities and accelerations, shape (n, dim), of nodes or particles."""

    m: np.ndarray
    x: np.ndarray
    v: np.ndarray
    a: np.ndarray
    on_nodes: bool


@dataclass
class State:
    """One simulation between two steps.

    Attributes
    ----------
    choices : TimeLoop
        The loop with its settings.
    time : float
        Positions and stresses live at `time` [s], velocities half a step earlier.
    external_work : float
        Work of body force, traction and prescribed motion so far [J].
    contact_energy : float
        What contact has taken so far [J]: friction, and the motion of nodes that it stopped.
    kinetic_given : float or None
        Kinetic energy that nodes were given so far [J], which only a loop can tell that has
        particles besides: what these did not take is the loss in transfers.
    time_step : float
        Size of the last step [s].
    held : ndarray of int
        Numbers of the nodes with a fixed component.
    initial_nodes : ndarray
        Places of the nodes [m], shape (N, dim), in the reference configuration.
    geometry : Geometry or None
        Where the basis was built.
    dead_load : ndarray or float
        Constant forces on the nodes [N], shape (N, dim).
    traction_particle : ndarray of int
        Particle or tracer on which each point load acts.
    workspace : object
        What a time loop keeps allocated between its steps.
    room : object
        What a transfer keeps allocated between the steps.
    around : object
        Which particles share a change of volume, where an explicit loop has F-bar.
    smooth : bool
        The functions have continuous gradients.
    records : dict of list
        What a time loop has to say about its steps, by name: one number or array per step.
    observe : callable or None
        ``observe(state)`` gives further time series of the problem, by name; called when history is
        sampled.
    start : callable or None
        ``start(state, dt)`` changes velocities, which live half a step before positions, when the
        first step is known.
    balanced : bool
        Without a `start`, the loop starts with the acceleration that balances the loads at t = 0.
    keep_accelerations : bool
        The next step writes ``particles.a``: energies will be asked for at its end.
    samples : int
        History is kept at about this many instants.
    law : NamedTuple
        The material's numbers, as compiled loops take them.
    axes : tuple of float
        As many zeros as there are dimensions.
    transfer : Transfer
    sums : NodalSums
        Adds up mass, momentum and forces on the nodes.
    walls : Walls
        The walls among the loads, and what they do.
    bodies : Bodies
        Whose particles and nodes are, and what they are made of.
    contact : Contact
        What keeps several bodies apart.
    watched : NamedTuple
        In what particles are looked at while they are updated (`parts.watch`).
    crossed, bad : int
        What was seen there since these were asked for last: particles that left their cells, and, after a
        step, those that a guard must see.
    """

    particles: Particles
    nodes: Nodes
    basis: Basis
    mass: Mass
    material: Material
    choices: Any
    fixed: np.ndarray
    loads: Loads = field(default_factory=Loads)
    time: float = 0.0
    external_work: float = 0.0
    contact_energy: float = 0.0
    kinetic_given: float | None = None
    time_step: float = 0.0
    dead_load: np.ndarray | float = 0.0
    traction_particle: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    initial_nodes: np.ndarray = field(default_factory=lambda: np.zeros((0, 1)))
    geometry: Geometry | None = None
    workspace: Any = None
    room: Any = None
    around: Any = None
    smooth: bool = True
    records: dict[str, list[Any]] = field(default_factory=dict)
    observe: Callable[["State"], dict[str, Any]] | None = None
    start: Callable[["State", float], None] | None = None
    balanced: bool = False
    keep_accelerations: bool = False
    samples: int = 200
    held: np.ndarray = field(init=False)
    bodies: Bodies = field(init=False)
    contact: Contact = field(default_factory=Contact)
    law: Any = field(init=False)
    axes: tuple[float, ...] = field(init=False)
    transfer: Transfer = field(init=False)
    sums: NodalSums = field(init=False)
    walls: Walls = field(init=False)
    watched: Any = field(init=False)
    crossed: int = 0
    bad: int | None = None

    def __post_init__(self) -> None:
        p = self.particles
        self.law = self.material.law
        self.bodies = Bodies.single(self.material, len(p.x), p.tracers)
        self.axes = (0.0,) * p.dimension
        self.initial_nodes = self.basis.nodes.copy()
        self.held = np.flatnonzero(self.fixed.any(axis=1))
        self.transfer = find_transfer(self.choices.transfer)
        self.nodes.keep_velocities = self.transfer.velocity_on_nodes
        body_force = self.loads.body_force is not None
        most = max(len(p.x), self.basis.stand_ins)
        self.sums = NodalSums(len(self.fixed), most, p.dimension, body_force)
        self.walls = Walls(self.loads.walls, len(self.fixed), p.dimension)
        self.watched = self.choices.watches(self)

    @property
    def carriers(self) -> Carriers:
        """What momentum is that of: particles, or nodes that keep their masses."""
        p, n = self.particles, self.nodes
        if isinstance(self.mass, KeptMass):
            return Carriers(self.mass.kept, self.basis.nodes, n.v, n.a, True)
        return Carriers(p.m, p.x, p.v, p.a, False)

    @property
    def movers(self) -> Carriers:
        """What kinetic energy is that of: nodes with lumped masses that keep their velocities, else particles.

        These only interpolate such velocities, ``v_p = sum_i phi_i v_i``, and lack what functions smooth.
        It is the same where the mass is consistent.
        """
        n, own = self.nodes, self.transfer.velocity_on_nodes and not self.choices.frozen
        if own and self.choices.mass == "lumped":
            return Carriers(n.m, self.basis.nodes, n.v, n.a, True)
        return self.carriers

    def of_body(self, carried: Carriers, body: int) -> slice | np.ndarray:
        """Which of these are those of a body."""
        if carried.on_nodes:
            return np.flatnonzero(self.bodies.node == body)
        return self.bodies.particles(body)

    def give(self, energy: float) -> None:
        """Count kinetic energy [J] that nodes were given."""
        self.kinetic_given = (self.kinetic_given or 0.0) + energy

    def record(self, name: str, value: Any) -> None:
        """Note a number or array about the step being done."""
        self.records.setdefault(name, []).append(value)

    def land(self) -> None:
        """Hold the moving nodes that have met what the material rests on."""
        if self.loads.landing is None or not self.choices.moving:
            return
        landed = self.loads.landing(self.basis.nodes) & ~self.fixed
        if landed.any():
            self.fixed |= landed
            self.held = np.flatnonzero(self.fixed.any(axis=1))
            self.nodes.v[landed], self.nodes.a[landed] = 0.0, 0.0
