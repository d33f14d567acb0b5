"""Beyond the thesis: Sulsky's disks and two rings by every method, beside finite elements of one disk."""

from typing import Any

from mpmbench.papers.kit import Campaigns, Chapter
from mpmbench.papers.parts import quantities

Match = dict[str, Any]


def _run(method: str, basis: str, rule: str) -> Match:
    return {"method": method, "basis": basis, "contact__name": rule}


METHODS: dict[str, Match] = {
    "MPM, linear, shared": _run("mpm", "linear", "shared"),
    "MPM, linear, multi_field": _run("mpm", "linear", "multi_field"),
    "MPM, linear, penalty": _run("mpm", "linear", "penalty"),
    "MPM, GIMP, shared": _run("mpm", "gimp", "shared"),
    "MPM, CPDI, shared": _run("mpm", "cpdi", "shared"),
    "MPM, max-ent, shared": _run("mpm", "lme", "shared"),
    "MPM, B-splines, shared": _run("ulmpm", "bspline", "shared"),
    "MPM, B-splines, multi_field": _run("ulmpm", "bspline", "multi_field"),
    "total-Lagrangian MPM, max-ent, penalty": _run("tlmpm", "lme", "penalty"),
    "MPM on moving nodes, linear, penalty": _run("moving_mesh_mpm", "linear", "penalty"),
    "unified, max-ent, shared": _run("unified", "lme", "shared"),
    "OTM, shared": _run("otm", "lme", "shared"),
    "OTM, penalty": _run("otm", "lme", "penalty"),
    "linear FEM, penalty": _run("linear_fem", "linear", "penalty"),
    "implicit MPM, linear, shared": _run("implicit_mpm", "linear", "shared"),
}
SHOWN = {
    "first_contact": "first contact [s]",
    "last_contact": "last contact [s]",
    "strain_energy_max": "largest strain energy [J]",
    "strain_energy_max_time": "at [s]",
    "kinetic_energy_kept": "kinetic energy kept",
    "locked_energy_fraction": "locked as strain",
    "captured": "inside the other body at the end",
    "energy_drift": "change of the energy",
    "momentum_drift": "change of momentum [kg m/s]",
}
# Explicit finite elements of one disk on a plane of symmetry, 64 cells, for the pair; contact by geometry.
REFERENCE = ("1.5858", "2.68", "2.372", "2.10", "0.88", "", "0", "", "")
BODIES = {
    "colliding_disks": (
        "Two disks of Sulsky, Chen and Schreyer",
        "The reference is one disk on a smooth plane by explicit finite elements, for the pair: 2.513 J at the "
        "start, of which vibrations keep what translation lacks. Contact begins at 1.5858 s by geometry; "
        "shared nodes act one or two cells before.",
    ),
    "elastic_rings": (
        "Two rings",
        "By geometry they meet after 0.0333 s; 1.979e7 J at the start. Nothing is lost in fact.",
    ),
}


def round_chapter(campaigns: Campaigns) -> Chapter:
    """A table for each problem."""
    campaigns["round_bodies"]  # raises when nothing was run
    page = Chapter("round_bodies", "Beyond the thesis: disks and rings by every method")
    columns = ["method and rule", *SHOWN.values()]
    for problem, (title, note) in BODIES.items():
        rows: list[list[Any]] = []
        if problem == "colliding_disks":
            rows.append(["reference", *REFERENCE])
        for name, match in METHODS.items():
            one = match | {"problem": problem}
            rows.append([name, *quantities(campaigns, "round_bodies", SHOWN, **one)])
        page.tabulate(problem, title, columns, rows, numeric=range(1, len(columns)), note=note)
    page.notes.append(
        "Instants of contact are those at which a thousandth of the largest momentum has changed its "
        "body, and after which no more than that still does. Implicit MPM maps accelerations from its particles "
        "(Iaconeta 2017, Eq. 41), which are not those of the forces where bodies meet: it makes or loses the "
        "energy that it counts among what transfers lose. SPH is left out, since it needs its particles at nodes, "
        "and implicit methods on moving clouds of nodes for their time: `experiments=impacts` has "
        "them."
    )
    return page
