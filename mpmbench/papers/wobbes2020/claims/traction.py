"""Claims on the bar with dynamic traction (Sect. 8.2)."""

import itertools

import numpy as np

from mpmbench.papers.kit import Campaigns
from mpmbench.papers.wobbes2020.bars import as_paper
from mpmbench.papers.wobbes2020.claims.judging import Answer, claim, error_of_fig7
from mpmbench.papers.wobbes2020.support import (
    ERROR,
    METHODS,
    MOVING,
    PAIRS,
    PROFILE,
    fields,
    method,
)
from mpmbench.papers.wobbes2020.survival import CUTOFFS, LAYOUTS, NODES, SIGNS
from mpmbench.report.claims import OPEN
from mpmbench.report.evidence import Evidence, Runs

EDGE = 0.95  # the right edge of the bar [m], in the initial position
FEWER = 3.0  # "significantly reduced": an error at the edge at least so many times smaller
GRIDS = (16, 32, 64, 128, 256)


@claim(
    "The errors of BSMPM at the right edge are due to quadrature",
    "Sect. 8.2, Fig. 7",
    quote="Within BSMPM, these inaccuracies can be significantly reduced by increasing the initial "
    "number of particles per elements. This suggests that the errors are caused by insufficient "
    "accuracy of the numerical integration in MPM",
    threshold=f"RMS error of the stress beyond x = {EDGE:g} m: 16 instead of 4 particles per cell "
    f"cut it by {FEWER:g} or more, another place of the load by less",
)
def edge_quadrature(runs: Runs) -> Answer:
    """Error at the edge with more quadrature points, and with another place of the load."""
    errors = {}
    for load, count in itertools.product(("last_particle", "end_point"), (4, 16)):
        change = {"method__traction": load, "particles_per_cell": count}
        file, found = fields(
            Campaigns(runs.campaigns), "fig7", *PROFILE, **as_paper("BSMPM", **change)
        )
        edge = found["position_initial"][:, 0] > EDGE
        off = (found["stress"] - found["stress_exact"])[edge, 0, 0]
        errors[load, count] = float(np.sqrt(np.mean(off**2)))
        name = f"edge error [Pa], load: {load.replace('_', ' ')}, {count} particles per cell"
        runs.evidence.append(Evidence(name, errors[load, count], (file,)))
    last, end = ([errors[load, n] for n in (4, 16)] for load in ("last_particle", "end_point"))
    because = (
        f"beyond x = {EDGE:g} m the RMS stress error falls from {last[0]:.3g} to {last[1]:.3g} Pa "
        f"with 16 instead of 4 particles per cell; with the load at the end of the bar instead of "
        f"the last particle it is {end[0]:.3g} with 4 and {end[1]:.3g} with 16"
    )
    parts = {
        "more particles help": last[0] >= FEWER * last[1] and end[0] >= FEWER * end[1],
        "the place of the load is no cause": last[0] < FEWER * end[0],
    }
    return parts, because


@claim(
    "OTM and the unified method are more accurate than their MPM counterparts",
    "Sect. 8.2, Fig. 7",
    quote="the OTM-P1, OTM-maxent, and unified methods provide significantly more accurate "
    "solutions than their MPM equivalents",
    threshold="a smaller RMS error of the displacement",
)
def better_than_mpm(runs: Runs) -> Answer:
    """Errors of MPM in the set-up of Fig. 7 over those of OTM and the unified method."""
    gains = {
        moving: error_of_fig7(runs, fixed) / error_of_fig7(runs, moving)
        for moving, fixed in PAIRS.items()
    }
    words = ", ".join(
        f"{gain:.2g} times that of {moving} ({PAIRS[moving]})" for moving, gain in gains.items()
    )
    return {moving: gain > 1.0 for moving, gain in gains.items()}, f"the error of MPM is {words}"


@claim(
    "The unified method and BSMPM have the lowest error and highest order",
    "Sect. 8.2, Fig. 8",
    quote="the unified approach and BSMPM have the lowest RMS error and highest convergence rates "
    "compared to the other methods",
    threshold="the smallest error on every grid of 16 to 256 cells; the largest least-squares slope",
)
def unified_best(runs: Runs) -> Answer:
    """Errors and slopes of Fig. 8."""
    load = {
        name: "end_point" if name in MOVING else runs.choice("traction", "last_particle")
        for name in METHODS
    }
    match = {name: method(name, method__traction=load[name]) for name in METHODS}
    ours = ("unified", "BSMPM")
    errors = {
        name: [runs.number("fig8", ERROR, **match[name], resolution=n) for n in GRIDS]
        for name in METHODS
    }
    slopes = {name: runs.order("fig8", ERROR, **match[name]).slope for name in METHODS}
    others = [name for name in METHODS if name not in ours]
    least = np.min([errors[name] for name in others], axis=0)
    first = {name: int(np.sum(np.array(errors[name]) < least)) for name in ours}
    steepest = max(slopes[name] for name in others)
    because = (
        f"of {len(GRIDS)} grids the unified method has a smaller error than all others on "
        f"{first['unified']}, BSMPM on {first['BSMPM']}; slopes "
        + ", ".join(f"{slope:.2f} ({name})" for name, slope in slopes.items())
    )
    parts = {f"error of {name}": first[name] == len(GRIDS) for name in ours}
    parts |= {f"order of {name}": slopes[name] >= steepest for name in ours}
    return parts, because


@claim(
    "The unified method is stable with consistent mass where BSMPM breaks (81 nodes)",
    "Sects. 8.2, 9",
    quote="changing the total number of nodes to 81 results in a termination after 0.3 s",
    threshold="every run of the unified method ends, every run of BSMPM that counts as 81 nodes "
    "breaks down",
)
def stays_stable(runs: Runs) -> Answer:
    """Break-downs of BSMPM and unified on grids that count as 81 nodes and as 85."""
    if runs.choice("mass_cutoff", 0.0):
        return _stable_with_cutoff(runs)
    ends: dict[str, list[bool]] = {}
    for name, cells, sign, layout in itertools.product(("BSMPM", "unified"), NODES, SIGNS, LAYOUTS):
        match = {"problem__domain_cells": cells, "problem__traction_amplitude": sign}
        status = runs.status("breakdown", **METHODS[name], **match, problem__particle_layout=layout)
        ends.setdefault(f"{name} {'81' if cells < 83 else '85'}", []).append(status == "ok")
    lost = {name: survived.count(False) for name, survived in ends.items()}
    total = {name: len(survived) for name, survived in ends.items()}
    because = (
        f"BSMPM breaks down in {lost['BSMPM 81']} of {total['BSMPM 81']} set-ups that count as "
        f"81 nodes and in {lost['BSMPM 85']} of {total['BSMPM 85']} with 85, the unified method in "
        f"{lost['unified 81'] + lost['unified 85']} of all"
    )
    if lost["unified 81"] or lost["unified 85"] or not lost["BSMPM 81"]:
        return False, because
    if lost["BSMPM 81"] == total["BSMPM 81"] and not lost["BSMPM 85"]:
        return True, because
    left = "what counts as a node, the sign of the load and the place of the particles"
    return f"{OPEN}: the paper leaves {left} open", because


def _stable_with_cutoff(runs: Runs) -> Answer:
    ends = [
        runs.status(
            "cutoff",
            method__mass_cutoff=CUTOFFS[2],
            problem__domain_cells=n,
            problem__traction_amplitude=sign,
        )
        for n, sign in itertools.product(NODES, SIGNS)
    ]
    broken = sum(status != "ok" for status in ends)
    because = (
        "with degrees of freedom below 1e-6 particle masses left out BSMPM breaks down in "
        f"{broken} of {len(ends)} set-ups"
    )
    return broken > 0, because


@claim(
    "The breakdown requires MUSL with a lumped mass",
    "Sect. 8.2",
    quote="requires the use of the MUSL algorithm with a lumped mass matrix to circumvent the "
    "breakdown",
    threshold="with 81 nodes every run of MUSL with lumped mass ends, and some run of every other "
    "choice breaks down",
)
def musl_needed(runs: Runs) -> Answer:
    """How BSMPM ends with either mass and each order of the stress update."""
    survived = {}
    for mass, update in itertools.product(("lumped", "consistent"), ("usl", "musl", "usf")):
        ends = [
            runs.status(
                "musl",
                mass=mass,
                method__stress_update=update,
                problem__domain_cells=cells,
                problem__traction_amplitude=sign,
            )
            for cells, sign in itertools.product((79, 80), SIGNS)
        ]
        survived[f"{update.upper()} {mass}"] = ends.count("ok")
    words = ", ".join(f"{name} {count}" for name, count in survived.items())
    because = f"of 4 set-ups that count as 81 nodes survive: {words}"
    others = [count for name, count in survived.items() if name != "MUSL lumped"]
    return {"it is enough": survived["MUSL lumped"] == 4, "it is needed": max(others) < 4}, because
