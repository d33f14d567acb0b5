"""Which runs survive: near-empty cells in Sect. 8.2, and the stability limit of the time step."""

import numpy as np
import pandas as pd
from matplotlib.colors import BoundaryNorm

from mpmbench.report.papers.parts import Campaigns, Chapter, MissingRuns, cell
from mpmbench.report.papers.wobbes2020.support import ERROR, METHODS, method, single
from mpmbench.report.records import Campaign
from mpmbench.report.series import series_name
from mpmbench.report.tables import Cell, Table

NODES = {79: "81 functions", 80: "81 knots", 83: "85 functions", 84: "85 knots", 85: "85 cells"}
SIGNS = {-1.0: "compressed first", 1.0: "stretched first"}
LAYOUTS = {"midpoint": "uniform over the bar", "aligned": "in the grid's cells"}
CUTOFFS = (0.0, 1e-8, 1e-6, 1e-4)
WAVE_SPEED = float(np.sqrt(4000.0))  # of the bar with fixed ends [m/s]


def breakdown_chapter(campaigns: Campaigns) -> Chapter:
    """The map of survival."""
    page = Chapter(
        "breakdown",
        "Sect. 8.2: break-down with consistent mass",
        "When a material point enters an empty element, BSMPM inherits stability issues from MPM: changing the total "
        "number of nodes to 81 results in a termination after 0.3 s. The unified method stays stable.",
    )
    rows, times = [], []
    for name in ("BSMPM", "MPM-maxent", "unified"):
        for sign, motion in SIGNS.items():
            for layout, place in LAYOUTS.items():
                line = [_end(campaigns, name, sign, layout, cells) for cells in NODES]
                rows.append([Cell(name), Cell(motion), Cell(place), *line])
                times.append([value.value if isinstance(value.value, float) else np.nan for value in line])
    figure, axes = single(height=3.4, width=6.4)
    levels = BoundaryNorm([0.2, 0.25, 0.3, 0.35, 0.4], 256)
    shades = np.array(times)
    drawn = axes.imshow(np.ma.masked_invalid(shades), cmap="Reds_r", norm=levels, aspect="auto")
    for y, x in np.ndindex(shades.shape):
        text = f"{shades[y, x]:.3f} s" if np.isfinite(shades[y, x]) else "survives"
        axes.text(x, y, text, ha="center", va="center", size=6.5, color="white" if shades[y, x] < 0.25 else "black")
    axes.set_xticks(range(len(NODES)), [f"{cells} cells\n({what})" for cells, what in NODES.items()])
    axes.set_yticks(range(len(rows)), [f"{r[0].text}, {r[1].text}, {r[2].text}" for r in rows], size=6.5)
    axes.grid(False)
    axes.tick_params(length=0)
    figure.colorbar(drawn, ax=axes, label="time of break-down [s]", pad=0.01)
    caption = "Time at which a run ends; all of them should reach 0.4 s. Cells are those of the grid on 1.25 m."
    page.draw("map", "Map of survival", caption, figure, campaigns["breakdown"].runs.index)
    columns = ["method", "traction", "particles", *(f"{cells} cells, {what}" for cells, what in NODES.items())]
    title = "Time of break-down [s]; empty: survives until 0.4 s"
    page.add(Table("times", title, columns, rows, numeric=tuple(range(3, 8))))
    page.add(_cutoffs(campaigns))
    page.notes.append(
        "The last active function is seen by one particle near the edge of its support, and its mass goes with the "
        "fourth power of the distance. Leaving out degrees of freedom with too little mass cures this; how little is a "
        "matter of accuracy (second table). The unified method has no empty cells."
    )
    return page


def _end(campaigns: Campaigns, name: str, sign: float, layout: str, cells: int) -> Cell:
    """Time at which a run broke down; empty when it survived, its files attached in both cases."""
    match = {"problem__traction_amplitude": sign, "problem__particle_layout": layout, "problem__domain_cells": cells}
    ended = cell(campaigns, "breakdown", ERROR, **METHODS[name], **match)
    if not ended.files:
        raise MissingRuns(f"breakdown: no run of {name} on {cells} cells")
    if isinstance(ended.value, float):
        return Cell("", ended.files)
    return Cell(_time_reached(campaigns["breakdown"], ended.files[0]), ended.files)


def _time_reached(campaign: Campaign, file: str) -> float:
    return float(campaign.runs.loc[[file], "time_reached"].to_numpy()[0])


def _cutoffs(campaigns: Campaigns) -> Table:
    """Displacement error of BSMPM by cut-off, or the time of break-down."""
    rows = []
    for sign, motion in SIGNS.items():
        for cells, what in NODES.items():
            row = [Cell(motion), Cell(f"{cells} cells, {what}")]
            for cutoff in CUTOFFS:
                match = {"problem__traction_amplitude": sign, "problem__domain_cells": cells}
                found = cell(campaigns, "cutoff", ERROR, method__mass_cutoff=cutoff, **match)
                if not isinstance(found.value, float) and found.files:
                    found = Cell(f"ends at {_time_reached(campaigns['cutoff'], found.files[0]):.3f} s", found.files)
                row.append(found)
            rows.append(row)
    columns = ["traction", "grid", *(f"cut-off {cutoff:g}" for cutoff in CUTOFFS)]
    title = "BSMPM: RMS displacement error [m] by the smallest mass kept, in particle masses"
    return Table("cutoffs", title, columns, rows, numeric=tuple(range(2, 6)))


def time_step_chapter(campaigns: Campaigns) -> Chapter:
    """Error of the time step, and stability limits found by bisection."""
    page = Chapter("time_step", "Beyond the paper: the time step")
    page.convergence(campaigns["time_step"], (ERROR,))
    page.add(stability_table(campaigns["stability"]))
    page.notes.append(
        "Fine steps leave the error of the mesh, coarse ones that of the time step, which is predicted exactly; runs "
        "beyond the stability limit fail (crosses). The limits in the last table were found by halving an interval "
        "between a run that survives 0.5 s and one that does not. They agree with two over the highest frequency of "
        "the discrete system: with consistent mass it is smaller by a factor of about the square root of 3."
    )
    return page


def stability_table(campaign: Campaign) -> Table:
    """Largest stable and smallest unstable step of each method against the limit of the discrete system."""
    rows = []
    for label, runs in brackets(campaign).items():
        survived, failed = runs[runs.status == "ok"], runs[runs.status != "ok"]
        high = failed.nsmallest(1, "cfl")
        low = survived[survived.cfl < (high.cfl.iloc[0] if len(high) else np.inf)].nlargest(1, "cfl")
        limit = float((survived.time_step / survived.cfl).median()) if len(survived) else float("nan")
        files = (*map(str, low.index), *map(str, high.index))
        cells = float(runs.resolution.iloc[0])
        name = [Cell(part) for part in label]
        theory = Cell(limit, tuple(map(str, survived.index[:1])))
        found = [_value(low), _value(high)]
        middle = 0.5 * (found[0] + found[1]) if np.isfinite(found).all() else float("nan")
        ends = [Cell(found[0], files[:1]), Cell(found[1], files[-1:])]
        rows.append([*name, theory, Cell(limit * WAVE_SPEED * cells, theory.files), *ends, Cell(middle, files)])
    columns = ["method", "mass", "limit of the discrete system [s]", "times c/h", "stable at [of it]", "unstable at"]
    note = (
        "The power iteration behind the second column approaches the limit from above, so that the last column may "
        "stay a little below 1. Where nothing is unstable the transfer damps what the scheme would amplify."
    )
    title = "Stability limits by bisection, 16 cells"
    return Table("stability", title, [*columns, "found over theory"], rows, note, tuple(range(2, 7)))


def brackets(campaign: Campaign) -> dict[tuple[str, str], pd.DataFrame]:
    """Runs of the bisection by method and mass, with their ``cfl``."""
    runs = campaign.runs.assign(cfl=pd.to_numeric(campaign.settings["cfl"]))
    labels = [series_name(name, basis) for name, basis in zip(runs.method, runs.basis, strict=True)]
    groups = runs.assign(label=labels).groupby(["label", "mass"], sort=True)
    return {(str(key[0]), str(key[1])): group for key, group in groups}


def _value(runs: pd.DataFrame) -> float:
    return float(runs.cfl.iloc[0]) if len(runs) else float("nan")


def plate_is_unstable(campaigns: Campaigns, name: str) -> bool:
    """Whether a method fails on 65 x 65 nodes with the paper's time step."""
    found = cell(campaigns, "time_step_plate", ERROR, **method(name))
    if not found.files:
        raise MissingRuns(f"time_step_plate: no run of {name}")
    return not isinstance(found.value, float)
