"""Print the speed of the explicit core and of campaigns, on a quiet machine: ``python -m benchmarks [SECTION...]``."""

import argparse
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from statistics import median

import numpy as np

from mpmbench import case
from mpmbench.core import registry
from mpmbench.core.bases.grid.product import GridBasis
from mpmbench.core.bases.grid.spline import TensorSpline
from mpmbench.core.compiled import threads
from mpmbench.core.geometry import Box, Cloud
from mpmbench.core.loops.explicit import step
from mpmbench.core.particles import Particles
from mpmbench.runs.hydra import compose

from . import goals, mutants, peers, reference
from .campaigns import campaign, overhead, program, seconds_of
from .compiling import compiling
from .contact import contact
from .family import family, transfers
from .functions import functions
from .goals import measured
from .implicit import implicit
from .measure import REPEATS, interleaved, plate
from .power import power
from .reference_numpy import numpy_step
from .roofline import roofline
from .scaling import scaling, sizes, users
from .sorting import sorting
from .taylor import taylor

TIME_STEP = 1e-6  # [s], stable on the finest grid below


def particle_updates() -> None:
    """Millions of whole steps of one particle per CPU-second, against numpy in the same run."""
    print(
        "Particle updates, 10^6 per CPU-second: MPM lumped, plate without body force, 16 particles per cell"
    )
    print(
        f"{'basis':10} {'nodes a side':>12} {'1 thread':>9} {'2 threads':>10} {'np.add.at':>10} {'ratio':>7}"
    )
    for basis in ("linear", "bspline"):
        for nodes in (33, 129, 513):
            state = plate(basis, nodes - 1)
            particles = len(state.particles.x)

            def on(n: int, state=state) -> Callable[[], None]:  # type: ignore[no-untyped-def]
                def task() -> None:
                    threads.use(n)
                    step(state, TIME_STEP)

                return task

            tasks = {"1": on(1), "2": on(2)}
            if nodes == 129:
                twin = plate(basis, nodes - 1)
                assert isinstance(twin.basis, TensorSpline)
                spline = twin.basis
                tasks["numpy"] = lambda twin=twin, spline=spline: numpy_step(
                    twin, spline, TIME_STEP
                )  # type: ignore[misc]
            seconds = interleaved(tasks)
            rate = {name: particles / value / 1e6 for name, value in seconds.items()}
            numpy_rate = (
                f"{rate['numpy']:10.2f} {rate['1'] / rate['numpy']:7.1f}" if "numpy" in rate else ""
            )
            print(f"{basis:10} {nodes:12} {rate['1']:9.1f} {rate['2']:10.1f} {numpy_rate}")
    threads.use(1)


def evaluations() -> None:
    """Nanoseconds for all values and gradients at one point, 2D, 65 x 65 nodes, 16 points per cell."""
    print(
        "\nEvaluation of values and gradients in 2D, ns per point (ratio to the quadratic B-spline)"
    )
    cells = 64
    box = Box((0.0, 0.0), (1.0, 1.0), (cells, cells))
    rng = np.random.default_rng(0)
    jittered = box.points.copy()
    inner = np.all((jittered > 0.01) & (jittered < 0.99), axis=1)
    jittered[inner] += rng.uniform(-0.2, 0.2, (int(inner.sum()), 2)) / cells
    points, volumes = registry.get("problem", "plate_axis_aligned")().seed(cells, 16)
    tasks = {}
    for name, plugin, settings, geometry in (
        ("bspline degree 2", "bspline", {}, box),
        ("linear", "linear", {}, box),
        ("bspline degree 3", "bspline", {"degree": 3}, box),
        ("gimp", "gimp", {}, box),
        ("cpdi", "cpdi", {}, box),
        ("on a mesh, cpdi2", "cpdi2", {}, box),
        ("ddmp", "ddmp", {}, box),
        ("maxent cubic prior, grid", "maxent", {}, box),
        ("lme gamma 1.8, arbitrary cloud", "lme", {}, Cloud(jittered)),
        ("mls, arbitrary cloud", "mls", {}, Cloud(jittered)),
    ):
        basis = registry.get("basis", plugin)(**settings).build(geometry, len(points), False)
        basis.follow(Particles.at_rest(points, volumes, 1.0))
        tasks[name] = evaluation(basis, points)
    seconds = interleaved(tasks)
    for name, value in seconds.items():
        print(
            f"{name:32} {value / len(points) * 1e9:8.1f} {value / seconds['bspline degree 2']:7.1f}"
        )
    named = (
        ("maxent", "max-ent"),
        ("lme", "LME"),
        ("mls", "MLS"),
        ("gimp", "GIMP"),
        ("cpdi", "CPDI"),
        ("on a mesh", "CPDI2"),
        ("ddmp", "DDMP"),
    )
    for start, called in named:
        (took,) = (value for name, value in seconds.items() if name.startswith(start))
        measured(f"{called} in quadratic B-splines", took / seconds["bspline degree 2"])


def evaluation(basis, points: np.ndarray) -> Callable[[], object]:  # type: ignore[no-untyped-def]
    """A task that computes every function once: kept on the fly on grids, stored on clouds."""
    if isinstance(basis, GridBasis):
        from .sweep import evaluate_all

        return lambda: evaluate_all(basis.handle, points)
    return lambda: basis.locate(points)


def consistent_mass() -> None:
    """What a consistent mass costs, in steps of the lumped one."""
    print("\nConsistent over lumped step, 129 x 129 nodes")
    for basis in ("linear", "bspline"):
        lumped, consistent = plate(basis, 128), plate(basis, 128, "consistent")
        seconds = interleaved(
            {
                "lumped": lambda s=lumped: step(s, TIME_STEP),
                "consistent": lambda s=consistent: step(s, TIME_STEP),
            }  # type: ignore[misc]
        )
        ratio = seconds["consistent"] / seconds["lumped"]
        print(f"{basis:10} {ratio:6.1f}")
        which = "linear" if basis == "linear" else "quadratic"
        measured(f"consistent over lumped step, {which}", ratio)


def bar() -> None:
    """Benchmark 8.1 as a user runs it: the solver's own clock."""
    print("\nbar_fixed_ends, MPM linear lumped, 512 nodes, 12 particles per cell")
    (config, _), *_ = compose.compose_many([["resolution=511"]])
    times = []
    for _ in range(REPEATS):
        result = case.solve(config)
        times.append(
            float(result["solver_time"]) / int(result["steps"]) / int(result["n_particles"])
        )
    print(f"{median(times) * 1e9:8.1f} ns per particle and step")
    measured("1D bar, a particle and step", median(times) * 1e9)


def start_up() -> None:
    """Whole commands, the first with an empty cache of kernels."""
    print("\nStart-up, wall-clock seconds (goal: 0.5 for --help and list)")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        cache = {"XDG_CACHE_HOME": str(folder / "cache")}
        first = seconds_of(program("rerun=all"), folder, **cache)
        print(f"{'first run, compiling':48} {first:7.2f}")
        measured("first run of all", first)
        for words in (["rerun=all"], ["--help"], ["list"], ["--cfg", "job"]):
            what = " ".join(words) if words[0] != "rerun=all" else "second run"
            took = median(seconds_of(program(*words), folder, **cache) for _ in range(5))
            print(f"{what:48} {took:7.2f}")
            if what == "second run":
                measured(what, took)


SECTIONS = {
    f.__name__: f
    for f in (
        particle_updates,
        users,
        scaling,
        sizes,
        evaluations,
        functions,
        consistent_mass,
        family,
        transfers,
        taylor,
        contact,
        implicit,
        sorting,
        bar,
        start_up,
        compiling,
        overhead,
        campaign,
        power,
        peers.peers,
        roofline,
    )
}

COMMANDS = {"reference": reference.main, "mutants": mutants.main}  # they have options of their own


def main(arguments: list[str]) -> int:
    """Run the sections that were asked for, then print goals and figures."""
    if arguments[:1] and arguments[0] in COMMANDS:
        return COMMANDS[arguments[0]](arguments[1:])
    if "--large" in arguments or "--write" in arguments:
        return peers.main([word for word in arguments if word != "peers"])
    parser = argparse.ArgumentParser(
        prog=f"python -m {__package__}",
        description="Measure the speed of the program; only on a quiet machine do figures mean much.",
        epilog="sections: " + ", ".join(SECTIONS) + "; 'peers --write', 'reference' and 'mutants' "
        "have options of their own",
    )
    parser.add_argument("section", nargs="*", help="what is measured; all without one")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the figures to a file")
    parser.add_argument(
        "--compare", type=Path, metavar="FILE", help="print figures over those of an earlier --json"
    )
    chosen = parser.parse_args(arguments)
    unknown = [name for name in chosen.section if name not in SECTIONS]
    if unknown:
        parser.error(f"unknown section {unknown[0]!r}; there are {', '.join(SECTIONS)}")
    if chosen.compare and not chosen.compare.is_file():
        parser.error(f"--compare {chosen.compare}: there is no such file")
    before = goals.stored(chosen.compare) if chosen.compare else None
    for name in chosen.section or SECTIONS:
        SECTIONS[name]()
    goals.print_goals(before)
    if chosen.json:
        goals.store(chosen.json)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
