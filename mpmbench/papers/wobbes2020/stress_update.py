"""What the order of the stress update does to the break-down, which the paper names as its cure."""

from itertools import product
from typing import Any

import numpy as np

from mpmbench.papers.kit import Campaigns, Chapter, cell, variables
from mpmbench.papers.wobbes2020.support import ERROR
from mpmbench.papers.wobbes2020.survival import NODES, SIGNS, time_reached
from mpmbench.report.tables import Cell, number_text

MASSES = ("lumped", "consistent")
UPDATES = {"usl": "last (USL)", "musl": "modified last (MUSL)", "usf": "first (USF)"}
CELLS = (79, 80)  # both count as 81 nodes
FAR = 10.0  # work of the load over that of the run where it is least: the loaded end has run away
Place = tuple[int, float]


def stress_update_chapter(campaigns: Campaigns) -> Chapter:
    """Which orders of the stress update survive, with either mass."""
    page = Chapter(
        "musl",
        "Sect. 8.2: the order of the stress update, with either mass",
        "The breakdown requires the use of the MUSL algorithm with a lumped mass matrix.",
    )
    campaigns["musl"]  # raises MissingRuns
    places = list(product(CELLS, SIGNS))
    rows: list[list[Any]] = []
    works: list[Cell] = []
    for mass, (update, name) in product(MASSES, UPDATES.items()):
        match = {"mass": mass, "method__stress_update": update}
        ends = [_end(campaigns, place, match) for place in places]
        survivors = [
            place for place, end in zip(places, ends, strict=True) if isinstance(end.value, float)
        ]
        done = [_work(campaigns, place, match) for place in survivors]
        works += done
        largest = max(done, key=lambda work: float(work.value), default=Cell())
        rows.append([mass, name, f"{len(survivors)} of {len(ends)}", *ends, largest])
    columns = ["mass", "stress update", "survive"]
    columns += [f"{cells} cells, {NODES[cells]}, {SIGNS[sign]}" for cells, sign in places]
    columns.append("largest work of the load [J]")
    title = "BSMPM without a cut-off: RMS displacement error [m] at t = 0.4 s, or the end"
    page.tabulate("ends", title, columns, rows, numeric=range(3, 8))
    page.notes += _runaways(works)
    return page


def _end(campaigns: Campaigns, place: Place, match: dict[str, Any]) -> Cell:
    """Error of a run that survived, else when it ended."""
    found = cell(campaigns, "musl", ERROR, **_of(place), **match)
    if isinstance(found.value, float) or not found.files:
        return found
    end = time_reached(campaigns["musl"], found.files[0])
    return Cell(f"ends at {end:.3f} s", found.files)


def _work(campaigns: Campaigns, place: Place, match: dict[str, Any]) -> Cell:
    """Largest work of the load [J], which acts on nodes."""
    file, found = variables(campaigns, "musl", "external_work", **_of(place), **match)
    return Cell(float(np.abs(found["external_work"]).max()), (file,))


def _of(place: Place) -> dict[str, float]:
    cells, sign = place
    return {"problem__domain_cells": cells, "problem__traction_amplitude": sign}


def _runaways(works: list[Cell]) -> list[str]:
    """A sentence on runs that survive with a node that has run away, where there are any."""
    least = min((float(work.value) for work in works), default=np.nan)
    far = [float(work.value) for work in works if float(work.value) > FAR * least]
    if not far:
        return []
    return [
        f"{len(far)} of the {len(works)} runs that survive do so without the end of the bar: the load, "
        f"which acts on that massless point, does up to {number_text(max(far))} J of work there and "
        f"{number_text(least)} J elsewhere, since a node with next to no mass carries the point away; "
        "the particles, which hardly see that node, stay where they belong."
    ]
