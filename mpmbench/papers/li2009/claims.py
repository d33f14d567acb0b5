"""The statements of the thesis, chapters 2 to 5.1, and the rules that judge them."""

from typing import Any

from mpmbench.analysis.estimate import OrderEstimate, slopes_text
from mpmbench.papers.li2009.bar import BARS, STRETCHES
from mpmbench.papers.li2009.bar import GAMMAS as LOCALITIES
from mpmbench.papers.li2009.functions import GAMMAS, PUBLISHED, TOLERANCES
from mpmbench.papers.li2009.support import CONSISTENT, DENSITY, LUMPED, OTM, VELOCITY
from mpmbench.report.claims import Claims, Holds, SetUp
from mpmbench.report.evidence import Runs

Answer = tuple[Holds, str]
AMPLITUDE = 3.2975e-5  # of the tip [m]
SPEED = 7.0  # of the tip [m/s] with the overshoot of fronts on a mesh; the exact one is 5
UNSTABLE = 100.0  # growth of a disturbance
CELLS = (50, 100, 200)  # of the shock in 1D
FEM = {"method": "linear_fem"}
COMPARED = (
    "OTM, lumped mass, nodal velocities",
    "OTM, consistent mass",
    "OTM, lumped, irregular nodes",
    "OTM, consistent, irregular nodes",
    "OTM, lumped, 1 particle per cell",
    "OTM, lumped, irregular, 1 particle per cell",
)
TIP = ("displacement_max", "displacement_min", "displacement_error", "velocity_max")
ROD: dict[str, Any] = OTM | {"resolution": 4}
REFERENCES: dict[str, tuple[str, float, float, float, str]] = {  # the ranges of Table 5.1
    "length": ("length", 21.26, 21.66, 1e3, " mm"),
    "radius": ("radius_nodes", 6.89, 7.24, 1e3, " mm"),
    "plastic strain": ("plastic_strain_max", 2.47, 3.25, 1.0, ""),
    "von Mises stress": ("von_mises_max", 419.0, 477.0, 1e-6, " MPa"),
}
STEPS_WITHIN = 0.6  # mean Newton steps
RATE_WITHIN = 0.2  # a least-squares slope so near to a printed rate reads as that rate
TIP_WITHIN = (
    "displacement of the tip within 3 % (maximum) and 6 % (minimum) of the exact one, relative L2 "
    f"error at most 0.03, speed at most {SPEED:g} m/s"
)
FORM = "the mass matrix and the transfer"
COUNT = "the number of particles"
LOCALITY = "the locality gamma"
SET_UPS = (
    SetUp("as stated"),
    SetUp("consistent mass, position differences", {"mass": "consistent"}, FORM),
    SetUp("two particles per cell", {"particles": 2}, COUNT),
    SetUp("gamma = 4", {"gamma": 4.0}, LOCALITY),
)
IN_WORDS = (
    "All claims are judged in one set-up: lumped mass, nodal velocities (Eq. 3.92), one particle per "
    "cell and gamma = 1.8 for the shock, two for the bar. The thesis derives position differences "
    "(Eq. 3.89) as well, and says for none of its dynamic problems which of them, which mass, how "
    "many particles in a cell or which gamma they have: a claim that turns on these is not "
    "decidable. With a consistent mass there are two particles per cell, since one makes it "
    "singular. What gamma does is in a chapter of its own."
)
claim = Claims()


@claim(
    "Mean Newton steps per sample by gamma and tolerance",
    "Table 2.1",
    quote="the average number of iterations required for convergence",
    threshold=f"every mean differs from the printed one by at most {STEPS_WITHIN:g} steps",
    holds=lambda largest: largest <= STEPS_WITHIN,
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
    quote="As the athermal limit is reached (for large values of γ), the Newton-Raphson method needs "
    "more iterations for convergence",
    threshold="for gamma = 6.8 plain Newton fails at more than half of the samples, with a line search "
    "at none",
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


def _chosen(runs: Runs) -> tuple[str, dict[str, Any]]:
    """Campaign of the shock in 1D with what this set-up chooses, and what its runs must match."""
    gamma, count = float(runs.choice("gamma", 1.8)), int(runs.choice("particles", 1))
    form = LUMPED
    if runs.choice("mass", "lumped") == "consistent":
        form, count = CONSISTENT, 2
    match = OTM | form | {"particles_per_cell": count}
    if gamma == 1.8 and (form is CONSISTENT or count == 1):
        return "fig4_4", match
    return "gamma", match | {"basis__gamma": gamma}


def _rate(runs: Runs, quantity: str) -> OrderEstimate:
    """Slopes of an error of the shock in this set-up."""
    campaign, match = _chosen(runs)
    return runs.order(campaign, quantity, cells=CELLS, **match)


@claim(
    "The velocity converges with 2.13",
    "Sect. 4.1.3, Fig. 4.4",
    quote="Convergence of the velocity field in one dimension. The rate is indicated by the value 2.13",
    threshold=f"the least-squares slope over 50, 100, 200 cells is within {RATE_WITHIN:g} of 2.13",
)
def velocity_rate(runs: Runs) -> Answer:
    """Slope of the velocity's error."""
    rate = _rate(runs, VELOCITY)
    return abs(rate.slope - 2.13) <= RATE_WITHIN, f"slope {slopes_text(rate)}"


@claim(
    "OTM is better than quadratic",
    "Sect. 4.1.3",
    quote="The convergence test of the velocity field shows the OTM is better than quadratic convergence",
    threshold="every local slope of the velocity's error above 2",
)
def better_than_quadratic(runs: Runs) -> Answer:
    """Local slopes of the velocity's error, whether they fall, and what linear elements do."""
    rate = _rate(runs, VELOCITY)
    fall = "falling" if rate.local[-1] < rate.local[0] else "rising"
    elements = runs.order("fig4_4", VELOCITY, cells=CELLS, **FEM)
    campaign, match = _chosen(runs)
    ours = runs.number(campaign, VELOCITY, resolution=CELLS[-1], **match)
    theirs = runs.number("fig4_4", VELOCITY, resolution=CELLS[-1], **FEM)
    because = (
        f"slope {slopes_text(rate)}, {fall} from {rate.local[0]:.2f} to {rate.local[-1]:.2f}; linear "
        f"finite elements have slope {slopes_text(elements)} and with {CELLS[-1]} cells an error of "
        f"{theirs:.3g} m^1.5/s, OTM {ours:.3g}"
    )
    return bool((rate.local > 2.0).all()), because


@claim(
    "The density converges with 1.88",
    "Sect. 4.1.3, Fig. 4.5",
    quote="Convergence of the density field in one dimension. The rate is indicated by the value 1.88",
    threshold=f"the least-squares slope over 50, 100, 200 cells is within {RATE_WITHIN:g} of 1.88",
)
def density_rate(runs: Runs) -> Answer:
    """Slope of the density's error."""
    rate = _rate(runs, DENSITY)
    return abs(rate.slope - 1.88) <= RATE_WITHIN, f"slope {slopes_text(rate)}"


@claim(
    "The errors remain below 1e-7",
    "Sect. 4.1.3",
    quote="the error measures remain below 10^-7 throughout the simulation",
    threshold="the velocity's error with 200 cells is below 1e-7",
    holds=lambda error, square: error < 1e-7,
    sentence="with 200 cells the velocity error is {error:.1e} m^1.5/s; its square is {square:.1e}",
)
def error_level(runs: Runs) -> dict[str, float]:
    """Error of the velocity on the finest nodes, and its square."""
    campaign, match = _chosen(runs)
    error = runs.number(campaign, VELOCITY, resolution=CELLS[-1], **match)
    return {"error": error, "square": error**2}


@claim(
    "The shock is also followed in two and three dimensions",
    "Sect. 4.1.3",
    quote="The same problem is also simulated in 2D and 3D",
    threshold="velocity errors of strip and cylinder at most twice that of the line",
)
def dimensions(runs: Runs) -> Answer:
    """Strip and cylinder with particles at barycentres, against the line: a factor of two."""
    gamma = float(runs.choice("gamma", 1.8))
    match = OTM | {"basis__gamma": gamma}
    one: dict[str, Any] = {"resolution": 50, "particles_per_cell": 1}
    line = runs.number("fig4_4" if gamma == 1.8 else "gamma", VELOCITY, **match, **LUMPED, **one)
    barycentres: dict[str, Any] = {"basis__gradient": "exact", "particles_per_cell": 1}
    over = {
        "the strip": runs.number("fig4_7", VELOCITY, **barycentres, **match) / line,
        "the cylinder": runs.number("fig4_9", VELOCITY, **match) / line,
    }
    words = ", ".join(f"{value:.1f} ({name})" for name, value in over.items())
    because = (
        f"with gamma = {gamma:g} the velocity error is so many times that of the line: {words}"
    )
    return {name: value <= 2.0 for name, value in over.items()}, because


@claim(
    "OTM agrees with finite elements, also on nonuniform nodes",
    "Sect. 4.2.2, Figs. 4.12, 4.13",
    quote="the OTM does not exhibit any of these instabilities even with a nonuniform distribution of "
    "nodes",
    threshold=TIP_WITHIN,
)
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
    quote="Standard SPH methods cannot solve this problem due to tension instability that immediately "
    "developed",
    threshold="standard SPH does not finish, and with symmetric derivatives is more than 30 % off",
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
    quote="A spurious mode occurs when solving this problem by the EFG method with nodal integration due "
    "to the rank deficiency",
    threshold=f"a relative error above 0.1 or a speed above {SPEED:g} m/s",
    holds=lambda error, speed, **_: error > 0.1 or speed > SPEED,
    sentence=(
        "with moving least squares, the functions of EFG, the relative error is {error:.3f}, the "
        "largest speed {speed:.2f} m/s; with local max-ent functions {lme_error:.3f} and "
        "{lme_speed:.2f} m/s"
    ),
)
def nodal_integration(runs: Runs) -> dict[str, float]:
    """Largest error and speed of the tip with nodal integration: MLS, and local max-ent."""
    found = {"error": "tip_displacement_error", "speed": "tip_velocity_max"}
    worst = {}
    for kind, before in (("", "nodal integration, MLS, "), ("lme_", "nodal integration, ")):
        names = [f"{before}{which} functions" for which in ("updated", "frozen")]
        for key, quantity in found.items():
            values = [runs.number("fig4_12", quantity, **BARS[name]) for name in names]
            worst[f"{kind}{key}"] = max(values)
    return worst


@claim(
    "OTM completely avoids the tensile instability",
    "Sect. 4.2.1",
    quote="we can show it therefore completely avoids the tensile instability and those due to the rank "
    "deficiency",
    threshold=f"no disturbance grows by more than a factor of {UNSTABLE:g}",
)
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


@claim(
    "The rod has come to rest at 80 microseconds",
    "Sect. 5.1",
    quote="after this moment, the kinetic energy is totally transformed into plastic deformation",
    threshold="less than 1e-3 of the kinetic energy is left",
    holds=lambda kinetic, wall: kinetic < 1e-3,
    sentence="{kinetic:.1e} of the kinetic energy is left; landing on the wall has taken {wall:.3f}",
)
def rest(runs: Runs) -> dict[str, float]:
    """What is left of the kinetic energy of OTM's rod, and what the wall has taken."""
    found = {"kinetic": "kinetic_share", "wall": "contact_share"}
    return {key: runs.number("taylor", name, **ROD) for key, name in found.items()}


@claim(
    "OTM agrees with the finite elements of Table 5.1",
    "Sect. 5.1, Table 5.1",
    quote="the Optimal transportation method obtained an excellent agreement with the finite element "
    "results",
    threshold="length, radius at nodes, plastic strain and von Mises stress lie between the smallest and "
    "the largest of the references",
)
def rod(runs: Runs) -> Answer:
    """Each column of Table 5.1, against the range of its references."""
    inside, words = {}, []
    for what, (quantity, low, high, scale, unit) in REFERENCES.items():
        value = scale * runs.number("taylor", quantity, **ROD)
        inside[what] = low <= value <= high
        words.append(f"{what} {value:.4g}{unit} (references {low:g} to {high:g})")
    return inside, ", ".join(words)


@claim(
    "The radius of the foot is 6.8 mm",
    "Table 5.1",
    quote="OTM 21.43 6.8 3.0 474",
    threshold="within 3 % at the nodes, or at the outermost material point",
)
def foot(runs: Runs) -> Answer:
    """The printed radius, which none of the references has, at nodes and material points."""
    nodes, points = (
        1e3 * runs.number("taylor", f"radius_{where}", **ROD) for where in ("nodes", "points")
    )
    near = {"nodes": abs(nodes / 6.8 - 1.0) <= 0.03, "points": abs(points / 6.8 - 1.0) <= 0.03}
    because = f"{nodes:.2f} mm at the nodes, {points:.2f} mm at the outermost material point"
    if not near["nodes"] and near["points"]:
        return "when the radius is that of the outermost material point", because
    return near["nodes"], because
