"""The contract of a time loop: what is exact for every choice of parts, and what is conserved as declared."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mpmbench.analysis.norms import error_norms
from mpmbench.analysis.slopes import fitted_order
from mpmbench.contracts import Contract, Finding, largest
from mpmbench.core import registry
from mpmbench.core.geometry import Box
from mpmbench.core.loops import TimeLoop
from mpmbench.core.particles import Particles, seed_cells
from mpmbench.core.simulation import Body, Solution, build_state, simulate
from mpmbench.core.state import Loads, State

SPACING = 0.25  # cell size [m]
TIME_STEP = 5e-4  # [s]
PLATE_CELLS = (4, 8, 16)
PLATE_STEP, PLATE_TIME = 2.5e-5, 3.5e-3  # [s]
ORDER_TOLERANCE = 0.35
NO_STIFFNESS = 1e-9  # [Pa]
Velocity = Callable[[np.ndarray], np.ndarray]
CHECKS = Contract()


def in_plane_with_nodes(case: Any) -> bool:
    """Two dimensions, and nodes besides the particles."""
    return case.dimension == 2 and has_nodes(case)


def has_nodes(case: Any) -> bool:
    """Velocities go to nodes and come back."""
    return not case.choices.particles_are_nodes


@dataclass(frozen=True)
class MethodCase:
    """A method in one to three dimensions, on a block of cells."""

    choices: Any
    dimension: int
    basis: str = "linear"
    material: str = "neo_hookean"
    young_modulus: float = 1e4  # [Pa]

    def block(
        self,
        velocity: Velocity,
        loads: Loads | None = None,
        fixed: Any = None,
        cells: int = 3,
        tracers: Any = None,
    ) -> State:
        """A block of `cells` a side, 3 particles per axis and cell, with two empty cells around it on a fixed grid."""
        dim, h, on_body = self.dimension, SPACING, self.choices.moving or self.choices.frozen
        block = Box((2 * h,) * dim, ((2 + cells) * h,) * dim, (cells,) * dim)
        domain = Box((0.0,) * dim, ((4 + cells) * h,) * dim, (4 + cells,) * dim)
        material = registry.get("material", self.material)
        ratio = 0.3 if dim > 1 else 0.0
        law = material(young_modulus=self.young_modulus, poisson_ratio=ratio, density=10.0)
        X, V0 = seed_cells(block, 3**dim)
        if self.choices.particles_are_nodes:
            X, V0 = block.points, np.full(len(block.points), h**dim)
        p = Particles.at_rest(X, V0, law.density, tracers=tracers)
        p.v[:] = velocity(p.X)
        free = fixed or (lambda x: np.zeros(x.shape, dtype=bool))
        body = Body(block if on_body else domain, p, free, velocity, loads or Loads())
        return build_state(body, registry.get("basis", self.basis)(), law, self.choices)


def cases(choices: TimeLoop) -> list[MethodCase]:
    """All cases of a method."""
    return [MethodCase(choices, dimension) for dimension in (1, 2, 3)]


def steps(state: State, n: int = 20, dt: float = TIME_STEP) -> Finding:
    """Run `n` steps; the finding is whether they ended well."""
    return ended_well(simulate(state, dt, n * dt))


def ended_well(solution: Solution) -> Finding:
    """Whether a run has come to its end."""
    return Finding(
        solution.status == "ok", f"the run ended with {solution.status}: {solution.reason}"
    )


def if_momentum_is_kept(case: MethodCase, *findings: Finding) -> Finding:
    """What conserved momentum makes exact: it must hold where that is promised, and only there."""
    found, promises = Finding.all(list(findings)), case.choices.promises
    if "momentum" in promises.conserves and promises.translation:
        return found
    return Finding.as_declared(found.passed, False, "conservation of momentum", found.text)


@CHECKS.asks()
def rigid_translation(case: MethodCase) -> Iterator[Finding]:
    """A block with the same velocity everywhere moves and does nothing else."""
    v = np.arange(1.0, case.dimension + 1.0)
    state = case.block(lambda x: np.tile(v, (len(x), 1)))
    yield steps(state)
    p = state.particles
    yield if_momentum_is_kept(
        case,
        Finding.below(p.x - p.X - state.time * v, 1e-11, "error of the positions [m]"),
        Finding.below(p.v - v, 1e-10, "error of the velocities [m/s]"),
    )
    strain, stress = largest(p.F - np.eye(case.dimension)), largest(p.sigma)
    rigid, claim = strain < 1e-12 and stress < 1e-6, "that a translation strains nothing"
    measured = f"deformation {strain:.2g}, stress {stress:.2g} Pa"
    yield Finding.as_declared(rigid, case.choices.promises.translation, claim, measured)


@CHECKS.asks()
def free_fall(case: MethodCase) -> Iterator[Finding]:
    """Constant body force: ``v = g t`` at the instant of velocities and ``x = X + g t^2 / 2``, exactly."""
    g, n, dt = -np.arange(1.0, case.dimension + 1.0), 20, TIME_STEP

    def gravity(X: np.ndarray, t: float, b: np.ndarray) -> None:
        b[:] = g

    state = case.block(np.zeros_like, loads=Loads(body_force=gravity))
    yield steps(state, n, dt)
    p = state.particles
    v, fallen = g * (state.time - case.choices.velocity_lag * dt), 0.5 * g * state.time**2
    momentum = (p.m @ p.v) / (p.m.sum() * v) - 1.0
    work = state.external_work / (0.5 * p.m.sum() * (g @ g) * state.time**2) - 1.0
    yield if_momentum_is_kept(
        case,
        Finding.below(p.v - v, 1e-10, "error of the velocities [m/s]"),
        Finding.below(p.x - p.X - fallen, 1e-12, "error of the positions [m]"),
        Finding.below(momentum, 1e-10, "relative error of the momentum"),
        Finding.below(work, 1e-9, "relative error of the external work"),
    )


@CHECKS.asks()
def mass_and_momentum(case: MethodCase) -> Iterator[Finding]:
    """A block that vibrates freely: stress waves change shape, not momentum; volumes follow the deformation."""
    state = case.block(lambda x: 0.5 * np.sin(3.0 * x[:, ::-1] + 1.0) + 0.2)
    p = state.particles
    before, mass = p.m @ p.v, p.m.sum()
    yield steps(state)
    drift = (p.m @ p.v - before) / mass
    yield if_momentum_is_kept(
        case, Finding.below(drift, 1e-11, "change of momentum over mass [m/s]")
    )
    yield Finding.below(p.m.sum() - mass, 1e-300, "change of mass [kg]")
    yield Finding(largest(p.sigma) > 1.0, "the block does not deform")
    volume = p.V / (p.V0 * np.linalg.det(p.F)) - 1.0
    yield Finding.below(volume, 1e-12, "relative difference of the volume from det(F) V0")


@CHECKS.asks(lambda case: case.dimension > 1 and has_nodes(case))
def angular_momentum(case: MethodCase) -> Iterator[Finding]:
    """A spinning block that is also sheared keeps its angular momentum exactly when method and material declare it."""

    def velocity(x: np.ndarray) -> np.ndarray:
        v = np.zeros_like(x)
        v[:, 0], v[:, 1] = -(x[:, 1] - 0.8) + x[:, 0] ** 2, 2.0 * (x[:, 0] - 0.9) * x[:, 1]
        return v

    state = case.block(velocity)
    solution = simulate(state, TIME_STEP, 0.01)  # short: nothing enters an empty cell
    yield ended_well(solution)
    spin = np.array(solution.history["angular_momentum"])[:, 2]
    drift = largest(spin - spin[0]) / abs(spin[0])
    declared = "angular_momentum" in case.choices.promises.conserves and state.material.symmetric
    claim = "conservation of angular momentum"
    yield Finding.as_declared(drift < 1e-11, declared, claim, f"drift {drift:.2g}")


@CHECKS.asks(has_nodes)
def uniform_stretch(case: MethodCase) -> Iterator[Finding]:
    """A linear velocity field deforms every particle alike in one step: F = I + dt grad v, x follows the same map.

    Where particles are strained twice in a step, the first half must not accelerate the second.
    """
    dim, dt, choices = case.dimension, 1e-3, case.choices
    halves = choices.stress_update == "usavg"
    if halves:
        case = replace(case, young_modulus=NO_STIFFNESS)
    gradient = 0.3 * np.arange(1.0, dim * dim + 1.0).reshape(dim, dim) / dim**2
    state = case.block(lambda x: x @ gradient.T, cells=9)
    yield steps(state, n=1, dt=dt)
    p, expected = state.particles, np.eye(dim) + dt * gradient
    half = np.eye(dim) + 0.5 * dt * gradient
    error = p.F - (half @ half if halves else expected)
    if not choices.promises.affine:  # a lumped projection is exact inside only
        inner = np.all(np.abs(p.X - 6.5 * SPACING) < 0.5 * SPACING, axis=1)
        yield Finding.below(error[inner], 1e-12, "error of the deformation gradient")
        return
    yield Finding.below(error, 1e-10, "error of the deformation gradient")
    if choices.stress_update != "usf":  # whose new stress accelerates within the step
        yield Finding.below(p.x - p.X @ expected.T, 1e-10, "error of the positions [m]")


@CHECKS.asks(has_nodes)
def affine_fields(case: MethodCase) -> Iterator[Finding]:
    """An affine velocity field goes from the nodes to the particles and back unchanged, if that is declared."""
    dim = case.dimension
    gradient = 2.0 * np.arange(1.0, dim * dim + 1.0).reshape(dim, dim) / dim**2

    def velocity(x: np.ndarray) -> np.ndarray:
        return 1.0 + (x - 3.0 * SPACING) @ gradient.T

    state = case.block(velocity)
    start = velocity(state.basis.nodes)
    yield steps(state, n=1)
    seen = state.nodes.m > 1e-6 * state.particles.m.sum() / len(state.particles.m)
    error = largest((state.nodes.v_old - start)[seen]) / largest(start[seen])
    claim = "that affine velocities come back to the nodes"
    declared = case.choices.promises.affine
    yield Finding.as_declared(error < 1e-10, declared, claim, f"relative error {error:.2g}")


@CHECKS.asks(in_plane_with_nodes)
def energy_of_small_scales(case: MethodCase) -> Iterator[Finding]:
    """Velocities without any order keep their energy when that is declared, and are filtered away otherwise.

    What is filtered away is counted as numerical dissipation.
    """

    def velocity(x: np.ndarray) -> np.ndarray:
        return 1e-2 * np.random.default_rng(1).standard_normal(x.shape)

    state = case.block(velocity)
    solution = simulate(state, TIME_STEP, 40 * TIME_STEP)
    yield ended_well(solution)
    total = np.add(solution.history["kinetic_energy"], solution.history["strain_energy"])
    kept = float(total[-1] / total[1])  # the first step may take away what nodes do not see
    declared = "energy" in case.choices.promises.conserves
    claim = "that the energy of small scales stays"
    yield Finding.as_declared(kept > 0.5, declared, claim, f"{kept:.2g} of it is left")
    lost = solution.history["numerical_dissipation"]
    imbalance = (total + lost - total[0]) / total[0]
    yield Finding.below(imbalance, 0.1, "energy that is neither there nor counted as lost")


def plate_error(choices: TimeLoop, resolution: int) -> float:
    """Root mean square error of the displacement [m] of the manufactured plate, with quadratic B-splines."""
    problem = registry.get("problem", "plate_axis_aligned")()
    law = registry.get("material", "neo_hookean")
    material = law(young_modulus=1e7, poisson_ratio=0.3, density=1000.0)
    X, V0 = problem.seed(resolution, 16)
    p = Particles.at_rest(X, V0, material.density)
    p.v[:] = problem.velocity(p.X, material)
    body = Body(
        problem.nodes(resolution, choices),
        p,
        problem.fixed,
        lambda x: problem.velocity(x, material),
        problem.loads(material),
    )
    state = build_state(body, registry.get("basis", "bspline")(), material, choices)
    solution = simulate(state, PLATE_STEP, PLATE_TIME)
    if solution.status != "ok":
        return float("nan")
    return error_norms(p.x - X, problem.exact(X, state.time, material)["displacement"])[0]


@CHECKS.asks(in_plane_with_nodes)
def order_on_a_plate(case: MethodCase) -> Iterator[Finding]:
    """Errors of the manufactured plate fall with the mesh as they are declared to, neither slower nor faster."""
    declared = case.choices.promises.order
    if declared is None:
        yield Finding(True, "no order is declared")
        return
    errors = [plate_error(case.choices, n) for n in PLATE_CELLS]
    order = fitted_order(1.0 / np.array(PLATE_CELLS), np.array(errors))
    text = ", ".join(f"{error:.2g}" for error in errors)
    yield Finding(
        abs(order - declared) <= ORDER_TOLERANCE,
        f"the order on a plate is {order:.2f} (errors {text} m), {declared:g} is declared",
    )


@CHECKS.asks(lambda case: case.dimension == 2)
def rest(case: MethodCase) -> Iterator[Finding]:
    """A body without stress at rest stays, to the last bit."""
    state = case.block(np.zeros_like)
    yield steps(state)
    yield Finding.below(state.particles.x - state.particles.X, 1e-300, "displacement [m]")


@CHECKS.asks(in_plane_with_nodes)
def constraints_act_per_component(case: MethodCase) -> Iterator[Finding]:
    """Rollers: the fixed component of a boundary node rests, the other is free."""

    def floor(x: np.ndarray) -> np.ndarray:
        return np.column_stack([np.zeros(len(x), dtype=bool), x[:, 1] < 2.004 * SPACING])

    state = case.block(lambda x: np.tile([1.0, -1.0], (len(x), 1)), fixed=floor)
    yield steps(state, n=10)
    p = state.particles
    along = p.m @ p.v[:, 0] / p.m.sum()
    yield if_momentum_is_kept(
        case, Finding.below(along - 1.0, 1e-10, "change of the free component [m/s]")
    )
    lowest = p.X[:, 1] < 2.2 * SPACING
    yield Finding.below(p.v[lowest, 1], 0.9, "held component of 1 m/s after ten steps")


@CHECKS.asks(lambda case: case.dimension == 1)
def tracers_do_nothing(case: MethodCase) -> Iterator[Finding]:
    """Massless points change nothing and move with the material around them."""
    without = case.block(np.sin)
    tracers = np.full((2, case.dimension), 3.6 * SPACING)
    tracers[0] = 2.0 * SPACING
    state = case.block(np.sin, tracers=tracers)
    yield steps(without)
    yield steps(state)
    p, q = without.particles, state.particles
    same = np.array_equal(q.x[:-2], p.x) and np.array_equal(q.sigma[:-2], p.sigma)
    yield Finding(same, "massless points change the others")
    moved = float(np.abs(q.x[-2:] - q.X[-2:]).min())
    yield Finding(moved > 1e-3, "they stay")
