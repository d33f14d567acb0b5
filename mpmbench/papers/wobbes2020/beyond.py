"""Studies that the paper does not have: large strain, quadrature, degrees, a floor of MPM."""

import math
from typing import Any

import numpy as np

from mpmbench.papers.kit import Campaigns, Chapter, MissingRuns, cell, subset
from mpmbench.papers.parts import along, finished, ticks
from mpmbench.papers.wobbes2020.support import ERROR, METHODS, PAIRS, STRESS, method
from mpmbench.report import style
from mpmbench.report.evidence import Runs
from mpmbench.report.figures import name_axes, single, tiles
from mpmbench.report.tables import ratio

PARTICLES = (1, 2, 3, 4, 6, 8, 12, 16)
AMPLITUDES = (0.005, 0.01, 0.02)
FLOOR_CELLS = (32, 64, 128, 256)


def large_strain_chapter(campaigns: Campaigns) -> Chapter:
    """Strains of 20 % instead of 0.2 %."""
    page = Chapter("large_strain", "Beyond the paper: large strain")
    page.statement = (
        "The paper's bar is strained by 0.2 %: BSMPM and the unified method give similar results."
    )
    page.convergence(campaigns["large_strain"], (ERROR, STRESS), prefix="bar_", where="bar")
    page.convergence(
        campaigns["large_strain_plate"], (ERROR, STRESS), prefix="plate_", where="plate"
    )
    rows = []
    grids = {"large_strain": ("bar", 64), "large_strain_plate": ("plate", 32)}
    for moving in ("unified", "OTM-P1", "OTM-maxent"):
        fixed = PAIRS[moving]
        for campaign, (problem, cells) in grids.items():
            if problem == "plate" and fixed == "MPM-maxent":
                continue
            matches = [method(name, resolution=cells) for name in (fixed, moving)]
            errors = [cell(campaigns, campaign, ERROR, **match) for match in matches]
            head = [f"{moving} against {fixed}", f"{problem}, {cells} cells"]
            rows.append([*head, *errors, ratio(*errors)])
    columns = ["methods", "problem", "nodes fixed [m]", "nodes moving [m]", "fixed over moving"]
    title = "What moving nodes gain at large strain"
    page.tabulate("gain", title, columns, rows, numeric=(2, 3, 4))
    return page


def quadrature_chapter(campaigns: Campaigns) -> Chapter:
    """Particles per cell and where they start."""
    page = Chapter("quadrature", "Beyond the paper: particles as quadrature points")
    page.statement = "The paper: insufficient accuracy of the numerical integration limits MPM."
    names = [name for name in METHODS if name != "MPM-maxent"]
    figure, axes = tiles(len(names), 3, height=1.5)
    rows = []
    for axis, name in zip(axes, names, strict=True):
        for layout, line in (("midpoint", "-"), ("gauss", "--")):
            match = method(name, problem__particle_layout=layout)
            errors = along(campaigns, "quadrature", ERROR, "particles_per_cell", PARTICLES, **match)
            lack = f"quadrature: no run of {name} with {layout} points has finished"
            look = style.line(METHODS[name]["method"], METHODS[name]["basis"]) | {"linestyle": line}
            look["markerfacecolor"] = look["color"] if layout == "midpoint" else "white"
            axis.loglog(*finished(PARTICLES, errors, lack), label=layout, **look)
            rows.append([name, layout, *errors])
        axis.set_title(name, pad=3)
        ticks(axis, PARTICLES)
    axes[0].legend()
    name_axes(figure, "particles per cell", "RMS displacement error [m]")
    caption = "Bar with fixed ends, 16 cells, time step 2e-6 s: midpoints of equal sub-cells and Gauss points."
    page.draw("particles", "Error by number and place of particles", caption, figure)
    columns = ["method", "layout", *(f"{n} per cell" for n in PARTICLES)]
    page.tabulate("particles", "RMS displacement error [m]", columns, rows, numeric=range(2, 10))
    page.convergence(campaigns["quadrature_plate"], (ERROR,), prefix="plate_", where="plate")
    return page


def degrees_chapter(campaigns: Campaigns) -> Chapter:
    """B-splines of degree 1 to 3."""
    page = Chapter("degrees", "Beyond the paper: B-splines of degree 1, 2 and 3")
    page.convergence(campaigns["degrees"], (ERROR, STRESS))
    for layout, where in (("midpoint", "midpoints of sub-cells"), ("gauss", "Gauss points")):
        match: dict[str, Any] = {"method": "unified", "problem__particle_layout": layout}
        orders = (
            Runs(campaigns).order("degrees", ERROR, basis__degree=degree, **match)
            for degree in (1, 2, 3)
        )
        slopes = [float(np.mean(order.local)) for order in orders]
        words = ", ".join(f"{slope:.2f}" for slope in slopes)
        page.notes.append(
            f"With particles at {where} the mean slopes of the unified method are {words}."
        )
    return page


def amplitude_chapter(campaigns: Campaigns) -> Chapter:
    """The floor of updated-Lagrangian linear MPM before any particle leaves its cell."""
    page = Chapter("amplitude_floor", "Beyond the paper: a floor of MPM-P1 without grid crossing")
    page.statement = "The paper: MPM-P1 suffers from grid-crossing errors that result in a loss of the convergence."
    figure, axes = single()
    rows = []
    for name in ("mpm", "otm"):
        for k, amplitude in enumerate(AMPLITUDES):
            match = {"method": name, "problem__velocity_amplitude": amplitude}
            errors = along(campaigns, "amplitude_floor", ERROR, "resolution", FLOOR_CELLS, **match)
            finest = match | {"resolution": FLOOR_CELLS[-1]}
            crossings = cell(campaigns, "amplitude_floor", "n_cell_crossings", **finest)
            lack = f"amplitude_floor: no run of {name} with {amplitude:g} m/s has finished"
            curve = finished(FLOOR_CELLS, errors, lack)
            text = f"{name.upper()}, {amplitude:g} m/s"
            axes.loglog(*curve, label=text, **style.line(name, "linear", k))
            rows.append([name.upper(), amplitude, *errors, crossings])
    ticks(axes, FLOOR_CELLS)
    axes.set(xlabel="cells along the reference length", ylabel="RMS displacement error [m]")
    axes.legend(fontsize=6)
    caption = "Linear functions, consistent mass, t = 0.02 s, time step 2e-6 s; one curve for each velocity amplitude."
    page.draw("floor", "Errors of linear MPM and OTM by amplitude", caption, figure)
    grids = [f"{n} cells" for n in FLOOR_CELLS]
    columns = ["method", "amplitude [m/s]", *grids, f"crossings, {grids[-1]}"]
    page.tabulate("errors", "RMS displacement error [m]", columns, rows, numeric=range(1, 7))
    exponent, of_mpm, of_otm = floor_growth(campaigns)
    page.notes.append(
        f"From {FLOOR_CELLS[-2]} to {FLOOR_CELLS[-1]} cells the slope of MPM at {AMPLITUDES[-1]:g} "
        f"m/s is {of_mpm:.2f}, that of OTM {of_otm:.2f}; the error of MPM on the finest grid grows "
        f"with the amplitude to the power {exponent:.2f}."
    )
    return page


def floor_growth(campaigns: Campaigns) -> tuple[float, float, float]:
    """Exponent of the amplitude in the floor of MPM; last slopes of MPM and OTM."""
    found = []
    for name in ("mpm", "otm"):
        campaign = subset(campaigns["amplitude_floor"], method=name, status="ok")
        table = campaign.runs.assign(
            v=campaign.settings["problem.velocity_amplitude"].astype(float)
        )
        errors = table.pivot_table(index="resolution", columns="v", values=ERROR)
        found.append(errors.reindex(index=FLOOR_CELLS, columns=AMPLITUDES).to_numpy())
    if not np.isfinite(found).all():
        raise MissingRuns("amplitude_floor: a run is missing")
    of_mpm, of_otm = (_slope(errors[-2, -1], errors[-1, -1]) for errors in found)
    return _slope(found[0][-1, -1], found[0][-1, -2]), of_mpm, of_otm


def _slope(coarse: float, fine: float) -> float:
    """Exponent of a factor of two."""
    return math.log2(coarse / fine)
