"""Section 5.2.3: a steel sphere on an aluminium plate, Figs. 5.14 to 5.23, cells and rules, and what is left open."""

from itertools import product
from typing import Any

import matplotlib
import numpy as np

from mpmbench.papers.kit import Campaigns, Chapter, cell, variables
from mpmbench.papers.parts import finished, numbers, quantities
from mpmbench.report import solids, style
from mpmbench.report.evidence import MissingRuns
from mpmbench.report.figures import name_axes, panels, single
from mpmbench.report.tables import Cell

Match = dict[str, Any]
SPEEDS = (500.0, 750.0, 1000.0, 1250.0, 1500.0, 2000.0, 2500.0, 3000.0)  # [m/s]
AT_REST, EVOLVING = (500.0, 750.0, 1000.0, 1250.0), (1500.0, 2000.0, 2500.0)  # of the figures
KEPT = "OTM, nodal velocities, masses kept"  # what claims on OTM are judged by
METHODS: dict[str, Match] = {
    KEPT: {"method": "otm", "basis": "lme", "mass": "kept"},
    "OTM, velocities of particles": {
        "method": "otm",
        "basis": "lme",
        "mass": "lumped",
        "method__transfer": "flip",
    },
    "MPM, linear, musl": {"method": "mpm", "basis": "linear"},
}
CAMPAIGN = dict(zip(METHODS, ("sphere_kept", "sphere_flip", "sphere_velocity"), strict=True))
CRATERS = (KEPT, "MPM, linear, musl")
# As the thesis has them, at SLOW velocities: they make energy, or take it.
MAPPED: dict[str, Match] = {
    "OTM, nodal velocities (Eq. 3.92), masses of each step": {"mass": "lumped"},
    "OTM, momentum of particles (Eq. 3.89), consistent mass": {"mass": "consistent"},
}
SLOW = (500.0, 1000.0, 1500.0)
# Depth over diameter by estimates from cavity expansion and craters, not data.
BANDS = {500.0: (0.35, 0.65), 1000.0: (0.8, 1.6), 2000.0: (1.2, 2.6)}
HYDRODYNAMIC = (
    7850.0 / 2700.0
) ** 0.5  # depth over length of a rod that flows: root of the densities
RULES = ("shared", "multi_field", "penalty")
WAYS: dict[str, Match] = {
    "particles": {"method__transfer": "flip"},
    "nodes that keep their masses": {"method__transfer": "nodal", "mass": "kept"},
    "nodes": {"method__transfer": "nodal", "mass": "lumped"},
}
RADIUS, GRID = 0.85e-3, 25.0 / 17.0  # of the sphere [m]; cell of a grid over the distance of nodes
READ = (
    "depth_over_diameter",
    "time_to_dissipation",
    "sphere_energy_left",
    "energy_imbalance",
    "energy_drift",
    "depth_over_diameter_of_centre",
)
BASE: Match = {
    "material__rate_exponent": 10.0,
    "material__reference_rate": 1000.0,
    "material__equation_of_state": "logarithmic",
    "problem__support": "rollers",
}
OPEN: dict[str, Match] = {
    "as assumed: m = 10, 1000 /s, logarithmic, rollers": {},
    "m = 5": {"material__rate_exponent": 5.0},
    "m = 20": {"material__rate_exponent": 20.0},
    "no rate effect": {"material__rate_exponent": None},
    "reference rate 1 /s": {"material__reference_rate": 1.0},
    "reference rate 1e5 /s": {"material__reference_rate": 1e5},
    "equation of Mie and Grueneisen": {"material__equation_of_state": "mie_grueneisen"},
    "lower face clamped": {"problem__support": "clamped"},
    "plate free": {"problem__support": "free"},
}


def impact_chapter(campaigns: Campaigns) -> Chapter:
    """Depth and time by velocity, and pictures of the craters."""
    page = Chapter(
        "sphere_impact",
        "Sect. 5.2.3: a sphere on a plate, Figs. 5.15 to 5.23",
        "When we increase the impact velocity, it may be observed the penetration depth "
        "asymptotically approaches that predicted by the hydrodynamic theory.",
    )
    _model(page, campaigns)
    _curves(page, campaigns)
    for name in CRATERS:
        _craters(page, campaigns, name, METHODS[name])
    rows = []
    for campaign, name, match, speeds in curves():
        for speed in speeds:
            row = quantities(campaigns, campaign, READ, **match, problem__speed=speed)
            if not any(one.files for one in row):  # empty is a run that keeps too much energy
                row = [Cell("not run") for _ in row]
            rows.append([name, speed, *row])
    columns = ["method", "velocity [m/s]", "depth over diameter", "time to dissipation [s]"]
    columns += ["energy of the sphere left", "energy not explained", "change of the energy"]
    columns += ["depth by the energy of the centre"]
    note = (
        "Depth of the plate's point under the sphere when the sphere has 1 % of its energy left; "
        f"empty where it keeps more until the end. Estimates from cavity expansion and craters: {bands()}. "
        "What changes is the energy of the nodes where velocities stay on them, else of the particles, over the "
        "one at the start, all losses in plastic strain counted. Nodes whose masses are lumped anew keep "
        "velocities that belong to others: the kinetic energy of nodes is that of the particles and the "
        "spread of nodal velocities within each support, which grows where one takes in nodes of the other body. "
        "Depths of runs that make energy are not comparable; their figures stand for the error."
    )
    title = "Depth and time by velocity"
    page.tabulate("depths", title, columns, rows, numeric=range(1, 8), note=note)
    return page


def bands() -> str:
    """The estimates in words."""
    return ", ".join(
        f"{low:g} to {high:g} at {speed:g} m/s" for speed, (low, high) in BANDS.items()
    )


def curves() -> list[tuple[str, str, Match, tuple[float, ...]]]:
    """Campaign, name, match and velocities of each curve over the velocity."""
    mapped = [("sphere_transfer", name, match, SLOW) for name, match in MAPPED.items()]
    return [
        *((CAMPAIGN[name], name, match, SPEEDS) for name, match in METHODS.items()),
        *mapped,
    ]


def _model(page: Chapter, campaigns: Campaigns) -> None:
    """Fig. 5.14: the particles of OTM at the start, cut open along the planes of symmetry."""
    wanted = ("position", "volume", "body")
    match = METHODS[KEPT]
    for speed in SPEEDS:
        try:
            _, found = variables(campaigns, CAMPAIGN[KEPT], *wanted, **match, problem__speed=speed)
        except MissingRuns:
            continue
        x, size = 1e3 * found["position"][0], 1e3 * np.cbrt(found["volume"][0])
        figure, axis = single(height=2.4, width=1.5 * style.COLUMN)
        colours = matplotlib.colormaps["viridis"]
        solids.draw(axis, x, found["body"], size, colours, (0.5, 2.0), azimuth=225.0)
        caption = f"A quarter of plate and sphere, seen from the axis: {len(x)} particles."
        page.draw("model", "Fig. 5.14: the particles at the start", caption, figure)
        return


def _curves(page: Chapter, campaigns: Campaigns) -> None:
    """Figs. 5.22 and 5.23."""
    figure, axes = panels(1, 2, 3.2, sharex=True)
    drawn = False
    for rank, (campaign, name, match, speeds) in enumerate(curves()):
        look = style.line(match.get("method", "otm"), match.get("basis", "lme"), rank)
        along = {
            quantity: [
                cell(campaigns, campaign, quantity, **match, problem__speed=speed)
                for speed in speeds
            ]
            for quantity in ("energy_drift", "depth_over_diameter_of_centre", "time_to_dissipation")
        }
        drift = np.nanmax(numbers(along.pop("energy_drift")), initial=0.0)
        label = f"{name} (energy changes by up to {drift:.0%})"
        for axis, found, factor in zip(axes[0], along.values(), (1.0, 1e6), strict=True):
            try:
                x, y = finished(speeds, found, f"{campaign}: no run has finished")
            except MissingRuns:
                continue
            drawn = True
            axis.plot(1e-3 * np.array(x), factor * np.array(y), label=label, **look)
    if not drawn:
        raise MissingRuns(f"{CAMPAIGN[KEPT]}: no run has finished")
    for speed, band in BANDS.items():
        axes[0, 0].plot([1e-3 * speed] * 2, band, color="#bbbbbb", lw=4.0, zorder=0)
    axes[0, 0].axhline(HYDRODYNAMIC, color="black", ls=":", lw=1.0)
    axes[0, 0].set_ylabel("depth over diameter")
    axes[0, 1].set_ylabel(r"time to dissipation [$\mu$s]")
    for axis in axes[0]:  # a name below all would lie on the legend
        axis.set_xlabel("velocity of the sphere [km/s]")
    handles = axes[0, 0].get_legend_handles_labels()
    figure.legend(*handles, fontsize=6, loc="outside lower center", ncols=1)
    caption = (
        "Depth when the sphere's centre has 1 % of its energy left, time when all of the sphere has. "
        "Grey: bands of estimates. Dotted: a flowing rod as long as the sphere, the root of the "
        "ratio of densities."
    )
    title = "Figs. 5.22, 5.23: depth and time by velocity"
    page.draw("depth", title, caption, figure)


def _craters(page: Chapter, campaigns: Campaigns, name: str, match: Match) -> None:
    """Figs. 5.15 to 5.21: plastic strain on the meridian, at the end or at instants."""
    for label, speeds, shots in (
        ("Figs. 5.15 to 5.18: at the end", AT_REST, (-1,)),
        ("Figs. 5.19 to 5.21: at 1, 2 and 4 microseconds", EVOLVING, (1, 2, 3)),
    ):
        figure, axes = panels(
            len(shots), len(speeds), 0.5 + 1.4 * len(shots), sharex=True, sharey=True
        )
        dots = None
        for column, speed in enumerate(speeds):
            wanted = ("snapshot_time", "position", "plastic_strain")
            one = match | {"problem__speed": speed}
            try:
                _, found = variables(campaigns, CAMPAIGN[name], *wanted, **one)
            except MissingRuns:
                how = cell(campaigns, CAMPAIGN[name], "steps", **one).value or "not run"
                axes[0][column].set_title(f"{speed:g} m/s: {how}", fontsize=7, pad=3)
                continue
            for row, shot in enumerate(shots):
                dots = _meridian(axes[row][column], found, shot)
                axes[row][column].set_title(f"{speed:g} m/s", fontsize=7, pad=3)
        if dots is None:
            continue
        figure.colorbar(dots, ax=axes.ravel().tolist(), label="plastic strain", shrink=0.7)
        name_axes(figure, "from the axis [mm]", "height [mm]")
        key = f"{match['method']}_{'rest' if shots == (-1,) else 'time'}"
        caption = f"{name}: particles within 4 mm of the impact, by radius and height, the largest strain on top."
        page.draw(key, label, caption, figure)


def _meridian(axis: Any, found: dict[str, np.ndarray], shot: int) -> Any:
    """Particles near the impact by their distance from the axis, mirrored."""
    x = 1e3 * found["position"][shot]
    near = (np.hypot(x[:, 1], x[:, 2]) < 4.0) & (x[:, 0] > -5.0)
    return solids.draw_meridian(axis, x[near], found["plastic_strain"][shot][near], (0.0, 2.0))


def cells_chapter(campaigns: Campaigns) -> Chapter:
    """Depth at three velocities by the size of the cells and by the rule of contact."""
    page = Chapter("sphere_rules", "Beyond the thesis: depth by size of cells and rule of contact")
    campaigns["sphere_rules"]  # raises when nothing was run
    names = (*READ, "momentum_drift")
    rows = []
    every = product(
        BANDS, (("mpm", GRID), ("otm", 1.0)), RULES, (10.0, None), WAYS.items(), (2, 3, 4)
    )
    for speed, (method, unit), rule, exponent, (way, keys), cells in every:
        match = {"method": method, "contact__name": rule, "problem__speed": speed, **keys}
        match["material__rate_exponent"] = exponent
        campaign = "sphere_rules" if speed == 1000.0 else "sphere_bands"
        found = quantities(campaigns, campaign, names, **match, resolution=cells)
        if found[0].files:
            spacing = round(1e3 * unit * RADIUS / cells, 3)
            law = "10" if exponent else "no rate effect"
            rows.append([speed, method, rule, way, law, spacing, *found])
    columns = ["velocity [m/s]", "method", "rule of contact", "velocities kept by", "m"]
    columns += ["cells [mm]", "depth over diameter"]
    columns += ["time to dissipation [s]", "energy of the sphere left", "energy not explained"]
    columns += [
        "change of the energy",
        "depth by the energy of the centre",
        "change of momentum [kg m/s]",
    ]
    note = (
        "For OTM the distance of the nodes at the impact. Estimates from cavity expansion and craters: "
        f"{bands()}. Shared nodes act up to a cell before surfaces meet, "
        "which makes the sphere of radius 0.85 mm wider by as much. Velocities that stay at nodes make energy "
        "where masses of nodes are lumped anew, as at the edge of steel. Rollers and planes of symmetry take momentum. "
        "With m = 10 and 1000 /s, which are assumed, a rate of 1e5 /s raises the flow stress by 59 %; Johnson "
        "and Cook's law of 6061-T6 (constant 0.002 for a rate of 1 /s, from memory) raises it by 2 %: next to no rate "
        "effect."
    )
    page.tabulate(
        "cells", "Depth by cells and rule", columns, rows, numeric=[0, *range(5, 13)], note=note
    )
    return page


def open_chapter(campaigns: Campaigns) -> Chapter:
    """What the thesis leaves open, one by one."""
    page = Chapter("sphere_open", "Beyond the thesis: what section 5.2.3 leaves open")
    campaigns["sphere_open"]  # raises when nothing was run
    rows = [
        [
            name,
            speed,
            *quantities(campaigns, "sphere_open", READ, **(BASE | change), problem__speed=speed),
        ]
        for name, change in OPEN.items()
        for speed in BANDS
    ]
    columns = ["assumption", "velocity [m/s]", "depth over diameter", "time to dissipation [s]"]
    columns += ["energy of the sphere left", "energy not explained", "change of the energy"]
    columns += ["depth by the energy of the centre"]
    note = (
        "MPM with linear functions, cells of 0.63 mm; one assumption changed in each row. Estimates from "
        f"cavity expansion and craters: {bands()}."
    )
    page.tabulate("open", "Depth by assumption", columns, rows, numeric=range(1, 8), note=note)
    return page
