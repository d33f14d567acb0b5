"""Figs. 5 to 8: the bar with fixed ends and the bar with dynamic traction."""

import numpy as np

from mpmbench.papers.kit import Campaigns, Chapter, cell
from mpmbench.papers.parts import exact_line, name_axes, tiles
from mpmbench.papers.wobbes2020.support import (
    ERROR,
    METHODS,
    MOVING,
    STRESS,
    derived,
    fields,
    method,
    scatter,
)
from mpmbench.report.tables import Cell, Table

PROFILE = ("position", "position_initial", "stress", "stress_exact")
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
    shown = {"MPM-P1": 511, "OTM-P1": 511, "unified": 31, "OTM-maxent": 31}
    figure, axes = tiles(4, 2)
    errors: dict[str, tuple[np.ndarray, np.ndarray]] = {}
    rows, files = [], []
    for axis, (name, cells) in zip(axes, shown.items(), strict=True):
        match = method(name, resolution=cells)
        file, found = fields(campaigns, "fig5", *PROFILE, **match)
        x, stress, exact = (
            found["position"][:, 0],
            found["stress"][:, 0, 0],
            found["stress_exact"][:, 0, 0],
        )
        exact_line(axis, x, exact)
        scatter(axis, x, stress, name)
        axis.set_title(f"{name}, {cells + 1} nodes", pad=3)
        files.append(file)
        errors[name] = x, stress - exact
        largest = float(np.abs(stress - exact).max())
        rows.append(
            [
                Cell(name),
                Cell(cells + 1),
                cell(campaigns, "fig5", STRESS, **match),
                Cell(largest, (file,)),
            ]
        )
        rows[-1].append(cell(campaigns, "fig5", "n_cell_crossings", **match))
    name_axes(figure, "position $x_1$ [m]", r"stress $\sigma$ [Pa]")
    page.draw(
        "stress", "Final stress", "Particles, and the exact solution in black.", figure, files
    )
    figure, axes = tiles(len(shown), 2, height=1.3, sharey=False)
    for axis, (name, (x, wrong)) in zip(axes, errors.items(), strict=True):
        scatter(axis, x, wrong, name)
        axis.set_title(f"{name}, {shown[name] + 1} nodes", pad=3)
    name_axes(figure, "position $x_1$ [m]", "error of the stress [Pa]")
    page.draw(
        "error", "Error of the final stress", "Each panel has a scale of its own.", figure, files
    )
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
    rows = []
    for name in ("MPM-P1", "BSMPM"):
        grids = [method(name, resolution=n) for n in (63, 127, 255, 511)]
        counts = [cell(campaigns, "fig6", "n_cell_crossings", **match) for match in grids]
        rows.append([Cell(name), *counts])
    columns = ["method", *(f"{n + 1} nodes" for n in (63, 127, 255, 511))]
    page.tabulate(
        "crossings",
        "Cell crossings of particles during the run",
        columns,
        rows,
        numeric=(1, 2, 3, 4),
    )
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
    figure, axes = tiles(len(METHODS), 3, height=1.4)
    files = []
    for axis, name in zip(axes, METHODS, strict=True):
        file, found = fields(campaigns, "fig7", *PROFILE, **_as_paper(name))
        x = found["position"][:, 0]
        exact_line(axis, x, found["stress_exact"][:, 0, 0])
        scatter(axis, x, found["stress"][:, 0, 0], name)
        axis.set_title(name, pad=3)
        files.append(file)
    name_axes(figure, "position $x_1$ [m]", r"stress $\sigma$ [Pa]")
    caption = (
        "68 cells with 4 particles at t = 0.4 s; methods with fixed nodes carry the load on their "
        "last particle. Black: exact solution of the nonlinear bar."
    )
    page.draw("stress", "Stress in the bar with dynamic traction", caption, figure, files)
    _fig7_edge(page, campaigns)
    page.add(_fig7_errors(campaigns))
    page.notes.append(
        "The reference is the exact simple wave of the neo-Hookean bar. The paper compares with "
        "the linear wave equation, whose distance from it is in the column beside. The edge is the "
        "last two cells of the bar."
    )
    return page


def _fig7_edge(page: Chapter, campaigns: Campaigns) -> None:
    """The end of the bar: what more particles do to BSMPM, and what the place of the load does."""
    shown = {
        "BSMPM, 4 particles per cell": _as_paper("BSMPM"),
        "BSMPM, 16 particles per cell": _as_paper("BSMPM") | {"particles_per_cell": 16},
        "BSMPM, 4, load at the end": _as_paper("BSMPM") | {"method__traction": "end_point"},
        "unified, 4 particles per cell": _as_paper("unified"),
    }
    figure, axes = tiles(len(shown), 4, height=1.7)
    files = []
    for axis, (label, match) in zip(axes, shown.items(), strict=True):
        file, found = fields(campaigns, "fig7", *PROFILE, **match)
        near = found["position_initial"][:, 0] > 1.0 - 3.0 * EDGE
        x = found["position"][near, 0]
        exact_line(axis, x, found["stress_exact"][near, 0, 0])
        scatter(axis, x, found["stress"][near, 0, 0], label.partition(",")[0], size=5.0)
        axis.set_title(label, pad=3, size=7)
        files.append(file)
    name_axes(figure, "position $x_1$ [m]", r"stress $\sigma$ [Pa]")
    caption = "The last six cells of the bar. Unless said otherwise BSMPM carries the load on its last particle."
    page.draw("edge", "The right edge", caption, figure, files)


def _as_paper(name: str) -> dict[str, object]:
    traction = "end_point" if name in MOVING else "last_particle"
    more = {"basis__search": "local"} if METHODS[name]["basis"] == "maxent" else {}
    return method(name, particles_per_cell=4, method__traction=traction, **more)


def _fig7_errors(campaigns: Campaigns) -> Table:
    rows = []
    for name in METHODS:
        tractions = ("end_point",) if name in MOVING else ("last_particle", "end_point")
        for traction in tractions:
            for particles in (4, 8, 16) if name == "BSMPM" else (4,):
                match = _as_paper(name) | {
                    "particles_per_cell": particles,
                    "method__traction": traction,
                }
                file, found = fields(campaigns, "fig7", *PROFILE, **match)
                near = found["position_initial"][:, 0] > 1.0 - EDGE
                wrong = (found["stress"] - found["stress_exact"])[:, 0, 0]
                at_edge, elsewhere = (
                    float(np.sqrt(np.mean(wrong[part] ** 2))) for part in (near, ~near)
                )
                rows.append(
                    [
                        *(Cell(name), Cell(traction.replace("_", " ")), Cell(particles)),
                        cell(campaigns, "fig7", ERROR, **match),
                        cell(campaigns, "fig7", f"{ERROR}_alternative", **match),
                        cell(campaigns, "fig7", STRESS, **match),
                        *(derived(at_edge, file), derived(elsewhere, file)),
                    ]
                )
    columns = [
        "method",
        "load at",
        "particles per cell",
        "RMS displacement error [m]",
        "against linear wave [m]",
    ]
    columns += ["RMS stress error [Pa]", "at the edge [Pa]", "elsewhere [Pa]"]
    return Table(
        "errors", "Errors at t = 0.4 s on 68 cells", columns, rows, numeric=tuple(range(2, 8))
    )


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
