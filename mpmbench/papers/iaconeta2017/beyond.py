"""Beyond the paper: the falling cantilever with all methods, and the patch test of clouds."""

from typing import Any

from mpmbench.papers.iaconeta2017.support import METHODS, history, look
from mpmbench.papers.kit import Campaigns, Chapter, cell
from mpmbench.papers.parts import along, numbers, quantities, thinned
from mpmbench.report import style
from mpmbench.report.figures import panels, single
from mpmbench.report.timing import clock_in

DYNAMIC: dict[str, tuple[dict[str, Any], str, str]] = {
    "UL-FEM, 16 x 4": ({"method": "fem", "resolution": 16}, "#f5c36b", "-"),
    "UL-FEM, 32 x 8": ({"method": "fem", "resolution": 32}, "#E69F00", "-"),
    "UL-FEM, 64 x 16": ({"method": "fem", "resolution": 64}, "#9c6c00", "-"),
    "implicit MPM, 16 x 4": ({"method": "implicit_mpm", "resolution": 16}, "#56B4E9", "--"),
    "implicit MPM, 32 x 8": ({"method": "implicit_mpm", "resolution": 32}, "#0072B2", "--"),
    "explicit MPM, 16 x 4": ({"method": "mpm", "resolution": 16}, "#bbbbbb", "-."),
    "explicit MPM, 32 x 8": ({"method": "mpm", "resolution": 32}, "#777777", "-."),
    "GMM-MLS, frozen": ({"basis": "mls", "method__shape_functions": "frozen"}, "#CC79A7", "-"),
    "GMM-MLS, updated": ({"basis": "mls", "method__shape_functions": "updated"}, "#CC79A7", ":"),
    "GMM-LME, frozen": ({"basis": "lme", "method__shape_functions": "frozen"}, "#009E73", "-"),
    "GMM-LME, updated": ({"basis": "lme", "method__shape_functions": "updated"}, "#009E73", ":"),
}
# time [s] and displacement [m] with quadratic finite elements, 24 x 6 cells
FIRST_MINIMUM, LATE_MAXIMUM = (1.0475, -3.304), (2.635, 0.042)
SCALARS = (
    "first_minimum",
    "lag_of_first_minimum",
    "late_maximum",
    "lag_of_late_maximum",
    "energy_drift",
)
PATCH = (8, 16, 32, 64)


def dynamic_chapter(campaigns: Campaigns) -> Chapter:
    """Tip displacement of all methods."""
    page = Chapter("dynamic", "Beyond the paper: implicit against explicit on a falling cantilever")
    page.statement = (
        "Quadratic total-Lagrangian finite elements: first minimum of the corner -3.304 m at "
        "1.0475 s, maximum after 2 s +0.042 m at 2.635 s."
    )
    figure, axes = panels(1, 3, 2.9)
    groups = (("UL-FEM",), ("implicit MPM", "explicit MPM"), ("GMM",))
    rows = []
    clock = clock_in(campaigns, "dynamic")
    wanted = (*SCALARS, clock.quantity)
    for name, (match, colour, line) in DYNAMIC.items():
        _, found = history(campaigns, "dynamic", "time", "tip_displacement", **match)
        column = next(k for k, group in enumerate(groups) if name.startswith(group))
        curve = thinned(found["time"], found["tip_displacement"])
        axes[0, column].plot(*curve, color=colour, ls=line, lw=1.1, label=name)
        rows.append([name, *quantities(campaigns, "dynamic", wanted, **match)])
    for axis in axes[0]:
        extrema = zip(FIRST_MINIMUM, LATE_MAXIMUM, strict=True)
        axis.plot(*extrema, "k+", ms=8, label="quadratic elements")
        axis.set(xlabel="time [s]", ylim=(-4.2, 1.9), yticks=range(-4, 1))
        axis.legend(fontsize=6, loc="upper left")
    axes[0, 0].set_ylabel("vertical displacement of the corner [m]")
    caption = "MPM with 16 particles per cell."
    page.draw("tip", "Displacement of the lower right corner", caption, figure)
    columns = ["method", "first minimum [m]", "its delay [s]", "late maximum [m]", "its delay [s]"]
    columns += ["energy drift", "solver time [s]"]
    title = clock.title("Extrema")
    page.tabulate("extrema", title, columns, rows, numeric=range(1, 7), note=clock.note)
    page.notes += _findings(campaigns)
    return page


def _findings(campaigns: Campaigns) -> list[str]:
    """Sentences with the numbers of the table, as far as they are there."""

    def text(quantity: str, name: str) -> str:
        return cell(campaigns, "dynamic", quantity, **DYNAMIC[name][0]).text or "missing"

    clouds = [
        f"{text('energy_drift', f'{name}, frozen')} with the functions of the initial state and "
        f"{text('energy_drift', f'{name}, updated')} with functions found anew in every step "
        f"({name})"
        for name in ("GMM-MLS", "GMM-LME")
    ]
    grids = [name for name in DYNAMIC if "32 x 8" in name]
    rebounds = ", ".join(f"{text('late_maximum', name)} m ({name})" for name in grids)
    drifts = ", ".join(f"{text('energy_drift', name)} ({name})" for name in grids)
    return [
        f"Energy drift of clouds: {'; '.join(clouds)}.",
        f"Rebound of the corner, which should reach +0.042 m: {rebounds}. Energy drift, in parts "
        f"of the largest kinetic energy: {drifts}. Particles feel jumps of the gradient where "
        "they cross cells of linear functions. Explicit MPM keeps its energy, but not in the "
        "motion; implicit MPM, whose nodes take up the velocity of the particles anew in every "
        "step (Eqs. 40 and 48), loses it.",
    ]


def patch_chapter(campaigns: Campaigns) -> Chapter:
    """Errors of the patch test over the spacing."""
    page = Chapter("patch", "Beyond the paper: integration error of clouds on irregular nodes")
    page.statement = "A linear displacement at the boundary, which every basis can represent, must continue inside."
    figure, axes = single(height=2.8, width=1.2 * style.COLUMN)
    rows = []
    curves: dict[str, dict[str, Any]] = {
        "UL-FEM": METHODS["UL-FEM"],
        "GMM-MLS": METHODS["GMM-MLS"],
        "GMM-LME, R = 2 h": {"basis": "lme", "basis__relative_radius": 2.0},
        "GMM-LME, R = 3 h": {"basis": "lme", "basis__relative_radius": 3.0},
    }
    wanted = ("patch", "error_displacement_relative", "resolution", PATCH)
    for name, match in curves.items():
        found = along(campaigns, *wanted, **match)
        if name != "UL-FEM":
            hollow = {"markerfacecolor": "white"} if name.endswith("3 h") else {}
            line = look(name.partition(",")[0]) | hollow | {"label": name}
            axes.loglog(PATCH, numbers(found), **line)
        rows.append([name, *found])
    axes.loglog([8, 64], [4e-3, 5e-4], color="#888888", lw=0.8, label="slope 1")
    axes.set(xlabel="cells along the square", ylabel="relative RMS displacement error")
    axes.set_xticks(PATCH, [str(n) for n in PATCH])
    axes.xaxis.minorticks_off()
    axes.set_ylim(1e-4, 1e-2)
    axes.legend(fontsize=6)
    caption = (
        "Square of irregular triangles with three points each, strains of 10 %, one load step. The "
        "errors of UL-FEM are in the table."
    )
    page.draw("errors", "Patch test", caption, figure)
    columns = ["method", *(f"{n} cells" for n in PATCH)]
    page.tabulate("errors", "Relative displacement errors", columns, rows, numeric=(1, 2, 3, 4))
    return page
