"""The statements of the thesis, chapters 2 to 4, and the rules that judge them."""

from typing import Any

from mpmbench.papers.li2009.bar import BARS, STRETCHES
from mpmbench.papers.li2009.bar import GAMMAS as LOCALITIES
from mpmbench.papers.li2009.functions import GAMMAS, PUBLISHED, TOLERANCES
from mpmbench.papers.li2009.support import CONSISTENT, DENSITY, LUMPED, OTM, VELOCITY
from mpmbench.report.claims import Claims
from mpmbench.report.evidence import Runs

Answer = tuple[bool | str, str]
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
TIP = ("displacement_max", "displacement_min", "displacement_error", "velocity_max")
claim = Claims()


@claim(
    "Mean Newton steps per sample by gamma and tolerance",
    "Table 2.1",
    holds=lambda largest: largest <= 0.6,
    sentence="the counts of the plain method differ by at most {largest:.2f}",
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


@claim(
    "Newton's method needs a line search",
    "Sect. 2.2.4",
    holds=lambda plain, safe: plain > 50.0 and safe == 0.0,
    sentence=(
        "for gamma = 6.8 plain Newton fails at {plain:.0f} % of the samples; with a line "
        "search at {safe:.0f}"
    ),
)
def line_search(runs: Runs) -> dict[str, float]:
    """Samples [%] that fail without a line search at large gamma, most that fail with one."""
    match = {"basis__line_search": False, "basis__gamma": 6.8, "basis__tolerance": 1e-10}
    plain = runs.number("table2_1", "newton_failures_share", **match)
    match["basis__line_search"] = True
    with_search = [
        runs.number("table2_1", "newton_failures", **match | {"basis__gamma": gamma})
        for gamma in GAMMAS
    ]
    return {"plain": 100 * plain, "safe": max(with_search)}


def _rates(runs: Runs, quantity: str) -> dict[str, float]:
    """Orders of an error of the shock with consistent and with lumped mass."""

    def order(**match: Any) -> float:
        return runs.order("fig4_4", quantity, cells=(50, 100, 200), **match).slope

    return {
        "consistent": order(particles_per_cell=2, **OTM, **CONSISTENT),
        "lumped": order(**OTM, **LUMPED),
    }


@claim(
    "The velocity converges with 2.13, better than quadratic",
    "Fig. 4.4",
    holds=lambda consistent, lumped: abs(consistent - 2.13) < 0.15,
    sentence="consistent mass with position differences: {consistent:.2f}; lumped mass: {lumped:.2f}",
)
def velocity_rate(runs: Runs) -> dict[str, float]:
    """Orders of the velocity."""
    return _rates(runs, VELOCITY)


@claim("The density converges with 1.88", "Fig. 4.5")
def density_rate(runs: Runs) -> Answer:
    """1.88 with both masses, or with one of them."""
    found = _rates(runs, DENSITY)
    near = [mass for mass, rate in found.items() if abs(rate - 1.88) < 0.2]
    because = "consistent mass: {consistent:.2f}; lumped mass: {lumped:.2f}".format(**found)
    return len(near) == 2 or (bool(near) and f"when the mass is {near[0]}"), because


@claim(
    "The errors remain below 1e-7",
    "Sect. 4.1.3",
    holds=lambda error, square: error < 1e-7,
    sentence="with 200 cells the velocity error is {error:.1e} m^1.5/s; its square is {square:.1e}",
)
def error_level(runs: Runs) -> dict[str, float]:
    """Error of the velocity on the finest nodes, and its square."""
    error = runs.number("fig4_4", VELOCITY, resolution=200, **OTM, **LUMPED)
    return {"error": error, "square": error**2}


@claim("The shock is also followed in two and three dimensions", "Sect. 4.1.3")
def dimensions(runs: Runs) -> Answer:
    """Strip and cylinder with particles at barycentres, against the line: a factor of two."""
    line = runs.number("fig4_4", VELOCITY, resolution=50, **OTM, **LUMPED)
    barycentres: dict[str, Any] = {"basis__gradient": "exact", "particles_per_cell": 1}
    texts, good = [], []
    for gamma in (1.8, 4.0):
        match = OTM | {"basis__gamma": gamma}
        strip = runs.number("fig4_7", VELOCITY, **barycentres, **match) / line
        cylinder = runs.number("fig4_9", VELOCITY, **match) / line
        texts.append(f"{strip:.1f} and {cylinder:.1f} (gamma {gamma:g})")
        if max(strip, cylinder) <= 2.0:
            good.append(f"when gamma is {gamma:g}")
    because = f"velocity error over that of the line, strip and cylinder: {', '.join(texts)}"
    return len(good) == 2 or (bool(good) and good[0]), because


@claim("OTM agrees with finite elements, also on nonuniform nodes", "Figs. 4.12, 4.13")
def bar(runs: Runs) -> Answer:
    """The tip of the bar, within the tolerances that linear elements meet."""

    def tip(name: str) -> tuple[bool, float]:
        top, low, error, speed = (
            runs.number("fig4_12", f"tip_{quantity}", **BARS[name]) for quantity in TIP
        )
        near = abs(top / AMPLITUDE - 1.0) <= 0.03 and abs(low / AMPLITUDE + 1.0) <= 0.06
        return near and error <= 0.03 and speed <= SPEED, error

    elements = max(tip(name)[1] for name in ("linear FEM", "linear FEM, irregular nodes"))
    found = {name: tip(name) for name in COMPARED}
    errors = [error for _, error in found.values()]
    because = (
        f"relative errors of the tip's displacement: OTM {min(errors):.3f} to {max(errors):.3f}, "
        f"linear elements at most {elements:.3f}"
    )
    bad = [name for name, (good, _) in found.items() if not good]
    if not bad:
        return True, because
    more = all("1 particle" in name for name in bad) and "when there are two particles per cell"
    return more, f"{because}; beyond the tolerances: {', '.join(bad)}"


@claim(
    "Standard SPH cannot solve the bar in tension",
    "Sect. 4.2.2",
    holds=lambda plain, error: plain != "ok" and error > 0.3,
    sentence=(
        "SPH ends with status {plain}; with symmetric derivatives the relative error is {error:.2f}"
    ),
)
def sph(runs: Runs) -> dict[str, Any]:
    """How standard SPH ends, and the error of SPH with symmetric derivatives."""
    match = BARS["SPH, symmetric derivatives"]
    return {
        "plain": runs.status("fig4_12", **BARS["SPH"]),
        "error": runs.number("fig4_12", "tip_displacement_error", **match),
    }


@claim(
    "A spurious mode occurs in the bar with nodal integration",
    "Sect. 4.2.2",
    holds=lambda error, speed: error > 0.1 or speed > SPEED,
    sentence=(
        "with local max-ent functions the relative error is {error:.3f}, the largest speed "
        "{speed:.2f} m/s"
    ),
)
def nodal_integration(runs: Runs) -> dict[str, float]:
    """Largest error and speed of the tip with nodal integration (in the thesis: with EFG)."""
    names = ("nodal integration, updated functions", "nodal integration, frozen functions")
    found = {"error": "tip_displacement_error", "speed": "tip_velocity_max"}
    return {
        key: max(runs.number("fig4_12", quantity, **BARS[name]) for name in names)
        for key, quantity in found.items()
    }


@claim("OTM completely avoids the tensile instability", "Sect. 4.2.1")
def tensile_instability(runs: Runs) -> Answer:
    """No instability of a stretched bar, for any gamma of the map or for the larger ones."""
    limits: dict[float, float] = {}
    for gamma in LOCALITIES:
        for s in STRETCHES:
            match = {"basis__gamma": gamma, "problem__stretch": s}
            finished = runs.status("stability", **match) == "ok"
            if not finished or runs.number("stability", "growth", **match) > UNSTABLE:
                limits.setdefault(gamma, s)
    if not limits:
        return True, f"no disturbance grows to a stretch of {STRETCHES[-1]:g}"
    words = ", ".join(f"{limit:g} (gamma {gamma:g})" for gamma, limit in limits.items())
    stable = [gamma for gamma in LOCALITIES if gamma > max(limits)]
    return bool(stable) and f"when gamma is {stable[0]:g} or more", (
        f"a disturbance grows from a stretch of {words}; the largest stretch tried is "
        f"{STRETCHES[-1]:g}"
    )
