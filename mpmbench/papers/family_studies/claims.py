"""What the runs of the studies say of claims that papers are cited for."""

from mpmbench.papers.family_studies.support import (
    CANTILEVER,
    CELLS,
    INNER,
    STRETCHES,
    TRACTION,
    WAVES,
)
from mpmbench.report.claims import Claims, Holds
from mpmbench.report.evidence import MissingRuns, Runs

Answer = tuple[Holds, str]
claim = Claims()
EXACT = 0.042  # late maximum of the cantilever's corner [m]
NEAR = 0.05  # of it [m]
AGREES = 0.1  # relative difference of rates
SURE = 0.2  # a rate [1/s] at which a disturbance must grow a million times in 100 s


def _rate(runs: Runs, name: str, stretch: float) -> float:
    return runs.known("waves", "growth_rate_predicted", problem__stretch=stretch, **WAVES[name])


@claim(
    "DDMP and B-splines have no noise of particles that cross cells",
    "Zhang, Ma and Giguere 2011; Steffen, Kirby and Berzins 2008",
    threshold="on the bar with a dynamic traction at 0.9 s, where particles cross, their stress error behind the "
    "wave is a fifth of that of hats or less on 64 to 256 cells, and falls with every refinement",
)
def crossing_noise(runs: Runs) -> Answer:
    """Stress errors behind the wave."""
    errors = {
        name: [runs.number("traction", INNER, resolution=n, **TRACTION[name]) for n in CELLS]
        for name in ("hats", "DDMP", "splines")
    }
    crossings = runs.number("traction", "n_cell_crossings", resolution=64, **TRACTION["hats"])
    if crossings == 0.0:
        raise MissingRuns("traction: no particle crosses a cell")
    answer = {}
    for name in ("DDMP", "splines"):
        own = errors[name]
        answer[f"{name}: smaller"] = all(
            a <= 0.2 * b for a, b in zip(own, errors["hats"], strict=True)
        )
        answer[f"{name}: falls"] = own[0] > own[1] > own[2]
    words = "; ".join(
        f"{name} {', '.join(f'{one:.2g}' for one in found)} Pa" for name, found in errors.items()
    )
    return answer, f"from {CELLS[0]} to {CELLS[-1]} cells: {words}"


@claim(
    "Lagrangian kernels have no tensile instability, Eulerian ones do",
    "Belytschko, Guo, Liu and Xiao 2000; Li 2009, Sect. 4.2",
    threshold="local max-ent functions, points between nodes: no wave grows at any stretch of 0.8 to 2 with "
    "functions that are kept, and some do in tension with functions that are evaluated anew",
)
def kernels(runs: Runs) -> Answer:
    """Predicted rates of growth."""
    kept = {s: _rate(runs, "LME, Lagrangian", s) for s in STRETCHES}
    anew = {s: _rate(runs, "LME, Eulerian", s) for s in STRETCHES}
    tension = [s for s in STRETCHES if s > 1.0 and anew[s] > 0.0]
    grows = ", ".join(f"{anew[s]:.2g}/s at {s:g}" for s in tension) or "at no stretch"
    stable = (
        "none grows"
        if not any(kept.values())
        else f"the fastest grows at {max(kept.values()):.2g}/s"
    )
    return (
        {"kept: stable": not any(kept.values()), "evaluated anew: unstable": bool(tension)},
        f"with functions that are kept {stable}; with functions evaluated anew {grows}",
    )


@claim(
    "Growth in time is that of the analysis",
    "Li 2009, Eqs. 4.28 to 4.30",
    threshold="wherever a disturbance grew a million times, its rate is within 10 % of the predicted one, and it did "
    "nowhere else",
)
def agreement(runs: Runs) -> Answer:
    """Both rates of all runs that have them."""
    off, count, silent = 0.0, 0, []
    for name, match in WAVES.items():
        for stretch in STRETCHES:
            given = {"problem__stretch": stretch, **match}
            try:
                predicted = runs.known("waves", "growth_rate_predicted", **given)
            except MissingRuns:
                continue
            try:
                seen = runs.known("waves", "growth_rate", **given)
            except MissingRuns:
                if predicted > SURE and runs.known("waves", "growth", **given) < 1e6:
                    silent.append(f"{name} at {stretch:g}")
                continue
            off, count = (
                max(off, abs(seen / predicted - 1.0) if predicted > 0.0 else 1.0),
                count + 1,
            )
    if count == 0:
        raise MissingRuns("waves: no disturbance has grown")
    answer = {"rates agree": off <= AGREES, "what should grow does": not silent}
    return answer, f"{count} rates, the worst off by {100.0 * off:.1f} %" + (
        f"; no growth is seen of {', '.join(silent)}" if silent else ""
    )


@claim(
    "SCNI eliminates the spurious modes of direct nodal integration",
    "Chen, Wu, Yoon and You 2001",
    threshold="in the bar as it was, the wave of two cells has a frequency above a tenth of the exact one with SCNI, "
    "and not with direct nodal integration",
)
def spurious_modes(runs: Runs) -> Answer:
    """Frequencies of the shortest wave."""
    ratio = {
        name: runs.number("waves", "shortest_wave", problem__stretch=1.0, **WAVES[name])
        for name in ("MLS, Lagrangian, nodal", "MLS, Lagrangian, SCNI", "LME, Lagrangian")
    }
    nodal, scni, between = ratio.values()
    return (
        {"direct: has one": nodal < 0.1, "SCNI: has none": scni > 0.1},
        f"over the exact one the frequency of the shortest wave is {nodal:.2g} with direct integration, {scni:.2g} "
        f"with SCNI and {between:.2g} with points between nodes (LME): means over cells do not see it either",
    )


@claim(
    "Total-Lagrangian and moving-mesh methods keep a large motion that updated MPM loses",
    "de Vaucorbeil, Nguyen and Hutchinson 2020; Wobbes et al. 2020",
    threshold=f"the corner of the cantilever comes back to within {NEAR:g} m of +0.042 m with tlmpm and "
    "moving_mesh_mpm, and with updated MPM (hats) it does not",
)
def cantilever(runs: Runs) -> Answer:
    """Late maxima."""
    names = {
        "tlmpm, hats": "TLMPM, hats (tlmpm)",
        "tlmpm, splines": "TLMPM, splines (tlmpm)",
        "moving_mesh_mpm": "moving mesh (moving_mesh_mpm)",
        "updated MPM": "MPM, hats",
    }
    answer, words = {}, []
    for short, name in names.items():
        match = CANTILEVER[name]
        done = runs.status("cantilever", **match) == "ok"
        late = runs.number("cantilever", "late_maximum", **match) if done else float("nan")
        near = abs(late - EXACT) <= NEAR
        answer[short] = near if short != "updated MPM" else not near
        words.append(f"{short} {late:+.3f} m" if done else f"{short} breaks down")
    return answer, ", ".join(words)
