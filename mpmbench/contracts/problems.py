"""The contract of a problem: its parts fit together, and a finer run is a better one."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from mpmbench.contracts import Check, Finding, largest
from mpmbench.core import registry
from mpmbench.core.choices import Choices
from mpmbench.core.materials import Material


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
    def problem(self) -> Any:
        return registry.get("problem", self.name)(**self.settings)

    @property
    def material(self) -> Material:
        material: Material = registry.get("material", self.material_name)(**self.material_settings)
        return material


def particles_fill_the_body(case: ProblemCase) -> Finding:
    """Positions and volumes have the right shapes, and refining keeps the volume of the body (of round ones nearly)."""
    problem = case.problem
    X, V0 = problem.seed(case.resolution, case.particles_per_cell)
    X2, V2 = problem.seed(2 * case.resolution, case.particles_per_cell)
    shapes = (
        X.shape == (len(V0), problem.dimension) and bool((V0 > 0.0).all()) and len(X2) >= len(X)
    )
    change = abs(V2.sum() / V0.sum() - 1.0)
    return Finding.all(
        [
            Finding(shapes, f"positions {X.shape}, volumes {V0.shape} from {V0.min():.2g}"),
            Finding.below(float(change), 0.01, "relative change of the volume with the resolution"),
        ]
    )


def fields_have_shapes(case: ProblemCase) -> Finding:
    """Velocity and constraints are given for any points, and tracers have the dimension of the problem."""
    problem = case.problem
    X, _ = problem.seed(case.resolution, case.particles_per_cell)
    v, fixed, tracers = problem.velocity(X, case.material), problem.fixed(X), problem.tracers()
    right = (
        v.shape == X.shape == fixed.shape
        and fixed.dtype == bool
        and tracers.shape[1:] == (problem.dimension,)
    )
    return Finding(
        right, f"velocity {v.shape}, fixed {fixed.shape} of {fixed.dtype}, tracers {tracers.shape}"
    )


def solution_starts_as_the_problem(case: ProblemCase) -> Finding:
    """The exact solution at t = 0 has the initial velocity, and the displacement that the body starts with."""
    problem, material = case.problem, case.material
    X, _ = problem.seed(case.resolution, case.particles_per_cell)
    exact, start = problem.exact(X, 0.0, material), problem.initial_displacement(material)
    length, speed = scales(case, X)
    findings = [Finding(True, "no exact solution")]
    if "displacement" in exact:
        difference = exact["displacement"] - (np.zeros_like(X) if start is None else start(X))
        findings.append(
            Finding.below(
                most(difference) / length, 1e-6, "relative difference of the displacements"
            )
        )
    if "velocity" in exact:
        difference = exact["velocity"] - problem.velocity(X, material)
        findings.append(
            Finding.below(most(difference) / speed, 1e-6, "relative difference of the velocities")
        )
    return Finding.all(findings)


def velocity_is_the_rate(case: ProblemCase) -> Finding:
    """The exact velocity is the derivative of the exact displacement in time."""
    problem, material = case.problem, case.material
    X, _ = problem.seed(case.resolution, case.particles_per_cell)
    t, step = 0.2 * case.end_time, 1e-5 * case.end_time
    fields = [problem.exact(X, time, material) for time in (t - step, t, t + step)]
    if not all({"displacement", "velocity"} <= set(some) for some in fields):
        return Finding(True, "no exact velocity")
    rate = (fields[2]["displacement"] - fields[0]["displacement"]) / (2.0 * step)
    _, speed = scales(case, X)
    return Finding.below(
        most(fields[1]["velocity"] - rate) / speed, 1e-4, "relative difference from the rate"
    )


def scales(case: ProblemCase, X: np.ndarray) -> tuple[float, float]:
    """Largest displacement [m] and velocity [m/s] of the problem, to measure differences by."""
    times = np.linspace(0.0, case.end_time, 5)
    fields = [case.problem.exact(X, float(t), case.material) for t in times]
    length = max(
        [1e-300, *(largest(some["displacement"]) for some in fields if "displacement" in some)]
    )
    start = largest(case.problem.velocity(X, case.material))
    return length, max(
        [
            start,
            length / case.end_time,
            *(largest(some["velocity"]) for some in fields if "velocity" in some),
        ]
    )


def nodes_hold_the_particles(case: ProblemCase) -> Finding:
    """All particles start inside the nodes, whether these are fixed or move."""
    problem = case.problem
    X, _ = problem.seed(case.resolution, case.particles_per_cell)
    findings = []
    for nodes in ("fixed", "moving"):
        choices = Choices(nodes=nodes)
        geometry, x = (
            problem.nodes(case.resolution, choices),
            problem.place(X, case.resolution, choices),
        )
        places = geometry.points
        inside = bool(
            (places.min(axis=0) <= x.min(axis=0)).all()
            and (places.max(axis=0) >= x.max(axis=0)).all()
        )
        findings.append(Finding(inside, f"particles lie outside the box around {nodes} nodes"))
    return Finding.all(findings)


def most(values: np.ndarray) -> float:
    """Largest magnitude of all but a fiftieth of the values: a jump may be read from either side."""
    return float(np.quantile(np.abs(values), 0.98))


CHECKS: dict[str, Check] = {
    "particles fill the body": particles_fill_the_body,
    "fields have shapes": fields_have_shapes,
    "the solution starts as the problem": solution_starts_as_the_problem,
    "the velocity is the rate": velocity_is_the_rate,
    "nodes hold the particles": nodes_hold_the_particles,
}
