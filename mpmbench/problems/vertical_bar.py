"""A block that hangs from rollers and falls when its weight is switched on (Sadeghirad, Brannon and Burghardt 2011).

A block of 1 x 1 m (1 m^3 in 3D) of neo-Hookean material slides on a roller along its top edge, in
plane strain. The weight acts from t = 0, undamped: the block is stretched and comes back. Total-
Lagrangian quadrilaterals on 32 cells per metre give the largest mean displacement of the bottom
edge, at a weight of 1000 m/s2, as 1.6666 m at 0.0922 s; the top corners are singular.

Neighbours of the start tell whether the body holds together: with the mean F of both, ``|x_a - x_b|``
is ``|F (X_a - X_b)|`` in one that does, whatever its stretch. A body that has parted falls freely:
the run ends there, and its elongation is no result.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from mpmbench.core.choices import Choices
from mpmbench.core.errors import BrokeDown, NotApplicable
from mpmbench.core.geometry import Box, tensor_points
from mpmbench.core.materials import Material
from mpmbench.core.particles import Particles, seed_cells
from mpmbench.core.registry import register
from mpmbench.core.setting import setting
from mpmbench.core.simulation import Solution
from mpmbench.core.stability import wave_speed
from mpmbench.core.state import Loads, State
from mpmbench.problems import Problem

BELOW, BESIDE = 2.5, 1.0  # lengths of grid below and beside the block
PARTED = 2.0  # largest gap between neighbours that still holds them together
COURANT, IMPLICIT = 0.1, 1.0  # steps over the time in which a wave crosses an undeformed cell
TRACERS = {2: 32, 3: 8}  # along each axis of the bottom
# [m] and [s] by weight [m/s2]: plane strain, 1 m, 32 cells
REFERENCE = {
    100.0: (0.1026, 0.0674),
    300.0: (0.3531, 0.0741),
    500.0: (0.6652, 0.0797),
    700.0: (1.0314, 0.0849),
    1000.0: (1.6666, 0.0922),
}
REFERENCE_3D = {1000.0: (1.7464, 0.0923)}  # quadratic hexahedra, 24 cells


@register("problem", "vertical_bar")
@dataclass(frozen=True)
class VerticalBar(Problem):
    """Block stretched by its suddenly applied weight, Sadeghirad et al. 2011; 300 m/s2 is mild, 1000 the paper's.

    A run whose body parts breaks down. The last axis is vertical; the references hold for the
    material of this problem.
    """

    gravity: float = setting(1000.0, "weight per unit mass", unit="m/s2", above=0.0, below=1.0e4)
    length: float = setting(1.0, "of each side of the block", unit="m", above=0.0, below=1e3)
    dimension: int = setting(2, "plane strain or a cube", unit="-", options=(2, 3))  # type: ignore[misc]
    bends: ClassVar[bool] = True
    samples: ClassVar[int] = 500
    known_early: ClassVar[tuple[str, ...]] = ("largest_gap", "parted_at")

    @property
    def reference_length(self) -> float:  # type: ignore[override]
        """A side of the block."""
        return self.length

    def check(self, material: Material, choices: Choices, basis: str, resolution: int) -> None:
        if not choices.dynamic:
            raise NotApplicable(
                "vertical_bar is a dynamic problem: it needs method.time=explicit or newmark"
            )

    # geometry

    def _block(self, resolution: int) -> Box:
        dim, l = self.dimension, self.length
        return Box((0.0,) * dim, (l,) * dim, (resolution,) * dim)

    def nodes(self, resolution: int, choices: Choices) -> Box:
        if choices.on_body:
            return self._block(resolution)
        beside, below = math.ceil(BESIDE * resolution), math.ceil(BELOW * resolution)
        across, h, l = self.dimension - 1, self.length / resolution, self.length
        return Box(
            (-beside * h,) * across + (-below * h,),
            (l + beside * h,) * across + (l,),
            (resolution + 2 * beside,) * across + (resolution + below,),
        )

    def seed(self, resolution: int, particles_per_cell: int) -> tuple[np.ndarray, np.ndarray]:
        return seed_cells(self._block(resolution), particles_per_cell)

    def tracers(self) -> np.ndarray:
        """Points all over the bottom."""
        count = TRACERS[self.dimension]
        along = self.length * ((np.arange(count) + 0.5) / count)
        return tensor_points([*[along] * (self.dimension - 1), np.zeros(1)])

    # boundary conditions and loads

    def fixed(self, x: np.ndarray) -> np.ndarray:
        """Rollers along the top."""
        held = np.zeros(x.shape, dtype=bool)
        held[:, -1] = x[:, -1] > (1.0 - 1e-9) * self.length
        return held

    def loads(self, material: Material) -> Loads:
        def weight(X: np.ndarray, t: float, b: np.ndarray) -> None:
            b[:, :-1], b[:, -1] = 0.0, -self.gravity

        return Loads(body_force=weight)

    def adaptive_step(self, state: State) -> Callable[[State], float] | None:
        """One step for all: a tenth of the time in which a wave crosses a cell, or all of it in implicit methods."""
        assert state.geometry is not None
        wave = wave_speed(state.material)
        courant = IMPLICIT if state.choices.implicit else COURANT
        step = courant * state.geometry.nodal_spacing / wave
        return lambda _: step

    # quantities of interest

    def observe(self, state: State) -> dict[str, Any]:
        """Mean fall of the bottom [m] and the largest gap between neighbours [-].

        Raises
        ------
        BrokeDown
            When the body has parted.
        """
        p = state.particles
        bottom = slice(p.material.stop, None)
        gap, where = largest_gap(p)
        if gap > PARTED:
            state.record("parted", gap)
            raise BrokeDown(
                f"the body has parted: next to particle {where}, neighbours are {gap:.3g} times as "
                "far from each other as their deformation says"
            )
        return {
            "elongation_history": float(np.mean(p.X[bottom, -1] - p.x[bottom, -1])),
            "largest_gap_history": gap,
        }

    def quantities(self, solution: Solution, material: Material) -> dict[str, tuple[Any, str, str]]:
        series = {name: np.array(values) for name, values in solution.history.items()}
        length, gap = series["elongation_history"], series["largest_gap_history"]
        largest = max([float(gap.max()), *solution.records.get("parted", [])])
        text = "largest distance of initial neighbours over |F dX|"
        out: dict[str, tuple[Any, str, str]] = {
            "elongation_history": (length, "m", "mean fall of the bottom"),
            "largest_gap_history": (gap, "1", text),
            "largest_gap": (largest, "1", f"{text} until the end; above {PARTED:g} it has parted"),
        }
        if "parted" in solution.records:
            out["parted_at"] = (solution.time_reached, "s", "instant at which the body parts")
        if solution.status != "ok":
            return out
        back = np.flatnonzero(length < 0.5 * np.maximum.accumulate(length))
        top = int(np.argmax(length[: back[0] if len(back) else None]))
        text = "largest mean fall of the bottom in the first swing"
        out["elongation"] = (float(length[top]), "m", text)
        out["time_of_elongation"] = (float(series["time"][top]), "s", "its instant")
        known = (REFERENCE if self.dimension == 2 else REFERENCE_3D).get(self.gravity)
        if known is not None and self.length == 1.0 and top < len(length) - 1:
            text = "relative error of elongation against converged finite elements"
            out["error_elongation"] = (abs(float(length[top]) / known[0] - 1.0), "1", text)
            out["lag_of_elongation"] = (
                float(series["time"][top]) - known[1],
                "s",
                "delay of its instant behind theirs",
            )
        return out


def largest_gap(p: Particles) -> tuple[float, int]:
    """Largest ``|x_a - x_b| / |F (X_a - X_b)|`` of neighbours on the lattice of the start, and one of both.

    F is the mean of both particles; the lattice fills a square or a cube.
    """
    X, x, F = p.X[p.material], p.x[p.material], p.F[p.material]
    dim = X.shape[1]
    along = round(len(X) ** (1.0 / dim))
    places = np.lexsort(np.round(X.T[::-1] * along * 8.0)).reshape((along,) * dim)
    worst, where = 0.0, 0
    for axis in range(dim):
        a = np.take(places, range(along - 1), axis).ravel()
        b = np.take(places, range(1, along), axis).ravel()
        expected = np.einsum("pij,pj->pi", 0.5 * (F[a] + F[b]), X[b] - X[a])
        ratio = np.linalg.norm(x[b] - x[a], axis=1) / np.linalg.norm(expected, axis=1)
        at = int(np.argmax(ratio))
        if ratio[at] > worst:
            worst, where = float(ratio[at]), int(a[at])
    return worst, where
