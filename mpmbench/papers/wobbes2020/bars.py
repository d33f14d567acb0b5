"""Figs. 5 to 8: the bar with fixed ends and the bar with dynamic traction."""

from typing import Any

import numpy as np

from mpmbench.papers.kit import Campaigns, Chapter
from mpmbench.papers.parts import along, of_file, quantities
from mpmbench.papers.wobbes2020.support import (
    ERROR,
    METHODS,
    MOVING,
    PROFILE,
    STRESS,
    fields,
    method,
    scatter,
    searched,
    stress_panels,
)
from mpmbench.report.figures import name_axes, tiles

GRIDS = (63, 127, 255, 511)
EDGE = 2.0 / 68.0  # the last two cells of the bar in Fig. 7 [m]


def fig5_chapter(campaigns: Campaigns) -> Chapter:
    """Final stress in the bar with fixed ends."""
    page = Chapter(
        "fig5",
        "Fig. 5: stress in the bar with fixed ends",
        "The paper: grid crossing causes severe oscillations in the stress of MPM-P1 on 512 "
        "nodes. OTM-P1 prevents them, but its stress is piecewise constant. The unified method is "
        "smooth and accurate on 32 nodes; results with max-ent functions are similar and not "
        "shown.",
    )
    cells = {"MPM-P1": 511, "OTM-P1": 511, "unified": 31, "OTM-maxent": 31}
    shown = {f"{name}, {n + 1} nodes": method(name, resolution=n) for name, n in cells.items()}
    figure = stress_panels(campaigns, "fig5", shown, 2)
    page.draw("stress", "Final stress", "Particles, and the exact solution in black.", figure)
    figure, axes = tiles(len(shown), 2, height=1.3, sharey=False)
    rows = []
    for axis, (title, match) in zip(axes, shown.items(), strict=True):
        file, found = fields(campaigns, "fig5", *PROFILE, **match)
        wrong = (found["stress"] - found["stress_exact"])[:, 0, 0]
        scatter(axis, found["position"][:, 0], wrong, title)
        axis.set_title(title, pad=3)
        error, crossings = quantities(campaigns, "fig5", (STRESS, "n_cell_crossings"), **match)
        name, nodes = title.partition(",")[0], match["resolution"] + 1
        rows.append([name, nodes, error, *of_file(file, np.abs(wrong).max()), crossings])
    name_axes(figure, "position $x_1$ [m]", "error of the stress [Pa]")
    page.draw("error", "Error of the final stress", "Each panel has a scale of its own.", figure)
    columns = ["method", "nodes", "RMS stress error [Pa]", "largest [Pa]", "cell crossings"]
    page.tabulate("errors", "Errors of the stress", columns, rows, numeric=(1, 2, 3, 4))
    return page


def fig6_chapter(campaigns: Campaigns) -> Chapter:
    """Convergence on the bar with fixed ends."""
    page = Chapter(
        "fig6",
        "Fig. 6: convergence on the bar with fixed ends",
        "The paper: MPM and OTM with piecewise-linear functions converge with order 2 on coarse "
        "grids; on fine ones MPM loses it to grid crossing, OTM keeps it until the last "
        "refinement. With max-ent functions the order is between 1 and 2. BSMPM and the unified "
        "method have order 3 until a limiting value is reached.",
    )
    page.convergence(campaigns["fig6"], (ERROR, STRESS))
    wanted = ("fig6", "n_cell_crossings", "resolution", GRIDS)
    rows = [[name, *along(campaigns, *wanted, **method(name))] for name in ("MPM-P1", "BSMPM")]
    columns = ["method", *(f"{n + 1} nodes" for n in GRIDS)]
    title = "Cell crossings of particles during the run"
    page.tabulate("crossings", title, columns, rows, numeric=(1, 2, 3, 4))
    page.notes.append(
        "The broken line is the error of the time step alone; orders are read with a step ten "
        "times smaller."
    )
    page.convergence(campaigns["orders"], (ERROR,), prefix="small_step_", where="time step 1e-6 s")
    return page


def fig7_chapter(campaigns: Campaigns) -> Chapter:
    """Stress in the bar with dynamic traction."""
    page = Chapter(
        "fig7",
        "Fig. 7: stress in the bar with dynamic traction",
        "The paper: MPM-maxent and BSMPM leave the solution at the right edge. In BSMPM more "
        "particles reduce this, which suggests quadrature errors; in MPM-maxent the set of "
        "functions is incomplete. OTM-P1, OTM-maxent and the unified method are significantly "
        "more accurate than their MPM counterparts.",
    )
    shown = {name: as_paper(name) for name in METHODS}
    figure = stress_panels(campaigns, "fig7", shown, 3, height=1.4)
    caption = (
        "68 cells with 4 particles at t = 0.4 s; methods with fixed nodes carry the load on their "
        "last particle. Black: exact solution of the nonlinear bar."
    )
    page.draw("stress", "Stress in the bar with dynamic traction", caption, figure)
    _fig7_edge(page, campaigns)
    _fig7_errors(page, campaigns)
    page.notes.append(
        "The reference is the exact simple wave of the neo-Hookean bar. The paper compares with "
        "the linear wave equation, whose distance from it is in the column beside. The edge is the "
        "last two cells of the bar."
    )
    return page


def _fig7_edge(page: Chapter, campaigns: Campaigns) -> None:
    """The end of the bar: what more particles do to BSMPM, and what the place of the load does."""
    shown = {
        "BSMPM, 4 particles per cell": as_paper("BSMPM"),
        "BSMPM, 16 particles per cell": as_paper("BSMPM", particles_per_cell=16),
        "BSMPM, 4, load at the end": as_paper("BSMPM", method__traction="end_point"),
        "unified, 4 particles per cell": as_paper("unified"),
    }
    look: dict[str, Any] = {"height": 1.7, "size": 5.0, "title": 7}
    figure = stress_panels(
        campaigns, "fig7", shown, 4, chosen=lambda found: _near_end(found, 3.0 * EDGE), **look
    )
    caption = "The last six cells of the bar. Unless said otherwise BSMPM carries the load on its last particle."
    page.draw("edge", "The right edge", caption, figure)


def _near_end(found: dict[str, np.ndarray], length: float) -> np.ndarray:
    return found["position_initial"][:, 0] > 1.0 - length


def as_paper(name: str, **more: Any) -> dict[str, Any]:
    """The runs of Fig. 7 with the load where the paper has it, but for what is said otherwise."""
    traction = "end_point" if name in MOVING else "last_particle"
    own = {"particles_per_cell": 4, "method__traction": traction} | searched(name)
    return method(name, **own | more)


def _fig7_errors(page: Chapter, campaigns: Campaigns) -> None:
    rows = []
    for name in METHODS:
        for traction in ("end_point",) if name in MOVING else ("last_particle", "end_point"):
            for particles in (4, 8, 16) if name == "BSMPM" else (4,):
                match = as_paper(name, particles_per_cell=particles, method__traction=traction)
                file, found = fields(campaigns, "fig7", *PROFILE, **match)
                near = _near_end(found, EDGE)
                wrong = (found["stress"] - found["stress_exact"])[:, 0, 0]
                parts = [np.sqrt(np.mean(wrong[part] ** 2)) for part in (near, ~near)]
                names = (ERROR, f"{ERROR}_alternative", STRESS)
                errors = quantities(campaigns, "fig7", names, **match)
                head = [name, traction.replace("_", " "), particles]
                rows.append([*head, *errors, *of_file(file, *parts)])
    columns = ["method", "load at", "particles per cell", "RMS displacement error [m]"]
    columns += ["against linear wave [m]", "RMS stress error [Pa]"]
    columns += ["at the edge [Pa]", "elsewhere [Pa]"]
    title = "Errors at t = 0.4 s on 68 cells"
    page.tabulate("errors", title, columns, rows, numeric=range(2, 8))


def fig8_chapter(campaigns: Campaigns) -> Chapter:
    """Convergence on the bar with dynamic traction."""
    page = Chapter(
        "fig8",
        "Fig. 8: convergence on the bar with dynamic traction",
        "The paper: the unified approach and BSMPM have the lowest error and the highest order. "
        "All orders are slightly lower than expected, because the stress is not smooth.",
    )
    page.convergence(campaigns["fig8"], (ERROR, STRESS))
    page.notes.append(
        "The stress has a kink at the front of the wave; the sharp orders of the displacement are "
        "5/3 for piecewise linear functions and lumped masses, 2 for quadratic ones and about 15/7 "
        "for max-ent functions."
    )
    return page
