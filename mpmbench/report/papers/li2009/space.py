"""Figs. 4.6 to 4.9: the shock along a strip and down a cylinder."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes

from mpmbench.report import style
from mpmbench.report.papers.li2009.support import DENSITY, FIELDS, OTM, VELOCITY, exact_shock, panels, variables
from mpmbench.report.papers.parts import Campaigns, Chapter, cell
from mpmbench.report.tables import Cell, Table

COLOURS: dict[str, Any] = {"cmap": "viridis", "vmin": 0.0, "vmax": 2.2, "rasterized": True}  # velocity [m/s]
STRIP: dict[str, dict[str, Any]] = {
    "gamma = 1.8": OTM | {"basis__gamma": 1.8, "basis__gradient": "exact", "particles_per_cell": 1},
    "gamma = 4": OTM | {"basis__gamma": 4.0},
    "gamma = 1.8, corrected gradients": OTM | {"basis__gradient": "consistent"},
    "gamma = 1.8, 2 x 2 particles per cell": OTM | {"particles_per_cell": 4},
    "linear FEM, 2 x 2 particles per cell": {"method": "linear_fem"},
}
CYLINDER: dict[str, dict[str, Any]] = {f"gamma = {gamma:g}": OTM | {"basis__gamma": gamma} for gamma in (1.8, 4.0)}


def strip_chapter(campaigns: Campaigns) -> Chapter:
    """The shock in two dimensions."""
    page = Chapter(
        "fig4_7",
        "Figs. 4.6 and 4.7: the shock along a strip",
        "The shock propagates in two dimensions; no errors are given.",
    )
    file, found = variables(campaigns, "fig4_7", *FIELDS, **STRIP["gamma = 4"])
    figure, axes = panels(6, 1, height=0.62, sharex=True)
    for row, place in enumerate(("reference", "deformed")):
        for k, t in enumerate(found["snapshot_time"][1:], 1):
            x = found["position_initial"] if place == "reference" else found["position"][k]
            axis = axes[3 * row + k - 1, 0]
            picture = _strip(axis, x, found["velocity"][k, :, 0], f"{place}, t = {1e3 * t:.2f} ms", 3.0)
            axis.set_xlim(-0.5, 44.0)
    figure.colorbar(picture, ax=list(axes[:, 0]), label="velocity [m/s]", shrink=0.7)
    figure.supxlabel("$x_1$ [mm]", size=8)
    caption = (
        "Material points at the barycentres of 400 triangles, where they were at first (Fig. 4.6) and where they are "
        "(Fig. 4.7); lumped mass, gamma = 4."
    )
    page.draw("strip", "Velocity at three instants", caption, figure, [file])
    figure, axes = panels(3, 2, height=1.5, sharex=True, sharey=True)
    files = []
    for axis, (name, match) in zip(axes.ravel(), STRIP.items(), strict=False):
        file, found = variables(campaigns, "fig4_7", *FIELDS, **match)
        picture = _strip(axis, found["position"][-1], found["velocity"][-1, :, 0], name, 7.0)
        axis.set_xlim(8.5, 17.0)
        files.append(file)
    axes[-1, -1].set_axis_off()
    figure.colorbar(picture, ax=list(axes.ravel()), label="velocity [m/s]", shrink=0.7)
    figure.supxlabel("$x_1$ [mm]", size=8)
    figure.supylabel("$x_2$ [mm]", size=8)
    page.draw(
        "head", "The compressed end at t = 6 L/C", "Material points; the motion has no part across.", figure, files
    )
    page.add(_errors(campaigns, "fig4_7", STRIP))
    page.notes.append(
        "Barycentres of the triangles integrate wide functions badly: the strip is pushed sideways. Narrow functions, "
        "particles in a regular pattern, or corrected gradients bring it back."
    )
    return page


def _strip(axis: Axes, x: np.ndarray, v: np.ndarray, title: str, size: float) -> Any:
    """Material points in the plane [m] coloured by their velocity [m/s]."""
    picture = axis.scatter(1e3 * x[:, 0], 1e3 * x[:, 1], c=v, s=size, linewidths=0.0, **COLOURS)
    axis.set_title(title, pad=2, fontsize=7)
    axis.set_aspect("equal")
    axis.set_ylim(-0.2, 3.7)
    axis.set_yticks((0, 3))
    axis.grid(False)
    return picture


def cylinder_chapter(campaigns: Campaigns) -> Chapter:
    """The shock in three dimensions."""
    page = Chapter(
        "fig4_9",
        "Figs. 4.8 and 4.9: the shock down a cylinder",
        "In 3D, 2907 nodes and 14,700 material points: a sequence of snapshots of the deformed configuration.",
    )
    figure, axes = panels(4, 1, height=1.7, subplot_kw={"projection": "3d"})
    file, found = variables(campaigns, "fig4_9", *FIELDS, **CYLINDER["gamma = 4"])
    X, times = 1e3 * found["position_initial"], found["snapshot_time"]
    surface = np.hypot(X[:, 1], X[:, 2]) > 0.6 * np.hypot(X[:, 1], X[:, 2]).max()
    views = [(X, found["velocity"][-1], f"reference configuration, t = {1e3 * times[-1]:.2f} ms")]
    views += [
        (1e3 * found["position"][k], found["velocity"][k], f"t = {1e3 * times[k]:.2f} ms") for k in range(1, len(times))
    ]
    for axis, (x, v, title) in zip(axes[:, 0], views, strict=True):
        picture = axis.scatter(*x[surface].T, c=v[surface, 0], s=1.5, linewidths=0.0, depthshade=False, **COLOURS)
        axis.set_box_aspect((43.4, 7.0, 7.0), zoom=1.3)
        axis.view_init(elev=18, azim=-72)
        axis.set_xlim(0.0, 43.4)
        axis.set_title(title, pad=-8, fontsize=7)
        axis.tick_params(labelsize=5, pad=-3)
        axis.set_yticks([])
        axis.set_zticks([])
    figure.colorbar(picture, ax=list(axes[:, 0]), label="velocity [m/s]", shrink=0.5)
    caption = "Material points near the surface, lumped mass, gamma = 4; lengths in mm."
    page.draw("cylinder", "Velocity in the cylinder", caption, figure, [file])
    files = _along(page, campaigns)
    assert file in files
    page.add(_errors(campaigns, "fig4_9", CYLINDER))
    page.notes.append(
        "The functions are measured with the deformation gradient of each material point, so that a compression to a "
        "tenth along one axis leaves a point the neighbours that it had."
    )
    return page


def _along(page: Chapter, campaigns: Campaigns) -> list[str]:
    """Velocity and density of all points of the cylinder over their initial place; the files."""
    figure, axes = panels(2, 2, height=1.6, sharex=True, sharey="row")
    files = []
    for column, (name, match) in enumerate(CYLINDER.items()):
        file, found = variables(campaigns, "fig4_9", *FIELDS, **match)
        files.append(file)
        X, t = found["position_initial"][:, 0], float(found["snapshot_time"][-1])
        V0 = found["volume"][0] * exact_shock(X, float(found["snapshot_time"][0]))["density"]
        line = np.linspace(0.0, X.max(), 240)
        computed = {"velocity [m/s]": found["velocity"][-1, :, 0], "density [kg/m$^3$]": V0 / found["volume"][-1]}
        for axis, (label, values) in zip(axes[:, column], computed.items(), strict=True):
            axis.plot(1e3 * X, values, ".", ms=1.5, mew=0.0, color=style.colour("otm"), rasterized=True)
            axis.plot(1e3 * line, exact_shock(line, t)[label.partition(" ")[0]], **style.EXACT | {"zorder": 3.0})
            if column == 0:
                axis.set_ylabel(label)
        axes[0, column].set_title(name, pad=3)
    figure.supxlabel("$X_1$ [mm]", size=8)
    caption = "All 14,700 material points at t = 6 L/C over their initial place; black: exact."
    page.draw("along", "Scatter over the cross-sections", caption, figure, files)
    return files


def _errors(campaigns: Campaigns, campaign: str, shown: dict[str, dict[str, Any]]) -> Table:
    """Errors and costs of some runs."""
    rows = []
    for name, match in shown.items():
        quantities = ("n_nodes", "n_particles", "neighbours_mean", "steps", "solver_time")
        errors = [cell(campaigns, campaign, quantity, **match) for quantity in (VELOCITY, DENSITY)]
        file, found = variables(campaigns, campaign, "velocity", **match)
        across = Cell(float(np.abs(found["velocity"][-1, :, 1:]).max()), (file,))
        rows.append(
            [Cell(name), *errors, across, *(cell(campaigns, campaign, quantity, **match) for quantity in quantities)]
        )
    columns = ["functions", "velocity error [m^1.5/s]", "density error [kg/m2]", "largest speed across [m/s]"]
    columns += ["nodes", "particles", "neighbours", "steps", "time [s]"]
    note = "Errors are largest ones over time, Eq. 4.27; the speed across is that of one material point at the end."
    return Table("errors", "Errors and cost", columns, rows, note, numeric=tuple(range(1, 9)))
