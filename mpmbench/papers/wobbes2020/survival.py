"""Which runs survive: near-empty cells in Sect. 8.2, and the stability limit of the time step."""

import numpy as np
import pandas as pd
from matplotlib.colors import BoundaryNorm

from mpmbench.papers.kit import Campaigns, Chapter, MissingRuns, cell
from mpmbench.papers.parts import along, numbers
from mpmbench.papers.wobbes2020 import spectra
from mpmbench.papers.wobbes2020.support import ERROR, METHODS
from mpmbench.report.figures import single
from mpmbench.report.series import series_name
from mpmbench.report.tables import Cell, Table
from mpmbench.results.records import Campaign

NODES = {79: "81 functions", 80: "81 knots", 83: "85 functions", 84: "85 knots", 85: "as in Fig. 7"}
SIGNS = {-1.0: "compressed first", 1.0: "stretched first"}
LAYOUTS = {"midpoint": "uniform over the bar", "aligned": "in the grid's cells"}
CUTOFFS = (0.0, 1e-8, 1e-6, 1e-4)
DEGREES = {"linear": 1, "bspline": 2, "maxent": 3}  # max-ent: cubic splines away from the ends
WAVE_SPEED = float(np.sqrt(4000.0))  # of the bar with fixed ends [m/s]


def breakdown_chapter(campaigns: Campaigns) -> Chapter:
    """The map of survival."""
    page = Chapter(
        "breakdown",
        "Sect. 8.2: break-down with consistent mass",
        "The paper: when a material point enters an empty element, BSMPM inherits stability "
        "issues from MPM: changing the total number of nodes to 81 results in a termination after "
        "0.3 s. The unified method stays stable.",
    )
    rows, labels, times = [], [], []
    for name in ("BSMPM", "MPM-maxent", "unified"):
        for sign, motion in SIGNS.items():
            for layout, place in LAYOUTS.items():
                line = [_end(campaigns, name, sign, layout, cells) for cells in NODES]
                rows.append([name, motion, place, *line])
                labels.append(f"{name}, {motion}, {place}")
                times.append(numbers(line))
    figure, axes = single(height=3.4, width=6.4)
    levels = BoundaryNorm([0.2, 0.25, 0.3, 0.35, 0.4], 256)
    shades = np.array(times)
    drawn = axes.imshow(np.ma.masked_invalid(shades), cmap="YlOrRd_r", norm=levels, aspect="auto")
    for (y, x), time in np.ndenumerate(shades):
        text = f"{time:.3f} s" if np.isfinite(time) else "survives"
        ink = "white" if time < 0.25 else "black"
        axes.text(x, y, text, ha="center", va="center", size=6.5, color=ink)
    axes.set_xticks(range(len(NODES)), [f"{n} cells\n({what})" for n, what in NODES.items()])
    axes.set_yticks(range(len(labels)), labels, size=6.5)
    axes.grid(False)
    axes.tick_params(length=0)
    figure.colorbar(drawn, ax=axes, label="time of break-down [s]", pad=0.01)
    caption = "Time at which a run ends; all of them should reach 0.4 s. Cells are those of the grid on 1.25 m."
    page.draw("map", "Map of survival", caption, figure)
    grids = [f"{cells} cells, {what}" for cells, what in NODES.items()]
    columns = ["method", "traction", "particles", *grids]
    title = "Time of break-down [s]; empty: survives until 0.4 s"
    page.tabulate("times", title, columns, rows, numeric=range(3, 8))
    _cutoffs(page, campaigns)
    page.notes.append(
        "When the last active function is seen by one particle near the edge of its support, its "
        "mass goes with the fourth power of the distance from there. The second table leaves out "
        "degrees of freedom with too little mass: how little is a matter of stability and of "
        "accuracy. The unified method has no empty cells."
    )
    return page


def _end(campaigns: Campaigns, name: str, sign: float, layout: str, cells: int) -> Cell:
    """Time at which a run broke down; empty when it survived, its files attached in both cases."""
    match = {
        "problem__traction_amplitude": sign,
        "problem__particle_layout": layout,
        "problem__domain_cells": cells,
    }
    ended = cell(campaigns, "breakdown", ERROR, **METHODS[name], **match)
    if not ended.files:
        raise MissingRuns(f"breakdown: no run of {name} on {cells} cells")
    if isinstance(ended.value, float):
        return Cell("", ended.files)
    return Cell(time_reached(campaigns["breakdown"], ended.files[0]), ended.files)


def time_reached(campaign: Campaign, file: str) -> float:
    """Instant [s] at which a run ended."""
    return float(campaign.runs.loc[[file], "time_reached"].to_numpy()[0])


def _cutoffs(page: Chapter, campaigns: Campaigns) -> None:
    """Displacement error of BSMPM by cut-off, or the time of break-down."""
    rows = []
    for sign, motion in SIGNS.items():
        for cells, what in NODES.items():
            match = {"problem__traction_amplitude": sign, "problem__domain_cells": cells}
            found = along(campaigns, "cutoff", ERROR, "method__mass_cutoff", CUTOFFS, **match)
            for k, one in enumerate(found):
                if not isinstance(one.value, float) and one.files:
                    end = time_reached(campaigns["cutoff"], one.files[0])
                    found[k] = Cell(f"ends at {end:.3f} s", one.files)
            rows.append([motion, f"{cells} cells, {what}", *found])
    columns = ["traction", "grid", *(f"cut-off {cutoff:g}" for cutoff in CUTOFFS)]
    title = "BSMPM: RMS displacement error [m] by the smallest mass kept, in particle masses"
    page.tabulate("cutoffs", title, columns, rows, numeric=range(2, 6))


def time_step_chapter(campaigns: Campaigns) -> Chapter:
    """Error of the time step, and stability limits found by bisection."""
    page = Chapter("time_step", "Beyond the paper: the time step")
    page.convergence(campaigns["time_step"], (ERROR,))
    table = stability_table(campaigns["stability"])
    page.add(table)
    page.notes += stability_sentences(table)
    return page


def stability_table(campaign: Campaign) -> Table:
    """Largest stable and smallest unstable step of each method against two theoretical limits."""
    rows = []
    for (label, mass), runs in brackets(campaign).items():
        survived, failed = runs[runs.status == "ok"], runs[runs.status != "ok"]
        high = failed.nsmallest(1, "cfl")
        below = survived.cfl < (high.cfl.iloc[0] if len(high) else np.inf)
        low = survived[below].nlargest(1, "cfl")
        if not len(survived):
            raise MissingRuns(f"stability: no run of {label} with {mass} mass has finished")
        step = float((survived.time_step / survived.cfl).median())
        limit = step * WAVE_SPEED * float(runs.resolution.iloc[0])
        files = (*map(str, low.index), *map(str, high.index))
        ends = [
            limit * (float(end.cfl.iloc[0]) if len(end) else float("nan")) for end in (low, high)
        ]
        middle = 0.5 * sum(ends)
        transfer = str(campaign.settings.loc[runs.index[0], "method.transfer"])
        theory = spectra.largest_step(DEGREES[str(runs.basis.iloc[0])], mass, transfer)
        discrete = Cell(limit, tuple(map(str, survived.index[:1])))
        found = [Cell(ends[0], files[:1]), Cell(ends[1], files[-1:])]
        against = [Cell(middle / limit, files), Cell(middle / theory, files)]
        rows.append([label, mass, discrete, theory, *found, *against])
    columns = ["method", "mass", "discrete system", "infinite grid", "stable", "unstable"]
    columns += ["found over discrete system", "found over infinite grid"]
    note = (
        "Steps times c/h. Discrete system: 2 over its highest frequency, boundaries included, as "
        "`time_step=auto` takes it. Infinite grid: von Neumann analysis of the whole step, with "
        "the projection of the velocity that lumping brings; the open ends of splines and few "
        "particles shift the limits."
    )
    title = "Stability limits by bisection, 16 cells"
    return Table("stability", title, columns, rows, note, range(2, 8))


def stability_sentences(table: Table) -> list[str]:
    """Ranges of the ratios, for each mass."""
    notes = []
    for mass in ("consistent", "lumped"):
        rows = [row for row in table.rows if row[1].value == mass]
        discrete, infinite = (
            [float(row[k].value) for row in rows if np.isfinite(row[k].value)] for k in (6, 7)
        )
        if discrete:
            notes.append(
                f"With {mass} mass the limits found are {min(discrete):.3f} to {max(discrete):.3f} "
                f"times those of the discrete system and {min(infinite):.3f} to "
                f"{max(infinite):.3f} times those on an infinite grid."
            )
    return notes


def brackets(campaign: Campaign) -> dict[tuple[str, str], pd.DataFrame]:
    """Runs of the bisection by method and mass, with their ``cfl``."""
    runs = campaign.runs.assign(cfl=pd.to_numeric(campaign.settings["cfl"]))
    labels = [series_name(name, basis) for name, basis in zip(runs.method, runs.basis, strict=True)]
    groups = runs.assign(label=labels).groupby(["label", "mass"], sort=True)
    return {(str(key[0]), str(key[1])): group for key, group in groups}
