"""Explicit MPM beside the same in Taichi and warp: one state, one thread, rounds interleaved.

``python -m benchmarks peers`` prints the table, with 65^3 nodes after ``--large``; ``--write`` also
writes it to `benchmarks/peers.md`, beside the tables of other processors.
Peers are written by us, as plainly as a good user would: loops over particles in the order of their
cells, stress from F where it is needed. A round is the same 20 steps from the same start, after
which particles agree to `DIGITS` digits or the section fails. The material stays some cells away
from the edges of the grid, where functions of open knots differ from those of peers.
"""

import importlib
from collections.abc import Callable, Sequence
from importlib.util import find_spec
from pathlib import Path
from statistics import median
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np

from mpmbench.commands.compare.ratio import Ratio, ratio_of
from mpmbench.core import registry
from mpmbench.core.compiled import threads
from mpmbench.core.geometry import Box
from mpmbench.core.particles import Particles, seed_cells
from mpmbench.core.simulation import Body, build_state
from mpmbench.core.state import State
from mpmbench.results.provenance import processor

from .goals import measured
from .measure import bare

PEERS = {"taichi": "Taichi", "warp": "warp"}  # module, and what it is called
BASES = {1: "linear", 2: "bspline"}
# Dimension, cells a side, empty cells at each edge, particles per cell.
SIZES = ((2, 128, 4, 16), (3, 32, 3, 8))
LARGE = ((3, 64, 3, 8),)  # takes five minutes more
STEPS, ROUNDS, DIGITS = 20, 9, 12
SPEED, TIME_STEP = 2.0, 1e-5  # [m/s], [s]: no particle leaves its cell within a round
GOAL = 1.5
MISSING = "not installed (pip install 'mpmbench[peers]')"
WRITTEN = Path(__file__).with_suffix(".md")


class Start(NamedTuple):
    """What a peer starts from: undeformed particles of one mass [kg] and volume [m^dim] in a unit box.

    `x` [m] and `v` [m/s] have the shape (P, dim), there are `cells` along each axis, and
    `lame` and `shear` are the Lame parameters [Pa].
    """

    x: np.ndarray
    v: np.ndarray
    mass: float
    volume: float
    cells: int
    degree: int
    lame: float
    shear: float


class Ours:
    """The same for the step of this project."""

    def __init__(self, state: State) -> None:
        self.state = state
        p = state.particles
        self.initial = [(array, array.copy()) for array in (p.x, p.v, p.F, p.sigma, p.V)]

    def restart(self) -> None:
        """Put all particles back to where they started."""
        for array, copy in self.initial:
            array[:] = copy

    def run(self, steps: int, dt: float) -> None:
        """Do so many steps of `dt` [s]."""
        for _ in range(steps):
            self.state.choices.step(self.state, dt)

    def arrays(self) -> dict[str, np.ndarray]:
        """Places, velocities and deformation gradients now."""
        p = self.state.particles
        return {"x": p.x, "v": p.v, "F": p.F}


def block(dim: int, cells: int, empty: int, particles_per_cell: int, degree: int) -> State:
    """A free neo-Hookean block in the middle of a unit box, in motion that strains and shears it."""
    box = Box((0.0,) * dim, (1.0,) * dim, (cells,) * dim)
    edge = empty / cells
    filled = Box((edge,) * dim, (1.0 - edge,) * dim, (cells - 2 * empty,) * dim)
    material = registry.get("material", "neo_hookean")(
        young_modulus=1e7, poisson_ratio=0.3, density=1000.0
    )
    X, V0 = seed_cells(filled, particles_per_cell)
    particles = Particles.at_rest(X, V0, material.density)
    turned = np.roll(X, -1, axis=1)
    signs = np.array([1.0, -1.0, 0.5])[:dim]
    particles.v[:] = SPEED * signs * np.sin(2.0 * np.pi * X) * np.cos(2.0 * np.pi * turned)
    body = Body(box, particles, lambda x: np.zeros(x.shape, dtype=bool), np.zeros_like)
    basis, method = registry.get("basis", BASES[degree])(), registry.get("method", "explicit")()
    return bare(build_state(body, basis, material, method))


def start_of(state: State, cells: int, degree: int) -> Start:
    """What a peer needs of a state."""
    p = state.particles
    lame, shear = state.material.lame_parameters()  # type: ignore[attr-defined]
    return Start(p.x.copy(), p.v.copy(), float(p.m[0]), float(p.V0[0]), cells, degree, lame, shear)


def disagreement(ours: dict[str, np.ndarray], peer: dict[str, np.ndarray]) -> float:
    """Largest difference in any array over the largest entry there; not a number counts as infinite."""
    found = [
        float(np.abs(ours[name] - peer[name]).max() / np.abs(ours[name]).max()) for name in ours
    ]
    return max(found) if np.isfinite(found).all() else float("inf")


def rounds(contenders: dict[str, Any]) -> tuple[dict[str, list[float]], dict[str, float]]:
    """Seconds of each round, in which every contender has its turn, and how far peers are from ours.

    Raises
    ------
    SystemExit
        When a peer computes something else.
    """
    times: dict[str, list[float]] = {name: [] for name in contenders}
    far: dict[str, float] = {}
    for k in range(-2, ROUNDS):  # the first compiles, and the next meets cold memory
        for name, one in contenders.items():
            one.restart()
            begin = perf_counter()
            one.run(STEPS, TIME_STEP)
            if k >= 0:
                times[name].append(perf_counter() - begin)
        for name, one in contenders.items():
            far[name] = max(
                far.get(name, 0.0), disagreement(contenders["mpmbench"].arrays(), one.arrays())
            )
            if not far[name] < 10.0**-DIGITS:
                raise SystemExit(f"peers: {name} differs by {far[name]:.1e} after {STEPS} steps")
    return times, far


def case(
    dim: int, cells: int, empty: int, particles_per_cell: int, degree: int, peers: Sequence[str]
) -> str:
    """One row of the table."""
    state = block(dim, cells, empty, particles_per_cell, degree)
    start = start_of(state, cells, degree)
    contenders: dict[str, Any] = {
        name: importlib.import_module(f"{__package__}.peers_{name}").Peer(start) for name in peers
    }
    contenders["mpmbench"] = Ours(state)
    times, far = rounds(contenders)
    updates = len(start.x) * STEPS / 1e6
    shown = {name: rate(times[name], updates) if name in times else MISSING for name in PEERS}
    what = f"{dim}D, {cells + 1}^{dim} nodes, {'quadratic' if degree == 2 else 'linear'}"
    cells_of_row = [what, str(len(start.x)), rate(times["mpmbench"], updates), *shown.values()]
    if peers:
        best = min(peers, key=lambda name: median(times[name]))
        ratio = ahead(times["mpmbench"], times[best])
        cells_of_row += [said(ratio), f"{GOAL}"]
        if (dim, cells, empty, particles_per_cell) in SIZES:
            which = "quadratic" if degree == 2 else "linear"
            measured(f"explicit over the best peer, {dim}D {which}", np.exp(ratio.shift))
        cells_of_row.append(f"{max(far.values()):.0e}")
    else:
        cells_of_row += ["", f"{GOAL}", ""]
    return f"| {' | '.join(cells_of_row)} |"


def rate(seconds: Sequence[float], updates: float) -> str:
    """Median, and the slowest and fastest round, of millions of particle steps per second."""
    rates = [updates / one for one in seconds]
    return f"{median(rates):.1f} ({min(rates):.1f} to {max(rates):.1f})"


def ahead(ours: Sequence[float], peer: Sequence[float]) -> Ratio:
    """How many times longer the peer takes."""
    return ratio_of([(np.log(ours), np.log(peer))])


def said(ratio: Ratio) -> str:
    """A ratio and its interval."""
    low, middle, high = np.exp(ratio.shift + ratio.half_width * np.array([-1.0, 0.0, 1.0]))
    return f"{middle:.2f} ({low:.2f} to {high:.2f})"


def version(module: str) -> str:
    """That of an installed peer."""
    found = importlib.import_module(module).__version__
    return found if isinstance(found, str) else ".".join(map(str, found))


def table(say: Callable[[str], None], sizes: Sequence[tuple[int, int, int, int]]) -> None:
    """Say the table row by row, for each of the sizes linear and quadratic."""
    peers = [name for name in PEERS if find_spec(name) is not None]
    names = [f"{PEERS[name]} {version(name) if name in peers else ''}".strip() for name in PEERS]
    threads.use(1)
    say(
        f"Explicit MPM (USL, FLIP, neo-Hookean, float64) on one thread of {processor()}: 10^6 particle "
        f"steps per second,\nmedian and extremes of {ROUNDS} interleaved rounds of {STEPS} steps; "
        "how many times longer the best peer takes, with its 95 %\ninterval; and the largest "
        "relative difference of x, v and F from any peer's.\n"
    )
    say(f"| case | particles | mpmbench | {' | '.join(names)} | ahead | goal | differ |")
    say("|---" * (len(names) + 6) + "|")
    for size in sizes:
        for degree in BASES:
            say(case(*size, degree, peers))
    kratos = "installed, but not compared" if find_spec("KratosMultiphysics") else "not installed"
    say(f"\nKratos (implicit): {kratos}.")


def peers() -> None:
    """Explicit MPM beside the same in Taichi and warp."""
    print()
    table(print, SIZES)


def main(arguments: Sequence[str]) -> int:
    """``python -m benchmarks peers [--large] [--write]``."""
    if not {*arguments} <= {"--large", "--write"}:
        print("python -m benchmarks peers [--large] [--write]")
        return 2
    lines: list[str] = []

    def say(text: str) -> None:
        print(text, flush=True)
        lines.append(text)

    table(say, SIZES + LARGE if "--large" in arguments else SIZES)
    if "--write" in arguments:
        write("\n".join(lines))
    return 0


def write(measured_here: str) -> None:
    """Put a table under the name of this processor, in the place of an older one."""
    sections = WRITTEN.read_text().split("\n## ")[1:] if WRITTEN.exists() else []
    tables = dict(section.split("\n\n", 1) for section in sections)
    tables[processor()] = measured_here
    text = [f"## {name}\n\n{tables[name].strip()}\n" for name in sorted(tables)]
    WRITTEN.write_text("\n".join(["# Beside its peers\n", *text]))
