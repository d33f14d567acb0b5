"""The paper's claims, each with a rule that judges it from stored runs."""

import numpy as np

from mpmbench.analysis.convergence import OrderEstimate, order_with_interval
from mpmbench.papers.kit import Campaigns
from mpmbench.papers.wobbes2020.beyond import floor_growth
from mpmbench.papers.wobbes2020.support import ERROR, METHODS, MOVING, STRESS, TIME, method
from mpmbench.papers.wobbes2020.survival import CUTOFFS, LAYOUTS, NODES, SIGNS
from mpmbench.papers.wobbes2020.table1 import PAPER, ratios
from mpmbench.report.claims import FAILS, HOLDS, Claim, Evidence, MissingRuns, Runs
from mpmbench.report.tables import number_text

PAIRS = {"OTM-P1": "MPM-P1", "OTM-maxent": "MPM-maxent", "unified": "BSMPM"}
Answer = tuple[str, str]


def _slope(runs: Runs, name: str, coarse: int, fine: int) -> float:
    """Local order of a method in Fig. 6 between two grids."""
    errors = [runs.number("fig6", ERROR, **method(name, resolution=n)) for n in (coarse, fine)]
    return float(np.log(errors[0] / errors[1]) / np.log(fine / coarse))


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
    lost = before > 1.8 and after < 1.0 and otm > 1.7 and crossings[0] == 0 < crossings[1]
    if not lost:
        return FAILS, because
    exponent, of_mpm, of_otm = floor_growth(Campaigns(runs.campaigns))
    inside = [
        runs.number(
            "amplitude_floor",
            "n_cell_crossings",
            method="mpm",
            resolution=256,
            problem__velocity_amplitude=v,
        )
        for v in (0.01, 0.02)
    ]
    if max(inside) == 0 and of_mpm < 1.0 < of_otm:
        because += (
            ". But crossing is not the only cause: without any, MPM-P1 has a floor (slope "
            f"{of_mpm:.2f}, growing with the amplitude to the power {exponent:.1f}), OTM-P1 has "
            "none"
        )
    return HOLDS, because


def maxent_accurate(runs: Runs) -> Answer:
    """Errors with max-ent against piecewise-linear functions, on all grids before the floor."""
    gains = {}
    for scheme in ("MPM", "OTM"):
        for n in (7, 15, 31, 63):
            linear, maxent = (
                runs.number("fig6", ERROR, **method(f"{scheme}-{basis}", resolution=n))
                for basis in ("P1", "maxent")
            )
            gains[scheme, n] = linear / maxent
    least = min(gains.values())
    most = max(gains.values())
    because = f"on 8 to 64 nodes max-ent errors are {number_text(least)} to {number_text(most)} times smaller"
    return (HOLDS if least > 5.0 else FAILS), because


def maxent_order(runs: Runs) -> Answer:
    """Order of max-ent with consistent mass, and with lumped."""
    consistent = [
        runs.order("orders", ERROR, **method(name)) for name in ("MPM-maxent", "OTM-maxent")
    ]
    lumped = runs.order("orders", ERROR, **METHODS["MPM-maxent"], mass="lumped")
    because = (
        f"with consistent mass p = {_words(consistent[0])} (MPM) and {_words(consistent[1])} "
        f"(OTM), with lumped mass {_words(lumped)} (MPM)"
    )
    if all(_reads_as(order, 1.0, 2.0) for order in consistent):
        return HOLDS, because
    return (f"{HOLDS} when the mass is lumped" if _reads_as(lumped, 1.0, 2.0) else FAILS), because


def spline_order(runs: Runs) -> Answer:
    """Order of BSMPM and unified with both masses, and the limiting value of Fig. 6."""
    names = ("BSMPM", "unified")
    consistent = [runs.order("orders", ERROR, **method(name)) for name in names]
    lumped = [runs.order("orders", ERROR, **METHODS[name], mass="lumped") for name in names]
    limits = [runs.number("fig6", ERROR, **method(name, resolution=511)) for name in names]
    floor = runs.number("fig6", "predicted_temporal_floor", **method("unified", resolution=511))
    because = (
        f"with consistent mass p = {_words(consistent[0])} (BSMPM) and {_words(consistent[1])} "
        f"(unified), with lumped mass {_words(lumped[0])} and {_words(lumped[1])}; on 512 nodes "
        f"the errors are {limits[0]:.3g} and {limits[1]:.3g} m, and the time step alone makes "
        f"{floor:.3g} m"
    )
    limited = all(limit < 1.5 * floor for limit in limits)
    third = [all(_reads_as(order, 2.8, 3.2) for order in orders) for orders in (consistent, lumped)]
    if not (limited and third[0]):
        return FAILS, because
    return (HOLDS if third[1] else f"{HOLDS} when the mass is consistent"), because


def with_splines(runs: Runs) -> dict[str, float]:
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


def stays_stable(runs: Runs) -> Answer:
    """Break-downs of BSMPM and unified on grids that count as 81 nodes, and with the cut-off."""
    ends: dict[str, list[bool]] = {}
    for name in ("BSMPM", "unified"):
        for cells in NODES:
            for sign in SIGNS:
                for layout in LAYOUTS:
                    match = {"problem__domain_cells": cells, "problem__traction_amplitude": sign}
                    status = runs.status(
                        "breakdown", **METHODS[name], **match, problem__particle_layout=layout
                    )
                    ends.setdefault(f"{name} {'81' if cells < 83 else '85'}", []).append(
                        status == "ok"
                    )
    cut = [
        runs.status(
            "cutoff",
            method__mass_cutoff=CUTOFFS[2],
            problem__domain_cells=cells,
            problem__traction_amplitude=A,
        )
        for cells in NODES
        for A in SIGNS
    ]
    lost = {name: len(survived) - sum(survived) for name, survived in ends.items()}
    because = (
        f"BSMPM breaks down in {lost['BSMPM 81']} of {len(ends['BSMPM 81'])} set-ups that count as "
        f"81 nodes and in {lost['BSMPM 85']} of {len(ends['BSMPM 85'])} with 85, the unified "
        f"method in {lost['unified 81'] + lost['unified 85']} of all; with degrees of freedom "
        "below 1e-6 particle masses left out BSMPM breaks down in "
        f"{cut.count('broke_down') + cut.count('diverged')} of {len(cut)}"
    )
    if lost["unified 81"] or lost["unified 85"] or not lost["BSMPM 81"]:
        return FAILS, because
    cured = all(status == "ok" for status in cut)
    return (f"{HOLDS} when BSMPM keeps near-empty degrees of freedom" if cured else HOLDS), because


def edge_errors(runs: Runs) -> dict[str, float]:
    """Error of BSMPM in Fig. 7 with more quadrature points, and with another place of the load."""
    return {
        "few": _fig7(runs, "BSMPM", "last_particle", STRESS, 4),
        "many": _fig7(runs, "BSMPM", "last_particle", STRESS, 16),
        "moved": _fig7(runs, "BSMPM", "end_point", STRESS, 4),
    }


def better_than_mpm(runs: Runs) -> Answer:
    """OTM and unified against their MPM counterparts, with both places of the load."""
    wins = {}
    for traction in ("last_particle", "end_point"):
        for moving, fixed in PAIRS.items():
            wins[traction, "Fig. 7", moving] = _fig7(runs, moving, "end_point") < _fig7(
                runs, fixed, traction
            )
            errors = [_fig8(runs, moving, "end_point", 128), _fig8(runs, fixed, traction, 128)]
            wins[traction, "Fig. 8", moving] = errors[0] < errors[1]
    lost = [
        f"{name} in {where} (load: {load.replace('_', ' ')})"
        for (load, where, name), won in wins.items()
        if not won
    ]
    because = f"{sum(wins.values())} of {len(wins)} comparisons won" + (
        f"; lost: {', '.join(lost)}" if lost else ""
    )
    if not lost:
        return HOLDS, because
    as_paper = all(won for (traction, _, _), won in wins.items() if traction == "last_particle")
    return (
        f"{HOLDS} when MPM carries the load on its last particle" if as_paper else FAILS
    ), because


def unified_best(runs: Runs) -> Answer:
    """Rank of the unified method in Fig. 8, grid by grid, with both places of MPM's load."""
    first: dict[str, list[int]] = {}
    for traction in ("last_particle", "end_point"):
        for cells in (16, 32, 64, 128, 256):
            errors = {
                name: _fig8(runs, name, "end_point" if name in MOVING else traction, cells)
                for name in METHODS
            }
            rivals = [error for name, error in errors.items() if name not in ("unified", "BSMPM")]
            if min(errors["unified"], errors["BSMPM"]) <= min(rivals):
                first.setdefault(traction, []).append(cells)
    slopes = {}
    for name in METHODS:
        found = runs.order("fig8", ERROR, **method(name, method__traction="end_point"))
        slopes[name] = float(np.mean(found.local))
    steepest = max(slopes[name] for name in ("unified", "BSMPM")) >= max(slopes.values())
    best = {traction: ", ".join(map(str, cells)) for traction, cells in first.items()}
    because = (
        f"the unified method or BSMPM has the lowest error on {best.get('last_particle', 'none')} "
        "of 16, 32, 64, 128, 256 cells when MPM carries the load on its last particle, on "
        f"{best.get('end_point', 'none')} when at the end; mean slopes are {slopes['unified']:.2f} "
        f"(unified), {slopes['BSMPM']:.2f} (BSMPM), {slopes['OTM-maxent']:.2f} (OTM-maxent), "
        f"{slopes['MPM-maxent']:.2f} (MPM-maxent)"
    )
    everywhere = [len(first.get(traction, [])) == 5 for traction in ("last_particle", "end_point")]
    if all(everywhere) and steepest:
        return HOLDS, because
    if everywhere[0] and steepest:
        return f"{HOLDS} when MPM carries the load on its last particle", because
    return FAILS, because


def cheaper_81(runs: Runs) -> Answer:
    """Time of max-ent over that of B-splines on 512 nodes."""
    return _cheaper(runs, "table1", 2.0, {"resolution": 511})


def cheaper_82(runs: Runs) -> Answer:
    """Time of max-ent over that of B-splines for Fig. 7."""
    return _cheaper(runs, "fig7", 10.0, {"particles_per_cell": 4})


def _cheaper(runs: Runs, campaign: str, factor: float, where: dict[str, int]) -> Answer:
    gains: dict[str, list[float]] = {}
    for maxent, spline in (("MPM-maxent", "BSMPM"), ("OTM-maxent", "unified")):
        place: dict[str, str] = {}
        if campaign == "fig7":
            place = {"method__traction": "end_point" if maxent in MOVING else "last_particle"}
        fast = runs.number(
            campaign, TIME, **method(spline), timing_context="exclusive", **where, **place
        )
        for search in ("all", "local"):
            match = method(maxent, timing_context="exclusive", basis__search=search)
            gains.setdefault(search, []).append(
                runs.number(campaign, TIME, **match, **where, **place) / fast
            )
    texts = {
        search: " and ".join(f"{gain:.1f}" for gain in found) for search, found in gains.items()
    }
    because = (
        f"max-ent takes {texts['all']} times (MPM, OTM) as long as B-splines when it searches "
        f"among all nodes, {texts['local']} times when among near ones"
    )
    enough = {search: min(found) >= factor for search, found in gains.items()}
    if enough["local"] and enough["all"]:
        return HOLDS, because
    return (f"{HOLDS} when max-ent searches among all nodes" if enough["all"] else FAILS), because


def table_of_times(runs: Runs) -> Answer:
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
    because = (
        f"{met} of {len(texts)} ratios are within a factor of 1.5 of the paper's (in brackets): "
    )
    because += ", ".join(texts)
    return (HOLDS if met == len(texts) else FAILS), because


def _fig7(runs: Runs, name: str, traction: str, quantity: str = ERROR, particles: int = 4) -> float:
    more = {"basis__search": "local"} if METHODS[name]["basis"] == "maxent" else {}
    match = method(name, particles_per_cell=particles, method__traction=traction, **more)
    return runs.number("fig7", quantity, **match)


def _fig8(runs: Runs, name: str, traction: str, cells: int) -> float:
    return runs.number("fig8", ERROR, **method(name, resolution=cells, method__traction=traction))


def _words(order: OrderEstimate) -> str:
    return order_with_interval(order)


def _reads_as(order: OrderEstimate, low: float, high: float) -> bool:
    """Whether the order, a tenth aside, lies between two values."""
    return bool(low - 0.1 <= order.order <= high + 0.1)


CLAIMS = (
    Claim(
        "grid_crossing",
        "MPM-P1 loses second order to grid crossing, OTM-P1 keeps it",
        "Fig. 6",
        grid_crossing,
    ),
    Claim(
        "maxent_accurate",
        "Max-ent functions lead to significantly lower errors than piecewise-linear ones",
        "Fig. 6",
        maxent_accurate,
    ),
    Claim(
        "maxent_order",
        "With max-ent functions the order is between 1 and 2",
        "Fig. 6",
        maxent_order,
    ),
    Claim(
        "spline_order",
        "BSMPM and the unified method have order 3 until a limiting value",
        "Fig. 6",
        spline_order,
    ),
    Claim(
        "splines_inconsistent",
        "Quadratic B-splines are not consistent, so that Algorithm 2 cannot use them",
        "Sect. 4, 7",
        measure=with_splines,
        holds=lambda otm, unified: otm >= 1.02 * unified,
        sentence=(
            "with the degrees of freedom at the Greville abscissae Algorithm 2 runs with quadratic "
            "B-splines and gives {otm:.4g} m on the bar with traction, the unified method "
            "{unified:.4g} m"
        ),
    ),
    Claim(
        "stays_stable",
        "The unified method is stable with consistent mass where BSMPM breaks (81 nodes)",
        "Sect. 8.2",
        stays_stable,
    ),
    Claim(
        "edge_quadrature",
        "The errors at the right edge are due to quadrature",
        "Fig. 7",
        measure=edge_errors,
        holds=lambda few, many, moved: moved >= many,
        sentence=(
            "BSMPM, RMS stress error: {few:.3g} Pa with 4 particles per cell, {many:.3g} Pa with "
            "16, but {moved:.3g} Pa with 4 and the load at the end of the bar instead of the last "
            "particle, half a particle spacing inside"
        ),
    ),
    Claim(
        "better_than_mpm",
        "OTM and the unified method are more accurate than their MPM counterparts",
        "Figs. 7, 8",
        better_than_mpm,
    ),
    Claim(
        "unified_best",
        "The unified method and BSMPM have the lowest error and highest order",
        "Fig. 8",
        unified_best,
    ),
    Claim(
        "cheaper_81",
        "B-splines take at most half the time of max-ent functions (512 nodes)",
        "Table 1",
        cheaper_81,
    ),
    Claim(
        "cheaper_82",
        "B-splines are ten times cheaper than max-ent functions",
        "Sect. 8.2",
        cheaper_82,
    ),
    Claim("table1", "The ratios of computational times", "Table 1", table_of_times),
)
