"""Section 5.1: Taylor's rod with one change of volume for all particles around a node, beside one at each."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from mpmbench.papers.kit import Campaigns, Chapter, variables
from mpmbench.papers.li2009.taylor import CELLS, OTM, shape_of
from mpmbench.papers.parts import of_file, quantities, with_digits
from mpmbench.report import style
from mpmbench.report.evidence import MissingRuns
from mpmbench.report.figures import panels
from mpmbench.report.tables import Cell

CAMPAIGN = "rod_locking"
RODS: dict[str, dict[str, Any]] = {
    "OTM": OTM,
    "linear FEM": {"method": "linear_fem"},
    "MPM on moving nodes, linear": {"method": "moving_mesh_mpm"},
}
SHARED = {"at each particle": "taylor", "one around each node (F-bar)": CAMPAIGN}
# From the smallest to the largest of the references in Table 5.1: columns of `shape_of`, and their ranges.
REFERENCES: dict[str, tuple[int, float, float]] = {
    "length [mm]": (0, 21.26, 21.66),
    "radius at nodes [mm]": (1, 6.89, 7.24),
    "plastic strain": (3, 2.47, 3.25),
    "largest von Mises [MPa]": (4, 419.0, 477.0),
}


def locking_chapter(campaigns: Campaigns) -> Chapter:
    """Shape, stresses and pressures with F-bar and without, and what lies within the references."""
    page = Chapter("rod_locking", "Beyond the thesis: what of the rod is volumetric locking")
    campaigns[CAMPAIGN]  # raises when nothing was run
    rows: list[list[Any]] = []
    judged: list[str] = []
    shapes: dict[tuple[str, str], list[list[Cell]]] = {}
    for name, match in RODS.items():
        for volume, campaign in SHARED.items():
            for cells in CELLS:
                one = match | {"resolution": cells}
                shape = shape_of(campaigns, campaign, **one)
                shapes.setdefault((name, volume), []).append(shape)
                (missing,) = quantities(campaigns, campaign, ("energy_imbalance",), **one)
                pressures = pressures_of(campaigns, campaign, shape[-1], one)
                rows.append([name, volume, cells, *shape, *pressures, missing])
            judged += within(f"{name}, {volume}, {cells} cells", shape)
    columns = ["method", "change of volume", "cells", "length [mm]", "radius, nodes [mm]"]
    columns += ["radius, outermost particle [mm]", "plastic strain", "largest von Mises [MPa]"]
    columns += ["99 % of the volume below [MPa]", "lowest pressure [MPa]", "highest pressure [MPa]"]
    note = (
        "Inside the rod there are six particles to a node, so more conditions on volume than nodes have "
        "motions. With F-bar there is one for each node: the particles that had it nearest at the start "
        "share a change of volume and a pressure. Nothing else differs, but for the steps in time, which "
        "follow the shortest cell."
    )
    page.tabulate(
        "shape",
        "The rod at 80 microseconds with F-bar and without",
        [*columns, "energy not explained"],
        rows,
        numeric=range(2, 12),
        note=note,
    )
    _curves(page, shapes)
    page.notes += judged
    return page


def pressures_of(
    campaigns: Campaigns, campaign: str, last: Cell, match: dict[str, Any]
) -> list[Cell]:
    """Lowest and highest pressure at the end [MPa]; nothing, where a run has no last stress."""
    if not isinstance(last.value, float):
        return [Cell(), Cell()]
    file, found = variables(campaigns, campaign, "pressure", **match)
    pressure = 1e-6 * found["pressure"][-1]
    return [with_digits(3, one) for one in of_file(file, np.nanmin(pressure), np.nanmax(pressure))]


def within(name: str, shape: list[Cell]) -> Iterator[str]:
    """Which values lie within the references of Table 5.1, and which do not."""
    values = {key: shape[column].value for key, (column, _, _) in REFERENCES.items()}
    if not all(isinstance(value, float) for value in values.values()):
        return
    inside = {key: low <= values[key] <= high for key, (_, low, high) in REFERENCES.items()}
    told = [
        ", ".join(f"{key} {values[key]:.4g}" for key in values if inside[key] is wanted) or "none"
        for wanted in (True, False)
    ]
    yield f"{name}: within the references of Table 5.1 are {told[0]}; outside are {told[1]}."


def _curves(page: Chapter, shapes: dict[tuple[str, str], list[list[Cell]]]) -> None:
    """Radius of the foot and plastic strain over the number of cells."""
    figure, axes = panels(1, 2, 3.1)
    drawn = False
    for axis, key in zip(axes[0], ("radius at nodes [mm]", "plastic strain"), strict=True):
        column, low, high = REFERENCES[key]
        axis.axhspan(low, high, color="#dddddd", zorder=0)
        for (name, volume), found in shapes.items():
            values = dict(zip(CELLS, (shape[column].value for shape in found), strict=True))
            known = {n: value for n, value in values.items() if isinstance(value, float)}
            if known:
                drawn, rank = True, [*RODS].index(name)
                look = style.line(RODS[name]["method"], RODS[name].get("basis", "linear"), rank)
                look["linestyle"] = "-" if SHARED[volume] == CAMPAIGN else ":"
                look["marker"] = "Do^"[rank]  # one colour stands for two methods
                axis.plot([*known], [*known.values()], label=f"{name}, {volume}", **look)
        axis.set(xlabel="cells along the radius", ylabel=key)
        axis.set_xticks(CELLS)
    if not drawn:
        raise MissingRuns(f"{CAMPAIGN}: no run has finished")
    handles = axes[0, 0].get_legend_handles_labels()
    figure.legend(*handles, fontsize=6, loc="outside lower center", ncols=2)
    caption = "Full lines: F-bar. Grey: the references of Table 5.1."
    page.draw("levels", "Radius and plastic strain with F-bar and without", caption, figure)
