"""Figs. 4.12 and 4.13, energies, and the tensile instability."""

from typing import Any

import numpy as np
from matplotlib.colors import LogNorm

from mpmbench.papers.kit import Campaigns, Chapter, cell, variables
from mpmbench.papers.li2009.support import CONSISTENT, LUMPED, OTM
from mpmbench.papers.parts import along, finished, numbers, quantities
from mpmbench.report import style
from mpmbench.report.figures import name_axes, panels, single
from mpmbench.report.tables import Cell

UNIFORM = {"problem__irregularity": 0.0}
IRREGULAR = {"problem__irregularity": 0.3}
CELLS = {"problem__particle_layout": "midpoint"}
AT_NODES = {"problem__particle_layout": "nodes"}
UPDATED, FROZEN = {"method__shape_functions": "updated"}, {"method__shape_functions": "frozen"}
FILTER = {"mass": "lumped", "method__transfer": "position_difference"}

ONE, TWO = {"particles_per_cell": 1}, {"particles_per_cell": 2}
FEM = {"method": "linear_fem"}
MLS = {"method": "otm", "basis": "mls"}  # the functions of the element-free Galerkin method
BARS: dict[str, dict[str, Any]] = {
    "OTM, lumped mass, nodal velocities": OTM | LUMPED | UNIFORM | CELLS | TWO,
    "OTM, consistent mass": OTM | CONSISTENT | UNIFORM,
    "linear FEM": FEM | UNIFORM,
    "OTM, lumped, irregular nodes": OTM | LUMPED | IRREGULAR | TWO,
    "OTM, consistent, irregular nodes": OTM | CONSISTENT | IRREGULAR,
    "linear FEM, irregular nodes": FEM | IRREGULAR,
    "OTM, lumped, 1 particle per cell": OTM | LUMPED | UNIFORM | CELLS | ONE,
    "OTM, lumped, irregular, 1 particle per cell": OTM | LUMPED | IRREGULAR | ONE,
    "MPM, linear": {"method": "mpm", "basis": "linear"},
    "MPM, B-splines": {"method": "mpm", "basis": "bspline"},
    "unified": {"method": "unified"},
    "nodal integration, updated functions": OTM | LUMPED | AT_NODES | UPDATED,
    "nodal integration, frozen functions": OTM | LUMPED | AT_NODES | FROZEN,
    "nodal integration, MLS, updated functions": MLS | LUMPED | AT_NODES | UPDATED,
    "nodal integration, MLS, frozen functions": MLS | LUMPED | AT_NODES | FROZEN,
    "OTM, lumped, position differences, 1 particle": OTM | FILTER | ONE,
    "OTM, lumped, position differences, 2 particles": OTM | FILTER | TWO,
    "SPH": {"method": "sph", "method__derivatives": "plain"},
    "SPH, symmetric derivatives": {"method": "sph", "method__derivatives": "symmetric"},
}
SHOWN = (
    "OTM, lumped mass, nodal velocities",
    "OTM, consistent mass",
    "linear FEM",
    "OTM, lumped, irregular nodes",
    "OTM, lumped, position differences, 1 particle",
    "SPH, symmetric derivatives",
)
STRETCHES = (1.0, 1.1, 1.2, 1.3, 1.4, 1.5, 1.6, 1.8, 2.0, 2.5, 3.0)
STRETCHED: dict[str, dict[str, Any]] = {
    "functions kept, gamma 1.8": OTM | FROZEN | CELLS | {"basis__gamma": 1.8},
    "functions kept, gamma 0.8": OTM | FROZEN | {"basis__gamma": 0.8},
    "nodal integration, gamma 1.8": OTM | UPDATED | AT_NODES,
    "nodal integration, functions kept, gamma 1.8": OTM | FROZEN | AT_NODES,
    "two particles per cell, gamma 1.8": OTM | UPDATED | TWO,
    "linear FEM": FEM,
}
GAMMAS = (0.8, 1.2, 1.8, 2.4, 3.2, 4.0, 6.8)
STEPS = (6.25e-9, 1.25e-8, 2.5e-8, 5e-8, 1e-7, 2e-7)
SCALARS = (
    "tip_displacement_max",
    "tip_displacement_min",
    "tip_displacement_error",
    "tip_velocity_max",
    "total_energy_drift",
    "total_energy_end",
)


def bar_chapter(campaigns: Campaigns) -> Chapter:
    """Histories of the free end."""
    page = Chapter(
        "fig4_12",
        "Figs. 4.12 and 4.13: the free end of the elastic bar",
        "OTM agrees with finite elements in tension and compression, also with a nonuniform "
        "distribution of nodes; standard SPH cannot solve the problem.",
    )
    caption = "100 nodes; black: exact solution. The last two are to fail."
    for quantity, unit, scale in (("displacement", r"$\mu$m", 1e6), ("velocity", "m/s", 1.0)):
        figure, axes = panels(3, 2, 4.35, sharex=True, sharey=True)
        tip = f"tip_{quantity}"
        for axis, name in zip(axes.ravel(), SHOWN, strict=True):
            wanted = ("time", tip, f"{tip}_exact")
            _, found = variables(campaigns, "fig4_12", *wanted, **BARS[name])
            t = 1e6 * found["time"]
            axis.plot(t, scale * found[f"{tip}_exact"], **style.EXACT)
            axis.plot(t, scale * found[tip], color=style.colour(BARS[name]["method"]), lw=0.8)
            axis.set_title(name, pad=3)
        name_axes(figure, r"time [$\mu$s]", f"tip {quantity} [{unit}]")
        page.draw(quantity, f"Tip {quantity}", caption, figure)
    rows = [
        [name, *quantities(campaigns, "fig4_12", SCALARS, **match)] for name, match in BARS.items()
    ]
    columns = ["method", "largest [m]", "smallest [m]", "relative L2 error", "largest speed [m/s]"]
    columns += ["energy drift", "energy left"]
    note = "Exact: 3.2975e-5 m and -3.2975e-5 m, 5 m/s. Extremes in the first period, error over 250 microseconds."
    page.tabulate("tip", "The free end by method", columns, rows, note=note, numeric=range(1, 7))
    page.notes.append(
        "Position differences with a lumped mass are a filter in every step: the bar comes to "
        "rest. SPH with the derivatives of Eq. 2.5 takes its free end away at once; with symmetric "
        "derivatives it keeps its energy and still gives a wrong motion."
    )
    return page


def energy_chapter(campaigns: Campaigns) -> Chapter:
    """Energy against the time step."""
    page = Chapter("energy", "Energy and time step: by mass and transfer, beyond the thesis")
    figure, axes = single()
    rows = []
    variants = {
        "lumped, nodal velocities": LUMPED,
        "consistent, position differences": CONSISTENT,
        "lumped, position differences": FILTER,
    }
    for rank, (name, match) in enumerate(variants.items()):
        drifts = along(campaigns, "energy", "total_energy_drift", "time_step", STEPS, **match)
        curve = finished(STEPS, drifts, f"energy: no run with {name} has finished")
        axes.loglog(*curve, label=name, **style.line("otm", "lme", rank))
        rows.append([name, *drifts])
    axes.set(xlabel="time step [s]", ylabel="relative change of the energy")
    axes.legend()
    caption = "OTM with local max-ent functions."
    page.draw("drift", "Largest change of the energy of the bar", caption, figure)
    columns = ["mass and transfer", *(f"{dt:g} s" for dt in STEPS)]
    title = "Largest relative change of the energy"
    page.tabulate("drift", title, columns, rows, numeric=range(1, 7))
    return page


def stability_chapter(campaigns: Campaigns) -> Chapter:
    """Growth of a disturbance in a stretched bar."""
    page = Chapter(
        "stability",
        "Sect. 4.2: tensile instability of a stretched bar",
        "Since OTM uses an incremental updated Lagrangian kernel and integrates at material "
        "points, it completely avoids the tensile instability.",
    )
    _growth_map(page, campaigns)
    rows = []
    for name, match in STRETCHED.items():
        stretches = [match | {"problem__stretch": s} for s in (1.2, 1.4, 1.6, 2.0)]
        rows.append([name, *(_growth(campaigns, "stability_frozen", **m) for m in stretches)])
    columns = ["method", "1.2", "1.4", "1.6", "2"]
    page.tabulate("frozen", "The same with other functions", columns, rows, numeric=(1, 2, 3, 4))
    page.notes.append(
        "Re-computed functions of a stretched bar are those of an Eulerian kernel as far as the "
        "instability goes: it sets in where the stress outweighs the tangent modulus in the "
        "shortest wave. Metals break or flow long before."
    )
    return page


def _growth_map(page: Chapter, campaigns: Campaigns) -> None:
    """Growth of the disturbance by stretch and gamma."""
    found = [
        [
            _growth(campaigns, "stability", basis__gamma=gamma, problem__stretch=s, **UPDATED)
            for s in STRETCHES
        ]
        for gamma in GAMMAS
    ]
    growth = np.array([numbers(row) for row in found])
    figure, axes = single()
    places = range(len(STRETCHES)), range(len(GAMMAS))
    look: dict[str, Any] = {"norm": LogNorm(1.0, 1e10), "cmap": "magma_r"}
    picture = axes.pcolormesh(*places, np.maximum(growth, 1.0), **look)
    axes.set_xticks(range(len(STRETCHES)), [f"{s:g}" for s in STRETCHES])
    axes.set_yticks(range(len(GAMMAS)), [f"{g:g}" for g in GAMMAS])
    axes.grid(False)
    axes.set(xlabel="stretch", ylabel=r"$\gamma$")
    figure.colorbar(picture, label="growth of the disturbance")
    caption = "41 nodes, P = E ln J, ends held, velocity noise 1e-10 m/s, 400 s; the initial stress is balanced."
    page.draw("map", "Growth by stretch and gamma", caption, figure)
    columns = ["gamma", *(f"{s:g}" for s in STRETCHES)]
    title = "Growth of the disturbance by stretch"
    rows = [[gamma, *row] for gamma, row in zip(GAMMAS, found, strict=True)]
    page.tabulate("growth", title, columns, rows, numeric=range(1 + len(STRETCHES)))


def _growth(campaigns: Campaigns, campaign: str, **match: Any) -> Cell:
    """Growth, also of a run that broke down because of it."""
    runs = campaigns[campaign].runs
    found = cell(campaigns, campaign, "growth", **match)
    if isinstance(found.value, str) and found.files and "growth" in runs:
        value = float(runs.loc[list(found.files), "growth"].iloc[0])
        return Cell(value, found.files) if np.isfinite(value) else found
    return found
