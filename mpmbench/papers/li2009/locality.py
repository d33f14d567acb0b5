"""What gamma does, which the thesis gives for none of its dynamic problems."""

from typing import Any

from mpmbench.analysis.estimate import asymptotic_text, numbers_text, slopes_text
from mpmbench.papers.kit import Campaigns, Chapter
from mpmbench.papers.li2009.support import CONSISTENT, DENSITY, LUMPED, VELOCITY
from mpmbench.papers.parts import along, finished, quantities, ticks
from mpmbench.report import style
from mpmbench.report.evidence import Runs
from mpmbench.report.figures import log_ticks, name_axes, panels
from mpmbench.report.names import drawn
from mpmbench.report.tables import Cell

GAMMAS = (0.8, 1.8, 4.0)
GRIDS = (50, 100, 200)
VARIANTS: dict[str, dict[str, Any]] = {
    "lumped, 1 per cell": LUMPED | {"particles_per_cell": 1},
    "lumped, 2 per cell": LUMPED | {"particles_per_cell": 2},
    "consistent, 2 per cell": CONSISTENT | {"particles_per_cell": 2},
}
NORMS = {"velocity [m^1.5/s]": VELOCITY, "density [kg/m^2]": DENSITY}
TIP = ("tip_displacement_error", "tip_displacement_max", "tip_displacement_min", "tip_velocity_max")


def locality_chapter(campaigns: Campaigns) -> Chapter:
    """Errors and slopes of the shock, and the tip of the bar, by gamma."""
    page = Chapter(
        "gamma",
        "The locality gamma of the shock and of the bar, which the thesis leaves open",
        "Sect. 2.2.3: gamma controls the width of the functions; its value is given for the "
        "figures of the functions and for none of the dynamic problems.",
    )
    _shock(page, campaigns)
    rows = []
    for share in (0.0, 0.3):
        for gamma in GAMMAS:
            match = {"basis__gamma": gamma, "problem__irregularity": share}
            found = quantities(campaigns, "gamma_bar", TIP, **match)
            rows.append(["irregular" if share else "uniform", gamma, *found])
    columns = ["nodes", "gamma", "relative L2 error", "largest [m]", "smallest [m]"]
    columns.append("largest speed [m/s]")
    title = "The free end of the bar: lumped mass, nodal velocities, two particles per cell"
    page.tabulate("bar", title, columns, rows, numeric=range(1, 6))
    return page


def _shock(page: Chapter, campaigns: Campaigns) -> None:
    """Errors over gamma on the finest nodes as a figure, with slopes as a table."""
    figure, axes = panels(1, 2, 2.5)
    rows = []
    for axis, (norm, quantity) in zip(axes[0], NORMS.items(), strict=True):
        for rank, (name, match) in enumerate(VARIANTS.items()):
            finest = match | {"resolution": GRIDS[-1]}
            errors = along(campaigns, "gamma", quantity, "basis__gamma", GAMMAS, **finest)
            lack = f"gamma: no run with {name} has finished"
            axis.loglog(
                *finished(GAMMAS, errors, lack), label=name, **style.line("otm", "lme", rank)
            )
            rows += [
                [name, gamma, norm, *_order(campaigns, quantity, match, gamma), error]
                for gamma, error in zip(GAMMAS, errors, strict=True)
            ]
        ticks(axis, GAMMAS)
        log_ticks(axis.yaxis, span=100.0)
        axis.set_ylabel(drawn(f"error of the {norm}"))
    axes[0, 0].legend()
    name_axes(figure, r"$\gamma$")
    caption = f"The shock in one dimension with {GRIDS[-1]} cells."
    page.draw("shock", "Errors of the shock by gamma", caption, figure)
    columns = ["curve", "gamma", "error", "order", "local slopes", "asymptotic order", "cells"]
    columns.append(f"error with {GRIDS[-1]} cells")
    page.tabulate("shock", "Orders of the shock by gamma", columns, rows, numeric=(1, 7))


def _order(
    campaigns: Campaigns, quantity: str, match: dict[str, Any], gamma: float
) -> tuple[Cell, ...]:
    """Least-squares slope, local slopes, asymptotic order and levels of the runs with this gamma."""
    runs = Runs(campaigns)
    found = runs.order("gamma", quantity, cells=GRIDS, basis__gamma=gamma, **match)
    files = runs.evidence[-1].files
    texts = (slopes_text(found), numbers_text(found.local), asymptotic_text(found))
    return *(Cell(text, files) for text in texts), Cell(" ".join(map(str, GRIDS)), files)
