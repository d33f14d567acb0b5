"""Figs. 4.6 to 4.9: the shock along a strip and down a cylinder."""

from itertools import product
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from mpmbench.papers.kit import Campaigns, Chapter, variables
from mpmbench.papers.li2009.support import DENSITY, FIELDS, OTM, VELOCITY, exact_shock
from mpmbench.papers.parts import of_file, quantities
from mpmbench.report import style
from mpmbench.report.figures import name_axes, panels
from mpmbench.report.tables import Cell
from mpmbench.report.timing import clock_in

# velocity [m/s]
COLOURS: dict[str, Any] = {"cmap": "viridis", "vmin": 0.0, "vmax": 2.2, "rasterized": True}
COSTS = ("n_nodes", "n_particles", "neighbours_mean", "steps")
VIEW = (30.0, 18.0)  # turn about the vertical and tilt [degrees]
STRIP: dict[str, dict[str, Any]] = {
    "gamma = 1.8": OTM | {"basis__gamma": 1.8, "basis__gradient": "exact", "particles_per_cell": 1},
    "gamma = 4": OTM | {"basis__gamma": 4.0},
    "gamma = 1.8, corrected gradients": OTM | {"basis__gradient": "consistent"},
    "gamma = 1.8, 2 x 2 particles per cell": OTM | {"particles_per_cell": 4},
    "linear FEM, 2 x 2 particles per cell": {"method": "linear_fem"},
}
CYLINDER: dict[str, dict[str, Any]] = {
    f"gamma = {gamma:g}": OTM | {"basis__gamma": gamma} for gamma in (1.8, 4.0)
}


def strip_chapter(campaigns: Campaigns) -> Chapter:
    """The shock in two dimensions."""
    page = Chapter(
        "fig4_7",
        "Figs. 4.6 and 4.7: the shock along a strip",
        "The shock propagates in two dimensions; no errors are given.",
    )
    _, found = variables(campaigns, "fig4_7", *FIELDS, **STRIP["gamma = 4"])
    figure, axes = panels(6, 1, 4.02, sharex=True)
    instants = list(enumerate(found["snapshot_time"]))[1:]
    shown = product(("reference", "deformed"), instants)
    for axis, (place, (k, t)) in zip(axes[:, 0], shown, strict=False):
        x = found["position_initial"] if place == "reference" else found["position"][k]
        title = f"{place}, t = {1e3 * t:.2f} ms"
        picture = _strip(axis, x, found["velocity"][k, :, 0], title, 3.0)
        axis.set_xlim(-0.5, 44.0)
    figure.colorbar(picture, ax=list(axes[:, 0]), label="velocity [m/s]", shrink=0.7)
    name_axes(figure, "$x_1$ [mm]")
    caption = (
        "Material points at the barycentres of 400 triangles, where they were at first (Fig. 4.6) "
        "and where they are (Fig. 4.7); lumped mass, gamma = 4."
    )
    page.draw("strip", "Velocity at three instants", caption, figure)
    figure, axes = panels(3, 2, 4.8, sharex=True, sharey=True)
    for axis, (name, match) in zip(axes.ravel(), STRIP.items(), strict=False):
        _, found = variables(campaigns, "fig4_7", *FIELDS, **match)
        picture = _strip(axis, found["position"][-1], found["velocity"][-1, :, 0], name, 7.0)
        axis.set_xlim(8.5, 17.0)
    axes[-1, -1].set_axis_off()
    figure.colorbar(picture, ax=list(axes.ravel()), label="velocity [m/s]", shrink=0.7)
    name_axes(figure, "$x_1$ [mm]", "$x_2$ [mm]")
    caption = "Material points; the exact motion has no part across."
    page.draw("head", "The compressed end at t = 6 L/C", caption, figure)
    _errors(page, campaigns, "fig4_7", STRIP)
    page.notes.append(
        "Barycentres of the triangles integrate wide functions badly: the strip is pushed "
        "sideways. Narrow functions, particles in a regular pattern, or corrected gradients bring "
        "it back."
    )
    return page


def _strip(axis: Axes, x: np.ndarray, v: np.ndarray, title: str, size: float) -> Any:
    """Material points in the plane [m] coloured by their velocity [m/s]."""
    picture = axis.scatter(1e3 * x[:, 0], 1e3 * x[:, 1], c=v, s=size, linewidths=0.0, **COLOURS)
    axis.set_title(title, pad=2, fontsize=7)
    axis.set(aspect="equal", ylim=(-0.2, 3.7), yticks=(0, 3))
    axis.grid(False)
    return picture


def cylinder_chapter(campaigns: Campaigns) -> Chapter:
    """The shock in three dimensions."""
    page = Chapter(
        "fig4_9",
        "Figs. 4.8 and 4.9: the shock down a cylinder",
        "In 3D, 2907 nodes and 14,700 material points: a sequence of snapshots of the deformed "
        "configuration.",
    )
    _, found = variables(campaigns, "fig4_9", *FIELDS, **CYLINDER["gamma = 4"])
    figure, axes = panels(3, 2, 3.45)
    X = found["position_initial"]
    kept = (X[:, 1] >= 0.0) | (X[:, 2] <= 0.0)
    for row, (k, t) in zip(axes, list(enumerate(found["snapshot_time"]))[1:], strict=False):
        places = {"reference": X, "deformed": found["position"][k]}
        for axis, (name, x) in zip(row, places.items(), strict=True):
            picture = _body(axis, 1e3 * x[kept], found["velocity"][k, kept, 0])
            axis.set_title(f"{name}, t = {1e3 * t:.2f} ms", pad=0, fontsize=7)
    figure.colorbar(picture, ax=list(axes.ravel()), label="velocity [m/s]", shrink=0.7)
    caption = (
        "Material points, a quarter of the cylinder cut away, where they were at first (Fig. 4.8) "
        "and where they are (Fig. 4.9); lumped mass, gamma = 4. The scale is in mm along the axis."
    )
    page.draw("cylinder", "Velocity in the cylinder at three instants", caption, figure)
    _along(page, campaigns)
    _errors(page, campaigns, "fig4_9", CYLINDER)
    page.notes.append(
        "The functions are measured with the deformation gradient of each material point, so that "
        "a compression to a tenth along one axis leaves a point the neighbours that it had."
    )
    return page


def _body(axis: Axes, x: np.ndarray, v: np.ndarray) -> Any:
    """Points in space [mm], seen along parallel rays from the driven end, far ones first."""
    turn, tilt = np.deg2rad(VIEW)

    def seen(x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        away = x[:, 0] * np.sin(turn) + x[:, 1] * np.cos(turn)
        across = x[:, 0] * np.cos(turn) - x[:, 1] * np.sin(turn)
        up = x[:, 2] * np.cos(tilt) + away * np.sin(tilt)
        return across, up, away * np.cos(tilt) - x[:, 2] * np.sin(tilt)

    across, up, depth = seen(x)
    order = np.argsort(-depth)
    picture = axis.scatter(across[order], up[order], c=v[order], s=2.5, linewidths=0.0, **COLOURS)
    low, marks = -1.4 * float(np.hypot(x[:, 1], x[:, 2]).max()), np.arange(0.0, 41.0, 10.0)
    across, up, _ = seen(np.column_stack([marks, np.zeros_like(marks), np.full_like(marks, low)]))
    axis.plot(across, up, "|-", color="#555555", lw=0.6, ms=4, mew=0.6)
    for mark, place, height in zip(marks, across, up, strict=True):
        axis.text(place, height - 0.7, f"{mark:g}", size=6, ha="center", va="top", color="#555555")
    axis.set_aspect("equal")
    axis.set_axis_off()
    return picture


def _along(page: Chapter, campaigns: Campaigns) -> None:
    """Velocity and density of all points of the cylinder over their initial place."""
    figure, axes = panels(2, 2, 3.5, sharex=True, sharey="row")
    dots = style.dots("otm", 1.5) | {"rasterized": True}
    for column, (name, match) in enumerate(CYLINDER.items()):
        _, found = variables(campaigns, "fig4_9", *FIELDS, **match)
        X, t = found["position_initial"][:, 0], float(found["snapshot_time"][-1])
        V0 = found["volume"][0] * exact_shock(X, float(found["snapshot_time"][0]))["density"]
        line = np.linspace(0.0, X.max(), 240)
        exact = exact_shock(line, t)
        computed = {
            "velocity [m/s]": found["velocity"][-1, :, 0],
            "density [kg/m$^3$]": V0 / found["volume"][-1],
        }
        for axis, (label, values) in zip(axes[:, column], computed.items(), strict=True):
            axis.plot(1e3 * X, values, **dots)
            field = exact[label.partition(" ")[0]]
            axis.plot(1e3 * line, field, **style.EXACT | {"zorder": 3.0})
            if column == 0:
                axis.set_ylabel(label)
        axes[0, column].set_title(name, pad=3)
    name_axes(figure, "$X_1$ [mm]")
    caption = "All 14,700 material points at t = 6 L/C over their initial place; black: exact."
    page.draw("along", "Scatter over the cross-sections", caption, figure)


def _errors(
    page: Chapter, campaigns: Campaigns, campaign: str, shown: dict[str, dict[str, Any]]
) -> None:
    """Errors and costs of some runs."""
    rows = []
    clock = clock_in(campaigns, campaign)
    for name, match in shown.items():
        errors = quantities(campaigns, campaign, (VELOCITY, DENSITY), **match)
        file, found = variables(campaigns, campaign, "velocity", **match)
        across = of_file(file, np.abs(found["velocity"][-1, :, 1:]).max())
        costs = quantities(campaigns, campaign, (*COSTS, clock.quantity), **match)
        if isinstance(costs[2].value, str):  # finite elements do not look for neighbours
            costs[2] = Cell("")
        rows.append([name, *errors, *across, *costs])
    columns = ["functions", "velocity error [m^1.5/s]", "density error [kg/m2]"]
    columns += ["largest speed across [m/s]"]
    columns += ["nodes", "particles", "neighbours", "steps", "time [s]"]
    note = "Errors are largest ones over time, Eq. 4.27; the speed across is that of one material point at the end. "
    note += clock.note
    page.tabulate("errors", clock.title("Errors and cost"), columns, rows, range(1, 9), note)
