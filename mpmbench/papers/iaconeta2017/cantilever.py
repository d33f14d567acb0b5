"""The static cantilever: Figs. 5-7, and beyond them search radii, locality and load steps."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator

from mpmbench.papers.iaconeta2017.support import METHODS, contours, history, look
from mpmbench.papers.kit import Campaigns, Chapter, cell
from mpmbench.papers.parts import along, numbers, of_file, quantities, ticks, with_digits
from mpmbench.report import style
from mpmbench.report.figures import panels, single
from mpmbench.report.tables import ratio
from mpmbench.report.timing import Clock, clock_in

SIZES = (16, 32, 64, 128, 800)
STEPS = (1, 2, 5, 10, 20, 50)
ROOT = 2.0**0.5
RADII = (ROOT, 1.7, 2.0, 2.5, 3.0)
# colour, marker and match of each curve of error against cost
CLOUDS: dict[str, tuple[str, str, dict[str, Any]]] = {
    "GMM-MLS": ("#CC79A7", "v", {"method": "gmm", "basis": "mls"}),
    **{
        f"GMM-LME, gamma = {gamma:g}": (
            colour,
            marker,
            METHODS["GMM-LME"] | {"basis__gamma": gamma},
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
    rows = []
    wanted = ("position_initial", "position", "displacement", "stress")
    for (left, right), (name, match) in zip(axes, METHODS.items(), strict=True):
        file, found = history(campaigns, "fields", *wanted, **match)
        start, position = found["position_initial"], found["position"][-1]
        u, stress = found["displacement"][-1][:, 1], found["stress"][-1][:, 0, 0] / 1e6
        sunk = contours(left, start, position, u, sinking, "viridis")
        stretched = contours(right, start, position, stress, stretching, "RdBu_r")
        left.set_ylabel(name)
        tip = with_digits(7, cell(campaigns, "fields", "tip_deflection", **match))
        rows.append([name, tip, *of_file(file, stress.min(), stress.max())])
    for axis in axes.ravel():
        axis.set(xlim=(-0.1, 8.2), ylim=(-0.8, 1.1), yticks=(0, 1))
        axis.tick_params(labelsize=6, labelbottom=axis in axes[-1])
    below: dict[str, Any] = {"location": "bottom", "shrink": 0.8, "aspect": 40}
    figure.colorbar(sunk, ax=axes[:, 0], label="vertical displacement [m]", **below)
    figure.colorbar(stretched, ax=axes[:, 1], label="stress along the beam [MPa]", **below)
    caption = "Left Fig. 5, right Fig. 6. h = 0.125 m, one load step; deformed shapes without magnification, in metres."
    page.draw("maps", "Displacement and Cauchy stress along the beam", caption, figure)
    columns = ["method", "deflection [m]", "least stress [MPa]", "largest stress [MPa]"]
    title = "Deflection of A and range of the stress along the beam"
    page.tabulate("values", title, columns, rows, numeric=(1, 2, 3))
    return page


def fig7_chapter(campaigns: Campaigns) -> Chapter:
    """Convergence of the deflection."""
    page = Chapter("fig7", "Fig. 7: convergence of the deflection")
    page.statement = (
        "The paper: all the methods have a quadratic rate of convergence; the error curves of "
        "UL-FEM, MPM and GMM-MLS coincide, that of GMM-LME is shifted a bit upwards."
    )
    figure, axes = panels(1, 2, 2.9)
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
        deflections = along(campaigns, "fig7", "tip_deflection", "resolution", SIZES, **match)
        rows.append([name, *(with_digits(7, found) for found in deflections)])
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
    page.draw("errors", "Error of the deflection", caption, figure)
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
    clock = clock_in(campaigns, "radius")
    for axis, n in zip(axes[0], (32, 64), strict=True):
        rows += _costs(axis, campaigns, n, clock)
    axes[0, 0].set_ylabel("relative error of the deflection")
    axes[0, 0].legend(fontsize=6)
    caption = "Numbers at the points are R / h. Moving least squares with R > sqrt(2) h are held by multipliers."
    page.draw("cost", "Error against cost", caption, figure)
    columns = ["method", "R / h", "h [m]", "relative error", "solver time [s]"]
    title = clock.title("All search radii")
    page.tabulate("all", title, columns, rows, numeric=(3, 4), note=clock.note)
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


def _costs(axis: Axes, campaigns: Campaigns, n: int, clock: Clock) -> list[list[Any]]:
    """Draw error against time on one mesh, and return the rows of the table."""
    rows: list[list[Any]] = []
    wanted = ("error_tip", clock.quantity)
    for name, (colour, marker, match) in CLOUDS.items():
        points = []
        for radius in RADII:
            here = {**match, "basis__relative_radius": radius, "resolution": n}
            cost = quantities(campaigns, "radius", wanted, **here)
            if isinstance(cost[0].value, float):
                points.append((1e3 * cost[1].value, cost[0].value))
                rows.append([name, f"{radius:.3g}", f"{8.0 / n:g}", *cost])
                axis.annotate(
                    f"{radius:.2g}", points[-1], (2, 2), textcoords="offset points", fontsize=5
                )
        if points:
            curve = zip(*points, strict=True)
            axis.loglog(*curve, marker, color=colour, label=name, ls="-")
    fem = quantities(campaigns, "radius", wanted, method="fem", resolution=n)
    error, time = numbers(fem)
    if np.isfinite([error, time]).all():
        axis.plot(time * 1e3, error, "o", color="#E69F00", label="UL-FEM")
        rows.append(["UL-FEM", "", f"{8.0 / n:g}", *fem])
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
    rows = []
    bare, ghost = ({"method__ghost_stiffness": stiffness} for stiffness in (0.0, 1e-6))
    variants: dict[str, dict[str, Any]] = {
        "UL-FEM": METHODS["UL-FEM"],
        "MPM": METHODS["MPM"] | bare,
        "MPM, ghost stiffness 1e-6": METHODS["MPM"] | ghost,
        "GMM-MLS": METHODS["GMM-MLS"],
        "GMM-LME": METHODS["GMM-LME"],
    }
    wanted = ("load_steps", "tip_deflection", "problem__load_steps", STEPS)
    for label, match in variants.items():
        found = along(campaigns, *wanted, **match)
        values = numbers(found)
        line = look(label.partition(",")[0]) | {"label": label}
        if "ghost" in label:
            line |= {"linestyle": ":", "markerfacecolor": "white"}
        axes.semilogx(STEPS, 100.0 * (values / values[0] - 1.0), **line)
        shown = [*found, ratio(found[-1], found[0])]
        rows.append([label, *(with_digits(6, one) for one in shown)])
    axes.set(xlabel="number of load steps", ylabel="change of the deflection [%]")
    ticks(axes, STEPS)
    axes.legend(fontsize=6)
    caption = "h = 0.25 m; change against one load step. Implicit MPM locates its particles anew after every step."
    page.draw("drift", "Drift with the number of load steps", caption, figure)
    columns = ["method", *(f"N = {n}" for n in STEPS), "N = 50 over N = 1"]
    title = "Deflection of A [m] after N load steps"
    page.tabulate("deflections", title, columns, rows, numeric=range(1, 8))
    return page
