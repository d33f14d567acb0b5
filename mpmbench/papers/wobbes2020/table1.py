"""Table 1: computational times, normalised by those of linear MPM."""

from typing import Any

import numpy as np

from mpmbench.papers.kit import Campaigns, Chapter, subset
from mpmbench.papers.wobbes2020.support import METHODS, TIME, method, searched
from mpmbench.report import style
from mpmbench.report.figures import log_ticks, single
from mpmbench.report.tables import Cell, median
from mpmbench.report.timing import Clock, clock_of
from mpmbench.results.netcdf import read_attributes
from mpmbench.results.records import Campaign
from mpmbench.results.timings import timings

CELLS = {31: "32 nodes", 511: "512 nodes"}
PAPER = {
    31: {"OTM-P1": 1.48, "MPM-maxent": 0.98, "OTM-maxent": 1.55, "BSMPM": 1.32, "unified": 1.78},
    511: {"OTM-P1": 1.19, "MPM-maxent": 2.31, "OTM-maxent": 2.50, "BSMPM": 1.04, "unified": 1.12},
}


def ratios(
    campaign: Campaign, name: str, cells: int, search: str = "local"
) -> tuple[np.ndarray, tuple[str, ...]]:
    """Solver time of a method over that of linear MPM, one value for each repeat, and the files.

    On a machine under load these are CPU times.

    The methods take turns with their repeats, so the two times of a quotient were measured soon
    after each other.
    """
    clock = clock_of(campaign.runs)
    file, times = _times(campaign, clock, name, cells, search)
    base, base_times = _times(campaign, clock, "MPM-P1", cells)
    repeats = min(len(times), len(base_times))
    return times[:repeats] / base_times[:repeats], (file, base)


def _times(
    campaign: Campaign, clock: Clock, name: str, cells: int, search: str = "local"
) -> tuple[str, np.ndarray]:
    """File and times in the solver of all repeats of one run [s].

    Raises
    ------
    MissingRuns
        When there is no such run, or it shared the machine with others.
    """
    match = method(name, resolution=cells, status="ok", timing_context="exclusive")
    found = subset(campaign, **match, **searched(name, search)).runs
    file = str(found.index[0])
    repeats = timings(read_attributes(campaign.folder / file))
    times = repeats.wall if clock.quantity == TIME else repeats.cpu
    return file, times if len(times) else found[clock.quantity].to_numpy()[:1]


def table1_chapter(campaigns: Campaigns) -> Chapter:
    """The paper's table beside ours."""
    campaign = campaigns["table1"]
    page = Chapter(
        "table1",
        "Table 1: computational times",
        "The paper: on the coarse grid the methods based on MPM are faster than those based on "
        "OTM; on the fine one the functions decide, and B-splines need less than half the time of "
        "max-ent functions. The max-ent computations were made without a search algorithm.",
    )
    _ratios(page, campaign)
    _seconds(page, campaign)
    return page


def variants() -> list[tuple[str, str, str]]:
    """Label, method and search of everything that was timed."""
    return [
        (name + (", search among all nodes" if search == "all" else ""), name, search)
        for name in METHODS
        for search in (("local", "all") if METHODS[name]["basis"] == "maxent" else ("local",))
    ]


def _ratios(page: Chapter, campaign: Campaign) -> None:
    """Times over those of linear MPM, as a table and as a figure, with the paper's."""
    rows = []
    figure, axes = single(height=2.5, width=1.5 * style.COLUMN)
    order = list(PAPER[31])
    for label, name, search in variants():
        if name not in order:
            continue
        everywhere = search == "all" or METHODS[name]["basis"] != "maxent"
        colour = style.colour(METHODS[name]["method"])
        face = "white" if search == "all" else colour
        look: dict[str, Any] = {"color": colour, "markerfacecolor": face, "capsize": 2, "lw": 1}
        row: list[Any] = [label]
        for panel, cells in enumerate(CELLS):
            paper = PAPER[cells][name] if everywhere else float("nan")
            found, files = ratios(campaign, name, cells, search)
            middle, low, high = float(np.median(found)), float(found.min()), float(found.max())
            row += [paper, Cell(middle, files), Cell(f"{low:.2f} to {high:.2f}", files)]
            y = order.index(name) + (0.2 if panel else -0.2) + (0.12 if search == "all" else 0.0)
            spread = [[middle - low], [high - middle]]
            axes.errorbar(middle, y, xerr=spread, marker="os"[panel], **look)
            if np.isfinite(paper):
                axes.plot(paper, y, marker="x", color="black", ms=4)
        rows.append(row)
    axes.set_xscale("log")
    axes.set_yticks(range(len(order)), order)
    axes.invert_yaxis()
    log_ticks(axes.xaxis, span=100.0)
    axes.set_xlabel("solver time over that of MPM-P1")
    caption = (
        "Circles: 32 nodes, squares: 512 nodes; filled: search among near nodes, white: among all "
        "nodes; bars: smallest and largest repeat; crosses: the paper."
    )
    page.draw("ratios", "Times over those of linear MPM", caption, figure)
    clock = clock_of(campaign.runs)
    columns = ["method"]
    for nodes in CELLS.values():
        columns += [f"{nodes}: paper", "here", "range"]
    note = (
        "Medians over repeats that take turns, and the smallest and largest quotient; compiling is "
        f"not counted. Absolute times of MPM-P1 are in the next table. {clock.note}"
    )
    title = clock.title("Solver time over that of MPM-P1")
    page.tabulate("ratios", title, columns, rows, numeric=range(1, 7), note=note)


def _seconds(page: Chapter, campaign: Campaign) -> None:
    """Medians in seconds, per step and particle."""
    rows = []
    clock = clock_of(campaign.runs)
    for label, name, search in variants():
        row: list[Any] = [label]
        for cells in CELLS:
            match = method(name, resolution=cells, status="ok", **searched(name, search))
            runs = subset(campaign, **match).runs
            time = median(runs, clock.quantity)
            work = float((runs.steps * runs.n_particles).median())
            row += [time, Cell(1e9 * time.value / work, time.files)]
        rows.append(row)
    columns = ["method"]
    for nodes in CELLS.values():
        columns += [f"{nodes} [s]", "per particle and step [ns]"]
    title = clock.title("Solver time")
    page.tabulate("seconds", title, columns, rows, numeric=(1, 2, 3, 4), note=clock.note)
