"""The statements of the thesis, chapters 2 to 4, and the rules that judge them."""

from mpmbench.report.claims import FAILS, HOLDS, Runs
from mpmbench.report.papers.li2009.bar import BARS
from mpmbench.report.papers.li2009.functions import GAMMAS, PUBLISHED, TOLERANCES
from mpmbench.report.papers.li2009.support import CONSISTENT, DENSITY, LUMPED, OTM, VELOCITY

AMPLITUDE = 3.2975e-5  # of the tip [m]


def newton_counts(runs: Runs) -> tuple[str, str]:
    """Table 2.1 within 0.6."""
    largest = 0.0
    for gamma in GAMMAS:
        for tolerance, published in zip(TOLERANCES, PUBLISHED[gamma], strict=True):
            match = {"basis__gamma": gamma, "basis__tolerance": tolerance, "basis__line_search": False}
            largest = max(largest, abs(runs.number("table2_1", "newton_steps_mean", **match) - published))
    return (HOLDS if largest <= 0.6 else FAILS), f"the counts of the plain method differ by at most {largest:.2f}"


def line_search_needed(runs: Runs) -> tuple[str, str]:
    """Plain Newton diverges at large gamma."""
    match = {"basis__gamma": 6.8, "basis__tolerance": 1e-10}
    plain = runs.number("table2_1", "newton_failures_share", basis__line_search=False, **match)
    safe = max(
        runs.number("table2_1", "newton_failures", basis__line_search=True, basis__gamma=g, basis__tolerance=1e-10)
        for g in GAMMAS
    )
    holds = plain > 0.5 and safe == 0.0
    return (HOLDS if holds else FAILS), (
        f"for gamma = 6.8 plain Newton fails at {100 * plain:.0f} % of the samples; with a line search at {safe:.0f}"
    )


def velocity_rate(runs: Runs) -> tuple[str, str]:
    """2.13, better than quadratic."""
    thesis = runs.order("fig4_4", VELOCITY, cells=(50, 100, 200), particles_per_cell=2, **OTM, **CONSISTENT).order
    lumped = runs.order("fig4_4", VELOCITY, cells=(50, 100, 200), **OTM, **LUMPED).order
    answer = HOLDS if abs(thesis - 2.13) < 0.15 else FAILS
    return answer, f"consistent mass with position differences: {thesis:.2f}; lumped mass: {lumped:.2f}"


def density_rate(runs: Runs) -> tuple[str, str]:
    """1.88 on uniform nodes."""
    thesis = runs.order("fig4_4", DENSITY, cells=(50, 100, 200), particles_per_cell=2, **OTM, **CONSISTENT).order
    lumped = runs.order("fig4_4", DENSITY, cells=(50, 100, 200), **OTM, **LUMPED).order
    near = [rate for rate in (thesis, lumped) if abs(rate - 1.88) < 0.2]
    answer = (
        HOLDS
        if len(near) == 2
        else "holds when the mass is " + ("lumped" if abs(lumped - 1.88) < 0.2 else "consistent")
    )
    return (answer if near else FAILS), f"consistent mass: {thesis:.2f}; lumped mass: {lumped:.2f}"


def error_level(runs: Runs) -> tuple[str, str]:
    """Errors below 1e-7."""
    smallest = runs.number("fig4_4", VELOCITY, resolution=200, **OTM, **LUMPED)
    return (HOLDS if smallest < 1e-7 else FAILS), f"with 200 cells the velocity error is {smallest:.1e} m^1.5/s"


def irregular_density(runs: Runs) -> tuple[str, str]:
    """Unstructured nodes."""
    plain = runs.order("irregular", DENSITY, cells=(50, 100), basis__gradient="exact", **OTM, **LUMPED).order
    mended = runs.order("irregular", DENSITY, cells=(50, 100), basis__gradient="consistent", **OTM, **LUMPED).order
    answer = HOLDS if plain > 1.5 else f"holds when gradients are corrected to integrate exactly ({mended:.2f})"
    if plain <= 1.5 and mended < 1.0:
        answer = FAILS
    return answer, f"density rate {plain:.2f} with derivatives as they are, {mended:.2f} with corrected gradients"


def bar_as_fem(runs: Runs) -> tuple[str, str]:
    """The tip of the bar, uniform and irregular nodes."""
    names = list(BARS)[:6]
    worst = max(runs.number("fig4_12", "tip_displacement_error", **BARS[name]) for name in names)
    highest = max(runs.number("fig4_12", "tip_displacement_max", **BARS[name]) for name in names) / AMPLITUDE
    holds = worst <= 0.03 and highest <= 1.03
    return (
        HOLDS if holds else FAILS
    ), f"relative error at most {worst:.3f}, largest displacement {highest:.3f} of the exact"


def sph_fails(runs: Runs) -> tuple[str, str]:
    """Standard SPH cannot solve the bar."""
    plain = runs.status("fig4_12", **BARS["SPH"])
    symmetric = runs.number("fig4_12", "tip_displacement_error", **BARS["SPH, symmetric derivatives"])
    holds = plain != "ok" and symmetric > 0.3
    return (HOLDS if holds else FAILS), (
        f"SPH ends with status {plain}; with symmetric derivatives the relative error is {symmetric:.2f}"
    )


def avoids_tensile_instability(runs: Runs) -> tuple[str, str]:
    """No instability of a stretched bar."""
    stretches = (1.1, 1.2, 1.3, 1.4, 1.5, 1.6, 1.8, 2.0)
    limits = {}
    for gamma in (0.8, 1.8, 4.0):
        unstable = [
            s
            for s in stretches
            if runs.status("stability", basis__gamma=gamma, problem__stretch=s) != "ok"
            or runs.number("stability", "growth", basis__gamma=gamma, problem__stretch=s) > 100.0
        ]
        limits[gamma] = min(unstable, default=None)
    words = ", ".join(
        f"gamma {gamma:g}: " + (f"unstable from {limit:g}" if limit else "stable to 2")
        for gamma, limit in limits.items()
    )
    if not any(limits.values()):
        return HOLDS, words
    return "holds when gamma is 4 or more" if limits[4.0] is None else FAILS, words


def energy_kept(runs: Runs) -> tuple[str, str]:
    """Position differences with either mass."""
    kept = runs.number("fig4_12", "total_energy_end", **BARS["OTM, consistent mass"])
    lost = runs.number("fig4_12", "total_energy_end", **BARS["OTM, lumped, position differences, 1 particle"])
    answer = "holds when the mass is consistent" if abs(kept - 1.0) < 0.01 and lost < 0.5 else FAILS
    return (
        answer,
        f"of the energy {100 * kept:.1f} % is left with a consistent mass, {100 * lost:.1f} % with a lumped one",
    )
