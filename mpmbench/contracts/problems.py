"""The contract of a problem: its parts fit together, and a finer run is a better one."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from mpmbench.contracts import Contract, Finding, largest
from mpmbench.core import registry
from mpmbench.core.choices import Choices
from mpmbench.core.materials import Material

CHECKS = Contract()


@dataclass(frozen=True)
class ProblemCase:
    """A problem with the settings, material and discretisation of its YAML file."""

    name: str
    settings: dict[str, Any]
    material_name: str
    material_settings: dict[str, Any]
    resolution: int
    particles_per_cell: int
    end_time: float

    @property
    def dimension(self) -> int:
        return int(self.problem.dimension)

    @property
    def problem(self) -> Any:
        return registry.get("problem", self.name)(**self.settings)

    @property
    def material(self) -> Material:
        material: Material = registry.get("material", self.material_name)(**self.material_settings)
        return material

    @property
    def positions(self) -> np.ndarray:
        """Where the particles are before they are placed [m], shape (P, dim)."""
        return np.asarray(self.problem.seed(self.resolution, self.particles_per_cell)[0])


@CHECKS.asks()
def particles_fill_the_body(case: ProblemCase) -> Iterator[Finding]:
    """Positions and volumes have the right shapes, and refining keeps the volume of the body (of round ones nearly)."""
    problem = case.problem
    X, V0 = problem.seed(case.resolution, case.particles_per_cell)
    X2, V2 = problem.seed(2 * case.resolution, case.particles_per_cell)
    right = X.shape == (len(V0), problem.dimension) and (V0 > 0.0).all() and len(X2) >= len(X)
    yield Finding(bool(right), f"positions {X.shape}, volumes {V0.shape} from {V0.min():.2g}")
    change = V2.sum() / V0.sum() - 1.0
    yield Finding.below(change, 0.01, "relative change of the volume with the resolution")


@CHECKS.asks()
def fields_have_shapes(case: ProblemCase) -> Iterator[Finding]:
    """Velocity and constraints are given for any points, and tracers have the dimension of the problem."""
    problem, X = case.problem, case.positions
    v, fixed, tracers = problem.velocity(X, case.material), problem.fixed(X), problem.tracers()
    right = (
        v.shape == X.shape == fixed.shape
        and fixed.dtype == bool
        and tracers.shape[1:] == (problem.dimension,)
    )
    yield Finding(
        right, f"velocity {v.shape}, fixed {fixed.shape} of {fixed.dtype}, tracers {tracers.shape}"
    )


@CHECKS.asks()
def the_solution_starts_as_the_problem(case: ProblemCase) -> Iterator[Finding]:
    """The exact solution at t = 0 has the initial velocity, and the displacement that the body starts with."""
    problem, material, X = case.problem, case.material, case.positions
    exact, start = problem.exact(X, 0.0, material), problem.initial_displacement(material)
    length, speed = scales(case, X)
    yield Finding(True, "no exact solution")
    if "displacement" in exact:
        difference = exact["displacement"] - (np.zeros_like(X) if start is None else start(X))
        what = "relative difference of the displacements"
        yield Finding.below(most(difference) / length, 1e-6, what)
    if "velocity" in exact:
        difference = exact["velocity"] - problem.velocity(X, material)
        what = "relative difference of the velocities"
        yield Finding.below(most(difference) / speed, 1e-6, what)


@CHECKS.asks()
def the_velocity_is_the_rate(case: ProblemCase) -> Iterator[Finding]:
    """The exact velocity is the derivative of the exact displacement in time."""
    X, t, step = case.positions, 0.2 * case.end_time, 1e-5 * case.end_time
    before, now, after = (
        case.problem.exact(X, time, case.material) for time in (t - step, t, t + step)
    )
    if not all({"displacement", "velocity"} <= set(some) for some in (before, now, after)):
        yield Finding(True, "no exact velocity")
        return
    difference = now["velocity"] - (after["displacement"] - before["displacement"]) / (2.0 * step)
    _, speed = scales(case, X)
    yield Finding.below(most(difference) / speed, 1e-4, "relative difference from the rate")


def scales(case: ProblemCase, X: np.ndarray) -> tuple[float, float]:
    """Largest displacement [m] and velocity [m/s] of the problem, to measure differences by."""
    times = np.linspace(0.0, case.end_time, 5)
    fields = [case.problem.exact(X, float(t), case.material) for t in times]
    lengths, speeds = (
        [largest(some[name]) for some in fields if name in some]
        for name in ("displacement", "velocity")
    )
    length = max([1e-300, *lengths])
    start = largest(case.problem.velocity(X, case.material))
    return length, max([start, length / case.end_time, *speeds])


@CHECKS.asks()
def nodes_hold_the_particles(case: ProblemCase) -> Iterator[Finding]:
    """All particles start inside the nodes, whether these are fixed or move."""
    for nodes in ("fixed", "moving"):
        choices = Choices(nodes=nodes)
        x = case.problem.place(case.positions, case.resolution, choices)
        places = case.problem.nodes(case.resolution, choices).points
        inside = np.all(
            (places.min(axis=0) <= x.min(axis=0)) & (x.max(axis=0) <= places.max(axis=0))
        )
        yield Finding(bool(inside), f"particles lie outside the box around {nodes} nodes")


def most(values: np.ndarray) -> float:
    """Largest magnitude of all but a fiftieth of the values: a jump may be read from either side."""
    return float(np.quantile(np.abs(values), 0.98))
