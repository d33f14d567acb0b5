"""What a transfer takes away and lets in, in numbers: the audit that decides between transfers.

Each measure is one motion of a free block whose particles start in step with the grid, with smooth
quadratic functions and a lumped mass. Losses are those of kinetic and strain energy together, per
step; the part of the motion that particles carry besides their velocities counts in the angular
momentum only.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from mpmbench.analysis.slopes import fitted_order
from mpmbench.contracts.loops import NO_STIFFNESS, MethodCase
from mpmbench.core.loops import TimeLoop
from mpmbench.core.simulation import Solution, simulate
from mpmbench.core.state import State

STEP = 5e-4  # [s], in which a wave crosses a sixteenth of a cell of 0.25 m
SPIN = 2.0  # [1/s]
CENTRE = 1.5  # of a block of 8 cells with two empty ones around it [m]
MIDDLE = 0.875  # of one of 3 cells [m]
FINEST = 8  # times smaller steps than `STEP`, in an order


@dataclass(frozen=True)
class Audit:
    """What was measured.

    Attributes
    ----------
    spin : float
        Largest change of the angular momentum over ``sum m |x| |v|``, of a block that spins and waves.
    rotation, wave, shear : float
        Part of the energy lost in a step: by a block that turns (it has some stress), by the
        longest standing wave of a bar, and by a shear layer one cell thin in a material without
        stiffness.
    noise : float
        What is left, after some steps, of particle velocities that nodes cannot see.
    order : float
        Order in time of the positions in the standing wave, on one grid, from differences of runs
        whose steps are halved three times. A filter that acts in every step has none: its loss
        grows with the number of steps.
    """

    spin: float
    rotation: float
    wave: float
    shear: float
    noise: float
    order: float


def audit(choices: TimeLoop, steps: int = 100) -> Audit:
    """Measure everything over so many steps."""
    return Audit(
        spin_drift(choices, steps),
        loss(rotation(choices), steps),
        loss(wave(choices), steps),
        loss(shear(choices), steps),
        noise_left(choices, steps),
        order_in_time(choices, steps),
    )


def rotation(choices: TimeLoop) -> State:
    """A block that turns about its middle."""

    def velocity(x: np.ndarray) -> np.ndarray:
        return SPIN * np.column_stack([CENTRE - x[:, 1], x[:, 0] - CENTRE])

    return MethodCase(choices, 2, "bspline").block(velocity, cells=8)


def wave(choices: TimeLoop) -> State:
    """The first mode of a free bar of 8 cells, which moves like ``cos(pi x / L)``."""
    start, length = 0.5, 2.0  # [m]
    case = MethodCase(choices, 1, "bspline")
    return case.block(lambda x: 0.1 * np.cos(np.pi * (x - start) / length), cells=8)


def shear(choices: TimeLoop) -> State:
    """Layers that slide over each other, with a change of velocity within one cell."""

    def velocity(x: np.ndarray) -> np.ndarray:
        return np.column_stack([0.1 * np.tanh((x[:, 1] - CENTRE) / 0.125), 0.0 * x[:, 0]])

    case = MethodCase(choices, 2, "bspline", young_modulus=NO_STIFFNESS)
    return case.block(velocity, cells=8)


def run(state: State, steps: int) -> Solution:
    """Do so many steps and keep the history of each.

    Raises
    ------
    RuntimeError
        When they do not end well.
    """
    state.samples = 2 * steps
    solution = simulate(state, STEP, steps * STEP)
    if solution.status != "ok":
        raise RuntimeError(solution.reason)
    return solution


def loss(state: State, steps: int) -> float:
    """Part of the energy that is lost in a step, after the first, which filters what nodes cannot see."""
    history = run(state, steps).history
    energy = np.add(history["kinetic_energy"], history["strain_energy"])
    return float(1.0 - (energy[-1] / energy[1]) ** (1.0 / (len(energy) - 2)))


def spin_drift(choices: TimeLoop, steps: int) -> float:
    """Change of the angular momentum of a block that spins and waves."""

    def velocity(x: np.ndarray) -> np.ndarray:
        arm = x - MIDDLE
        turning = SPIN * np.column_stack([-arm[:, 1], arm[:, 0]])
        return turning + 0.5 * np.sin(3.0 * arm[:, ::-1]) * [2.0, 1.0]

    state = MethodCase(choices, 2, "bspline").block(velocity)
    p = state.particles
    scale = float(p.m @ (np.linalg.norm(p.x, axis=1) * np.linalg.norm(p.v, axis=1)))
    spin = np.array(run(state, steps).history["angular_momentum"])[1:]
    return float(np.abs(spin - spin[0]).max()) / scale


def noise_left(choices: TimeLoop, steps: int) -> float:
    """Root mean square of the velocities that nodes cannot see at the end, over that at the start."""
    noise = np.zeros((0, 1))

    def velocity(x: np.ndarray) -> np.ndarray:
        return noise if len(noise) == len(x) else np.zeros_like(x)

    case = MethodCase(choices, 1, "bspline")
    rest = case.block(velocity, cells=8)
    noise = 1e-3 * unseen(rest, np.random.default_rng(3).standard_normal(rest.particles.x.shape))
    state = case.block(velocity, cells=8)
    run(state, steps)
    return float(np.linalg.norm(unseen(state, state.particles.v)) / np.linalg.norm(noise))


def order_in_time(choices: TimeLoop, steps: int) -> float:
    """Slope of the differences of positions between runs with steps that are halved."""
    places, sizes = [], [1, 2, 4, FINEST]
    for size in sizes:
        state = wave(choices)
        solution = simulate(state, STEP / size, steps * STEP)
        if solution.status != "ok":
            raise RuntimeError(solution.reason)
        places.append(state.particles.x.copy())
    differences = np.array([np.abs(a - b).max() for a, b in pairwise(places)])
    return fitted_order(1.0 / np.array(sizes[:-1]), differences)


def unseen(s: State, v: np.ndarray) -> np.ndarray:
    """The part of particle velocities that gives no node any momentum, shape (P, dim)."""
    p = s.particles
    S = s.basis.evaluate(p.x).matrix(len(s.basis.nodes))
    root = np.sqrt(p.m)[:, None]
    seen = np.linalg.lstsq(root * S, root * v, rcond=1e-10)[0]
    return np.asarray(v - S @ seen)
