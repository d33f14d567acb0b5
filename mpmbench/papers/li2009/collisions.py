"""Section 5.2.1: contact by shared nodes, six cubes, Figs. 5.9 to 5.12, and every rule of contact side by side."""

from typing import Any

import numpy as np

from mpmbench.papers.kit import Campaigns, Chapter, cell, variables
from mpmbench.papers.parts import quantities, thinned
from mpmbench.report.evidence import MissingRuns
from mpmbench.report.figures import name_axes, panels
from mpmbench.report.tables import Cell
from mpmbench.report.timing import clock_in

Match = dict[str, Any]
RULES: dict[str, Match] = {
    "shared, MPM": {"method": "mpm", "contact__name": "shared"},
    "multi_field, MPM": {"method": "mpm", "contact__name": "multi_field"},
    "penalty, MPM": {"method": "mpm", "contact__name": "penalty"},
    "none, OTM": {"method": "otm", "contact__name": "none"},
    "shared, OTM": {"method": "otm", "contact__name": "shared"},
    **{
        f"range {reach:g} h, OTM": {
            "method": "otm",
            "contact__name": "range",
            "contact__range": reach,
        }
        for reach in (0.25, 1.0, 2.0)
    },
    "penalty, OTM": {"method": "otm", "contact__name": "penalty"},
    "penalty, linear FEM": {"method": "linear_fem", "contact__name": "penalty"},
    "shared, MPM, B-splines": {"method": "ulmpm", "contact__name": "shared"},
    "multi_field, MPM, B-splines": {"method": "ulmpm", "contact__name": "multi_field"},
    "penalty, MPM, B-splines": {"method": "ulmpm", "contact__name": "penalty"},
    "shared, unified, max-ent": {"method": "unified", "contact__name": "shared"},
    "penalty, total-Lagrangian MPM, max-ent": {"method": "tlmpm", "contact__name": "penalty"},
    "penalty, MPM on moving nodes": {"method": "moving_mesh_mpm", "contact__name": "penalty"},
    "shared, implicit MPM": {"method": "implicit_mpm", "contact__name": "shared"},
}
CHECKS = {
    "momentum_drift": "change of momentum [kg m/s]",
    "energy_imbalance": "energy not explained",
    "kinetic_energy_kept": "kinetic energy kept",
    "locked_energy_fraction": "locked as strain",
    "captured": "inside the other body at the end",
    "captured_most": "at most",
    "pulled_back": "separation pulled back",
    "first_contact": "first contact [s]",
}
CUBES: dict[str, Match] = {
    name: RULES[name]
    for name in ("shared, OTM", "penalty, OTM", "multi_field, MPM", "penalty, linear FEM")
}
# What is varied about six cubes with shared nodes, one by one.
CUBES_BASE: Match = {
    "basis__gamma": 1.8,
    "method__mass": "lumped",
    "method__transfer": "nodal",
    "time_step": 5e-5,
}
CUBES_OPEN: dict[str, Match] = {
    "as above: gamma = 1.8 by the distance of the nodes": {},
    "wider functions, gamma = 0.9": {"basis__gamma": 0.9},
    "narrower functions, gamma = 3.6": {"basis__gamma": 3.6},
    "nodes keep their masses of the start": {"method__mass": "kept"},
    "particles keep the velocities (flip)": {"method__transfer": "flip"},
    "half the time step": {"time_step": 2.5e-5},
}
FRICTION = 0.1  # coefficient of the penalty on squares that slide
SLIPS = (1.0, 2.0, 4.0)  # of two squares along each other [m/s]
SLIDING: dict[str, Match] = {
    "shared, too far apart to meet": {"contact__name": "shared", "problem__gap": 3.0},
    "shared": {"contact__name": "shared", "problem__gap": 0.375},
    f"penalty, friction {FRICTION:g}": {"contact__name": "penalty"},
}
SIX = (
    "energy_imbalance",
    "momentum_drift",
    "kinetic_energy_kept",
    "locked_energy_fraction",
    "captured",
    "strain_energy_max",
)


def rules_chapter(campaigns: Campaigns) -> Chapter:
    """All rules of contact by the five checks, on two squares."""
    campaigns["contact_checks"]  # raises when nothing was run
    page = Chapter(
        "contact",
        "Sect. 5.2.1: rules of contact by five checks",
        "The constitutive law of the contacting bodies will automatically avoid the penetration, "
        "without constraints or gap functions.",
    )
    columns = ["rule and method", *CHECKS.values(), "dependence on the order [m/s]"]
    for offset, where in ((0.0, "head-on"), (0.4, "with an offset of 0.4")):
        rows: list[list[Any]] = []
        for name, match in RULES.items():
            one = match | {"problem__offset": offset}
            found = quantities(campaigns, "contact_checks", CHECKS, **one, problem__swapped=False)
            rows.append([name, *found, order_of(campaigns, one)])
        page.tabulate(
            f"checks_{offset:g}".replace(".", "_"),
            f"Two squares that collide {where}",
            columns,
            rows,
            numeric=range(1, len(columns)),
            note="A square at 2 m/s, 0.034 of the speed of waves, meets one at rest: the momentum is "
            "15,666 kg m/s, and by geometry they meet after 0.1875 s. Energies are over the kinetic "
            "energy at the start; what is locked is mean strain minus mean vibration energy over the "
            "last fifth. What is pulled back is speed of separation that the bodies lose again.",
        )
    return page


def order_of(campaigns: Campaigns, match: Match) -> Cell:
    """Difference of the speeds [m/s] when the bodies are named in the other order."""
    first, second = (
        cell(campaigns, "contact_checks", name, **match, problem__swapped=swapped)
        for name, swapped in (("velocity_1", False), ("velocity_2", True))
    )
    if not isinstance(first.value, float) or not isinstance(second.value, float):
        return Cell()
    return Cell(abs(first.value - second.value), (*first.files, *second.files))


def slip_chapter(campaigns: Campaigns) -> Chapter:
    """What rules of contact do along surfaces, and what a step with them costs."""
    page = Chapter(
        "contact_slip",
        "Sect. 5.2.1: squares that slide along each other, and what contact costs",
        "We are able to capture not only the normal forces but also the friction on the contact "
        "interfaces.",
    )
    campaigns["contact_slip"]  # raises when nothing was run
    names = ("impulse_ratio", "captured", "pulled_back", "energy_imbalance", "momentum_drift")
    rows: list[list[Any]] = []
    for called, rule in SLIDING.items():
        for slip in SLIPS:
            match = rule | {"problem__slip": slip}
            cost, steps = (
                cell(campaigns, "contact_slip", name, **match)
                for name in ("solver_cpu_time", "steps")
            )
            if isinstance(cost.value, float) and isinstance(steps.value, float):
                cost = Cell(1e6 * cost.value / steps.value, cost.files)
            rows.append(
                [called, slip, *quantities(campaigns, "contact_slip", names, **match), cost]
            )
    columns = ["rule", "speed of sliding [m/s]"]
    columns += ["impulse along over across the faces", "inside the other body at the end"]
    columns += ["separation pulled back", "energy not explained", "change of momentum [kg m/s]"]
    columns += ["processor time of a step [us]"]
    page.tabulate(
        "slip",
        "A square meets another one at 2 m/s and slides along it",
        columns,
        rows,
        numeric=range(1, 8),
        note="OTM; three quarters of the faces cover each other when they meet. Friction on plane faces keeps "
        "the ratio of the impulses below its coefficient however fast bodies slide; bodies that stick have one that "
        "grows with the speed. Squares that have turned meet again by their corners, which adds to it. "
        + clock_in(campaigns, "contact_slip").note,
    )
    return page


def cubes_chapter(campaigns: Campaigns) -> Chapter:
    """Energy and momenta of six cubes."""
    page = Chapter(
        "six_cubes",
        "Sect. 5.2.1: six cubes, Figs. 5.9 to 5.12",
        "All the fields are perfectly conserved during the impact by using the novel meshless "
        "contact algorithm.",
    )
    figure, axes = panels(1, len(CUBES), 2.3, sharex=True, sharey=True)
    drawn = []
    for axis, (name, match) in zip(axes[0], CUBES.items(), strict=True):
        axis.set_title(name, fontsize=7, pad=3)
        try:
            _, found = variables(campaigns, "six_cubes", "time", *ENERGIES, **match)
        except MissingRuns:
            how = cell(campaigns, "six_cubes", "steps", **match).value or "not run"
            axis.text(0.5, 0.5, how, transform=axis.transAxes, ha="center", fontsize=7)
            continue
        drawn.append(name)
        total = np.sum([found[energy] for energy in ENERGIES], axis=0)
        for energy, values in (*((one, found[one]) for one in ENERGIES), ("total", total)):
            curve = thinned(found["time"], 1e-3 * values)
            axis.plot(*curve, label=energy.replace("_", " "), lw=1.0)
    if not drawn:
        raise MissingRuns("six_cubes: no run has finished")
    axes[0][0].legend(fontsize=5)
    name_axes(figure, "time [s]", "energy [kJ]")
    caption = "Total, and what it consists of: at the start 93.996 kJ of kinetic energy."
    page.draw("energy", "Fig. 5.9: energy of six cubes", caption, figure)
    _momenta(page, campaigns, CUBES[drawn[0]], drawn[0])
    for name in drawn:
        _motion(page, campaigns, CUBES[name], name)
    rows = [
        [name, *quantities(campaigns, "six_cubes", SIX, **match)] for name, match in CUBES.items()
    ]
    columns = ["rule and method", "energy not explained", "change of momentum [kg m/s]"]
    columns += ["kinetic energy kept", "locked as strain", "inside another body at the end"]
    columns += ["largest strain energy [J]"]
    page.tabulate("cubes", "Six cubes by rule and method", columns, rows, numeric=range(1, 7))
    return page


def open_cubes_chapter(campaigns: Campaigns) -> Chapter:
    """What the energies of six cubes owe to choices."""
    page = Chapter(
        "cubes_open", "Sect. 5.2.1: what the thesis leaves open about six cubes with shared nodes"
    )
    campaigns["cubes_open"]  # raises when nothing was run
    wanted = ("energy_drift", *SIX)
    rows = [
        [name, *quantities(campaigns, "cubes_open", wanted, **CUBES_BASE | changed)]
        for name, changed in CUBES_OPEN.items()
    ]
    columns = ["choice", "change of the energy", "energy not explained"]
    columns += ["change of momentum [kg m/s]", "kinetic energy kept", "locked as strain"]
    columns += ["inside another body at the end", "largest strain energy [J]"]
    note = (
        "Velocities on nodes have the kinetic energy of these with their lumped masses; particles only "
        "interpolate them. What the energy changes by is that of kinetic and strain energy together."
    )
    title = "Six cubes, OTM, shared nodes: one choice changed"
    page.tabulate("choices", title, columns, rows, numeric=range(1, len(columns)), note=note)
    return page


ENERGIES = ("kinetic_energy", "strain_energy", "contact_energy")


def _momenta(page: Chapter, campaigns: Campaigns, match: Match, name: str) -> None:
    """Momentum of every cube along both axes."""
    _, found = variables(campaigns, "six_cubes", "time", "body_momentum", **match)
    momentum = found["body_momentum"]
    figure, axes = panels(1, 2, 2.6, sharex=True)
    for d, axis in enumerate(axes[0]):
        for b in range(momentum.shape[1]):
            axis.plot(
                *thinned(found["time"], 1e-3 * momentum[:, b, d]), label=f"cube {b + 1}", lw=1.0
            )
        whole = 1e-3 * np.sum(momentum[:, :, d], axis=1)
        axis.plot(*thinned(found["time"], whole), "k--", label="total", lw=1.0)
        axis.set_title(f"along $x_{d + 1}$", fontsize=7, pad=3)
    figure.legend(*axes[0][0].get_legend_handles_labels(), fontsize=5, loc="outside right center")
    name_axes(figure, "time [s]", "momentum [Mg m/s]")
    page.draw("momenta", "Figs. 5.10, 5.11: momentum of each cube", f"{name}.", figure)


def _motion(page: Chapter, campaigns: Campaigns, match: Match, name: str) -> None:
    """Fig. 5.12: the particles at the instants that were kept, by body."""
    wanted = ("snapshot_time", "position", "body")
    _, found = variables(campaigns, "six_cubes", *wanted, **match)
    shots = range(1, len(found["snapshot_time"]))
    figure, axes = panels(1, len(shots), 2.3, sharex=True, sharey=True)
    for axis, shot in zip(axes[0], shots, strict=True):
        x = found["position"][shot]
        axis.scatter(x[:, 0], x[:, 1], c=found["body"], s=0.5, lw=0.0, cmap="tab10", vmax=10.0)
        axis.set_aspect("equal")
        axis.set_title(f"{found['snapshot_time'][shot]:.3g} s", fontsize=7, pad=3)
    name_axes(figure, "$x_1$ [m]", "$x_2$ [m]")
    key = f"motion_{match['contact__name']}_{match['method']}"
    page.draw(key, "Fig. 5.12: motion of six cubes", f"{name}.", figure)
