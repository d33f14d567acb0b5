"""Section 5.1: Taylor's rod, Table 5.1 and Figs. 5.3 to 5.6; every method on it, and Johnson and Cook's copper."""

import dataclasses
from typing import Any

import matplotlib
import numpy as np

from mpmbench.papers.kit import Campaigns, Chapter, cell, variables
from mpmbench.papers.parts import quantities, thinned, with_digits
from mpmbench.report import solids, style
from mpmbench.report.evidence import MissingRuns
from mpmbench.report.figures import name_axes, panels, single
from mpmbench.report.tables import Cell
from mpmbench.report.timing import clock_in

CELLS = (2, 3, 4)  # along the radius
OTM = {"method": "otm", "basis": "lme"}
RODS: dict[str, dict[str, Any]] = {
    "OTM": OTM,
    "linear FEM": {"method": "linear_fem"},
    "total-Lagrangian MPM, B-splines": {"method": "tlmpm"},
    "MPM, B-splines": {"method": "ulmpm"},
    "MPM, linear, musl": {"method": "mpm", "basis": "linear"},
    "MPM, max-ent": {"method": "mpm", "basis": "lme"},
    "MPM on moving nodes, linear": {"method": "moving_mesh_mpm"},
    "unified, max-ent": {"method": "unified", "basis": "lme"},
}
# Table 5.1 of the thesis: length and radius [mm], plastic strain, von Mises stress [MPa].
PRINTED: dict[str, tuple[str, str, str, str]] = {
    "Kamoulakis": ("21.47-21.66", "7.02-7.12", "2.47-3.24", "472-476"),
    "Zhu and Cescotto": ("21.26-21.49", "6.89-7.18", "2.75-3.03", "419-477"),
    "Camacho and Ortiz": ("21.42-21.44", "7.21-7.24", "2.97-3.25", ""),
    "OTM of the thesis": ("21.43", "6.8", "3.0", "474"),
}
SHAPE = ("length", "radius_nodes", "radius_points", "plastic_strain_max", "von_mises_max")
BULK = 0.99  # of the volume: the rest are single particles at the foot
SCALES = (1e3, 1e3, 1e3, 1.0, 1e-6)
ENERGIES = ("kinetic_share", "contact_share", "transfer_share", "energy_imbalance")
INSTANTS = (20e-6, 40e-6, 80e-6)  # of Figs. 5.3 to 5.5 [s]
FIELDS: dict[str, tuple[str, str, float, tuple[float, float]]] = {
    "plastic_strain": ("Fig. 5.4", "effective plastic strain", 1.0, (0.0, 3.0)),
    "von_mises": ("Fig. 5.5", "von Mises stress [MPa]", 1e-6, (0.0, 600.0)),
}
# Johnson and Cook (1983), from memory: length, diameter at the foot and at a fifth of the length.
COPPER = (16.2, 13.5, 10.1)
COPPERS = {
    name: RODS[name] for name in ("OTM", "total-Lagrangian MPM, B-splines", "MPM, B-splines")
}


def scaled(found: Cell, factor: float) -> Cell:
    """A number in another unit; how a run ended stays."""
    value = found.value * factor if isinstance(found.value, float) else found.value
    return with_digits(4, dataclasses.replace(found, value=value))


def shape_of(campaigns: Campaigns, campaign: str = "taylor", **match: Any) -> list[Cell]:
    """Final length, radii [mm], plastic strain and von Mises stresses [MPa] of one run."""
    found = quantities(campaigns, campaign, SHAPE, **match)
    shape = [scaled(one, factor) for one, factor in zip(found, SCALES, strict=True)]
    return [*shape, bulk_stress(campaigns, campaign, **match)]


def bulk_stress(campaigns: Campaigns, campaign: str, **match: Any) -> Cell:
    """The von Mises stress [MPa] at the end that `BULK` of the volume does not pass."""
    largest = cell(campaigns, campaign, "von_mises_max", **match)
    if not isinstance(largest.value, float):
        return largest
    _, found = variables(campaigns, campaign, "von_mises", "volume", **match)
    value = bulk(found["von_mises"][-1], found["volume"][-1])
    return scaled(dataclasses.replace(largest, value=value), 1e-6)


def bulk(stress: np.ndarray, volume: np.ndarray) -> float:
    """The stress that `BULK` of the volume does not pass, of particles that have one."""
    solid = np.flatnonzero(np.isfinite(stress))
    order = solid[np.argsort(stress[solid])]
    share = np.cumsum(volume[order]) / volume[order].sum()
    return float(stress[order[np.searchsorted(share, BULK)]])


def finest(campaigns: Campaigns, match: dict[str, Any]) -> dict[str, Any]:
    """The match with the largest number of cells whose run has finished.

    Raises
    ------
    MissingRuns
        When none has.
    """
    for cells in reversed(CELLS):
        one = match | {"resolution": cells}
        if isinstance(cell(campaigns, "taylor", "length", **one).value, float):
            return one
    raise MissingRuns(f"taylor: no run with {match['method']} has finished")


def taylor_chapter(campaigns: Campaigns) -> Chapter:
    """Table 5.1 and the figures of OTM."""
    page = Chapter(
        "taylor",
        "Sect. 5.1: Taylor's rod, Table 5.1 and Figs. 5.3 to 5.6",
        "The rod has come to rest after 80 microseconds; its length, the radius of its foot, the "
        "largest plastic strain and von Mises stress agree with those of finite elements.",
    )
    best = finest(campaigns, OTM)
    columns = ["source", "length [mm]", "radius, nodes [mm]", "radius, outermost particle [mm]"]
    columns += ["plastic strain", "largest von Mises [MPa]", "99 % of the volume below [MPa]"]
    rows: list[list[Any]] = [
        [name, length, radius, "", strain, stress, ""]
        for name, (length, radius, strain, stress) in PRINTED.items()
    ]
    for cells in CELLS:
        row = shape_of(campaigns, **OTM, resolution=cells)
        rows.append([f"OTM here, {cells} cells along the radius", *row])
    note = (
        "Above: as printed; axisymmetric but for OTM. Below: three dimensions, a quarter of the rod, "
        "lumped mass, nodal velocities, gamma = 1.8, neighbours by the metric that goes with F. "
        "Largest values over the particles at 80 microseconds; von Mises stresses also as what 99 % of "
        "the volume does not pass: the flow stress at a strain of 3 is 700 MPa, and what a few "
        "particles at the foot have left of it when they unload decides the largest one."
    )
    page.tabulate("table5_1", "Table 5.1", columns, rows, numeric=range(1, 7), note=note)
    _pictures(page, campaigns, best)
    _heights(page, campaigns)
    page.notes.append(
        "The printed radius of 6.8 mm is smaller than that of all references. The outermost "
        "material point of OTM lies inside the rim, where the nodes are: the table has both."
    )
    return page


def _pictures(page: Chapter, campaigns: Campaigns, match: dict[str, Any]) -> None:
    """The rod cut open, and fields on its meridian, at the instants of the thesis."""
    wanted = ("snapshot_time", "position", "volume", *FIELDS)
    _, found = variables(campaigns, "taylor", *wanted, **match)
    shots = [int(np.argmin(np.abs(found["snapshot_time"] - t))) for t in INSTANTS]
    cells = match["resolution"]
    figure, axes = panels(1, 3, 3.2)
    for axis, shot in zip(axes[0], shots, strict=True):
        dots = cut_open(axis, found, shot, FIELDS["plastic_strain"])
        axis.set_title(rf"{1e6 * found['snapshot_time'][shot]:.0f} $\mu$s", pad=3)
    across = max(abs(end) for axis in axes[0] for end in axis.get_xlim())
    lowest, highest = (
        pick(axis.get_ylim()[end] for axis in axes[0]) for end, pick in ((0, min), (1, max))
    )
    for axis in axes[0]:  # on one scale
        axis.set(xlim=(-across, across), ylim=(lowest, highest))
    figure.colorbar(dots, ax=list(axes[0]), label="effective plastic strain", shrink=0.7)
    caption = (
        f"OTM, {cells} cells along the radius: every particle, the front quarter left out, the other "
        "quarters by symmetry."
    )
    page.draw("rod", "Fig. 5.3: the rod at 20, 40 and 80 microseconds", caption, figure)
    for field, (number, label, factor, limits) in FIELDS.items():
        figure, axes = panels(1, 3, 2.6, sharex=True, sharey=True)
        for axis, shot in zip(axes[0], shots, strict=True):
            x, values = 1e3 * found["position"][shot], factor * found[field][shot]
            dots = solids.draw_meridian(axis, x, values, limits)
            axis.set_title(rf"{1e6 * found['snapshot_time'][shot]:.0f} $\mu$s", pad=3)
        figure.colorbar(dots, ax=list(axes[0]), label=label, shrink=0.7)
        name_axes(figure, "distance from the axis [mm]", "height above the wall [mm]")
        caption = f"OTM, {cells} cells along the radius: all particles by radius and height, the largest on top."
        page.draw(field, f"{number}: {label.split(' [')[0]}", caption, figure)


def cut_open(
    axis: Any,
    found: dict[str, np.ndarray],
    shot: int,
    field: tuple[str, str, float, tuple[float, float]],
    name: str = "plastic_strain",
) -> Any:
    """Draw a quarter rod with two mirror images and one quarter left out towards the eye."""
    _, _, factor, limits = field
    size = np.cbrt(found["volume"][shot])
    whole = solids.mirrored(found["position"][shot], (1, 2), factor * found[name][shot], size)
    shown = ~((whole[0][:, 1] > 0.0) & (whole[0][:, 2] > 0.0))
    x, values, size = (part[shown] for part in whole)
    return solids.draw(axis, x, values, size, matplotlib.colormaps["viridis"], limits)


def _heights(page: Chapter, campaigns: Campaigns) -> None:
    """The length of the rod over time, by method."""
    figure, axes = single(height=2.8, width=1.5 * style.COLUMN)
    for rank, (name, match) in enumerate(RODS.items()):
        try:
            best = finest(campaigns, match)
        except MissingRuns:
            continue
        _, found = variables(campaigns, "taylor", "time", "length_history", **best)
        curve = thinned(1e6 * found["time"], 1e3 * found["length_history"])
        look: dict[str, Any] = {
            "color": style.colour(best["method"]),
            "ls": style.LINE_STYLES[rank % 4],
            "lw": 1.0,
        }
        axes.plot(*curve, label=f"{name}, {best['resolution']} cells", **look)
    axes.set(xlabel=r"time [$\mu$s]", ylabel="length of the rod [mm]")
    axes.legend(fontsize=6)
    page.draw(
        "height", "Fig. 5.6: height of the rod", "On its axis; the finest run of each.", figure
    )


def methods_chapter(campaigns: Campaigns) -> Chapter:
    """All methods on the same particles: shape, energy and cost."""
    page = Chapter("taylor_methods", "Beyond the thesis: every method on Taylor's rod")
    clock = clock_in(campaigns, "taylor")
    shapes: list[list[Any]] = []
    costs: list[list[Any]] = []
    for name, match in RODS.items():
        for cells in CELLS:
            one = match | {"resolution": cells}
            shapes.append([name, cells, *shape_of(campaigns, **one)])
            energies = quantities(campaigns, "taylor", ENERGIES, **one)
            effort = quantities(
                campaigns, "taylor", ("n_particles", "steps", clock.quantity), **one
            )
            costs.append([name, cells, *energies, *effort, _per_step(effort)])
    columns = ["method", "cells", "length [mm]", "radius, nodes [mm]"]
    columns += ["radius, outermost particle [mm]", "plastic strain", "largest von Mises [MPa]"]
    columns += ["99 % of the volume below [MPa]"]
    note = (
        "On a grid the radius at nodes is that of a massless point on the rim of the foot. Meshes of "
        "linear tetrahedra lock: their feet spread little and their plastic strains stay small, unless "
        "they have F-bar (below)."
    )
    page.tabulate(
        "shape",
        "The rod at 80 microseconds by method",
        columns,
        shapes,
        numeric=range(1, 8),
        note=note,
    )
    columns = ["method", "cells", "kinetic left", "taken by the wall", "lost in transfers"]
    columns += [
        "not explained",
        "particles",
        "steps",
        "time [s]",
        "time per particle and step [us]",
    ]
    note = f"Energies over the kinetic one at the impact. {clock.note}"
    title = clock.title("Energy and cost by method")
    page.tabulate("cost", title, columns, costs, numeric=range(1, 10), note=note)
    _curves(page, campaigns)
    page.notes.append(
        "SPH and moving B-splines do not apply: SPH needs its particles at the nodes, where all others "
        "have them in tetrahedra, and knots on moving nodes keep lines along the axes straight. A run "
        "that broke down shows how it ended in its cells. `python -m mpmbench animate FILE.nc "
        "plastic_strain` makes a moving picture of a run with snapshots."
    )
    return page


def _per_step(effort: list[Cell]) -> Cell:
    """Time per particle and step [us]."""
    particles, steps, time = (one.value for one in effort)
    if not all(isinstance(value, float) for value in (particles, steps, time)):
        return Cell()
    return Cell(1e6 * time / (particles * steps), effort[2].files)


def _curves(page: Chapter, campaigns: Campaigns) -> None:
    """Length and radius over the number of cells."""
    figure, axes = panels(1, 2, 3.1)
    drawn = False
    for axis, column in zip(axes[0], (0, 1), strict=True):
        for rank, (name, match) in enumerate(RODS.items()):
            found = [shape_of(campaigns, **match, resolution=cells)[column] for cells in CELLS]
            known = [
                (cells, one.value)
                for cells, one in zip(CELLS, found, strict=True)
                if isinstance(one.value, float)
            ]
            if known:
                drawn = True
                look = style.line(match["method"], match.get("basis", "linear"), rank)
                axis.plot(*zip(*known, strict=True), label=name, **look)
        axis.set_xticks(CELLS)
        axis.set_xlabel("cells along the radius")
    if not drawn:
        raise MissingRuns("taylor: no run has finished")
    axes[0, 0].axhspan(21.26, 21.66, color="#dddddd", zorder=0)
    axes[0, 1].axhspan(6.89, 7.24, color="#dddddd", zorder=0)
    axes[0, 0].set_ylabel("length [mm]")
    axes[0, 1].set_ylabel("radius at nodes [mm]")
    handles = axes[0, 0].get_legend_handles_labels()
    figure.legend(*handles, fontsize=6, loc="outside lower center", ncols=3)
    page.draw(
        "levels",
        "Length and radius by number of cells",
        "Grey: the references of Table 5.1.",
        figure,
    )


def copper_chapter(campaigns: Campaigns) -> Chapter:
    """The published final shape of Johnson and Cook's copper, beside ours."""
    page = Chapter(
        "johnson_cook",
        "Beyond the thesis: the copper rod of Johnson and Cook",
        "Johnson and Cook (1983), oxygen-free copper, 25.4 x 7.62 mm, 190 m/s.",
    )
    rows: list[list[Any]] = [["published, from memory", "", *COPPER, "", ""]]
    wanted = ("length", "radius_nodes", "radius_fifth", "plastic_strain_max", "kinetic_share")
    for name, match in COPPERS.items():
        for cells in CELLS[:2]:
            found = quantities(campaigns, "johnson_cook", wanted, **match, resolution=cells)
            scale = (1e3, 2e3, 2e3, 1.0, 1.0)
            row = [scaled(one, factor) for one, factor in zip(found, scale, strict=True)]
            rows.append([name, cells, *row])
    if not any(isinstance(one, Cell) and one.files for row in rows for one in row):
        raise MissingRuns("johnson_cook: there are no runs")
    columns = ["source", "cells along the radius", "length [mm]", "diameter of the foot [mm]"]
    columns += ["diameter at a fifth of the length [mm]", "plastic strain", "kinetic energy left"]
    note = (
        "The published numbers are reported, not asserted: no text with them was at hand. At 80 "
        "microseconds; a smooth wall."
    )
    page.tabulate("shape", "Final shape", columns, rows, numeric=range(1, 7), note=note)
    return page
