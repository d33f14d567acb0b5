"""Figs. 3 and 4: the functions themselves, as the bases of this program give them."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes

from mpmbench.papers.kit import Campaigns, Chapter, variables
from mpmbench.papers.parts import of_file, quantities
from mpmbench.report.figures import name_axes, panels

WANTED = ("position_initial", "shown_nodes", "shape_function", "shape_function_gradient")
PRIORS = ("position_initial", "shown_nodes", "prior", "prior_gradient")
BASES: dict[str, dict[str, Any]] = {
    "linear": {"basis": "linear"},
    "quadratic B-splines": {"basis": "bspline", "basis__degree": 2},
    "cubic B-splines": {"basis": "bspline", "basis__degree": 3},
    "max-ent, d_max = 2": {"basis": "maxent"},
}
PROPERTIES = (
    "smallest_value",
    "largest_value",
    "error_partition_of_unity",
    "error_completeness",
)
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7")  # of neighbours, in turn
REACH = 3  # nodes from an end, so far that the functions do not see it


def functions_chapter(campaigns: Campaigns) -> Chapter:
    """Functions and derivatives on a line."""
    page = Chapter(
        "functions",
        "Figs. 3 and 4: the functions and their derivatives",
        "Quadratic B-splines and max-ent functions are smooth, non-negative, have compact support "
        "and sum up to one; only first-order B-splines satisfy the linear completeness property. "
        "Local max-ent functions represent affine functions exactly.",
    )
    _splines(page, campaigns)
    _maxent(page, campaigns)
    rows = []
    for name, match in BASES.items():
        file, found = variables(campaigns, "functions", *WANTED, **match)
        steepest = of_file(file, np.abs(found["shape_function_gradient"]).max())
        rows.append([name, *quantities(campaigns, "functions", PROPERTIES, **match), *steepest])
    columns = ["functions", "smallest value", "largest value", "sum of all, off 1 by"]
    columns += ["sum with places, off x by [m]", "largest derivative [1/m]"]
    title = "What the functions satisfy, at 400 points of 8 cells"
    page.tabulate("properties", title, columns, rows, numeric=range(1, 6))
    page.notes.append(
        "B-splines of any degree represent x exactly when their coefficients are read at the "
        "Greville abscissae, against what the paper says. "
        f"{REACH} nodes or more from the ends the max-ent functions are the cubic B-splines: their "
        f"largest difference is {_from_cubic_splines(campaigns):.1e}."
    )
    return page


def _splines(page: Chapter, campaigns: Campaigns) -> None:
    """Fig. 3: quadratic B-splines."""
    _, found = variables(campaigns, "functions", *WANTED, **BASES["quadratic B-splines"])
    figure, axes = panels(1, 2, 2.1)
    x = found["position_initial"][:, 0]
    _curves(axes[0, 0], x, found["shape_function"], r"$\phi_i$")
    _curves(axes[0, 1], x, found["shape_function_gradient"][:, :, 0], r"$d\phi_i/dx$ [1/m]")
    name_axes(figure, "position $x$ [m]")
    caption = (
        "Open knots on 8 cells of 1 m, 10 functions; left the functions, right their derivatives."
    )
    page.draw("splines", "Fig. 3: quadratic B-splines", caption, figure)


def _maxent(page: Chapter, campaigns: Campaigns) -> None:
    """Fig. 4: cubic-spline weights above, the max-ent functions that they lead to below."""
    _, weights = variables(campaigns, "functions", *PRIORS, **BASES["max-ent, d_max = 2"])
    _, found = variables(campaigns, "functions", *WANTED, **BASES["max-ent, d_max = 2"])
    figure, axes = panels(2, 2, 3.9, sharex=True)
    x = found["position_initial"][:, 0]
    _curves(axes[0, 0], x, weights["prior"], "$w_i$", "(a) weights")
    slope = weights["prior_gradient"][:, :, 0]
    _curves(axes[0, 1], x, slope, "$dw_i/dx$ [1/m]", "(b) their derivatives")
    _curves(axes[1, 0], x, found["shape_function"], r"$\phi_i$", "(c) max-ent functions")
    slope = found["shape_function_gradient"][:, :, 0]
    _curves(axes[1, 1], x, slope, r"$d\phi_i/dx$ [1/m]", "(d) their derivatives")
    name_axes(figure, "position $x$ [m]")
    caption = (
        "Cubic splines (Eq. 89) and max-ent functions of 9 nodes on 1 m, d_max = 2. At the ends "
        "the functions are 1 or 0, which the weights are not."
    )
    page.draw("maxent", "Fig. 4: weights and max-ent functions", caption, figure)


def _curves(axis: Axes, x: np.ndarray, values: np.ndarray, label: str, title: str = "") -> None:
    """One curve for each function, shape (n, functions), where it is not zero."""
    for k, one in enumerate(values.T):
        some = np.where(one == 0.0, np.nan, one)
        axis.plot(x, some, color=COLOURS[k % len(COLOURS)], lw=1.0)
    axis.set_ylabel(label)
    axis.set_title(title, pad=3)
    axis.set_xlim(0.0, 1.0)


def _from_cubic_splines(campaigns: Campaigns) -> float:
    """Largest difference of inner max-ent functions from the cubic B-splines at the same nodes."""
    _, maxent = variables(campaigns, "functions", *WANTED, **BASES["max-ent, d_max = 2"])
    _, spline = variables(campaigns, "functions", *WANTED, **BASES["cubic B-splines"])
    inner = range(REACH, maxent["shown_nodes"].shape[0] - REACH)
    places = maxent["shown_nodes"][inner, 0]
    same = [int(np.argmin(np.abs(spline["shown_nodes"][:, 0] - x))) for x in places]
    apart = maxent["shape_function"][:, inner] - spline["shape_function"][:, same]
    return float(np.abs(apart).max())
