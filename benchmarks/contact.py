"""Contact: what a step of six cubes consists of by rule, and how the search grows with the surface."""

import numpy as np

from mpmbench import case
from mpmbench.core.compiled import threads
from mpmbench.core.loops.explicit import step
from mpmbench.core.state import State
from mpmbench.runs.hydra import compose

from .goals import measured
from .measure import interleaved

RULES = {
    "OTM, shared": ["method=otm", "basis=lme", "contact=shared"],
    "OTM, penalty": ["method=otm", "basis=lme", "contact=penalty"],
    "MPM, penalty": ["method=mpm", "basis=linear", "contact=penalty"],
    "MPM, multi_field": ["method=mpm", "basis=linear", "contact=multi_field"],
}
SIZES = (8, 16, 32)  # cells along a side, for the search of the penalty
STEP = 5e-5  # of the default variant [s], which has 18,000 of them
STILL = 1e-12


def squares(problem: str, *overrides: str) -> State:
    """The state of colliding bodies at the start."""
    (config, _), *_ = compose.compose_many([[f"problem={problem}", *overrides]])
    return case.build(case.read(config))


def contact() -> None:
    """Milliseconds of a step of six cubes, the share that contact takes, and the growth of the search."""
    threads.use(1)
    print("\nSix cubes: CPU ms of a step near the first contact, and the share of contact in it")
    print(f"{'rule':20} {'step':>9} {'contact':>9} {'18,000 steps [s]':>17}")
    for name, words in RULES.items():
        state = squares("six_cubes", *words)
        while state.time < 0.11:  # two cubes touch at 0.1 s by geometry
            state.time_step = 2.0 * STEP
            step(state, state.time_step)
        state.time_step = STILL

        def alone(state: State = state) -> None:
            state.contact.push(state)
            state.contact.hold(state, STILL)

        seconds = interleaved({"step": lambda s=state: step(s, STILL), "contact": alone})  # type: ignore[misc]
        share = seconds["contact"] / seconds["step"]
        whole = 18_000 * seconds["step"]
        print(f"{name:20} {1e3 * seconds['step']:9.3f} {share:9.1%} {whole:17.1f}")
        if name == "OTM, penalty":
            measured("search for contact in a step, OTM on six cubes", 100.0 * share)
            measured("six cubes, 18,000 steps", whole)
    each = []
    for cells in SIZES:
        words = ["method=mpm", "basis=linear", "contact=penalty", f"resolution={cells}"]
        state = squares("two_squares", *words, "problem.gap=0.0")
        state.time_step = STILL
        tasks = {"push": lambda s=state: s.contact.push(s)}  # type: ignore[misc]
        each.append(interleaved(tasks)["push"])
    growth = float(np.polyfit(np.log(SIZES), np.log(each), 1)[0])
    print(f"search over cells along a side, exponent: {growth:.2f}")
    measured("growth of the search for contact with the surface, exponent", growth)
