"""Local max-ent functions on 11 x 11 nodes: values, derivatives, Newton's iteration (Li 2009, section 2.2, Table 2.1).

The nodes fill a square with the spacing h = 1, regular or displaced at random; the functions are
evaluated at a grid of samples, with the multipliers starting from zero at each.
"""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from mpmbench.core.choices import Choices
from mpmbench.core.errors import NotApplicable, SolverFailure
from mpmbench.core.geometry import Box, Cloud, Geometry, tensor_points
from mpmbench.core.geometry.triangulate import jittered
from mpmbench.core.materials import Material
from mpmbench.core.particles import Particles
from mpmbench.core.registry import register
from mpmbench.core.setting import setting
from mpmbench.core.simulation import Solution
from mpmbench.core.state import State
from mpmbench.problems import Problem


@register("problem", "lme_shape_functions")
@dataclass(frozen=True)
class ShapeFunctions(Problem):
    """Local max-ent functions on 11 x 11 nodes: values, derivatives, Newton's steps; Li 2009, Sect. 2.2.

    The spacing of the nodes is 1 m for resolution 10.
    """

    irregularity: float = setting(
        0.3, "random displacement of nodes over their spacing", unit="-", least=0.0, most=0.4
    )
    samples_per_axis: int = setting(
        41,
        "the functions are evaluated at a square of so many points a side",
        unit="-",
        least=2,
        most=1000,
    )
    margin: float = setting(
        0.05, "distance of the outermost samples from the boundary", unit="m", least=0.0, below=5.0
    )
    metric_stretch: float = setting(
        1.0,
        "s: samples carry F = diag(s, 1/s), the metric of a convected locality",
        unit="-",
        least=0.1,
        most=10.0,
    )
    random_seed: int = 0
    dimension: ClassVar[int] = 2
    still: ClassVar[bool] = True
    reference_length: ClassVar[float] = 10.0

    def check(self, material: Material, choices: Choices, basis: str, resolution: int) -> None:
        if basis not in ("lme", "maxent"):
            raise NotApplicable(
                f"basis={basis} has no multipliers to iterate for: lme and maxent have"
            )
        if choices.moves_particles:
            raise NotApplicable(
                f"method={choices.name} moves particles: the study of functions needs method=evaluate"
            )

    # geometry

    def nodes(self, resolution: int, choices: Choices) -> Geometry:
        l, h = self.reference_length, self.reference_length / resolution
        regular = Box((0.0, 0.0), (l, l), (resolution, resolution)).points
        on_boundary = (regular < 1e-9 * l) | (regular > (1.0 - 1e-9) * l)
        return Cloud(
            jittered(regular, h, self.irregularity, on_boundary, self.random_seed), spacing=h
        )

    def seed(self, resolution: int, particles_per_cell: int) -> tuple[np.ndarray, np.ndarray]:
        line = np.linspace(self.margin, self.reference_length - self.margin, self.samples_per_axis)
        X = tensor_points([line, line])
        return X, np.full(len(X), self.reference_length**2 / len(X))

    def prepare(self, particles: Particles, material: Material) -> None:
        particles.F[:] = np.diag([self.metric_stretch, 1.0 / self.metric_stretch])

    # quantities of interest

    def shown(self, nodes: np.ndarray) -> np.ndarray:
        """Numbers of the nodes whose functions are kept: centre, next to an edge, on an edge, and at a corner."""
        n = round(len(nodes) ** 0.5)
        middle = n // 2
        return np.array([middle * n + middle, n + middle, middle, 0])

    def observe(self, state: State) -> dict[str, Any]:
        """Newton's steps at each sample, -1 where they fail, and some of the functions."""
        basis, x = state.basis, state.particles.x
        steps = basis.newton_steps(x)  # type: ignore[attr-defined]
        shown = self.shown(basis.nodes)
        phi, gradient = (
            np.full((len(x), len(shown)), np.nan),
            np.full((len(x), len(shown), 2), np.nan),
        )
        completeness = np.full(len(x), np.nan)
        good = np.flatnonzero(steps >= 0)
        try:
            stored = basis.evaluate(x[good])
        except SolverFailure:  # without a line search values may fail where counting did not
            good = good[:0]
        if len(good):
            values = stored.matrix(len(basis.nodes))
            phi[good], gradient[good] = (
                values[:, shown],
                stored.gradient_matrix(len(basis.nodes))[:, shown],
            )
            completeness[good] = np.linalg.norm(values @ basis.nodes - x[good], axis=1)
        return {
            "newton_steps": steps,
            "shape_function": phi,
            "shape_function_gradient": gradient,
            "completeness": completeness,
            "shown_nodes": basis.nodes[shown],
        }

    def quantities(self, solution: Solution, material: Material) -> dict[str, tuple[Any, ...]]:
        found = {name: values[0] for name, values in solution.history.items()}
        steps, converged = found["newton_steps"], found["newton_steps"] >= 0
        mean = float(steps[converged].mean()) if converged.any() else np.nan
        failed = int(np.count_nonzero(~converged))
        return {
            "newton_steps_mean": (
                mean,
                "1",
                "Newton steps until the tolerance is met, mean over converged samples",
            ),
            "newton_steps_max": (int(steps.max()), "1", "most Newton steps at one sample"),
            "newton_failures": (failed, "1", "samples where Newton's iteration fails"),
            "newton_failures_share": (
                failed / len(steps),
                "1",
                "share of samples where Newton's iteration fails",
            ),
            "newton_steps": (steps, "1", "Newton steps, -1 where they fail", ("particle",)),
            "shape_function": (
                found["shape_function"],
                "1",
                "functions of some nodes",
                ("particle", "shown"),
            ),
            "shape_function_gradient": (
                found["shape_function_gradient"],
                "m-1",
                "gradients of these functions",
                ("particle", "shown", "dim"),
            ),
            "shown_nodes": (
                found["shown_nodes"],
                "m",
                "positions of these nodes",
                ("shown", "dim"),
            ),
            "error_completeness": (
                float(np.nanmax(found["completeness"], initial=0.0)),
                "m",
                "largest |sum_i phi_i x_i - x| where the iteration converges",
            ),
        }
