"""Speed of the implicit solver. CPU times, medians, compiling left out."""

from time import process_time

import numpy as np

from mpmbench import case
from mpmbench.core.implicit.newton import Equations
from mpmbench.core.implicit.step import prepare
from mpmbench.core.loads import external_force
from mpmbench.core.state import State
from mpmbench.runs.hydra import compose

from .goals import measured
from .measure import interleaved

PAIRS = (("fem", "linear"), ("implicit_mpm", "linear"), ("gmm", "mls"), ("gmm", "lme"))


def build(*overrides: str) -> State:
    """The initial state of a run."""
    (config, reason), *_ = compose.compose_many([list(overrides)])
    assert not reason, reason
    return case.build(case.read(config))


def equations_of(s: State) -> Equations:
    """The equations of a step of an implicit method, with the whole load."""
    w = prepare(s)
    return Equations(s, w, external_force(s, w.phi, 1.0, s.nodes.f_external), 1.0, None)


def newton_iteration() -> None:
    """Assembly and solution of one Newton iteration on 128 x 16 quads with four particles per cell."""
    print("\nOne Newton iteration, 128 x 16 quads, 4 particles per cell, CPU ms")
    print(
        f"{'method':20} {'functions':>10} {'assembly':>10} {'solution':>10} {'together':>10} {'half band':>10}"
    )
    for method, basis in PAIRS:
        state = build(
            "problem=cantilever_self_weight", f"method={method}", f"basis={basis}", "resolution=128"
        )
        equations = equations_of(state)
        du = np.zeros_like(state.nodes.v)
        residual = equations.residual(du)
        assert residual is not None
        tasks = {
            "functions": lambda state=state: prepare(state),
            "assembly": lambda equations=equations, du=du: equations.residual(du),
            "solution": lambda equations=equations, du=du, r=residual: equations.correction(du, r),
        }
        seconds = interleaved(tasks)
        together = seconds["assembly"] + seconds["solution"]
        parts = "".join(f" {1e3 * seconds[name]:10.2f}" for name in tasks)
        band = 2 * (equations.pattern.band + 1) - 1
        print(f"{method + ' ' + basis:20}{parts} {1e3 * together:10.2f} {band:10}")
        if method == "implicit_mpm":
            measured("Newton iteration, implicit MPM", 1e3 * together)
        elif method == "gmm":
            measured(f"implicit functions, {basis.upper()}", 1e3 * seconds["functions"])
            if basis == "lme":
                measured("Newton iteration, GMM", 1e3 * together)


def whole_runs() -> None:
    """CPU seconds of whole runs."""
    print("\nWhole runs, CPU seconds")
    runs = (
        (
            "cantilever, h = 1/32, MPM",
            ("problem=cantilever_self_weight", "method=implicit_mpm", "resolution=256"),
        ),
        (
            "cantilever, h = 1/32, GMM-MLS",
            ("problem=cantilever_self_weight", "method=gmm", "basis=mls", "resolution=256"),
        ),
        (
            "cantilever, h = 1/100, MPM",
            ("problem=cantilever_self_weight", "method=implicit_mpm", "resolution=800"),
        ),
        (
            "soil column, h = 0.1, 2 s, MPM",
            ("problem=soil_column", "method=implicit_mpm"),
        ),
        ("soil column, h = 0.1, 2 s, GMM-LME", ("problem=soil_column", "method=gmm", "basis=lme")),
    )
    for name, overrides in runs:
        state = build(*overrides)
        step = state.choices.step
        static = state.choices.time == "static"
        dt, steps = (1.0, 1) if static else (2e-3, 1000)
        step(build(*overrides), dt)  # compiles
        start = process_time()
        for _ in range(steps):
            step(state, dt)
        took = process_time() - start
        print(f"{name:45} {took:8.2f}")
        if name.startswith("soil"):
            method = "GMM-LME" if "LME" in name else "implicit MPM"
            measured(f"soil column, h = 0.1 m, {method}", took)


def implicit() -> None:
    """Newton iterations and whole runs of the implicit methods."""
    newton_iteration()
    whole_runs()
