"""Figs. 2.1 and 2.2: max-ent functions without locality, and what they make of scattered data."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes

from mpmbench.papers.kit import Campaigns, Chapter, cell, variables
from mpmbench.papers.parts import quantities
from mpmbench.report.figures import name_axes, panels
from mpmbench.report.tables import Cell

NO_LOCALITY = 1e-6  # gamma, so small that it does not count
GAMMAS = (NO_LOCALITY, 0.8, 1.8, 6.8)
WANTED = ("position_initial", "shape_function", "shown_nodes", "nodes")
DATA = ("position_initial", "approximation", "data", "nodes", "nodal_data")
PROPERTIES = ("largest_value", "error_partition_of_unity", "error_completeness")
SHOWN, TICKS = (-0.05, 1.05), (0.0, 0.5, 1.0)  # [m]
LEVELS = np.linspace(0.0, 1.0, 21)
BOTH_SIGNS = np.linspace(-1.0, 1.0, 22)


def maxent_chapter(campaigns: Campaigns) -> Chapter:
    """Max-ent functions of a vertex of a pentagon, and of an inner node of many."""
    page = Chapter(
        "fig2_1",
        "Fig. 2.1: max-ent functions in the plane",
        "At the vertices of a convex pentagon the functions have the Kronecker delta property, and "
        "on its edges they are linear. The function of an interior node of a larger node set "
        "vanishes at the boundary.",
    )
    figure, axes = panels(1, 2, 2.9)
    rows = []
    places = {"pentagon": "(a) a vertex of a pentagon", "scattered": "(b) an inner node of 121"}
    for axis, (arrangement, title) in zip(axes[0], places.items(), strict=True):
        match = {"problem__arrangement": arrangement}
        file, found = variables(campaigns, "fig2_1", *WANTED, **match)
        X, phi, nodes = found["position_initial"], found["shape_function"][:, 0], found["nodes"]
        highest = float(phi.max())
        picture = _filled(axis, X, phi / highest, LEVELS, "magma_r")
        axis.plot(*nodes.T, ".", color="#555555", ms=2.5, mew=0, clip_on=False)
        axis.plot(*found["shown_nodes"][0], "+", color="#0072B2", ms=7, mew=1.2, clip_on=False)
        axis.set_title(f"{title}: largest {highest:.2g}", pad=3, fontsize=7)
        at_node = Cell(_nearest(X, phi, found["shown_nodes"][0]), (file,))
        rim = Cell(_on_boundary(X, phi, arrangement, nodes), (file,))
        properties = quantities(campaigns, "fig2_1", PROPERTIES[1:], **match)
        rows.append([title[4:], at_node, rim, *properties])
    figure.colorbar(picture, ax=list(axes[0]), label="function / largest value", shrink=0.8)
    name_axes(figure, "$x_1$ [m]", "$x_2$ [m]")
    caption = (
        f"gamma = {NO_LOCALITY:g}: no locality. The cross is the node of the function, the dots are "
        "all nodes. The thesis gives no nodes."
    )
    page.draw("functions", "Max-ent functions without locality", caption, figure)
    columns = ["function of", "value nearest to its node", "largest on opposite edges"]
    columns += ["sum of all, off 1 by", "sum with places, off x by [m]"]
    page.tabulate("values", "At the node and on the boundary", columns, rows, numeric=range(1, 5))
    return page


def _filled(axis: Axes, X: np.ndarray, values: np.ndarray, levels: np.ndarray, colours: str) -> Any:
    """Filled contours of values at points of the plane, as pixels: their outlines would be megabytes."""
    ticks = {"xticks": TICKS, "yticks": TICKS}
    axis.set(aspect="equal", xlim=SHOWN, ylim=SHOWN, **ticks)
    axis.grid(False)
    contours = axis.tricontourf(X[:, 0], X[:, 1], values, levels=levels, cmap=colours)
    contours.set_rasterized(True)
    return contours


def _nearest(X: np.ndarray, values: np.ndarray, place: np.ndarray) -> float:
    return float(values[np.argmin(np.linalg.norm(X - place, axis=1))])


def _on_boundary(X: np.ndarray, phi: np.ndarray, arrangement: str, nodes: np.ndarray) -> float:
    """Largest value at the samples next to edges that the node of the function is not on."""
    if arrangement == "scattered":
        near = np.minimum(X, 1.0 - X).min(axis=1) < 0.005
        return float(phi[near].max())
    edges = np.roll(nodes, -1, axis=0) - nodes
    outward = np.stack([edges[:, 1], -edges[:, 0]], axis=1) / np.linalg.norm(edges[0])
    depth = -((X[:, None, :] - nodes) * outward).sum(axis=2)
    return float(phi[(depth[:, 1:4] < 0.005).any(axis=1)].max())


def data_chapter(campaigns: Campaigns) -> Chapter:
    """Approximation of data at scattered nodes, without and with locality."""
    page = Chapter(
        "fig2_2",
        "Fig. 2.2: max-ent approximation from scattered data",
        "The max-ent approximation is far from interpolating in the interior and results in a very "
        "poor fit to the data; control over the degree of locality is required.",
    )
    figure, axes = panels(1, len(GAMMAS) + 1, 1.7, sharex=True, sharey=True)
    rows = []
    for axis, gamma in zip(axes[0, 1:], GAMMAS, strict=True):
        _, found = variables(campaigns, "fig2_2", *DATA, basis__gamma=gamma)
        X, u = found["position_initial"], found["approximation"]
        _filled(axis, X, u, BOTH_SIGNS, "RdBu_r")
        axis.set_title(_name(gamma), pad=3, fontsize=7)
        error = cell(campaigns, "fig2_2", "error_data", basis__gamma=gamma)
        largest = Cell(float(np.abs(u).max()), error.files)
        properties = quantities(campaigns, "fig2_2", PROPERTIES, basis__gamma=gamma)
        rows.append([_name(gamma), error, largest, *properties])
    picture = _filled(axes[0, 0], X, found["data"], BOTH_SIGNS, "RdBu_r")
    look: dict[str, Any] = {
        "cmap": "RdBu_r",
        "vmin": -1.0,
        "vmax": 1.0,
        "s": 7.0,
        "linewidths": 0.4,
    }
    axes[0, 0].scatter(*found["nodes"].T, c=found["nodal_data"], edgecolors="#555555", **look)
    axes[0, 0].set_title("data", pad=3, fontsize=7)
    figure.colorbar(picture, ax=list(axes[0]), label="$u$", shrink=0.8, ticks=(-1.0, 0.0, 1.0))
    name_axes(figure, "$x_1$ [m]", "$x_2$ [m]")
    caption = (
        r"Data u = sin(2 pi x1 / l) sin(2 pi x2 / l) at 121 scattered nodes, l = 1 m, and what the "
        "functions make of them. The thesis gives neither nodes nor data."
    )
    page.draw("data", "Approximation from scattered data", caption, figure)
    columns = ["functions", "RMS distance from the data's function", "largest value of u"]
    columns += ["largest value of an inner function", "sum of all, off 1 by"]
    columns += ["sum with places, off x by [m]"]
    page.tabulate("fit", "How well the data are met", columns, rows, numeric=range(1, 6))
    return page


def _name(gamma: float) -> str:
    return "no locality" if gamma == NO_LOCALITY else f"gamma = {gamma:g}"
