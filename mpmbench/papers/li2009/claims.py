"""The statements of the thesis, chapters 2 to 4, and the rules that judge them."""

from typing import Any

from mpmbench.papers.li2009.bar import BARS, STRETCHES
from mpmbench.papers.li2009.bar import GAMMAS as LOCALITIES
from mpmbench.papers.li2009.functions import GAMMAS, PUBLISHED, TOLERANCES
from mpmbench.papers.li2009.support import CONSISTENT, DENSITY, LUMPED, OTM, VELOCITY
from mpmbench.report.claims import FAILS, HOLDS, Claim, Runs

AMPLITUDE = 3.2975e-5  # of the tip [m]
SPEED = 7.0  # of the tip [m/s] with the overshoot of fronts on a mesh; the exact one is 5
UNSTABLE = 100.0  # growth of a disturbance
COMPARED = (
    "OTM, lumped mass, nodal velocities",
    "OTM, consistent mass",
    "OTM, lumped, irregular nodes",
    "OTM, consistent, irregular nodes",
    "OTM, lumped, 1 particle per cell",
    "OTM, lumped, irregular, 1 particle per cell",
)


def newton_counts(runs: Runs) -> dict[str, float]:
    """Largest difference from Table 2.1."""
    differences = []
    for gamma in GAMMAS:
        for tolerance, published in zip(TOLERANCES, PUBLISHED[gamma], strict=True):
            match = {"basis__gamma": gamma, "basis__tolerance": tolerance}
            steps = runs.number("table2_1", "newton_steps_mean", **match, basis__line_search=False)
            differences.append(abs(steps - published))
    return {"largest": max(differences)}


def newton_failures(runs: Runs) -> dict[str, float]:
    """Samples [%] that fail without a line search at large gamma, most that fail with one."""
    safe = {"basis__line_search": True}
    match = {"basis__line_search": False, "basis__gamma": 6.8, "basis__tolerance": 1e-10}
    plain = runs.number("table2_1", "newton_failures_share", **match)
    with_search = [
        runs.number(
            "table2_1", "newton_failures", **safe, basis__gamma=gamma, basis__tolerance=1e-10
        )
        for gamma in GAMMAS
    ]
    return {"plain": 100 * plain, "safe": max(with_search)}


def rates(runs: Runs, quantity: str) -> dict[str, float]:
    """Orders of an error of the shock with consistent and with lumped mass."""

    def order(**match: Any) -> float:
        return runs.order("fig4_4", quantity, cells=(50, 100, 200), **match).order

    return {
        "consistent": order(particles_per_cell=2, **OTM, **CONSISTENT),
        "lumped": order(**OTM, **LUMPED),
    }


def density_holds(consistent: float, lumped: float) -> bool | str:
    """1.88 with both masses, or with one of them."""
    near = [abs(rate - 1.88) < 0.2 for rate in (consistent, lumped)]
    return all(near) or (
        any(near) and "when the mass is " + ("lumped" if near[1] else "consistent")
    )


def error_level(runs: Runs) -> dict[str, float]:
    """Error of the velocity on the finest nodes, and its square."""
    error = runs.number("fig4_4", VELOCITY, resolution=200, **OTM, **LUMPED)
    return {"error": error, "square": error**2}


def more_dimensions(runs: Runs) -> tuple[str, str]:
    """Strip and cylinder with particles at barycentres, against the line: a factor of two."""
    line = runs.number("fig4_4", VELOCITY, resolution=50, **OTM, **LUMPED)
    ratios = {}
    for gamma in (1.8, 4.0):
        match = OTM | {"basis__gamma": gamma}
        strip = runs.number(
            "fig4_7", VELOCITY, basis__gradient="exact", particles_per_cell=1, **match
        )
        ratios[gamma] = [strip / line, runs.number("fig4_9", VELOCITY, **match) / line]
    because = "velocity error over that of the line, strip and cylinder: " + ", ".join(
        f"{two:.1f} and {three:.1f} (gamma {gamma:g})" for gamma, (two, three) in ratios.items()
    )
    good = [gamma for gamma, found in ratios.items() if max(found) <= 2.0]
    if len(good) == len(ratios):
        return HOLDS, because
    return (f"holds when gamma is {good[0]:g}" if good else FAILS), because


def irregular_density(runs: Runs) -> tuple[str, str]:
    """Unstructured nodes."""
    plain = runs.order(
        "irregular", DENSITY, cells=(50, 100), basis__gradient="exact", **OTM, **LUMPED
    ).order
    mended = runs.order(
        "irregular", DENSITY, cells=(50, 100), basis__gradient="consistent", **OTM, **LUMPED
    ).order
    answer = (
        HOLDS
        if plain > 1.5
        else f"holds when gradients are corrected to integrate exactly ({mended:.2f})"
    )
    if plain <= 1.5 and mended < 1.0:
        answer = FAILS
    return (
        answer,
        f"density rate {plain:.2f} with derivatives as they are, {mended:.2f} with corrected "
        "gradients",
    )


def bar_as_fem(runs: Runs) -> tuple[str, str]:
    """The tip of the bar, within the tolerances that linear elements meet."""

    def far(name: str) -> tuple[bool, float]:
        top, low, error, speed = (
            runs.number("fig4_12", quantity, **BARS[name])
            for quantity in (
                "tip_displacement_max",
                "tip_displacement_min",
                "tip_displacement_error",
                "tip_velocity_max",
            )
        )
        near = abs(top / AMPLITUDE - 1.0) <= 0.03 and abs(low / AMPLITUDE + 1.0) <= 0.06
        return not (near and error <= 0.03 and speed <= SPEED), error

    elements = max(far(name)[1] for name in ("linear FEM", "linear FEM, irregular nodes"))
    found = {name: far(name) for name in COMPARED}
    because = (
        f"relative errors of the tip's displacement: OTM {min(e for _, e in found.values()):.3f} "
        f"to {max(e for _, e in found.values()):.3f}, linear elements at most {elements:.3f}"
    )
    bad = [name for name, (outside, _) in found.items() if outside]
    if not bad:
        return HOLDS, because
    rest = (
        "holds when there are two particles per cell"
        if all("1 particle" in name for name in bad)
        else FAILS
    )
    return rest, f"{because}; beyond the tolerances: {', '.join(bad)}"


def avoids_tensile_instability(runs: Runs) -> tuple[str, str]:
    """No instability of a stretched bar, for any gamma of the map or for the larger ones."""
    limits: dict[float, float | None] = {}
    for gamma in LOCALITIES:
        unstable = [
            s
            for s in STRETCHES
            if runs.status("stability", basis__gamma=gamma, problem__stretch=s) != "ok"
            or runs.number("stability", "growth", basis__gamma=gamma, problem__stretch=s) > UNSTABLE
        ]
        limits[gamma] = min(unstable, default=None)
    worst = max((gamma for gamma, limit in limits.items() if limit), default=None)
    if worst is None:
        return HOLDS, f"no disturbance grows to a stretch of {STRETCHES[-1]:g}"
    words = ", ".join(f"{limit:g} (gamma {gamma:g})" for gamma, limit in limits.items() if limit)
    stable = [gamma for gamma in LOCALITIES if gamma > worst]
    answer = f"holds when gamma is {stable[0]:g} or more" if stable else FAILS
    return (
        answer,
        f"a disturbance grows from a stretch of {words}; the largest stretch tried is "
        f"{STRETCHES[-1]:g}",
    )


def sph_error(runs: Runs) -> dict[str, Any]:
    """How standard SPH ends, and the error of SPH with symmetric derivatives."""
    match = BARS["SPH, symmetric derivatives"]
    return {
        "plain": runs.status("fig4_12", **BARS["SPH"]),
        "error": runs.number("fig4_12", "tip_displacement_error", **match),
    }


def nodal_integration(runs: Runs) -> dict[str, float]:
    """Largest error and speed of the tip with nodal integration (in the thesis: with EFG)."""
    names = ("nodal integration, updated functions", "nodal integration, frozen functions")
    found = {"error": "tip_displacement_error", "speed": "tip_velocity_max"}
    return {
        key: max(runs.number("fig4_12", quantity, **BARS[name]) for name in names)
        for key, quantity in found.items()
    }


def energy_left(runs: Runs) -> dict[str, float]:
    """Energy left at the end [%], position differences with either mass."""
    names = {
        "consistent": "OTM, consistent mass",
        "lumped": "OTM, lumped, position differences, 1 particle",
    }
    return {
        mass: 100 * runs.number("fig4_12", "total_energy_end", **BARS[name])
        for mass, name in names.items()
    }


CLAIMS = (
    Claim(
        "newton_counts",
        "Mean Newton steps per sample by gamma and tolerance",
        "Table 2.1",
        measure=newton_counts,
        holds=lambda largest: largest <= 0.6,
        sentence="the counts of the plain method differ by at most {largest:.2f}",
    ),
    Claim(
        "line_search",
        "Newton's method needs a line search",
        "Sect. 2.2.4",
        measure=newton_failures,
        holds=lambda plain, safe: plain > 50.0 and safe == 0.0,
        sentence=(
            "for gamma = 6.8 plain Newton fails at {plain:.0f} % of the samples; with a line "
            "search at {safe:.0f}"
        ),
    ),
    Claim(
        "velocity_rate",
        "The velocity converges with 2.13, better than quadratic",
        "Fig. 4.4",
        measure=lambda runs: rates(runs, VELOCITY),
        holds=lambda consistent, lumped: abs(consistent - 2.13) < 0.15,
        sentence=(
            "consistent mass with position differences: {consistent:.2f}; lumped mass: {lumped:.2f}"
        ),
    ),
    Claim(
        "density_rate",
        "The density converges with 1.88",
        "Fig. 4.5",
        measure=lambda runs: rates(runs, DENSITY),
        holds=density_holds,
        sentence="consistent mass: {consistent:.2f}; lumped mass: {lumped:.2f}",
    ),
    Claim(
        "error_level",
        "The errors remain below 1e-7",
        "Sect. 4.1.3",
        measure=error_level,
        holds=lambda error, square: error < 1e-7,
        sentence=(
            "with 200 cells the velocity error is {error:.1e} m^1.5/s; its square is {square:.1e}"
        ),
    ),
    Claim(
        "dimensions",
        "The shock is also followed in two and three dimensions",
        "Sect. 4.1.3",
        more_dimensions,
    ),
    Claim(
        "irregular",
        "Convergence does not depend on structured nodes",
        "Sects. 1, 4",
        irregular_density,
    ),
    Claim(
        "bar",
        "OTM agrees with finite elements, also on nonuniform nodes",
        "Figs. 4.12, 4.13",
        bar_as_fem,
    ),
    Claim(
        "sph",
        "Standard SPH cannot solve the bar in tension",
        "Sect. 4.2.2",
        measure=sph_error,
        holds=lambda plain, error: plain != "ok" and error > 0.3,
        sentence=(
            "SPH ends with status {plain}; with symmetric derivatives the relative error is "
            "{error:.2f}"
        ),
    ),
    Claim(
        "nodal_integration",
        "A spurious mode occurs in the bar with nodal integration",
        "Sect. 4.2.2",
        measure=nodal_integration,
        holds=lambda error, speed: error > 0.1 or speed > SPEED,
        sentence=(
            "with local max-ent functions the relative error is {error:.3f}, the largest speed "
            "{speed:.2f} m/s"
        ),
    ),
    Claim(
        "tensile_instability",
        "OTM completely avoids the tensile instability",
        "Sect. 4.2.1",
        avoids_tensile_instability,
    ),
    Claim(
        "energy",
        "The discrete motion of Eqs. 3.88-3.91 keeps its energy",
        "Sect. 3.2.3",
        measure=energy_left,
        holds=lambda consistent, lumped: (
            abs(consistent - 100.0) < 1.0 and lumped < 50.0 and "when the mass is consistent"
        ),
        sentence=(
            "of the energy {consistent:.1f} % is left with a consistent mass, {lumped:.1f} % with "
            "a lumped one"
        ),
    ),
)
