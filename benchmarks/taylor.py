"""Taylor's rod: whole steps of the methods that impact is done with, and what a step of OTM consists of."""

import numpy as np

from mpmbench import case
from mpmbench.core.compiled import threads
from mpmbench.core.guards import guard
from mpmbench.core.loops.explicit import step, total_force, update_particles
from mpmbench.core.state import State
from mpmbench.runs.hydra import compose

from .goals import measured
from .measure import interleaved

RESOLUTION = 4  # cells along the radius: 3,840 particles of a quarter
SETTLED = 200  # steps before the first measurement: the foot has begun to spread
METHODS = {
    "OTM": ["method=otm", "basis=lme"],
    "MPM, B-splines": ["method=mpm", "basis=bspline"],
    "MPM, linear, musl": ["method=mpm", "basis=linear", "method.stress_update=musl"],
    "linear FEM": ["method=linear_fem"],
}
GOALS = {
    "OTM": "Taylor's rod by OTM, a particle and step",
    "MPM, B-splines": "Taylor's rod by 3D B-spline MPM, a particle and step",
}


def rod(*overrides: str) -> tuple[State, float]:
    """The quarter rod after some steps, and a step [s] that moves it on without changing it much."""
    words = ["problem=taylor_anvil", f"resolution={RESOLUTION}", *overrides]
    (config, _), *_ = compose.compose_many([words])
    plugins = case.read(config)
    state = case.build(plugins)
    size = plugins.problem.adaptive_step(state)
    assert size is not None
    for _ in range(SETTLED):
        state.time_step = size(state)
        step(state, state.time_step)
        guard(state)  # tracers at the surface are put back into it
    return state, 1e-6 * state.time_step


def taylor() -> None:
    """Microseconds per particle and step, on one thread and on two, and the parts of OTM's step."""
    print(
        f"\nTaylor's rod, a quarter with {RESOLUTION} cells along the radius: CPU us per particle and step"
    )
    print(f"{'method':20} {'particles':>9} {'functions':>9} {'1 thread':>9}")
    threads.use(1)
    rods = {name: rod(*words) for name, words in METHODS.items()}
    seconds = interleaved({name: lambda one=one: step(*one) for name, one in rods.items()})  # type: ignore[misc]
    for name, (state, _) in rods.items():
        particles = len(state.particles.x)
        seen = state.basis.statistics().get("neighbours_mean")
        width = f"{seen[0]:9.1f}" if seen else f"{'':9}"
        each = 1e6 * seconds[name] / particles
        print(f"{name:20} {particles:9} {width} {each:9.3f}")
        if name in GOALS:
            measured(GOALS[name], each)
    state, dt = rod(*METHODS["OTM"])
    p, n, still = state.particles, state.nodes, np.zeros_like(state.nodes.v)
    parts = {
        "functions": lambda: state.basis.locate(p.x),
        "sums on the nodes": lambda: total_force(state),
        "mass and walls": lambda: (
            state.mass.assemble(state.basis, p, n.m, n.seen),
            state.walls.hold(state, dt),
        ),
        "velocity and stress": lambda: update_particles(state, dt, velocity=True, strain=True),
        "move": lambda: state.basis.move(still),
    }
    for name, value in interleaved(parts).items():
        print(f"OTM: {name:20} {1e6 * value / len(p.x):9.3f}")
