"""Figs. 4.2 to 4.5: the isothermal shock in one dimension, and what the thesis does not show."""

from itertools import product
from typing import Any

import numpy as np

from mpmbench.papers.kit import Campaigns, Chapter, variables
from mpmbench.papers.li2009.support import DENSITY, FIELDS, OTM, SHOCK, VELOCITY, exact_shock
from mpmbench.papers.parts import along, finished, quantities, ticks
from mpmbench.report import style
from mpmbench.report.figures import name_axes, panels
from mpmbench.report.tables import Cell
from mpmbench.results.records import Campaign

PARTICLES = (1, 2, 3, 4, 6, 8)
DENSITY_TICKS = (3e-4, 5e-4, 1e-3, 1.5e-3)  # [kg/m2]
USUAL = {"basis.gamma": 1.8, "basis.locality": "convected", "method.shape_functions": "updated"}
UNITS = {"density": "kg/m$^3$", "displacement": "m", "velocity": "m/s", "acceleration": "m/s$^2$"}
SHOWN_LENGTH = 0.018  # where something happens [m]


def exact_chapter(campaigns: Campaigns) -> Chapter:
    """The exact fields, and the computed ones against them."""
    page = Chapter(
        "fig4_3",
        "Figs. 4.2 and 4.3: the shock",
        "Density, displacement, velocity and acceleration of the travelling wave; OTM follows "
        "them.",
    )
    file, found = variables(campaigns, "fig4_3", *FIELDS, resolution=50)
    X, times = found["position_initial"][:, 0], found["snapshot_time"]
    line = np.linspace(0.0, X.max(), 240)
    figure, axes = panels(2, 2, 3.7, sharex=True)
    for axis, (name, unit) in zip(axes.ravel(), UNITS.items(), strict=True):
        for k, t in enumerate(times):
            grey = str(0.75 * (1.0 - k / (len(times) - 1)))
            axis.plot(line, exact_shock(line, t)[name], color=grey, lw=0.9)
        axis.set_ylabel(f"{name} [{unit}]")
    name_axes(figure, "$X_1$ [m]")
    caption = "Exact fields at t = 0 (light) to 6 L/C (dark), with + log 2 in Eqs. 4.21a and 4.23b."
    page.draw("exact", "Fig. 4.2: exact fields", caption, figure)
    _computed(page, found, line, float(campaigns["fig4_3"].runs.time_step[file]))
    return page


def _computed(page: Chapter, found: dict[str, np.ndarray], line: np.ndarray, step: float) -> None:
    """Computed fields against the exact ones on a line [m]; the last time step is `step` [s]."""
    X, times = found["position_initial"][:, 0], found["snapshot_time"]
    figure, axes = panels(2, 3, 3.3, sharex=True)
    reference = found["volume"][0] / (SHOCK["rho"] / exact_shock(X, 0.0)["density"])
    lag = 0.5 * step  # a velocity lives half a step before its instant
    near, some = line[line < SHOWN_LENGTH], X < SHOWN_LENGTH
    colour = style.colour("otm")
    instants = range(1, len(times), 2)
    for k, face in zip(instants, ("white", "#f3c4a3", colour), strict=False):
        computed = {
            "density": SHOCK["rho"] * reference / found["volume"][k],
            "displacement": found["displacement"][k, :, 0],
            "velocity": found["velocity"][k, :, 0],
        }
        points = {"ms": 3.2, "mfc": face, "mec": colour, "mew": 0.6}
        for (above, below), (name, values) in zip(axes.T, computed.items(), strict=True):
            t = times[k] - (lag if name == "velocity" else 0.0)
            above.plot(near, exact_shock(near, t)[name], **style.EXACT)
            above.plot(X[some], values[some], "D", **points)
            error = (values - exact_shock(X, t)[name])[some]
            below.plot(X[some], error, "D-", lw=0.6, color=colour, **points)
            above.set_ylabel(f"{name} [{UNITS[name]}]")
            below.set_ylabel(f"error [{UNITS[name]}]")
            below.ticklabel_format(axis="y", style="sci", scilimits=(-2, 2))
    name_axes(figure, "$X_1$ [m]")
    caption = (
        "OTM with 50 cells, lumped mass, gamma = 1.8, at t = "
        f"{', '.join(f'{1e3 * times[k]:.2f}' for k in instants)} ms (white to filled); "
        "black: exact. Below the differences at the same points."
    )
    page.draw("computed", "Fig. 4.3: computed and exact fields", caption, figure)


def convergence_chapter(campaigns: Campaigns) -> Chapter:
    """Orders in one dimension."""
    page = Chapter(
        "fig4_4",
        "Figs. 4.4 and 4.5: convergence of the shock in one dimension",
        "The rates are 2.13 for the velocity and 1.88 for the density; the errors stay below 1e-7.",
    )
    page.convergence(campaigns["fig4_4"], (VELOCITY, DENSITY))
    page.notes.append(
        "The error level of the thesis belongs to squared norms: at h = L/8 the velocity is right "
        "to about 5e-5 m^1.5/s in the norm of Eq. 4.27."
    )
    return page


def irregular_chapter(campaigns: Campaigns) -> Chapter:
    """Irregular nodes, and gradients that integrate exactly."""
    page = Chapter(
        "irregular",
        "Irregular nodes: displaced by 20 %, beyond the thesis",
        "The thesis shows uniform nodes only.",
    )
    page.convergence(campaigns["irregular"], (VELOCITY, DENSITY))
    page.notes.append(
        "Particles at the middle of irregular segments do not integrate the gradients exactly: a "
        "constant stress pushes nodes about, and the density stops converging. Gradients corrected "
        "so that they integrate exactly (basis.gradient=consistent) mend it."
    )
    return page


def particles_chapter(campaigns: Campaigns) -> Chapter:
    """More particles per cell."""
    page = Chapter(
        "particles", "Particles per cell: what they do for the density, beyond the thesis"
    )
    figure, axes = panels(1, 2, 2.4, sharey=True)
    rows = []
    for axis, share in zip(axes[0], (0.0, 0.2), strict=True):
        for rank, gradient in enumerate(("exact", "consistent")):
            match: dict[str, Any] = {"problem__irregularity": share, "basis__gradient": gradient}
            wanted = ("particles", DENSITY, "particles_per_cell", PARTICLES)
            errors = along(campaigns, *wanted, **match)
            lack = f"particles: no run with {gradient} gradients has finished"
            curve = finished(PARTICLES, errors, lack)
            axis.loglog(*curve, label=f"{gradient} gradients", **style.line("otm", "lme", rank))
            rows.append(["irregular" if share else "uniform", gradient, *errors])
        axis.set_title("20 % irregular nodes" if share else "uniform nodes", pad=3)
        ticks(axis, PARTICLES)
        axis.set_yticks(DENSITY_TICKS, [f"{error:g}" for error in DENSITY_TICKS])
    axes[0, 0].legend()
    name_axes(figure, "particles per cell", "density error [kg/m$^2$]")
    caption = "50 cells, OTM, lumped mass, gamma = 1.8."
    page.draw("density", "Error of the density", caption, figure)
    columns = ["nodes", "gradients", *(f"{n} per cell" for n in PARTICLES)]
    title = "Largest L1 error of the density [kg/m2]"
    page.tabulate("density", title, columns, rows, numeric=range(2, 8))
    return page


def mass_chapter(campaigns: Campaigns) -> Chapter:
    """Mass and transfer, and all methods on the shock."""
    page = Chapter(
        "methods",
        "Mass and transfer, other methods: the shock in one dimension",
        "The thesis derives a consistent form (3.89) and a lumped one with nodal velocities "
        "(3.92).",
    )
    _by_mass(page, campaigns)
    _all_methods(page, campaigns["shock_methods"])
    return page


def _by_mass(page: Chapter, campaigns: Campaigns) -> None:
    """Errors of OTM by mass and transfer, and why runs fail."""
    rows = []
    transfers = ("nodal", "position_difference")
    for mass, transfer, n in product(("lumped", "consistent"), transfers, (1, 2)):
        match = OTM | {"mass": mass, "method__transfer": transfer, "particles_per_cell": n}
        errors = quantities(campaigns, "mass_transfer", (VELOCITY, DENSITY), **match)
        why = ""
        if isinstance(errors[0].value, str) and errors[0].files:
            why = str(campaigns["mass_transfer"].runs.reason[errors[0].files[0]])
        rows.append([mass, transfer.replace("_", " "), n, *errors, why.split(":")[0]])
    columns = ["mass", "transfer", "particles per cell"]
    columns += ["velocity error [m^1.5/s]", "density error [kg/m2]", "reason"]
    title = "OTM with 50 cells, by mass and transfer"
    page.tabulate("mass", title, columns, rows, numeric=(2, 3, 4))


def _all_methods(page: Chapter, campaign: Campaign) -> None:
    """Errors of every run, named by its method and by the settings of its basis that are unusual."""
    runs, settings = campaign.runs, campaign.settings
    rows = []
    for file in runs.sort_values(["method", "basis"]).index:
        name = f"{runs.method[file]}, {runs.basis[file]}"
        for key, usual in USUAL.items() if runs.basis[file] == "lme" else ():
            value = settings[key][file] if key in settings else None
            if value is not None and value == value and value != usual:
                name += f", {key.partition('.')[2].replace('_', ' ')} {value}"
        done = runs.status[file] == "ok"
        ended = runs.status[file].replace("_", " ")
        errors = [
            Cell(float(runs[norm][file]) if done else ended, (file,))
            for norm in (VELOCITY, DENSITY)
        ]
        reason = "" if done else str(runs.reason[file]).partition(" (")[0]
        rows.append([name, str(runs.mass[file]), *errors, reason])
    columns = ["method", "mass", "velocity error [m^1.5/s]", "density error [kg/m2]", "reason"]
    title = "All methods, 50 cells, two particles per cell"
    page.tabulate("methods", title, columns, rows, numeric=(2, 3))
