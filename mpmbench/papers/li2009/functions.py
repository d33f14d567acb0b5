"""Table 2.1 and Figs. 2.3 and 2.4: Newton's iteration and the functions themselves."""

from itertools import chain
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from mpmbench.papers.kit import Campaigns, Chapter, cell, variables
from mpmbench.papers.parts import along, of_file
from mpmbench.report import style
from mpmbench.report.figures import name_axes, panels, single

GAMMAS = (0.8, 1.8, 2.8, 6.8)
TOLERANCES = (1e-5, 1e-10, 1e-13)
PUBLISHED = {0.8: (2.7, 3.6, 4.2), 1.8: (2.4, 3.5, 4.3), 2.8: (3.0, 4.0, 5.0), 6.8: (4.0, 5.0, 6.0)}
SHOWN = ("inner node", "node next to an edge", "node on an edge", "corner")
WANTED = ("shape_function", "shape_function_gradient", "position_initial", "shown_nodes")
WINDOW = 5.0  # width of a panel [m]
LEVELS = np.linspace(0.0, 1.0, 21)


def table_chapter(campaigns: Campaigns) -> Chapter:
    """Newton steps per sample point."""
    page = Chapter(
        "table2_1",
        "Table 2.1: Newton steps for the multipliers",
        "For a tolerance of 1e-5 two to three Newton steps suffice over a broad range of gamma; "
        "large gamma need more.",
    )
    campaigns["table2_1"]  # raises MissingRuns
    runs = campaigns, "table2_1"
    rows = []
    for gamma in GAMMAS:
        for line_search in (False, True):
            match: dict[str, Any] = {"basis__gamma": gamma, "basis__line_search": line_search}
            steps = along(*runs, "newton_steps_mean", "basis__tolerance", TOLERANCES, **match)
            pairs = zip(PUBLISHED[gamma], steps, strict=True)
            fail = cell(*runs, "newton_failures_share", basis__tolerance=1e-10, **match)
            name = "with line search" if line_search else "plain"
            rows.append([gamma, name, *chain(*pairs), fail])
    columns = ["gamma", "Newton's method"]
    for name in ("1e-5", "1e-10", "round-off"):
        columns += [f"{name}, thesis", f"{name}, here"]
    columns.append("share of samples that fail")
    title = "Mean Newton steps of the samples that converge"
    page.tabulate("steps", title, columns, rows, numeric=(0, *range(2, 9)))
    page.notes.append(
        "The thesis describes an exact line search. Its numbers are those of the plain method, "
        "averaged over the samples where it converges: for gamma = 6.8 a minority. With a line "
        "search no sample fails."
    )
    return page


def boundary_chapter(campaigns: Campaigns) -> Chapter:
    """Functions at the boundary, and anisotropic ones."""
    page = Chapter(
        "fig2_3",
        "Fig. 2.3: functions at the boundary, anisotropic functions",
        "At a vertex the functions have the Kronecker property, and functions of inner nodes "
        "vanish on the boundary. Other metrics give anisotropic functions.",
    )
    figure, axes = panels(2, 4, 3.8, sharey="col")
    rows = []
    for row, stretch in enumerate((1.0, 2.0)):
        file, found = variables(campaigns, "fig2_3", *WANTED, problem__metric_stretch=stretch)
        X, phi, nodes = found["position_initial"], found["shape_function"], found["shown_nodes"]
        on_edge = (np.abs(X - 5.0) > 5.0 - 1e-9).any(axis=1)
        for k, name in enumerate(SHOWN):
            axis = axes[row, k]
            picture = _contours(axis, X, phi[:, k])
            corner = np.maximum(nodes[k] - 0.5 * WINDOW, 0.0)
            _window(axis, corner, name if row == 0 else "")
            axis.plot(*nodes[k], "+", color="white", ms=4, mew=0.7, clip_on=False)
            rows.append([name, stretch, *of_file(file, phi[:, k].max(), phi[on_edge, k].max())])
        axes[row, 0].set_ylabel("anisotropic" if row else "isotropic")
    marks = (0.0, 0.5, 1.0)
    figure.colorbar(picture, ax=list(axes.ravel()), label="function", shrink=0.6, ticks=marks)
    name_axes(figure, "$x_1$ [m]", "$x_2$ [m]")
    caption = (
        "gamma = 1.8, 11 x 11 regular nodes, each panel 5 m wide; below with the metric of F = "
        "diag(2, 1/2). The crosses are the nodes."
    )
    page.draw("functions", "Functions of four nodes", caption, figure)
    columns = ["node", "metric stretch", "largest value", "largest value on the boundary"]
    page.tabulate("values", "Values on the boundary", columns, rows, numeric=(1, 2, 3))
    return page


def gamma_chapter(campaigns: Campaigns) -> Chapter:
    """One function and its derivative for four values of gamma."""
    page = Chapter(
        "fig2_4",
        "Fig. 2.4: a function and its derivative by gamma",
        "The functions are smooth and gamma controls their locality; for gamma = 6.8 the function "
        "ostensibly coincides with the Delaunay shape function.",
    )
    figure, axes = panels(2, 4, 3.8, sharex=True, sharey=True)
    rows = []
    for k, gamma in enumerate(GAMMAS):
        file, found = variables(campaigns, "fig2_4", *WANTED, basis__gamma=gamma)
        X, phi = found["position_initial"], found["shape_function"][:, 0]
        slope = found["shape_function_gradient"][:, 0, 0]
        largest = float(np.abs(slope).max())
        above = _contours(axes[0, k], X, phi)
        below = _contours(axes[1, k], X, slope / largest, np.linspace(-1.0, 1.0, 22), "RdBu_r")
        titles = (f"gamma = {gamma:g}", f"largest {largest:.2f} / m")
        for axis, title in zip(axes[:, k], titles, strict=True):
            _window(axis, found["shown_nodes"][0] - 0.5 * WINDOW, title)
        support = float(np.mean(phi > 1e-3) * 100.0)
        rows.append([gamma, *of_file(file, phi.max(), largest, support)])
    figure.colorbar(above, ax=list(axes[0]), label="function", ticks=(0.0, 0.5, 1.0))
    figure.colorbar(below, ax=list(axes[1]), label="derivative / largest", ticks=(-1.0, 0.0, 1.0))
    name_axes(figure, "$x_1$ [m]", "$x_2$ [m]")
    caption = (
        "Above the function of an inner node, below its derivative by the first coordinate over "
        "the largest one; jittered nodes, h = 1 m."
    )
    page.draw("functions", "Function and derivative", caption, figure)
    columns = ["gamma", "largest value", "largest slope [1/m]", "area with phi > 0.001 [m2]"]
    page.tabulate("extent", "Height, slope and extent", columns, rows, numeric=(0, 1, 2, 3))
    _section(page, campaigns)
    return page


def _contours(
    axis: Axes,
    X: np.ndarray,
    values: np.ndarray,
    levels: np.ndarray = LEVELS,
    colours: str = "magma_r",
) -> Any:
    """Filled contours of values at the points of a square grid."""
    n = round(len(X) ** 0.5)
    grid = [one.reshape(n, n) for one in (X[:, 0], X[:, 1], values)]
    return axis.contourf(*grid, levels=levels, cmap=colours)


def _window(axis: Axes, corner: np.ndarray, title: str) -> None:
    """Show a square of the plane."""
    axis.set_title(title, pad=3, fontsize=7)
    axis.grid(False)
    (left, low), (right, high) = corner, corner + WINDOW
    axis.set(xlim=(left, right), ylim=(low, high), aspect="equal")


def _section(page: Chapter, campaigns: Campaigns) -> None:
    """The functions on a line through the node."""
    figure, axes = single(2.5, 2.0 * style.COLUMN)
    for k, gamma in enumerate(GAMMAS):
        _, found = variables(campaigns, "fig2_4", *WANTED, basis__gamma=gamma)
        X, phi = found["position_initial"], found["shape_function"][:, 0]
        line = np.abs(X[:, 1] - X[np.argmax(phi), 1]) < 1e-9
        look: dict[str, Any] = {"color": style.colour("otm"), "label": f"gamma = {gamma:g}"}
        axes.plot(X[line, 0], phi[line], style.LINE_STYLES[k], **look)
    axes.set_xlim(2.0, 8.0)
    axes.set(xlabel="$x_1$ [m]", ylabel="function")
    axes.legend()
    caption = "As gamma grows the function becomes that of linear elements; its corners are smooth on a finer scale."
    page.draw("section", "The function on a line through its highest sample", caption, figure)
