"""The static cantilever: Figs. 5-7, and beyond them search radii, locality and load steps."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator

from mpmbench.papers.iaconeta2017.support import METHODS, contours, history, look
from mpmbench.papers.kit import Campaigns, Chapter, cell
from mpmbench.papers.parts import (
    along,
    files_of,
    numbers,
    panels,
    quantities,
    ratio,
    single,
    ticks,
    with_digits,
)
from mpmbench.report import style
from mpmbench.report.tables import Cell

SIZES = (16, 32, 64, 128, 800)
STEPS = (1, 2, 5, 10, 20, 50)
ROOT = 2.0**0.5
RADII = (ROOT, 1.7, 2.0, 2.5, 3.0)
COST = ("error_tip", "solver_time")
# colour, marker and match of each curve of error against cost
CLOUDS: dict[str, tuple[str, str, dict[str, object]]] = {
    "GMM-MLS": ("#CC79A7", "v", {"method": "gmm", "basis": "mls"}),
    **{
        f"GMM-LME, gamma = {gamma:g}": (
            colour,
            marker,
            {"method": "gmm", "basis": "lme", "basis__gamma": gamma},
        )
        for gamma, colour, marker in (
            (0.8, "#66c2a5", "d"),
            (1.8, "#009E73", "D"),
            (2.8, "#00553d", "s"),
        )
    },
}


def fields_chapter(campaigns: Campaigns) -> Chapter:
    """Displacement and stress of the four methods."""
    page = Chapter("fields", "Figs. 5 and 6: cantilever under its own weight")
    page.statement = "The paper: the results are in good agreement for all the methods."
    figure, axes = panels(4, 2, 4.3)
    sinking, stretching = np.linspace(-0.7, 0.0, 15), np.linspace(-1.8, 1.8, 19)
    files, rows = [], []
    for k, (name, match) in enumerate(METHODS.items()):
        file, found = history(
            campaigns, "fields", "position_initial", "position", "displacement", "stress", **match
        )
        files.append(file)
        start, position = found["position_initial"], found["position"][-1]
        u, stress = found["displacement"][-1][:, 1], found["stress"][-1][:, 0, 0]
        left = contours(axes[k, 0], start, position, u, sinking, "viridis")
        right = contours(axes[k, 1], start, position, stress / 1e6, stretching, "RdBu_r")
        axes[k, 0].set_ylabel(name)
        rows.append(
            [
                Cell(name),
                with_digits(7, cell(campaigns, "fields", "tip_deflection", **match)),
                Cell(float(stress.min() / 1e6), (file,)),
                Cell(float(stress.max() / 1e6), (file,)),
            ]
        )
    for axis in axes.ravel():
        axis.set(xlim=(-0.1, 8.2), ylim=(-0.8, 1.1), yticks=(0, 1))
        axis.tick_params(labelsize=6, labelbottom=axis in axes[-1])
    figure.colorbar(
        left,
        ax=axes[:, 0],
        location="bottom",
        label="vertical displacement [m]",
        shrink=0.8,
        aspect=40,
    )
    figure.colorbar(
        right,
        ax=axes[:, 1],
        location="bottom",
        label="stress along the beam [MPa]",
        shrink=0.8,
        aspect=40,
    )
    caption = "Left Fig. 5, right Fig. 6. h = 0.125 m, one load step; deformed shapes without magnification, in metres."
    page.draw("maps", "Displacement and Cauchy stress along the beam", caption, figure, files)
    columns = ["method", "deflection [m]", "least stress [MPa]", "largest stress [MPa]"]
    page.tabulate(
        "values",
        "Deflection of A and range of the stress along the beam",
        columns,
        rows,
        numeric=(1, 2, 3),
    )
    return page


def fig7_chapter(campaigns: Campaigns) -> Chapter:
    """Convergence of the deflection."""
    page = Chapter("fig7", "Fig. 7: convergence of the deflection")
    page.statement = (
        "The paper: all the methods have a quadratic rate of convergence; the error curves of "
        "UL-FEM, MPM and GMM-MLS coincide, that of GMM-LME is shifted a bit upwards."
    )
    figure, axes = panels(1, 2, 2.9)
    files: list[str] = []
    rows = []
    inverse = [n / 8.0 for n in SIZES]
    reference = np.full(len(SIZES), np.nan)
    for name, match in METHODS.items():
        errors = along(campaigns, "fig7", "error_tip", "resolution", SIZES, **match)
        values = numbers(errors)
        if name == "UL-FEM":
            reference = values
        line = look(name) | ({"markerfacecolor": "white", "zorder": 3} if name == "MPM" else {})
        axes[0, 0].loglog(inverse, values, **line)
        axes[0, 1].semilogx(inverse, values / reference, **line)
        files += files_of(errors)
        deflections = along(campaigns, "fig7", "tip_deflection", "resolution", SIZES, **match)
        rows.append([Cell(name), *(with_digits(7, found) for found in deflections)])
    axes[0, 0].loglog([2.0, 16.0], [0.2, 0.2 / 64.0], color="#888888", lw=0.8, label="slope 2")
    for axis in axes[0]:
        axis.set_xlabel("1 / h [1/m]")
    axes[0, 0].set_ylabel("relative error of the deflection")
    axes[0, 1].set_ylabel("error over that of UL-FEM")
    axes[0, 0].legend()
    caption = (
        "Left: error against -0.67436 m, h = 0.5 to 0.01 m. Right: the same errors over those of "
        "UL-FEM, with which MPM (hollow) coincides."
    )
    page.draw("errors", "Error of the deflection", caption, figure, files)
    columns = ["method", *(f"h = {8.0 / n:g} m" for n in SIZES)]
    page.tabulate("deflections", "Deflection of A [m]", columns, rows, numeric=range(1, 6))
    page.notes.append(
        "The error is taken against the limit of UL-FEM under refinement. Against the linear "
        "deflection of Eq. 62, -0.67806 m, every method would stall at 0.55 %."
    )
    return page


def radius_chapter(campaigns: Campaigns) -> Chapter:
    """Error against cost over search radius and locality."""
    page = Chapter("radius", "Beyond the paper: search radius and locality")
    page.statement = "The paper uses R = sqrt(2) h and gamma = 1.8 throughout this example."
    figure, axes = panels(1, 2, 3.0)
    rows = []
    for axis, n in zip(axes[0], (32, 64), strict=True):
        rows += _costs(axis, campaigns, n)
    files = files_of(row[3] for row in rows if row[0].value != "UL-FEM")
    axes[0, 0].set_ylabel("relative error of the deflection")
    axes[0, 0].legend(fontsize=6)
    caption = "Numbers at the points are R / h. Moving least squares with R > sqrt(2) h are held by multipliers."
    page.draw("cost", "Error against cost", caption, figure, files)
    columns = ["method", "R / h", "h [m]", "relative error", "solver time [s]"]
    page.tabulate("all", "All search radii", columns, rows, numeric=(3, 4))
    own = {"method": "gmm", "basis": "lme", "basis__gamma": 1.8, "resolution": 64}
    narrow, wide = (
        cell(campaigns, "radius", "error_tip", **own, basis__relative_radius=r) for r in (ROOT, 3.0)
    )
    page.notes.append(
        "R = sqrt(2) h cuts exp(-1.8 (r / h)^2) off where it still is 0.027. For GMM-LME at h = "
        f"0.125 m the error with R = 3 h is {ratio(wide, narrow).text or 'an unknown part'} of "
        "that with R = sqrt(2) h."
    )
    return page


def _costs(axis: Axes, campaigns: Campaigns, n: int) -> list[list[Cell]]:
    """Draw error against time on one mesh, and return the rows of the table."""
    rows = []
    for name, (colour, marker, match) in CLOUDS.items():
        points = []
        for radius in RADII:
            here = {**match, "basis__relative_radius": radius, "resolution": n}
            error, seconds = quantities(campaigns, "radius", COST, **here)
            if isinstance(error.value, float):
                points.append((radius, error.value, 1e3 * seconds.value))
                where = [Cell(f"{radius:.3g}"), Cell(f"{8.0 / n:g}")]
                rows.append([Cell(name), *where, error, seconds])
        if points:
            _, errors, times = zip(*points, strict=True)
            axis.loglog(times, errors, marker, color=colour, label=name, ls="-")
        for radius, error_value, time in points:
            place = (time, error_value)
            text = f"{radius:.2g}"
            axis.annotate(text, place, (2, 2), textcoords="offset points", fontsize=5)
    fem = quantities(campaigns, "radius", COST, method="fem", resolution=n)
    error_value, time = numbers(fem)
    if np.isfinite([error_value, time]).all():
        axis.plot(time * 1e3, error_value, "o", color="#E69F00", label="UL-FEM")
        rows.append([Cell("UL-FEM"), Cell(), Cell(f"{8.0 / n:g}"), *fem])
    axis.set_xlabel("solver time [ms]")
    axis.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.xaxis.set_major_formatter("{x:g}")
    axis.xaxis.minorticks_off()
    axis.set_title(f"h = {8.0 / n:g} m")
    return rows


def load_steps_chapter(campaigns: Campaigns) -> Chapter:
    """Deflection over the number of load steps."""
    page = Chapter("load_steps", "Beyond the paper: the same load in several steps")
    page.statement = "The paper: MPM and UL-FEM curves coincide. That is an identity when the load is applied at once."
    figure, axes = single(height=2.8, width=1.4 * style.COLUMN)
    files: list[str] = []
    rows = []
    variants: list[tuple[str, str, dict[str, object]]] = [
        ("UL-FEM", "UL-FEM", {}),
        ("MPM", "MPM", {"method__ghost_stiffness": 0.0}),
        ("MPM, ghost stiffness 1e-6", "MPM", {"method__ghost_stiffness": 1e-6}),
        ("GMM-MLS", "GMM-MLS", {}),
        ("GMM-LME", "GMM-LME", {}),
    ]
    for label, name, more in variants:
        match = METHODS[name] | more
        found = along(
            campaigns, "load_steps", "tip_deflection", "problem__load_steps", STEPS, **match
        )
        values = numbers(found)
        style_of = look(name) | {"label": label}
        if more.get("method__ghost_stiffness"):
            style_of |= {"linestyle": ":", "markerfacecolor": "white"}
        axes.semilogx(STEPS, 100.0 * (values / values[0] - 1.0), **style_of)
        files += files_of(found)
        shown = [*found, ratio(found[-1], found[0])]
        rows.append([Cell(label), *(with_digits(6, one) for one in shown)])
    axes.set_xlabel("number of load steps")
    axes.set_ylabel("change of the deflection [%]")
    ticks(axes, STEPS)
    axes.legend(fontsize=6)
    caption = "h = 0.25 m; change against one load step. Implicit MPM locates its particles anew after every step."
    page.draw("drift", "Drift with the number of load steps", caption, figure, files)
    columns = ["method", *(f"N = {n}" for n in STEPS), "N = 50 over N = 1"]
    page.tabulate(
        "deflections", "Deflection of A [m] after N load steps", columns, rows, numeric=range(1, 8)
    )
    return page
