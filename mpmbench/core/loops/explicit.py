"""The explicit time loop of MPM (Algorithm 1), OTM (Algorithm 2) and the unified method (Algorithm 3), Wobbes 2020.

The three algorithms are one, with choices: where the nodes go, which mass, and how velocity is
transferred. Equation numbers are of the paper, with the corrections of its errata: the internal
force enters with a minus sign, the traction is there, ``V = det(F) V_0``, and constrained
components leave the system before it is solved.
"""

from dataclasses import dataclass
from functools import partial
from typing import Any, ClassVar

import numpy as np

from mpmbench.core.bases.grid.product import GridBasis
from mpmbench.core.bases.handle import interpolate
from mpmbench.core.compiled import implemented, threads
from mpmbench.core.errors import NotApplicable
from mpmbench.core.loads import (
    add_loads,
    body_force,
    constrain,
    reaction_work,
    rise_of_traction,
)
from mpmbench.core.loops import LoopPromises, TimeLoop
from mpmbench.core.loops.f_bar import strain_together
from mpmbench.core.materials import cauchy_stress
from mpmbench.core.nodes import (
    accelerate,
    add_multiple_of,
    copy,
    note_strains,
    over,
    scalar_product,
)
from mpmbench.core.registry import register
from mpmbench.core.setting import setting
from mpmbench.core.state import State
from mpmbench.core.transfer import Transfer, find_transfer
from mpmbench.core.transfer.carry import Update, g2p
from mpmbench.core.transfer.parts import NOTHING, InBox

# Share of the step in which particles are strained before the forces; usavg: Nairn 2003.
STRAIN_BEFORE = {"usl": 0.0, "musl": 0.0, "usavg": 0.5, "usf": 1.0}


@register("method", "explicit")
@dataclass(frozen=True)
class Explicit(TimeLoop):
    """The explicit loop of MPM, OTM and the unified method."""

    time: str = "explicit"
    mass: str = setting(
        "lumped",
        "mass matrix of the nodes: lumped in each step, or once and kept by nodes with their velocities",
        options=("lumped", "kept", "consistent"),
    )
    transfer: str = setting(
        "flip",
        "of velocities: flip, pic, blend, apic, asflip, tpic, xpic, fmpm, position_difference, nodal, or of a "
        "plug-in",
    )
    flip: float = setting(
        1.0,
        "weight of flip against pic, or apic, when transfer is blend or asflip",
        unit="-",
        least=0.0,
        most=1.0,
    )
    separation: float = setting(
        1.0,
        "share of what flip keeps by which places follow too, unless compressed, when transfer is asflip",
        unit="-",
        least=0.0,
        most=1.0,
    )
    stress_update: str = setting(
        "usl",
        "after the nodal velocities, before, after mapping them back once more, or half before and half after",
        options=("usl", "usf", "musl", "usavg"),
    )
    mass_cutoff: float = setting(
        1e-6,
        "nodes with less than this many particle masses follow their neighbours; 0: only massless ones",
        unit="-",
        least=0.0,
        below=1.0,
    )
    traction: str = setting(
        "end_point",
        "where a point load acts: at a massless point that follows the boundary, or a particle",
        options=("end_point", "last_particle"),
    )
    transfer_order: int = setting(
        2, "terms of the series when transfer is xpic or fmpm", unit="-", least=1, most=20
    )
    gradient: str = setting(
        "functions",
        "derivatives, those of the nearest affine field as in MLS-MPM, or means over Voronoi cells as in SCNI",
        options=("functions", "affine", "conforming"),
    )
    volumetric: str = setting(
        "standard",
        "change of volume at each particle, or one for those around a moving node (f_bar: no locking)",
        options=("standard", "f_bar"),
    )
    drag: float = setting(
        0.0,
        "force against the velocity over mass and velocity, which brings a body to rest in its equilibrium",
        unit="1/s",
        least=0.0,
    )
    velocity_lag: ClassVar[float] = 0.5
    meets_walls: ClassVar[bool] = True
    stress: ClassVar[Any] = staticmethod(cauchy_stress)

    def check_together(self) -> None:
        """The transfer exists."""
        super().check_together()
        find_transfer(self.transfer)

    @property
    def flip_weight(self) -> float:
        """Weight of FLIP in the velocity update; the rest is interpolated."""
        return find_transfer(self.transfer).flip_weight(self)

    @property
    def promises(self) -> LoopPromises:
        """Momentum is conserved always, by the partition of unity.

        Angular momentum is exactly when the matrix that is solved is that of ``sum_p m_p phi_i x_p
        = sum_j M_ij x_j``, which a lumped one is not, and where nodes keep their masses, whose momenta
        only forces change. Energy is bounded unless a lumped projection
        filters the velocity of the particles (PIC) in every step.
        """
        transfer, kept = find_transfer(self.transfer).promises, {"mass", "momentum"}
        if self.mass in ("kept", "consistent"):
            kept |= {"angular_momentum", "energy"}
        elif transfer.energy:
            kept.add("energy")
        if self.drag > 0.0:
            return LoopPromises(frozenset({"mass"}), self.mass == "consistent" or transfer.affine)
        order = None  # known for the usual order of things only
        if self.stress_update == "usl" and not self.frozen:
            on_nodes = find_transfer(self.transfer).velocity_on_nodes
            if self.mass == "consistent":
                order = None if on_nodes else 3.0
            elif not self.moving:
                order = transfer.order
        return LoopPromises(frozenset(kept), self.mass == "consistent" or transfer.affine, order)

    def start(self, s: State, dt: float) -> None:
        """Bring the velocities of particles and nodes to ``v(0) - a(0) dt/2``."""
        p, n = s.particles, s.nodes
        s.land()
        s.basis.locate(p.x)
        total_force(s)
        s.mass.assemble(s.basis, p, n.m, n.seen)
        n.v_old[:] = n.v
        constrain(s, dt)
        n.a[s.fixed] = 2.0 / dt * (n.v - n.v_old)[s.fixed]  # to the mean velocity of the first step
        s.mass.solve(n.f, n.a)
        np.add(s.walls.along(n.v_old), np.multiply(n.a, 0.5 * dt, out=n.v), out=n.v)
        s.walls.hold(s, 0.5 * dt)  # what hits them does so in the first step
        s.contact.hold(s, 0.5 * dt)
        carry(s, -0.5 * dt, Update(True, False, False, False, flip=1.0))
        np.subtract(n.v_old, 0.5 * dt * n.a, out=n.v)
        s.transfer.start(s)

    def circumstances(self, s: State) -> str:
        """The lightest node of a grid that was accelerated, and what the time step can bear."""
        lightest = s.mass.light_nodes.lightest / s.particles.heaviest
        if self.on_body or s.geometry is None or not np.isfinite(lightest):
            return ""
        lame, shear = s.material.lame_parameters()
        speed_squared = (lame + 2.0 * shear) / s.material.density
        bearable = speed_squared * (s.time_step / s.geometry.nodal_spacing) ** 2
        return (
            f"; the lightest node so far had {lightest:.1e} particle masses, and one much lighter "
            f"than (c dt/h)^2 = {bearable:.1e} may be unstable"
        )

    def check(self, case: Any) -> None:
        """Refuse what `check` below refuses, whatever the case, and affine gradients that are lost on faces."""
        check(self)
        if case.basis.stands_in and (self.gradient != "functions" or sums_more(self.transfer)):
            raise NotApplicable(
                f"basis={case.basis_name} with other points in the place of its particles is for "
                "method.gradient=functions and transfers that add nothing to nodal sums of their own, "
                f"such as flip, pic and blend, given {self.gradient} and {self.transfer}"
            )
        if self.gradient == "conforming":
            from mpmbench.core.bases.conforming import refuse_other_cells  # and sparse matrices

            refuse_other_cells(case)
        if self.gradient == "affine" and not case.basis.promises.continuous_gradient:
            raise NotApplicable(
                f"method.gradient=affine with basis={case.basis_name}: inside a cell this is the "
                "gradient of its functions, and on faces there is none: leave it out"
            )

    def watches(self, s: State) -> Any:
        """The box of a grid, where the step as it is listed below has the last word on the particles."""
        usual = type(self).step is Explicit.step and type(s.transfer).shift is Transfer.shift
        if usual and isinstance(s.basis, GridBasis) and not self.on_body:
            return InBox(s.basis.lower, s.basis.upper)
        return NOTHING

    def step(self, s: State, dt: float) -> None:
        """Do one `step` as it is listed below."""
        step(s, dt)


def step(s: State, dt: float) -> None:
    """Advance the state by one step of size `dt` [s]."""
    p, n, choices = s.particles, s.nodes, s.choices
    s.bad = 0
    s.land()
    s.basis.locate(p.x)  # step 3
    before = STRAIN_BEFORE[choices.stress_update]
    if before > 0.0:
        project_velocity(s)
        strains(s, dt, before, first=True)
        update_particles(s, before * dt, strain=True)
    total_force(s)  # and mass and momentum, Eqs. 17, 20, 21
    s.transfer.to_nodes(s, n.q)
    s.mass.assemble(s.basis, p, n.m, n.seen)  # Eqs. 19, 48, 90

    if s.transfer.velocity_on_nodes:  # Li 2009, Eq. 3.92: nodes keep their velocities
        s.transfer.keep_momentum(s)
    else:
        s.mass.solve(n.q, n.v_old)  # Eq. 23
    constrain(s, dt)
    s.mass.solve(n.f, n.a)  # Eqs. 22, 93
    speeds = s.fixed, choices.drag, dt, n.f, n.v_old, n.v_last, n.new, n.v, n.a
    power = sum(over(accelerate, n.seen, n.axes, *speeds))  # Eqs. 24, 51, 94
    by_walls, by_contact = s.walls.hold(s, dt), s.contact.hold(s, dt)
    s.transfer.refine(s)
    by_loads = dt * sum(over(scalar_product, n.seen, n.axes, n.f_external, n.v))
    by_reaction = reaction_work(s, dt)
    s.contact_energy -= by_walls + by_contact
    s.external_work += by_loads + by_reaction
    by_forces = dt * (power + s.contact.power(n.v)) + by_loads
    s.give(0.5 * by_forces + by_walls + by_contact + by_reaction)
    if choices.drag > 0.0:
        lost = dt * choices.drag * float(np.vdot(s.mass.multiply(n.v_old), n.v))
        s.external_work -= lost
        s.give(-lost)
    loaded = p.x[s.traction_particle]

    if choices.stress_update == "usl":
        strains(s, dt)
        update_particles(
            s, dt, velocity=True, strain=True, position=True
        )  # Eqs. 26-30, 52-55, 96-99, step 10
    else:
        update_particles(s, dt, velocity=True)  # Eq. 27
        if choices.stress_update == "musl":
            project_velocity(s)
            strains(s, dt)
            update_particles(s, dt, strain=True)
            over(copy, n.seen, n.axes, n.v_old, n.v)
        elif before < 1.0:
            strains(s, dt, 1.0 - before)
            update_particles(s, (1.0 - before) * dt, strain=True)
        update_particles(s, dt, position=True)  # Eq. 26
    if not choices.frozen:
        s.basis.carry(n.v, dt)
    s.external_work += rise_of_traction(s, dt, loaded)
    if choices.moving and not choices.frozen:
        s.basis.move(np.multiply(n.v, dt, out=n.q))  # Eqs. 51, 95
    if choices.frozen and s.loads.walls:
        s.walls.moved += dt * n.v
    s.time += dt


def strains(s: State, dt: float, share: float = 1.0, first: bool = False) -> None:
    """Count half of the work of the stresses at the nodal velocities that now strain the particles.

    They do so for a `share` of the step, `first` before its forces. The other half is that of the
    stresses which follow: work by the trapezoidal rule, as strains store it.
    """
    n = s.nodes
    rest = 1.0 - share if first else 0.0
    kept = share, rest, n.f_internal, n.v, n.v_last, n.new
    s.give(0.5 * share * dt * sum(over(note_strains, n.seen, n.axes, *kept)))


def total_force(s: State) -> None:
    """Sum mass, momentum and forces on the nodes, with the loads of this instant."""
    n, part = s.nodes, s.transfer.part(s)
    p, loads = s.basis.sources(s.particles.arrays, partial(body_force, s, s.time))
    s.sums(s.basis.handle, p, n, loads, part)
    if np.ndim(s.dead_load) or s.loads.traction is not None:
        add_loads(s, s.basis.handle, s.time, n.f_external)
        over(add_multiple_of, n.seen, n.axes, n.f_internal, 1.0, n.f_external, n.f)
    s.contact.push(s)


def update_particles(
    s: State, dt: float, velocity: bool = False, strain: bool = False, position: bool = False
) -> None:
    """Carry nodal velocities to the particles; what the transfer takes itself comes before positions."""
    flip, keep = s.transfer.flip_weight(s.choices), velocity and s.keep_accelerations
    if strain and s.choices.volumetric == "f_bar":
        strain_together(s, dt)
        strain = False
    if velocity and s.transfer.takes_more:
        carry(s, dt, Update(velocity, strain, False, keep, flip))
        s.transfer.to_particles(s, dt)
        velocity = strain = keep = False
    if velocity or strain or position:
        carry(s, dt, Update(velocity, strain, position, keep, flip))
    if position:
        s.transfer.shift(s, dt)


def carry(s: State, dt: float, update: Update) -> None:
    """Update all particles in their chunks (`g2p`)."""
    p = s.particles.arrays
    by_lines = implemented(interpolate, type(s.basis.handle))
    nodes = s.nodes.arrays if by_lines else s.nodes.in_rows
    phi, solid = s.basis.handle, s.particles.material.stop
    besides = s.transfer.part(s) if update.velocity else NOTHING
    for material, first, last in s.bodies.laws:
        law, rows = material.law, (len(p.x) if last == solid else last) - first

        def part(c: int, start: int, stop: int, law: Any = law, first: int = first) -> Any:
            own = solid, first + start, first + stop
            return g2p(phi, law, p, besides, s.watched, nodes, dt, update, *own)

        for crossed, bad in threads.run(part, rows):
            s.crossed += crossed
            s.bad = None if s.bad is None else s.bad + bad


def project_velocity(s: State) -> None:
    """Nodal velocities from the particles': ``v = M^-1 sum_p m_p phi_i v_p``, for USF and MUSL.

    What nodes had before is in ``v_old``.
    """
    n = s.nodes
    p, _ = s.basis.sources(s.particles.arrays, partial(body_force, s, s.time))
    s.sums(s.basis.handle, p, n, lambda start, stop: None)
    s.transfer.to_nodes_again(s, n.q)
    s.mass.assemble(s.basis, s.particles, n.m, n.seen)
    s.mass.solve(n.q, n.v)  # fixed components keep the velocity of the last step
    given = s.walls.nodal_impulse
    s.walls.hold(s, s.time_step)
    s.contact.hold(s, s.time_step)
    s.transfer.refine(s)
    s.walls.nodal_impulse = given  # particles get nothing of what these velocities took


def sums_more(transfer: str) -> bool:
    """Whether a transfer sums over particles by itself."""
    own, plain = type(find_transfer(transfer)), Transfer
    return any(
        getattr(own, name) is not getattr(plain, name)
        for name in ("to_nodes", "to_nodes_again", "part", "refine", "to_particles")
    )


def check(choices: Explicit) -> None:
    """Refuse combinations that make no sense.

    Raises
    ------
    NotApplicable
        With the reason.
    """
    transfer = find_transfer(choices.transfer)
    transfer.check(choices)
    if choices.mass == "kept" and (choices.frozen or not transfer.velocity_on_nodes):
        raise NotApplicable(
            "method.mass=kept is for nodes that keep their velocities while functions change: it needs "
            f"method.transfer=nodal and method.shape_functions=updated, given {choices.transfer} "
            f"and {choices.shape_functions}"
        )
    if choices.volumetric == "f_bar" and (choices.frozen or not choices.moving):
        raise NotApplicable(
            "method.volumetric=f_bar in an explicit loop is for particles around a node that goes with them: it "
            "needs method.nodes=moving and method.shape_functions=updated, given "
            f"{choices.nodes} and {choices.shape_functions}"
        )
    if choices.stress_update != "usl" and choices.on_body:
        raise NotApplicable(
            f"method.stress_update={choices.stress_update} needs method.nodes=fixed and updated "
            "functions: where nodes move with the material, F must follow their motion"
        )
