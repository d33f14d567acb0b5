"""What all claims of the paper are judged by: the set-ups, one threshold per quantity, short cuts."""

from typing import Any

from mpmbench.papers.wobbes2020.support import ERROR, METHODS, MOVING, method
from mpmbench.report.claims import Claims, Holds, SetUp
from mpmbench.report.evidence import Runs

Answer = tuple[Holds, str]
claim = Claims()

ORDER_WITHIN = 0.2  # a least-squares slope so near to p reads as order p
MUCH = 5.0  # "significantly", "considerably": errors at least so many times smaller
LITTLE = 1.2  # "little influence": errors that differ by less than this factor
TIME_WITHIN = 1.5  # times that agree within this factor

ORDER = f"a slope reads as order p when it is within {ORDER_WITHIN:g} of p"
LARGE = f"errors at least {MUCH:g} times smaller"
TIME = f"times agree within a factor of {TIME_WITHIN:g}"

MASS = "the mass matrix of MPM and OTM"
LOAD = "where MPM carries the traction"
LOCAL, END = {"search": "local"}, {"traction": "end_point"}
SET_UPS = (
    SetUp("as stated"),
    SetUp("lumped mass", {"mass": "lumped"}, MASS),
    SetUp("consistent mass, MPM-P1 too", {"mass": "consistent"}, MASS),
    SetUp("load at the end of the bar", END, LOAD),
    SetUp("search among near nodes", LOCAL),
    SetUp("no degrees of freedom below 1e-6 particle masses", {"mass_cutoff": 1e-6}),
    SetUp("d_max = 2 with MPM", {"d_max": 2.0}),
)
IN_WORDS = (
    "All claims are judged in one set-up: the update-stress-last loop, consistent mass except for "
    "MPM with linear functions (lumped), no degree of freedom left out, MPM carries the traction "
    "on its last particle, max-ent functions search among all nodes where times are judged, "
    "d_max = 2 in one dimension and 3 with MPM in two. The paper says neither which mass MPM and "
    "OTM have in its figures nor where MPM carries the traction: a claim that turns on these is "
    "not decidable. Orders are read with a time step ten times smaller than the paper's, so that "
    "its error does not bend the fine end; the limiting value with the paper's own."
)


def mass_of(runs: Runs, name: str) -> str:
    """The mass of a method in this set-up; the unified method states its own."""
    if name == "unified":
        return "consistent"
    return str(runs.choice("mass", method(name)["mass"]))


def chosen(runs: Runs, name: str, **more: Any) -> dict[str, Any]:
    """What a run of one of the paper's methods must match in this set-up."""
    return METHODS[name] | {"mass": mass_of(runs, name)} | more


def in_ablation(runs: Runs, name: str) -> dict[str, Any]:
    """A method among the runs that change one choice at a time, in this set-up."""
    moving = name in MOVING
    load = "end_point" if moving else runs.choice("traction", "last_particle")
    return {
        "basis": METHODS[name]["basis"],
        "mass": mass_of(runs, name),
        "method__nodes": "moving" if moving else "fixed",
        "method__transfer": "position_difference" if name.startswith("OTM") else "flip",
        "method__shape_functions": "updated",
        "method__traction": load,
    }


def error_of_fig7(runs: Runs, name: str) -> float:
    """RMS error of the displacement [m] in the set-up of Fig. 7."""
    return runs.number("ablation", ERROR, **in_ablation(runs, name))
