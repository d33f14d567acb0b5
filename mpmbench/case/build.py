"""From the plug-ins of a run to its solution: the initial state, the time step, and the steps."""

from collections.abc import Callable
from time import perf_counter
from typing import TYPE_CHECKING

from mpmbench.case.compiling import compile_kernels
from mpmbench.case.output import Outcome, outcome
from mpmbench.case.read import Case, Config, bodies_of, read
from mpmbench.core.bodies import particles_of
from mpmbench.core.compiled import threads
from mpmbench.core.end_state import EndState, refuse_unlike
from mpmbench.core.errors import SolverFailure
from mpmbench.core.particles import Particles
from mpmbench.core.simulation import Body, Solution, Watch, build_state, first_step, simulate
from mpmbench.core.stability import stability_limit
from mpmbench.core.state import State
from mpmbench.problems import Problem

if TYPE_CHECKING:
    import xarray as xr

Progress = Callable[[float, float], None]


def build(case: Case) -> State:
    """The initial state of a run."""
    problem, material = case.problem, case.material
    parts = bodies_of(case)
    if parts:
        particles = particles_of(parts, material, case.contact.surface_of_nodes(case.choices))
    else:
        X, V0 = problem.seed(case.resolution, case.particles_per_cell)
        X = problem.place(X, case.resolution, case.choices)
        particles = Particles.at_rest(
            X, V0, material.density, problem.tracers(), material.history, material.rate_dependent
        )
        particles.v[:] = problem.velocity(particles.X, material)
    problem.prepare(particles, material)
    body = Body(
        geometry=problem.nodes(case.resolution, case.choices),
        particles=particles,
        fixed=problem.fixed,
        velocity=lambda x: problem.velocity(x, material),
        loads=problem.loads(material),
        initial_acceleration=problem.initial_acceleration,
        displacement=problem.initial_displacement(material),
        parts=parts,
    )
    state = build_state(body, case.basis, material, case.choices, case.contact)
    state.observe, state.samples = problem.observe, problem.samples
    state.start = problem.start if type(problem).start is not Problem.start else None
    return state


def solve(config: Config) -> "xr.Dataset":
    """Run one case in this process, as `run`; what came out as a dataset of xarray."""
    return run(config).as_dataset()


def run(
    config: Config, progress: Progress | None = None, before: EndState | None = None
) -> Outcome:
    """Run one case in this process.

    Parameters
    ----------
    config : mapping
        The resolved configuration.
    progress : callable or None
        ``progress(fraction, time)``, first with 0 when set-up and compiling are over and the solver
        starts.
    before : EndState or None
        The end of a shorter run, from which this one goes on.

    Returns
    -------
    Outcome
        What the result file holds, without provenance; a numerical failure is a status, not
        an exception.
    """
    case = read(config)
    end_time = float(config["end_time"])
    of_solver = int(config.get("threads", 1))
    threads.use(of_solver)
    start = perf_counter()
    try:
        state = build(case)
        time_step = step_size(config, case, state)
        compile_kernels(lambda: build(case), time_step, end_time, of_solver)
    except SolverFailure as failure:
        solution = Solution(status=failure.status, reason=f"{failure} (before the first step)")
        return outcome(config, case, None, solution, perf_counter() - start)
    compile_time = perf_counter() - start
    instants = config.get("snapshot_times") or ()
    solution = simulate(state, time_step, end_time, instants, progress, before)
    return outcome(config, case, state, solution, compile_time)


def refuse_to_continue(config: Config, before: EndState) -> None:
    """Raise `NotApplicable` with the reason unless a run can go on from the end of a shorter one."""
    state = build(read(config))
    first_step(state, float(config["time_step"]))
    refuse_unlike(Watch(state, Solution(), float(config["end_time"]), []), before)


def step_size(config: Config, case: Case, state: State) -> float | Callable[[State], float]:
    """The constant step, ``cfl`` times the stability limit for ``auto``, or the problem's own adaptive step."""
    if config["time_step"] != "auto":
        return float(config["time_step"])
    adaptive = case.problem.adaptive_step(state)
    return adaptive if adaptive is not None else float(config["cfl"]) * stability_limit(state)
