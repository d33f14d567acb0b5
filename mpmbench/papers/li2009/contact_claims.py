"""The statements of the thesis on contact, section 5.2.1, and the rules that judge them."""

from itertools import pairwise

from mpmbench.papers.li2009.claims import Answer, claim
from mpmbench.papers.li2009.collisions import CUBES, RULES
from mpmbench.report.evidence import Runs

MOMENTUM = 31_332.0  # of six cubes at the start [kg m/s]
MEETING = 0.1875  # of two squares by geometry [s]


@claim(
    "All fields are conserved in the collision of six cubes",
    "Sect. 5.2.1, Figs. 5.9 to 5.11",
    quote="It is evidenced that all the fields are perfectly conserved during the impact by using the "
    "novel meshless contact algorithm",
    threshold="momentum changes by less than 1e-9 of that at the start; the total energy by less than 1 %; "
    "less than 1 % of it stays locked as strain, which a perfectly elastic collision gives back",
)
def conserved(runs: Runs) -> Answer:
    """Momentum, total energy, and that no energy stays locked."""
    match = CUBES["shared, OTM"]
    drift, energy, locked = (
        runs.number("six_cubes", name, **match)
        for name in ("momentum_drift", "energy_drift", "locked_energy_fraction")
    )
    inside = {
        "momentum": drift < 1e-9 * MOMENTUM,
        "total energy": energy < 0.01,
        "what comes back as motion": abs(locked) < 0.01,
    }
    return inside, (
        f"the momentum changes by {drift / MOMENTUM:.1e} of itself, the total energy by {energy:.1%}, "
        f"and {locked:.1%} of it is locked as strain"
    )


@claim(
    "A smaller range of the nodes is more accurate",
    "Sect. 5.2.1, Fig. 5.7",
    quote="the smaller search range for the first neighbor of nodes gives the more accurate contact "
    "detection",
    threshold="the smaller the range, the nearer is the first contact of two squares to that by geometry; "
    "and with no range does anything end inside the other body",
)
def node_range(runs: Runs) -> Answer:
    """Distance of the first contact from that by geometry, and what is captured, by range."""
    late, captured = {}, {}
    for match in RULES.values():
        reach = match.get("contact__range")
        if reach is None:
            continue
        one = match | {"problem__swapped": False}
        first = runs.number("contact_checks", "first_contact", **one, problem__offset=0.0)
        late[float(reach)] = first - MEETING
        captured[float(reach)] = max(
            runs.number("contact_checks", "captured", **one, problem__offset=offset)
            for offset in (0.0, 0.4)
        )
    ordered = [abs(late[reach]) for reach in sorted(late)]
    inside = {
        "the first contact": all(a < b for a, b in pairwise(ordered)),
        "what stays outside": not any(captured.values()),
    }
    words = ", ".join(
        f"{1e3 * late[reach]:.1f} ms and {captured[reach]:.0f} captured (range {reach:g} h)"
        for reach in sorted(late)
    )
    return inside, f"contact is off by {words}"
