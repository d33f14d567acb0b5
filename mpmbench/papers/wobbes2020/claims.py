"""The paper's claims, each with a rule that judges it from stored runs."""

import itertools
from typing import Any

import numpy as np

from mpmbench.analysis.estimate import OrderEstimate, slopes_text
from mpmbench.papers.kit import Campaigns
from mpmbench.papers.wobbes2020.bars import as_paper
from mpmbench.papers.wobbes2020.beyond import floor_growth
from mpmbench.papers.wobbes2020.support import ERROR, METHODS, MOVING, PAIRS, STRESS, method
from mpmbench.papers.wobbes2020.survival import CUTOFFS, LAYOUTS, NODES, SIGNS
from mpmbench.papers.wobbes2020.table1 import PAPER, ratios
from mpmbench.report.claims import Claims
from mpmbench.report.evidence import Evidence, MissingRuns, Runs
from mpmbench.report.tables import number_text
from mpmbench.report.timing import clock_in

TRACTIONS = ("last_particle", "end_point")
AS_PAPER = "when MPM carries the load on its last particle"
Answer = tuple[bool | str, str]
claim = Claims()


def _slope(runs: Runs, name: str, coarse: int, fine: int) -> float:
    """Local order of a method in Fig. 6 between two grids."""
    errors = [runs.number("fig6", ERROR, **method(name, resolution=n)) for n in (coarse, fine)]
    return float(np.log(errors[0] / errors[1]) / np.log(fine / coarse))


@claim("MPM-P1 loses second order to grid crossing, OTM-P1 keeps it", "Fig. 6")
def grid_crossing(runs: Runs) -> Answer:
    """Orders before and after particles cross cells; whether the loss needs crossing."""
    before, after = _slope(runs, "MPM-P1", 15, 63), _slope(runs, "MPM-P1", 127, 511)
    otm = _slope(runs, "OTM-P1", 127, 511)
    crossings = [
        runs.number("fig6", "n_cell_crossings", **method("MPM-P1", resolution=n)) for n in (63, 511)
    ]
    because = (
        f"MPM-P1 has slope {before:.2f} from 16 to 64 nodes ({crossings[0]:g} crossings at 64) and "
        f"{after:.2f} from 128 to 512 ({crossings[1]:g} at 512); OTM-P1 has {otm:.2f} there"
    )
    if not (before > 1.8 and after < 1.0 and otm > 1.7 and crossings[0] == 0 < crossings[1]):
        return False, because
    exponent, of_mpm, of_otm = floor_growth(Campaigns(runs.campaigns))
    finest = {"method": "mpm", "resolution": 256}
    inside = [
        runs.number("amplitude_floor", "n_cell_crossings", **finest, problem__velocity_amplitude=v)
        for v in (0.01, 0.02)
    ]
    if max(inside) == 0 and of_mpm < 1.0 < of_otm:
        because += (
            ". But crossing is not the only cause: without any, MPM-P1 has a floor (slope "
            f"{of_mpm:.2f}, growing with the amplitude to the power {exponent:.1f}), OTM-P1 has "
            "none"
        )
    return True, because


@claim("Max-ent functions lead to significantly lower errors than piecewise-linear ones", "Fig. 6")
def maxent_accurate(runs: Runs) -> Answer:
    """Errors with max-ent against piecewise-linear functions, on all grids before the floor."""
    gains = []
    for scheme, n in itertools.product(("MPM", "OTM"), (7, 15, 31, 63)):
        linear, maxent = (
            runs.number("fig6", ERROR, **method(f"{scheme}-{basis}", resolution=n))
            for basis in ("P1", "maxent")
        )
        gains.append(linear / maxent)
    least, most = number_text(min(gains)), number_text(max(gains))
    because = f"on 8 to 64 nodes max-ent errors are {least} to {most} times smaller"
    return min(gains) > 5.0, because


@claim("With max-ent functions the order is between 1 and 2", "Fig. 6")
def maxent_order(runs: Runs) -> Answer:
    """Order of max-ent with consistent mass, and with lumped."""
    consistent = [
        runs.order("orders", ERROR, **method(name)) for name in ("MPM-maxent", "OTM-maxent")
    ]
    lumped = runs.order("orders", ERROR, **METHODS["MPM-maxent"], mass="lumped")
    mpm, otm, other = map(slopes_text, (*consistent, lumped))
    because = (
        f"with consistent mass p = {mpm} (MPM) and {otm} (OTM), with lumped mass {other} (MPM)"
    )
    if all(_reads_as(order, 1.0, 2.0) for order in consistent):
        return True, because
    return _reads_as(lumped, 1.0, 2.0) and "when the mass is lumped", because


@claim("BSMPM and the unified method have order 3 until a limiting value", "Fig. 6")
def spline_order(runs: Runs) -> Answer:
    """Order of BSMPM and unified with both masses, and the limiting value of Fig. 6."""
    names = ("BSMPM", "unified")
    consistent = [runs.order("orders", ERROR, **method(name)) for name in names]
    lumped = [runs.order("orders", ERROR, **METHODS[name], mass="lumped") for name in names]
    limits = [runs.number("fig6", ERROR, **method(name, resolution=511)) for name in names]
    floor = runs.number("fig6", "predicted_temporal_floor", **method("unified", resolution=511))
    words = [slopes_text(order) for order in consistent + lumped]
    because = (
        f"with consistent mass p = {words[0]} (BSMPM) and {words[1]} (unified), with lumped mass "
        f"{words[2]} and {words[3]}; on 512 nodes the errors are {limits[0]:.3g} and "
        f"{limits[1]:.3g} m, and the time step alone makes {floor:.3g} m"
    )
    third = [all(_reads_as(order, 2.8, 3.2) for order in orders) for orders in (consistent, lumped)]
    if max(limits) >= 1.5 * floor or not third[0]:
        return False, because
    return third[1] or "when the mass is consistent", because


@claim(
    "Quadratic B-splines are not consistent, so that Algorithm 2 cannot use them",
    "Sect. 4, 7",
    holds=lambda otm, unified: otm >= 1.02 * unified,
    sentence=(
        "with the degrees of freedom at the Greville abscissae Algorithm 2 runs with quadratic "
        "B-splines and gives {otm:.4g} m on the bar with traction, the unified method "
        "{unified:.4g} m"
    ),
)
def splines_inconsistent(runs: Runs) -> dict[str, float]:
    """Errors of Algorithm 2 with quadratic B-splines, and of the unified method."""
    match = {
        "basis": "bspline",
        "mass": "consistent",
        "method__nodes": "moving",
        "method__traction": "end_point",
    }
    transfers = {"otm": "position_difference", "unified": "flip"}
    return {
        name: runs.number("ablation", ERROR, **match, method__transfer=transfer)
        for name, transfer in transfers.items()
    }


@claim(
    "The unified method is stable with consistent mass where BSMPM breaks (81 nodes)", "Sect. 8.2"
)
def stays_stable(runs: Runs) -> Answer:
    """Break-downs of BSMPM and unified on grids that count as 81 nodes, and with the cut-off."""
    ends: dict[str, list[bool]] = {}
    for name, cells, sign, layout in itertools.product(("BSMPM", "unified"), NODES, SIGNS, LAYOUTS):
        match = {"problem__domain_cells": cells, "problem__traction_amplitude": sign}
        status = runs.status("breakdown", **METHODS[name], **match, problem__particle_layout=layout)
        ends.setdefault(f"{name} {'81' if cells < 83 else '85'}", []).append(status == "ok")
    kept = {"method__mass_cutoff": CUTOFFS[2]}
    cut = [
        runs.status("cutoff", **kept, problem__domain_cells=n, problem__traction_amplitude=sign)
        for n, sign in itertools.product(NODES, SIGNS)
    ]
    lost = {name: survived.count(False) for name, survived in ends.items()}
    because = (
        f"BSMPM breaks down in {lost['BSMPM 81']} of {len(ends['BSMPM 81'])} set-ups that count as "
        f"81 nodes and in {lost['BSMPM 85']} of {len(ends['BSMPM 85'])} with 85, the unified "
        f"method in {lost['unified 81'] + lost['unified 85']} of all; with degrees of freedom "
        "below 1e-6 particle masses left out BSMPM breaks down in "
        f"{cut.count('broke_down') + cut.count('diverged')} of {len(cut)}"
    )
    if lost["unified 81"] or lost["unified 85"] or not lost["BSMPM 81"]:
        return False, because
    cured = all(status == "ok" for status in cut)
    return "when BSMPM keeps near-empty degrees of freedom" if cured else True, because


@claim(
    "The errors at the right edge are due to quadrature",
    "Fig. 7",
    holds=lambda few, many, moved: moved >= many,
    sentence=(
        "BSMPM, RMS stress error: {few:.3g} Pa with 4 particles per cell, {many:.3g} Pa with "
        "16, but {moved:.3g} Pa with 4 and the load at the end of the bar instead of the last "
        "particle, half a particle spacing inside"
    ),
)
def edge_quadrature(runs: Runs) -> dict[str, float]:
    """Error of BSMPM in Fig. 7 with more quadrature points, and with another place of the load."""
    changes: dict[str, dict[str, Any]] = {
        "few": {},
        "many": {"particles_per_cell": 16},
        "moved": {"method__traction": "end_point"},
    }
    return {
        name: runs.number("fig7", STRESS, **as_paper("BSMPM", **change))
        for name, change in changes.items()
    }


@claim("OTM and the unified method are more accurate than their MPM counterparts", "Figs. 7, 8")
def better_than_mpm(runs: Runs) -> Answer:
    """OTM and unified against their MPM counterparts, with both places of the load."""
    wins = {}
    for traction in TRACTIONS:
        for moving, fixed in PAIRS.items():
            errors = [
                runs.number("fig7", ERROR, **as_paper(name, method__traction=load))
                for name, load in ((moving, "end_point"), (fixed, traction))
            ]
            wins[traction, "Fig. 7", moving] = errors[0] < errors[1]
            errors = [_fig8(runs, moving, "end_point", 128), _fig8(runs, fixed, traction, 128)]
            wins[traction, "Fig. 8", moving] = errors[0] < errors[1]
    lost = [
        f"{name} in {where} (load: {load.replace('_', ' ')})"
        for (load, where, name), won in wins.items()
        if not won
    ]
    because = f"{sum(wins.values())} of {len(wins)} comparisons won"
    if not lost:
        return True, because
    as_printed = all(won for (traction, _, _), won in wins.items() if traction == TRACTIONS[0])
    return as_printed and AS_PAPER, f"{because}; lost: {', '.join(lost)}"


@claim("The unified method and BSMPM have the lowest error and highest order", "Fig. 8")
def unified_best(runs: Runs) -> Answer:
    """Rank of the unified method in Fig. 8, grid by grid, with both places of MPM's load."""
    first: dict[str, list[int]] = {traction: [] for traction in TRACTIONS}
    for traction in TRACTIONS:
        for cells in (16, 32, 64, 128, 256):
            errors = {
                name: _fig8(runs, name, "end_point" if name in MOVING else traction, cells)
                for name in METHODS
            }
            if min(errors["unified"], errors["BSMPM"]) == min(errors.values()):
                first[traction].append(cells)
    slopes = {}
    for name in METHODS:
        found = runs.order("fig8", ERROR, **method(name, method__traction="end_point"))
        slopes[name] = float(np.mean(found.local))
    steepest = max(slopes[name] for name in ("unified", "BSMPM")) >= max(slopes.values())
    last, end = (", ".join(map(str, first[traction])) or "none" for traction in TRACTIONS)
    because = (
        f"the unified method or BSMPM has the lowest error on {last} "
        "of 16, 32, 64, 128, 256 cells when MPM carries the load on its last particle, on "
        f"{end} when at the end; mean slopes are {slopes['unified']:.2f} "
        f"(unified), {slopes['BSMPM']:.2f} (BSMPM), {slopes['OTM-maxent']:.2f} (OTM-maxent), "
        f"{slopes['MPM-maxent']:.2f} (MPM-maxent)"
    )
    on_last, at_end = (len(first[traction]) == 5 and steepest for traction in TRACTIONS)
    return on_last and (at_end or AS_PAPER), because


@claim("B-splines take at most half the time of max-ent functions (512 nodes)", "Table 1")
def cheaper_81(runs: Runs) -> Answer:
    """Time of max-ent over that of B-splines on 512 nodes."""
    return _cheaper(runs, "table1", 2.0, {"resolution": 511})


@claim("B-splines are ten times cheaper than max-ent functions", "Sect. 8.2")
def cheaper_82(runs: Runs) -> Answer:
    """Time of max-ent over that of B-splines for Fig. 7."""
    return _cheaper(runs, "fig7", 10.0, {"particles_per_cell": 4})


def _cheaper(runs: Runs, campaign: str, factor: float, where: dict[str, int]) -> Answer:
    gains: dict[str, list[float]] = {}
    clock = clock_in(runs.campaigns, campaign).quantity
    for maxent, spline in (("MPM-maxent", "BSMPM"), ("OTM-maxent", "unified")):
        place: dict[str, str] = {}
        if campaign == "fig7":
            place = {"method__traction": "end_point" if maxent in MOVING else "last_particle"}
        fast = runs.number(
            campaign, clock, **method(spline), timing_context="exclusive", **where, **place
        )
        for search in ("all", "local"):
            match = method(maxent, timing_context="exclusive", basis__search=search)
            gains.setdefault(search, []).append(
                runs.number(campaign, clock, **match, **where, **place) / fast
            )
    everywhere, near = (" and ".join(f"{gain:.1f}" for gain in found) for found in gains.values())
    because = (
        f"max-ent takes {everywhere} times (MPM, OTM) as long as B-splines when it searches "
        f"among all nodes, {near} times when among near ones"
    )
    enough = {search: min(found) >= factor for search, found in gains.items()}
    return enough["all"] and (enough["local"] or "when max-ent searches among all nodes"), because


@claim("The ratios of computational times", "Table 1")
def table1(runs: Runs) -> Answer:
    """How many of the paper's ten ratios are met within 1.5, with a search among all nodes."""
    if "table1" not in runs.campaigns:
        raise MissingRuns("there is no campaign table1")
    met, texts = 0, []
    for cells, column in PAPER.items():
        for name, paper in column.items():
            found, files = ratios(runs.campaigns["table1"], name, cells, "all")
            ours = float(np.median(found))
            runs.evidence.append(
                Evidence(f"{name}, {cells + 1} nodes: time over MPM-P1", ours, files)
            )
            met += 1 / 1.5 <= ours / paper <= 1.5
            texts.append(f"{name} {ours:.2f} ({paper:.2f})")
    counted = f"{met} of {len(texts)} ratios are within a factor of 1.5 of the paper's"
    return met == len(texts), f"{counted} (in brackets): {', '.join(texts)}"


def _fig8(runs: Runs, name: str, traction: str, cells: int) -> float:
    return runs.number("fig8", ERROR, **method(name, resolution=cells, method__traction=traction))


def _reads_as(order: OrderEstimate, low: float, high: float) -> bool:
    """Whether the order, a tenth aside, lies between two values."""
    return bool(low - 0.1 <= order.slope <= high + 0.1)
