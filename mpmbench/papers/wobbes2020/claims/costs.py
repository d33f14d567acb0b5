"""Claims on computational times (Table 1 and Sect. 8.2)."""

import numpy as np

from mpmbench.papers.wobbes2020.claims.judging import TIME, TIME_WITHIN, Answer, claim
from mpmbench.papers.wobbes2020.support import MOVING, PAIRS, method, searched
from mpmbench.papers.wobbes2020.table1 import PAPER, ratios
from mpmbench.report.evidence import Evidence, MissingRuns, Runs
from mpmbench.report.timing import clock_in


@claim(
    "B-splines take at most half the time of max-ent functions (512 nodes)",
    "Sect. 8.1, Table 1",
    quote="replacing maxent by B-spline basis functions reduces the computational time by at least "
    "a factor of 2",
    threshold="max-ent takes at least 2 times as long, with MPM and with OTM",
)
def cheaper_81(runs: Runs) -> Answer:
    """Time of max-ent over that of B-splines on 512 nodes."""
    gains = _gains(runs, "table1", {"resolution": 511})
    return {scheme: gain >= 2.0 for scheme, gain in gains.items()}, _words(runs, gains)


@claim(
    "B-splines are about ten times cheaper than max-ent functions",
    "Sect. 8.2, Fig. 7",
    quote="the unified approach and BSMPM computations are approximately 10 times faster than the "
    "OTM and MPM computations with maxent basis functions (without a search algorithm)",
    threshold=f"{TIME} with 10",
)
def cheaper_82(runs: Runs) -> Answer:
    """Time of max-ent over that of B-splines for Fig. 7."""
    gains = _gains(runs, "fig7", {"particles_per_cell": 4})
    near = {scheme: 1 / TIME_WITHIN <= gain / 10.0 <= TIME_WITHIN for scheme, gain in gains.items()}
    return near, _words(runs, gains)


def _gains(runs: Runs, campaign: str, where: dict[str, int]) -> dict[str, float]:
    """Times of max-ent over those of B-splines, for MPM and OTM."""
    clock = clock_in(runs.campaigns, campaign).quantity
    search = runs.choice("search", "all")
    gains = {}
    for maxent, spline in (("MPM-maxent", "BSMPM"), ("OTM-maxent", "unified")):
        place: dict[str, str] = {}
        if campaign == "fig7":
            place = {"method__traction": "end_point" if maxent in MOVING else "last_particle"}
        slow, fast = (
            runs.number(
                campaign,
                clock,
                **method(name, timing_context="exclusive"),
                **searched(name, search),
                **where,
                **place,
            )
            for name in (maxent, spline)
        )
        gains[maxent.split("-")[0]] = slow / fast
    return gains


def _words(runs: Runs, gains: dict[str, float]) -> str:
    times = " and ".join(f"{gain:.1f} ({scheme})" for scheme, gain in gains.items())
    among = "all" if runs.choice("search", "all") == "all" else "near"
    return f"max-ent, searching among {among} nodes, takes {times} times as long as B-splines"


@claim(
    "On the coarse grid MPM is cheaper than OTM",
    "Sect. 8.1, Table 1",
    quote="For the coarse discretization, the MPM scheme-based approaches outperform the ones "
    "adopting the OTM algorithm",
    threshold="with 32 nodes each MPM method takes less time than its OTM counterpart",
)
def coarse_cheaper(runs: Runs) -> Answer:
    """Times of OTM and the unified method over those of their MPM counterparts, 32 nodes."""
    clock = clock_in(runs.campaigns, "table1").quantity
    search = runs.choice("search", "all")
    over = {}
    for moving, fixed in PAIRS.items():
        times = [
            runs.number("table1", clock, **method(name, resolution=31), **searched(name, search))
            for name in (moving, fixed)
        ]
        over[f"{moving} over {fixed}"] = times[0] / times[1]
    words = ", ".join(f"{name} {value:.2f}" for name, value in over.items())
    return {name: value > 1.0 for name, value in over.items()}, f"times on 32 nodes: {words}"


@claim(
    "The ratios of computational times",
    "Table 1",
    quote="Computational time required for the considered methods normalized with respect to the "
    "MPM-P1 computational time with the corresponding number of nodes",
    threshold=f"{TIME} with those printed, all ten ratios",
)
def table1(runs: Runs) -> Answer:
    """How many of the paper's ten ratios are met."""
    if "table1" not in runs.campaigns:
        raise MissingRuns("there is no campaign table1")
    search = runs.choice("search", "all")
    met, texts = {}, []
    for cells, column in PAPER.items():
        for name, paper in column.items():
            found, files = ratios(runs.campaigns["table1"], name, cells, search)
            ours = float(np.median(found))
            what = f"{name}, {cells + 1} nodes"
            runs.evidence.append(Evidence(f"{what}: time over MPM-P1", ours, files))
            met[what] = 1 / TIME_WITHIN <= ours / paper <= TIME_WITHIN
            texts.append(f"{name} {ours:.2f} ({paper:.2f})")
    counted = f"{sum(met.values())} of {len(met)} ratios agree with the paper's"
    return met, f"{counted} (in brackets): {', '.join(texts)}"
