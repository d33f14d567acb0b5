"""Claims on the algorithms themselves (Sects. 4, 7 and 9)."""

import numpy as np

from mpmbench.papers.kit import Campaigns, variables
from mpmbench.papers.wobbes2020.claims.judging import LITTLE, Answer, claim
from mpmbench.papers.wobbes2020.support import ERROR
from mpmbench.report.evidence import Evidence, Runs

MOVED = {"mass": "consistent", "method__nodes": "moving", "method__traction": "end_point"}


@claim(
    "With equal choices, MPM and OTM differ in the update of the basis functions only",
    "Sect. 9",
    quote="the only difference between the algorithms emerges from the update of the basis functions",
    threshold="MPM with moving nodes and the transfer of OTM has every particle where OTM has it, "
    "to the last bit",
)
def equivalence(runs: Runs) -> Answer:
    """Positions of particles by OTM and by MPM with its choices, on the bar with traction."""
    campaigns = Campaigns(runs.campaigns)
    apart = {}
    for basis in ("linear", "maxent"):
        search = {"basis__search": "local"} if basis == "maxent" else {}
        otm = {"method": "otm", "basis": basis, "particles_per_cell": 4} | search
        mpm = MOVED | {"basis": basis, "method__transfer": "position_difference"}
        mpm |= {"method__shape_functions": "updated"}
        (file, one), (other_file, other) = (
            variables(campaigns, campaign, "position", **match)
            for campaign, match in (("fig7", otm), ("ablation", mpm))
        )
        apart[basis] = float(np.abs(one["position"][-1] - other["position"][-1]).max())
        name = f"largest distance of a particle between OTM and MPM, {basis} [m]"
        runs.evidence.append(Evidence(name, apart[basis], (file, other_file)))
    words = " and ".join(f"{value:.1e} m with {basis} functions" for basis, value in apart.items())
    return {
        b: value == 0.0 for b, value in apart.items()
    }, f"particles are apart by at most {words}"


@claim(
    "Quadratic B-splines are not consistent, so that Algorithm 2 cannot use them",
    "Sects. 4, 7",
    quote="Therefore, according to the definition in Sect. 4, higher-order basis functions are not "
    "consistent",
    threshold=f"Algorithm 2 fails, or its error is more than {LITTLE:g} times that of Algorithm 3",
    holds=lambda otm, unified: otm >= LITTLE * unified,
    sentence=(
        "with the degrees of freedom at the Greville abscissae Algorithm 2 runs with quadratic "
        "B-splines and gives {otm:.4g} m on the bar with traction, the unified method "
        "{unified:.4g} m"
    ),
)
def splines_inconsistent(runs: Runs) -> dict[str, float]:
    """Errors of Algorithm 2 with quadratic B-splines, and of the unified method."""
    match = MOVED | {"basis": "bspline"}
    transfers = {"otm": "position_difference", "unified": "flip"}
    errors = {}
    for name, transfer in transfers.items():
        here = match | {"method__transfer": transfer}
        done = runs.status("ablation", **here) == "ok"
        errors[name] = runs.number("ablation", ERROR, **here) if done else np.inf
    return errors


@claim(
    "The unified method has no parameters that a user has to choose",
    "Sect. 9",
    quote="the unified approach does not contain user-defined parameters",
    threshold=f"no choice of its own changes the error by more than a factor of {LITTLE:g}",
)
def parameters(runs: Runs) -> Answer:
    """Errors of the unified method with splines of degree 1, 2 and 3."""
    errors = [
        runs.number(
            "degrees",
            ERROR,
            method="unified",
            basis__degree=degree,
            problem__particle_layout="midpoint",
            resolution=32,
        )
        for degree in (1, 2, 3)
    ]
    words = ", ".join(f"{error:.2g}" for error in errors)
    free = max(errors) <= LITTLE * min(errors)
    where = "there is no radius of support; the degree of the splines is a choice"
    return free or where, (
        "it has no radius of support as max-ent functions have; its splines have a degree, and "
        f"with degree 1, 2, 3 the errors on 32 cells of the bar with fixed ends are {words} m"
    )
