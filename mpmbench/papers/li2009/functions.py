"""Table 2.1 and Figs. 2.3 and 2.4: Newton's iteration and the functions themselves."""

import numpy as np
from matplotlib.axes import Axes

from mpmbench.papers.kit import Campaigns, Chapter, cell, variables
from mpmbench.papers.parts import name_axes, panels
from mpmbench.report import style
from mpmbench.report.tables import Cell

GAMMAS = (0.8, 1.8, 2.8, 6.8)
TOLERANCES = (1e-5, 1e-10, 1e-13)
PUBLISHED = {0.8: (2.7, 3.6, 4.2), 1.8: (2.4, 3.5, 4.3), 2.8: (3.0, 4.0, 5.0), 6.8: (4.0, 5.0, 6.0)}
SHOWN = ("inner node", "node next to an edge", "node on an edge", "corner")
WANTED = ("shape_function", "shape_function_gradient", "position_initial", "shown_nodes")
WINDOW = 5.0  # width of a panel [m]


def table_chapter(campaigns: Campaigns) -> Chapter:
    """Newton steps per sample point."""
    page = Chapter(
        "table2_1",
        "Table 2.1: Newton steps for the multipliers",
        "For a tolerance of 1e-5 two to three Newton steps suffice over a broad range of gamma; "
        "large gamma need more.",
    )
    campaigns["table2_1"]  # raises MissingRuns
    rows = []
    for gamma in GAMMAS:
        for line_search in (False, True):
            match = {"basis__gamma": gamma, "basis__line_search": line_search}
            row = [Cell(gamma), Cell("with line search" if line_search else "plain")]
            for k, tolerance in enumerate(TOLERANCES):
                row.append(Cell(PUBLISHED[gamma][k]))
                row.append(
                    cell(
                        campaigns,
                        "table2_1",
                        "newton_steps_mean",
                        basis__tolerance=tolerance,
                        **match,
                    )
                )
            row.append(
                cell(
                    campaigns, "table2_1", "newton_failures_share", basis__tolerance=1e-10, **match
                )
            )
            rows.append(row)
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
    files, rows = [], []
    for row, stretch in enumerate((1.0, 2.0)):
        file, found = variables(campaigns, "fig2_3", *WANTED, problem__metric_stretch=stretch)
        files.append(file)
        X, phi, nodes = found["position_initial"], found["shape_function"], found["shown_nodes"]
        n = round(len(X) ** 0.5)
        grid = [X[:, d].reshape(n, n) for d in (0, 1)]
        on_edge = (np.abs(X - 5.0) > 5.0 - 1e-9).any(axis=1)
        for k, name in enumerate(SHOWN):
            axis = axes[row, k]
            picture = axis.contourf(
                *grid, phi[:, k].reshape(n, n), levels=np.linspace(0.0, 1.0, 21), cmap="magma_r"
            )
            corner = np.maximum(nodes[k] - 0.5 * WINDOW, 0.0)
            _window(axis, corner, name if row == 0 else "")
            axis.plot(*nodes[k], "+", color="white", ms=4, mew=0.7, clip_on=False)
            largest, edge = float(phi[:, k].max()), float(phi[on_edge, k].max())
            rows.append([Cell(name), Cell(stretch), Cell(largest, (file,)), Cell(edge, (file,))])
        axes[row, 0].set_ylabel("anisotropic" if row else "isotropic")
    figure.colorbar(
        picture, ax=list(axes.ravel()), label="function", shrink=0.6, ticks=(0.0, 0.5, 1.0)
    )
    name_axes(figure, "$x_1$ [m]", "$x_2$ [m]")
    caption = (
        "gamma = 1.8, 11 x 11 regular nodes, each panel 5 m wide; below with the metric of F = "
        "diag(2, 1/2). The crosses are the nodes."
    )
    page.draw("functions", "Functions of four nodes", caption, figure, files)
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
    files, rows = [], []
    for k, gamma in enumerate(GAMMAS):
        file, found = variables(campaigns, "fig2_4", *WANTED, basis__gamma=gamma)
        files.append(file)
        X, phi, slope = (
            found["position_initial"],
            found["shape_function"][:, 0],
            found["shape_function_gradient"],
        )
        n = round(len(X) ** 0.5)
        grid = [X[:, d].reshape(n, n) for d in (0, 1)]
        slope = slope[:, 0, 0]
        largest = float(np.abs(slope).max())
        values, slopes = phi.reshape(n, n), slope.reshape(n, n)
        above = axes[0, k].contourf(*grid, values, levels=np.linspace(0.0, 1.0, 21), cmap="magma_r")
        below = axes[1, k].contourf(
            *grid, slopes / largest, levels=np.linspace(-1.0, 1.0, 22), cmap="RdBu_r"
        )
        for axis, title in zip(
            axes[:, k], (f"gamma = {gamma:g}", f"largest {largest:.2f} / m"), strict=True
        ):
            _window(axis, found["shown_nodes"][0] - 0.5 * WINDOW, title)
        support = float(np.mean(phi > 1e-3) * 100.0)
        rows.append(
            [
                Cell(gamma),
                Cell(float(phi.max()), (file,)),
                Cell(largest, (file,)),
                Cell(support, (file,)),
            ]
        )
    figure.colorbar(above, ax=list(axes[0]), label="function", ticks=(0.0, 0.5, 1.0))
    figure.colorbar(below, ax=list(axes[1]), label="derivative / largest", ticks=(-1.0, 0.0, 1.0))
    name_axes(figure, "$x_1$ [m]", "$x_2$ [m]")
    caption = (
        "Above the function of an inner node, below its derivative by the first coordinate over "
        "the largest one; jittered nodes, h = 1 m."
    )
    page.draw("functions", "Function and derivative", caption, figure, files)
    columns = ["gamma", "largest value", "largest slope [1/m]", "area with phi > 0.001 [m2]"]
    page.tabulate("extent", "Height, slope and extent", columns, rows, numeric=(0, 1, 2, 3))
    _section(page, campaigns)
    return page


def _window(axis: Axes, corner: np.ndarray, title: str) -> None:
    """Show a square of the plane."""
    axis.set_title(title, pad=3, fontsize=7)
    axis.set_aspect("equal")
    axis.grid(False)
    axis.set_xlim(corner[0], corner[0] + WINDOW)
    axis.set_ylim(corner[1], corner[1] + WINDOW)


def _section(page: Chapter, campaigns: Campaigns) -> None:
    """The functions on a line through the node."""
    figure, axes = panels(1, 1, 2.5)
    files = []
    for k, gamma in enumerate(GAMMAS):
        file, found = variables(campaigns, "fig2_4", *WANTED, basis__gamma=gamma)
        X, phi = found["position_initial"], found["shape_function"][:, 0]
        line = np.abs(X[:, 1] - X[np.argmax(phi), 1]) < 1e-9
        axes[0, 0].plot(
            X[line, 0],
            phi[line],
            style.LINE_STYLES[k],
            color=style.colour("otm"),
            label=f"gamma = {gamma:g}",
        )
        files.append(file)
    axes[0, 0].set_xlim(2.0, 8.0)
    axes[0, 0].set_xlabel("$x_1$ [m]")
    axes[0, 0].set_ylabel("function")
    axes[0, 0].legend()
    caption = "As gamma grows the function becomes that of linear elements; its corners are smooth on a finer scale."
    page.draw(
        "section", "The function on a line through its highest sample", caption, figure, files
    )
