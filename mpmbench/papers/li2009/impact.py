"""Section 5.2.3: a steel sphere on an aluminium plate, Figs. 5.14 to 5.23, cells and rules, and what is left open."""

from itertools import product
from typing import Any

import matplotlib
import numpy as np

from mpmbench.papers.kit import Campaigns, Chapter, cell, variables
from mpmbench.papers.parts import finished, quantities
from mpmbench.report import solids, style
from mpmbench.report.evidence import MissingRuns
from mpmbench.report.figures import name_axes, panels, single

Match = dict[str, Any]
SPEEDS = (500.0, 750.0, 1000.0, 1250.0, 1500.0, 2000.0, 2500.0, 3000.0)  # [m/s]
AT_REST, EVOLVING = (500.0, 750.0, 1000.0, 1250.0), (1500.0, 2000.0, 2500.0)  # of the figures
METHODS: dict[str, Match] = {
    "OTM, shared nodes": {"method": "otm", "basis": "lme"},
    "MPM, linear, musl": {"method": "mpm", "basis": "linear"},
}
# Depth over diameter by estimates from cavity expansion and craters, not data.
BANDS = {500.0: (0.35, 0.65), 1000.0: (0.8, 1.6), 2000.0: (1.2, 2.6)}
HYDRODYNAMIC = (
    7850.0 / 2700.0
) ** 0.5  # depth over length of a rod that flows: root of the densities
RULES = ("shared", "multi_field", "penalty")
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
    for name, match in METHODS.items():
        _craters(page, campaigns, name, match)
    rows = [
        [
            name,
            speed,
            *quantities(campaigns, "sphere_velocity", READ, **match, problem__speed=speed),
        ]
        for name, match in METHODS.items()
        for speed in SPEEDS
    ]
    columns = ["method", "velocity [m/s]", "depth over diameter", "time to dissipation [s]"]
    columns += ["energy of the sphere left", "energy not explained", "change of the energy"]
    columns += ["depth by the energy of the centre"]
    bands = ", ".join(
        f"{low:g} to {high:g} at {speed:g} m/s" for speed, (low, high) in BANDS.items()
    )
    note = (
        "Depth of the plate's point under the sphere when the sphere has 1 % of its energy left; "
        f"empty where it keeps more until the end. Estimates from cavity expansion and craters: {bands}. "
        "Velocities that stay on nodes while their masses change (Eq. 3.92) make energy: what changes is "
        "that of the particles over the one at the start, all losses in plastic strain counted."
    )
    title = "Depth and time by velocity"
    page.tabulate("depths", title, columns, rows, numeric=range(1, 8), note=note)
    return page


def _model(page: Chapter, campaigns: Campaigns) -> None:
    """Fig. 5.14: the particles of OTM at the start, cut open along the planes of symmetry."""
    wanted = ("position", "volume", "body")
    match = METHODS["OTM, shared nodes"]
    for speed in SPEEDS:
        try:
            _, found = variables(
                campaigns, "sphere_velocity", *wanted, **match, problem__speed=speed
            )
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
    figure, axes = panels(1, 2, 2.6, sharex=True)
    drawn = False
    for rank, (name, match) in enumerate(METHODS.items()):
        for axis, quantity, factor in zip(axes[0], READ[:2], (1.0, 1e6), strict=True):
            found = [
                cell(campaigns, "sphere_velocity", quantity, **match, problem__speed=speed)
                for speed in SPEEDS
            ]
            try:
                x, y = finished(SPEEDS, found, "sphere_velocity: no run has finished")
            except MissingRuns:
                continue
            drawn = True
            look = style.line(match["method"], match["basis"], rank)
            axis.plot(1e-3 * np.array(x), factor * np.array(y), label=name, **look)
    if not drawn:
        raise MissingRuns("sphere_velocity: no run has finished")
    for speed, band in BANDS.items():
        axes[0, 0].plot([1e-3 * speed] * 2, band, color="#bbbbbb", lw=4.0, zorder=0)
    axes[0, 0].axhline(HYDRODYNAMIC, color="black", ls=":", lw=1.0)
    axes[0, 0].set_ylabel("depth over diameter")
    axes[0, 1].set_ylabel(r"time to dissipation [$\mu$s]")
    axes[0, 0].legend(fontsize=6)
    name_axes(figure, "velocity of the sphere [km/s]")
    caption = (
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
                _, found = variables(campaigns, "sphere_velocity", *wanted, **one)
            except MissingRuns:
                how = cell(campaigns, "sphere_velocity", "steps", **one).value or "not run"
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
    """Depth at 1000 m/s by the size of the cells and by the rule of contact."""
    page = Chapter("sphere_rules", "Beyond the thesis: depth by size of cells and rule of contact")
    campaigns["sphere_rules"]  # raises when nothing was run
    names = (*READ, "momentum_drift")
    rows = []
    every = product((("mpm", GRID), ("otm", 1.0)), RULES, ("flip", "nodal"), (2, 3, 4))
    for (method, unit), rule, transfer, cells in every:
        match = {"method": method, "contact__name": rule, "method__transfer": transfer}
        found = quantities(campaigns, "sphere_rules", names, **match, resolution=cells)
        if found[0].files:
            spacing = round(1e3 * unit * RADIUS / cells, 3)
            rows.append([method, rule, transfer, spacing, *found])
    columns = ["method", "rule of contact", "transfer", "cells [mm]", "depth over diameter"]
    columns += ["time to dissipation [s]", "energy of the sphere left", "energy not explained"]
    columns += [
        "change of the energy",
        "depth by the energy of the centre",
        "change of momentum [kg m/s]",
    ]
    low, high = BANDS[1000.0]
    note = (
        "The sphere at 1000 m/s; for OTM the distance of the nodes at the impact. Estimates from cavity "
        f"expansion and craters: {low:g} to {high:g}. Shared nodes act up to a cell before surfaces meet, "
        "which makes the sphere of radius 0.85 mm wider by as much. Velocities that stay at nodes (nodal) make energy "
        "where masses of nodes change much, as at the edge of steel. Rollers and planes of symmetry take momentum."
    )
    page.tabulate(
        "cells", "Depth by cells and rule", columns, rows, numeric=range(3, 11), note=note
    )
    return page


def open_chapter(campaigns: Campaigns) -> Chapter:
    """What the thesis leaves open, one by one."""
    page = Chapter("sphere_open", "Beyond the thesis: what section 5.2.3 leaves open")
    campaigns["sphere_open"]  # raises when nothing was run
    rows = [
        [name, *quantities(campaigns, "sphere_open", READ, **(BASE | change))]
        for name, change in OPEN.items()
    ]
    columns = ["assumption", "depth over diameter", "time to dissipation [s]"]
    columns += ["energy of the sphere left", "energy not explained", "change of the energy"]
    columns += ["depth by the energy of the centre"]
    note = "MPM with linear functions at 1000 m/s, cells of 0.63 mm; one assumption changed in each row."
    page.tabulate("open", "Depth by assumption", columns, rows, numeric=range(1, 7), note=note)
    return page
