"""Functions of any basis on a few nodes, and their gradients: for figures of the functions themselves.

In one dimension on equal cells of a line (Wobbes 2020, Figs. 3 and 4); in the plane on cells, at the
corners of a regular pentagon or on scattered nodes (Li 2009, Figs. 2.1 and 2.2), with data ``u =
sin(2 pi x_1 / l) sin(2 pi x_2 / l)`` at the nodes. The papers give neither their nodes nor their data.
Samples are inside the hull of the nodes, on which some functions have no gradient.
"""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from mpmbench.core.bases.entropy.basis import EntropyBasis
from mpmbench.core.bases.radial import CUBIC_SPLINE, QUARTIC_SPLINE, cubic_spline, quartic_spline
from mpmbench.core.choices import Choices
from mpmbench.core.errors import NotApplicable, require
from mpmbench.core.geometry import Box, Cloud, Geometry, tensor_points
from mpmbench.core.geometry.triangulate import jittered
from mpmbench.core.materials import Material
from mpmbench.core.registry import register
from mpmbench.core.setting import setting
from mpmbench.core.simulation import Solution
from mpmbench.core.state import State
from mpmbench.problems import Problem

CORNERS = 5
RADIUS = 0.5  # of the pentagon over the reference length
INSIDE = 0.999  # samples of the pentagon, so far from its middle to its edges
PRIORS = {CUBIC_SPLINE: cubic_spline, QUARTIC_SPLINE: quartic_spline}
LAYOUT = ("particle", "shown")
QUANTITIES = {
    "shape_function": ("1", "functions of some nodes", LAYOUT),
    "shape_function_gradient": ("m-1", "gradients of these functions", (*LAYOUT, "dim")),
    "shown_nodes": ("m", "positions of these nodes", ("shown", "dim")),
    "prior": ("1", "weights of these nodes, before linear completeness", LAYOUT),
    "prior_gradient": ("m-1", "gradients of these weights", (*LAYOUT, "dim")),
    "partition_of_unity": ("1", "sum of all functions", ("particle",)),
    "completeness": ("m", "|sum_i phi_i x_i - x|", ("particle",)),
    "approximation": ("1", "sum_i phi_i u_i of data u_i at the nodes", ("particle",)),
    "data": ("1", "the function that the data are taken from", ("particle",)),
    "nodes": ("m", "positions of all nodes", ("node", "dim")),
    "nodal_data": ("1", "data at all nodes", ("node",)),
}


@register("problem", "shape_functions")
@dataclass(frozen=True)
class ShapeFunctions(Problem):
    """Functions and gradients of any basis on a line or in a square of 1 m: Li 2009, Wobbes 2020."""

    dimension: int = setting(  # type: ignore[misc]
        1, "1: a line, 2: a square", unit="-", options=(1, 2)
    )
    arrangement: str = setting(
        "cells",
        "nodes of equal cells; the same displaced at random; or the corners of a pentagon",
        options=("cells", "scattered", "pentagon"),
    )
    irregularity: float = setting(
        0.3,
        "random displacement of scattered nodes over their spacing",
        unit="-",
        least=0.0,
        most=0.4,
    )
    samples_per_axis: int = setting(
        400,
        "samples along each axis, in the middles of equal distances",
        unit="-",
        least=2,
        most=1000,
    )
    random_seed: int = 0
    still: ClassVar[bool] = True
    reference_length: ClassVar[float] = 1.0

    def check_together(self) -> None:
        flat = self.dimension == 2 or self.arrangement == "cells"
        require(flat, "arrangement", self.arrangement, "cells in one dimension")

    def check(self, material: Material, choices: Choices, basis: str, resolution: int) -> None:
        if choices.moves_particles:
            raise NotApplicable(
                f"method={choices.name} moves particles: the study of functions needs method=evaluate"
            )

    # geometry

    def nodes(self, resolution: int, choices: Choices) -> Geometry:
        l, dim = self.reference_length, self.dimension
        if self.arrangement == "pentagon":
            angles = 2.0 * np.pi * np.arange(CORNERS) / CORNERS + 0.5 * np.pi
            circle = np.column_stack([np.cos(angles), np.sin(angles)])
            return Cloud(0.5 * l + RADIUS * l * circle, spacing=RADIUS * l)
        box = Box((0.0,) * dim, (l,) * dim, (resolution,) * dim)
        if self.arrangement == "cells":
            return box
        on_boundary = (box.points < 1e-9 * l) | (box.points > (1.0 - 1e-9) * l)
        h = l / resolution
        places = jittered(box.points, h, self.irregularity, on_boundary, self.random_seed)
        return Cloud(places, spacing=h)

    def seed(self, resolution: int, particles_per_cell: int) -> tuple[np.ndarray, np.ndarray]:
        n, l = self.samples_per_axis, self.reference_length
        X = tensor_points([(np.arange(n) + 0.5) * l / n] * self.dimension)
        if self.arrangement == "pentagon":
            angles = 2.0 * np.pi * (np.arange(CORNERS) + 0.5) / CORNERS + 0.5 * np.pi
            outward = np.stack([np.cos(angles), np.sin(angles)])
            apothem = RADIUS * l * np.cos(np.pi / CORNERS)
            X = X[((X - 0.5 * l) @ outward <= INSIDE * apothem).all(axis=1)]
        return X, np.full(len(X), (l / n) ** self.dimension)

    # quantities of interest

    def shown(self, nodes: np.ndarray) -> np.ndarray:
        """Numbers of the nodes whose functions are kept: the one nearest to the middle of a square, else all."""
        if self.dimension == 1 or self.arrangement == "pentagon":
            return np.arange(len(nodes))
        away = np.linalg.norm(nodes - 0.5 * self.reference_length, axis=1)
        return np.array([np.argmin(away)])

    def data(self, x: np.ndarray) -> np.ndarray:
        """The function that the functions approximate from its values at the nodes."""
        return np.asarray(np.sin(2.0 * np.pi * x / self.reference_length).prod(axis=1))

    def observe(self, state: State) -> dict[str, Any]:
        """The functions at the samples, what they sum up to, and the priors where there are any."""
        basis, x = state.basis, state.particles.x
        nodes, stored = basis.nodes, basis.evaluate(x)
        shown = self.shown(nodes)
        phi = stored.matrix(len(nodes))
        found = {
            "shape_function": phi[:, shown],
            "shape_function_gradient": stored.gradient_matrix(len(nodes))[:, shown],
            "shown_nodes": nodes[shown],
            "partition_of_unity": phi.sum(axis=1),
            "completeness": np.linalg.norm(phi @ nodes - x, axis=1),
            "approximation": phi @ self.data(nodes),
            "data": self.data(x),
            "nodes": nodes.copy(),
            "nodal_data": self.data(nodes),
        }
        if isinstance(basis, EntropyBasis) and basis.cloud.form.prior in PRIORS:
            found |= _priors(basis, x, shown)
        return found

    def quantities(self, solution: Solution, material: Material) -> dict[str, tuple[Any, ...]]:
        found = {
            name: (solution.history[name][0], *about)
            for name, about in QUANTITIES.items()
            if name in solution.history
        }
        (phi, *_), (whole, *_), (off, *_) = (
            found[name] for name in ("shape_function", "partition_of_unity", "completeness")
        )
        misfit = found["approximation"][0] - found["data"][0]
        return found | {
            "smallest_value": (float(phi.min()), "1", "smallest value of the functions shown"),
            "largest_value": (float(phi.max()), "1", "largest value of the functions shown"),
            "error_partition_of_unity": (
                float(np.abs(whole - 1.0).max()),
                "1",
                "largest |sum_i phi_i - 1|",
            ),
            "error_completeness": (float(off.max()), "m", "largest |sum_i phi_i x_i - x|"),
            "error_data": (
                float(np.sqrt(np.mean(misfit**2))),
                "1",
                "RMS distance of the approximation from the function of the data",
            ),
        }


def _priors(basis: EntropyBasis, x: np.ndarray, shown: np.ndarray) -> dict[str, np.ndarray]:
    """Weights of some nodes at points x, shape (n, shown), and their gradients [1/m]."""
    weight = np.vectorize(PRIORS[basis.cloud.form.prior].py_func)
    away = x[:, None, :] - basis.nodes[shown]
    square = (away**2).sum(axis=2) * basis.cloud.inverse_square[shown]
    value, slope = weight(np.minimum(square, 1.0))
    gradient = (slope * basis.cloud.inverse_square[shown])[:, :, None] * away
    return {"prior": value, "prior_gradient": gradient}
