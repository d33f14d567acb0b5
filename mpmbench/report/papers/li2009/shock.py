"""Figs. 4.2 to 4.9: the isothermal shock in one, two and three dimensions, and what the thesis does not show."""

from typing import Any

import numpy as np

from mpmbench.report import style
from mpmbench.report.papers.li2009.support import (
    DENSITY,
    OTM,
    SHOCK,
    VELOCITY,
    exact_shock,
    panels,
    variables,
)
from mpmbench.report.papers.parts import Campaigns, Chapter, MissingRuns, cell
from mpmbench.report.tables import Cell, Table

FIELDS = ("position_initial", "position", "velocity", "displacement", "volume", "snapshot_time")
PARTICLES = (1, 2, 3, 4, 6, 8)


def exact_chapter(campaigns: Campaigns) -> Chapter:
    """The exact fields, and the computed ones against them."""
    page = Chapter(
        "fig4_3",
        "Figs. 4.2 and 4.3: the shock",
        "Density, displacement, velocity and acceleration of the travelling wave; OTM follows them.",
    )
    file, found = variables(campaigns, "fig4_3", *FIELDS, resolution=100)
    X, times = found["position_initial"][:, 0], found["snapshot_time"]
    line = np.linspace(0.0, X.max(), 800)
    units = {"density": "kg/m$^3$", "displacement": "m", "velocity": "m/s", "acceleration": "m/s$^2$"}
    figure, axes = panels(2, 2, height=1.7, sharex=True)
    for axis, (name, unit) in zip(axes.ravel(), units.items(), strict=True):
        for k, t in enumerate(times):
            axis.plot(line, exact_shock(line, t)[name], color=str(0.75 * (1.0 - k / (len(times) - 1))), lw=0.9)
        axis.set_ylabel(f"{name} [{unit}]")
    figure.supxlabel("$X_1$ [m]", size=8)
    caption = "Exact fields at t = 0 (light) to 6 L/C (dark), with + log 2 in Eqs. 4.21a and 4.23b."
    page.draw("exact", "Fig. 4.2: exact fields", caption, figure, [])
    figure, axes = panels(1, 3, height=2.0, sharex=True)
    reference = found["volume"][0] / (SHOCK["rho"] / exact_shock(X, 0.0)["density"])
    for k in range(1, len(times), 2):
        lag = 0.5 * _step(campaigns, file)
        exact = exact_shock(line, times[k])
        computed = {
            "velocity": found["velocity"][k, :, 0],
            "displacement": found["displacement"][k, :, 0],
            "density": SHOCK["rho"] * reference / found["volume"][k],
        }
        exact["velocity"] = exact_shock(line, times[k] - lag)["velocity"]
        for axis, (name, values) in zip(axes[0], computed.items(), strict=True):
            axis.plot(line, exact[name], **style.EXACT)
            axis.plot(X, values, ".", ms=3, mew=0, color=style.colour("otm"))
            axis.set_ylabel(f"{name} [{units[name]}]")
    figure.supxlabel("$X_1$ [m]", size=8)
    caption = "OTM with 100 cells, lumped mass, gamma = 1.8, at three instants; black: exact."
    page.draw("computed", "Fig. 4.3: computed and exact fields", caption, figure, [file])
    return page


def _step(campaigns: Campaigns, file: str) -> float:
    """Last time step of a run [s]."""
    runs = campaigns["fig4_3"].runs
    return float(runs.time_step[file])


def convergence_chapter(campaigns: Campaigns) -> Chapter:
    """Orders in one dimension."""
    page = Chapter(
        "fig4_4",
        "Figs. 4.4 and 4.5: convergence of the shock in one dimension",
        "The rates are 2.13 for the velocity and 1.88 for the density; the errors stay below 1e-7.",
    )
    page.convergence(campaigns["fig4_4"], (VELOCITY, DENSITY))
    page.notes.append(
        "The error level of the thesis belongs to squared norms: at h = L/8 the velocity is right to about 5e-5 "
        "m^1.5/s in the norm of Eq. 4.27."
    )
    return page


def irregular_chapter(campaigns: Campaigns) -> Chapter:
    """Irregular nodes, and gradients that integrate exactly."""
    page = Chapter(
        "irregular",
        "Beyond the thesis: nodes displaced by 20 %",
        "The thesis shows uniform nodes only.",
    )
    page.convergence(campaigns["irregular"], (VELOCITY, DENSITY))
    page.notes.append(
        "Particles at the middle of irregular segments do not integrate the gradients exactly: a constant stress "
        "pushes nodes about, and the density does not converge. Gradients corrected so that they integrate exactly "
        "(basis.gradient=consistent) mend it."
    )
    return page


def particles_chapter(campaigns: Campaigns) -> Chapter:
    """More particles per cell."""
    page = Chapter("particles", "Beyond the thesis: particles per cell and the density")
    figure, axes = panels(1, 2, height=2.1, sharey=True)
    rows, files = [], []
    for axis, share in zip(axes[0], (0.0, 0.2), strict=True):
        for rank, gradient in enumerate(("exact", "consistent")):
            match: dict[str, Any] = {"problem__irregularity": share, "basis__gradient": gradient}
            errors = [cell(campaigns, "particles", DENSITY, particles_per_cell=n, **match) for n in PARTICLES]
            known = [(n, e.value) for n, e in zip(PARTICLES, errors, strict=True) if isinstance(e.value, float)]
            if not known:
                raise MissingRuns(f"particles: no run with {gradient} gradients has finished")
            axis.loglog(*zip(*known, strict=True), label=f"{gradient} gradients", **style.line("otm", "lme", rank))
            rows.append([Cell("irregular" if share else "uniform"), Cell(gradient), *errors])
            files += [file for e in errors for file in e.files]
        axis.set_title("20 % irregular nodes" if share else "uniform nodes", pad=3)
        axis.set_xticks(PARTICLES, [str(n) for n in PARTICLES])
        axis.minorticks_off()
    axes[0, 0].legend()
    figure.supxlabel("particles per cell", size=8)
    figure.supylabel("density error [kg/m$^2$]", size=8)
    page.draw("density", "Error of the density", "50 cells, OTM, lumped mass, gamma = 1.8.", figure, files)
    columns = ["nodes", "gradients", *(f"{n} per cell" for n in PARTICLES)]
    title = "Largest L1 error of the density [kg/m2]"
    page.add(Table("density", title, columns, rows, numeric=tuple(range(2, 8))))
    return page


def mass_chapter(campaigns: Campaigns) -> Chapter:
    """Mass and transfer, and all methods on the shock."""
    page = Chapter(
        "methods",
        "Mass, transfer and other methods on the shock",
        "The thesis derives a consistent form (3.89) and a lumped one with nodal velocities (3.92).",
    )
    rows = []
    for mass in ("lumped", "consistent"):
        for transfer in ("nodal", "position_difference"):
            for n in (1, 2):
                match = OTM | {"mass": mass, "method__transfer": transfer, "particles_per_cell": n}
                errors = [cell(campaigns, "mass_transfer", norm, **match) for norm in (VELOCITY, DENSITY)]
                rows.append([Cell(mass), Cell(transfer.replace("_", " ")), Cell(n), *errors])
    columns = ["mass", "transfer", "particles per cell", "velocity error [m^1.5/s]", "density error [kg/m2]"]
    page.add(Table("mass", "OTM with 50 cells, by mass and transfer", columns, rows, numeric=(2, 3, 4)))
    runs, settings = campaigns["shock_methods"].runs, campaigns["shock_methods"].settings
    rows = []
    for file in runs.sort_values(["method", "basis"]).index:
        name = f"{runs.method[file]}, {runs.basis[file]}"
        for key, usual in (
            ("basis.gamma", 1.8),
            ("basis.locality", "convected"),
            ("method.shape_functions", "updated"),
        ):
            value = settings[key][file] if key in settings else None
            if value is not None and value == value and value != usual and runs.basis[file] == "lme":
                name += f", {key.partition('.')[2].replace('_', ' ')} {value}"
        done = runs.status[file] == "ok"
        errors = [
            Cell(float(runs[norm][file]) if done else runs.status[file].replace("_", " "), (file,))
            for norm in (VELOCITY, DENSITY)
        ]
        reason = Cell("" if done else str(runs.reason[file]).partition(" (")[0])
        rows.append([Cell(name), Cell(str(runs.mass[file])), *errors, reason])
    columns = ["method", "mass", "velocity error [m^1.5/s]", "density error [kg/m2]", "reason"]
    page.add(Table("methods", "All methods, 50 cells, two particles per cell", columns, rows, numeric=(2, 3)))
    return page


def strip_chapter(campaigns: Campaigns) -> Chapter:
    """The shock in two dimensions."""
    page = Chapter(
        "fig4_7",
        "Figs. 4.6 and 4.7: the shock along a strip",
        "The shock propagates in two dimensions; no errors are given.",
    )
    shown: dict[str, dict[str, Any]] = {
        "gamma = 1.8": OTM | {"basis__gamma": 1.8, "basis__gradient": "exact", "particles_per_cell": 1},
        "gamma = 4": OTM | {"basis__gamma": 4.0},
        "gamma = 1.8, corrected gradients": OTM | {"basis__gradient": "consistent"},
        "gamma = 1.8, 2 x 2 particles per cell": OTM | {"particles_per_cell": 4},
        "linear FEM, 2 x 2 particles per cell": {"method": "linear_fem"},
    }
    names = list(shown)[:3]
    figure, axes = panels(6, 1, height=0.85)
    files = []
    for k, name in enumerate(names):
        file, found = variables(campaigns, "fig4_7", *FIELDS, **shown[name])
        files.append(file)
        for row, (place, label) in enumerate((("position_initial", "reference"), ("position", "deformed"))):
            x = found[place] if row == 0 else found[place][-1]
            axis = axes[2 * k + row, 0]
            picture = axis.scatter(*(1e3 * x).T, c=found["velocity"][-1, :, 0], s=2, cmap="viridis", rasterized=True)
            axis.set_title(f"{name}, {label}", pad=2, fontsize=7)
            axis.set_aspect("equal")
            axis.set_xlim(-1.0, 44.5)
            axis.grid(False)
    figure.colorbar(picture, ax=list(axes[:, 0]), label="velocity [m/s]", shrink=0.5)
    figure.supxlabel("$x_1$ [mm]", size=8)
    page.draw("strip", "Velocity at the end, material points", "50 x 4 cells, t = 6 L/C.", figure, files)
    page.add(_errors(campaigns, "fig4_7", shown))
    page.notes.append(
        "Barycentres of the triangles integrate wide functions badly: the strip is pushed sideways, and the error of "
        "the velocity is ten times that of the line. Narrow functions, particles in a regular pattern, or corrected "
        "gradients bring it back."
    )
    return page


def cylinder_chapter(campaigns: Campaigns) -> Chapter:
    """The shock in three dimensions."""
    page = Chapter(
        "fig4_9",
        "Figs. 4.8 and 4.9: the shock down a cylinder",
        "In 3D, 2907 nodes and 14,700 material points: a sequence of snapshots of the deformed configuration.",
    )
    shown: dict[str, dict[str, Any]] = {f"gamma = {gamma:g}": OTM | {"basis__gamma": gamma} for gamma in (1.8, 4.0)}
    figure, axes = panels(4, 1, height=1.7, subplot_kw={"projection": "3d"})
    file, found = variables(campaigns, "fig4_9", *FIELDS, **shown["gamma = 4"])
    X, times = 1e3 * found["position_initial"], found["snapshot_time"]
    surface = np.hypot(X[:, 1], X[:, 2]) > 0.6 * np.hypot(X[:, 1], X[:, 2]).max()
    views = [(X, found["velocity"][-1], "reference configuration, end")]
    views += [(1e3 * found["position"][k], found["velocity"][k], f"t = {1e3 * times[k]:.2f} ms") for k in (0, 1, -1)]
    for axis, (x, v, title) in zip(axes[:, 0], views, strict=True):
        picture = axis.scatter(
            *x[surface].T, c=v[surface, 0], s=1.5, cmap="viridis", vmin=0.0, vmax=2.2, rasterized=True
        )
        axis.set_box_aspect((43.4, 7.0, 7.0), zoom=1.3)
        axis.view_init(elev=18, azim=-72)
        axis.set_xlim(0.0, 43.4)
        axis.set_title(title, pad=-8, fontsize=7)
        axis.tick_params(labelsize=5, pad=-3)
        axis.set_yticks([])
        axis.set_zticks([])
    figure.colorbar(picture, ax=list(axes[:, 0]), label="velocity [m/s]", shrink=0.5)
    caption = "Material points near the surface, gamma = 4; lengths in mm."
    page.draw("cylinder", "Velocity in the cylinder", caption, figure, [file])
    page.add(_errors(campaigns, "fig4_9", shown))
    return page


def _errors(campaigns: Campaigns, campaign: str, shown: dict[str, dict[str, Any]]) -> Table:
    """Errors and costs of some runs."""
    rows = []
    for name, match in shown.items():
        quantities = (VELOCITY, DENSITY, "n_nodes", "n_particles", "steps", "solver_time")
        rows.append([Cell(name), *(cell(campaigns, campaign, quantity, **match) for quantity in quantities)])
    columns = [
        "functions",
        "velocity error [m^1.5/s]",
        "density error [kg/m2]",
        "nodes",
        "particles",
        "steps",
        "time [s]",
    ]
    return Table("errors", "Errors and cost", columns, rows, numeric=tuple(range(1, 7)))
