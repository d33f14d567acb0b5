"""One chapter for each study."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm

from mpmbench.papers.family_studies.support import (
    CANTILEVER,
    CELLS,
    INNER,
    STRETCHES,
    TRACTION,
    WALLED,
    WAVES,
    Match,
)
from mpmbench.papers.kit import Campaigns, Chapter, cell, variables
from mpmbench.papers.parts import LINES, along, error_lines, numbers, of_file, quantities, thinned
from mpmbench.report.evidence import MissingRuns, Runs
from mpmbench.report.figures import panels, single
from mpmbench.report.tables import Cell

SHOWN = (  # of the cantilever; the others are in the table
    *("MPM, hats", "ULMPM, splines", "CPDI2", "TLMPM, hats (tlmpm)", "TLMPM, splines (tlmpm)"),
    *("moving mesh (moving_mesh_mpm)", "linear finite elements"),
)
SLOWEST, FASTEST = 0.1, 3.0  # rates of growth that colours tell apart [1/s]


def cantilever_chapter(campaigns: Campaigns) -> Chapter:
    """The end of the beam and the drift of the energy."""
    page = Chapter("cantilever", "A cantilever that falls under suddenly applied gravity, 3 s")
    page.statement = (
        "Converged total-Lagrangian finite elements: the corner falls to -3.304 m at 1.0475 s and comes back to "
        "+0.042 m at 2.635 s. Nothing is lost in between."
    )
    campaigns["cantilever"]
    figure, axes = single()
    for rank, name in enumerate(SHOWN):
        try:
            _, found = variables(
                campaigns, "cantilever", "time", "tip_displacement", **CANTILEVER[name]
            )
        except MissingRuns:
            continue
        curve = thinned(found["time"], found["tip_displacement"])
        axes.plot(*curve, LINES[rank % 4], lw=1.1, label=name)
    axes.set(xlabel="time [s]", ylabel="displacement of the corner [m]")
    figure.legend(fontsize=6, loc="outside lower center", ncols=2)
    caption = "16 cells along 4 m, 16 particles in each, steps of 0.1 ms."
    page.draw("corner", "The lower right corner", caption, figure)
    wanted = ("energy_drift", "n_cell_crossings")
    rows = [
        [
            name,
            "wall" if name in WALLED else "room",
            *_turns(campaigns, match),
            *quantities(campaigns, "cantilever", wanted, **match),
        ]
        for name, match in CANTILEVER.items()
    ]
    head = [
        "method",
        "behind",
        "first minimum [m]",
        "late maximum [m]",
        "energy drift",
        "crossings",
    ]
    note = "The drift is the largest change of the total energy over the largest kinetic energy."
    page.tabulate("ends", "All methods", head, rows, numeric=range(2, 6), note=note)
    page.notes.append(
        "B-splines, GIMP, CPDI and DDMP on a grid that stays need a smooth wall behind the clamp, where their "
        "functions would reach; the wall lets go, and converged values differ there: compare within one kind."
    )
    return page


def _turns(campaigns: Campaigns, match: Match) -> list[Cell]:
    """Lowest place of the corner before 1.5 s and highest after 2 s [m], or how the run ended."""
    try:
        file, found = variables(campaigns, "cantilever", "time", "tip_displacement", **match)
    except MissingRuns:
        return [cell(campaigns, "cantilever", "late_maximum", **match)] * 2
    time, tip = found["time"], found["tip_displacement"]
    return of_file(file, tip[time < 1.5].min(), tip[time > 2.0].max())


def waves_chapter(campaigns: Campaigns) -> Chapter:
    """What a step makes of waves, and how fast a disturbance grows in time."""
    page = Chapter("waves", "Waves in a stretched bar: von Neumann's analysis of each scheme")
    page.statement = (
        "Belytschko et al. 2000; Li 2009, Fig. 4.10: with an Eulerian kernel the scheme has a tensile instability, "
        "with a Lagrangian one it is stable where the equation is. Here P = E ln J, whose tangent E/J is positive: the "
        "equation is stable at every stretch."
    )
    campaigns["waves"]
    _map_of_growth(page, campaigns)
    _dispersion(page, campaigns)
    page.notes.append(
        "The analysis linearises the program's own step, by copies of the state in which one unknown is off: places, "
        "velocities and deformations of the particles of a cell, place and velocity of its node. Particles of MPM that "
        "stay in their cells feel their volume grow but not that they become fewer: hats are too stiff in a stretched "
        "bar, sqrt(1 + ln J) times too fast, until particles cross."
    )
    return page


def _map_of_growth(page: Chapter, campaigns: Campaigns) -> None:
    kinds = ("growth_rate_predicted", "growth_rate")
    rates = {
        kind: [
            [_known(campaigns, kind, problem__stretch=s, **match) for s in STRETCHES]
            for match in WAVES.values()
        ]
        for kind in kinds
    }
    predicted, seen = (np.array([numbers(row) for row in rates[kind]]) for kind in kinds)
    figure, axes = panels(1, 1, 3.4)
    axis: Axes = axes[0, 0]
    colours = np.clip(np.where(predicted > 0.0, predicted, np.nan), SLOWEST, FASTEST)
    picture = axis.imshow(colours, norm=LogNorm(SLOWEST, FASTEST), cmap="YlOrRd", aspect="auto")
    for i, row in enumerate(predicted):
        for j, rate in enumerate(row):
            words = "stable" if rate == 0.0 else "" if np.isnan(rate) else f"{rate:.3g}"
            if np.isfinite(seen[i, j]):
                words += f" / {seen[i, j]:.3g}"
            ink = "white" if rate > 1.0 else "black"
            axis.text(j, i, words, ha="center", va="center", size=6, color=ink)
    axis.set_xticks(range(len(STRETCHES)), [f"{s:g}" for s in STRETCHES])
    axis.set_yticks(range(len(WAVES)), list(WAVES))
    axis.grid(False)
    axis.tick_params(length=0, labelsize=6)
    axis.set(xlabel="stretch")
    figure.colorbar(picture, label="predicted rate of growth [1/s]", shrink=0.8)
    caption = "Predicted / as seen in time, where a disturbance of 1e-10 m/s grew a million times in 100 s."
    page.draw("growth", "Rates at which the fastest wave grows [1/s]", caption, figure)
    head = ["scheme", *(f"J = {s:g}" for s in STRETCHES)]
    for kind, words in zip(kinds, ("predicted", "seen in time"), strict=True):
        table = [[name, *row] for name, row in zip(WAVES, rates[kind], strict=True)]
        title = f"Largest rate of growth [1/s], {words}"
        page.tabulate(kind, title, head, table, numeric=range(1, 6))


def _known(campaigns: Campaigns, quantity: str, **match: Any) -> Cell:
    """The number of a run, also of one that has broken down."""
    runs = Runs(campaigns)
    try:
        value = runs.known("waves", quantity, **match)
    except MissingRuns:
        return Cell("none" if quantity == "growth_rate" else "")
    return Cell(value, runs.evidence[-1].files)


def _dispersion(page: Chapter, campaigns: Campaigns) -> None:
    figure, axes = panels(1, 2, 3.0)
    for axis, stretch in zip(axes[0], (1.0, 1.5), strict=True):
        found: dict[str, np.ndarray] = {}
        for rank, (name, match) in enumerate(WAVES.items()):
            names = ("wave_number", "wave_frequency", "wave_frequency_exact")
            try:
                _, found = variables(campaigns, "waves", *names, problem__stretch=stretch, **match)
            except MissingRuns:
                continue
            curve = found["wave_number"], found["wave_frequency"]
            axis.plot(*curve, LINES[rank // 4], lw=1.0, label=name)
        if found:
            axis.plot(
                found["wave_number"], found["wave_frequency_exact"], "k", lw=0.8, label="exact"
            )
        axis.set(xlabel="wave number [rad per cell]", title=f"stretch {stretch:g}", ylim=(0.0, 2.2))
    axes[0, 0].set_ylabel("frequency of the fastest part [rad/s]")
    figure.legend(
        *axes[0, 0].get_legend_handles_labels(), fontsize=6, loc="outside lower center", ncols=4
    )
    caption = "c = 1 m/s and h = 1 m in the bar as it was. A wave without frequency grows or has no energy."
    page.draw("dispersion", "Frequencies of waves", caption, figure)


def traction_chapter(campaigns: Campaigns) -> Chapter:
    """Stress errors behind the wave, where particles have crossed."""
    page = Chapter(
        "traction", "A bar with a dynamic traction: what crossing cells does to stresses"
    )
    page.statement = (
        "Zhang, Ma and Giguere 2011: dual domain gradients remove the noise of crossing."
    )
    campaigns["traction"]
    rows: dict[str, list[Cell]] = {
        name: along(campaigns, "traction", INNER, "resolution", CELLS, **match)
        for name, match in TRACTION.items()
    }
    figure, axes = single()
    error_lines(axes, CELLS, rows, "stress error [Pa]")
    axes.legend(fontsize=7)
    caption = "MPM with four functions at 0.9 s; the quarter at the loaded end is left out."
    page.draw("stress", "Stress error behind the wave", caption, figure)
    table = [
        [
            name,
            *found,
            cell(campaigns, "traction", "n_cell_crossings", **TRACTION[name], resolution=256),
            cell(campaigns, "traction", "error_stress_rms", **TRACTION[name], resolution=256),
        ]
        for name, found in rows.items()
    ]
    head = [
        "functions",
        *(f"{n} cells" for n in CELLS),
        "crossings, 256 cells",
        "whole bar, 256 cells",
    ]
    page.tabulate("errors", "Stress error behind the wave [Pa]", head, table, numeric=range(1, 6))
    page.notes.append(
        "At the paper's 0.4 s no particle of the default resolution crosses a cell. The error of DDMP on the whole bar "
        "is that of its free end, where its gradients reach over empty cells."
    )
    return page
