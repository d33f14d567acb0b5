"""The statements of the thesis on contact, section 5.2.1, and the rules that judge them."""

from itertools import pairwise
from typing import Any

import numpy as np

from mpmbench.papers.li2009.claims import Answer, claim
from mpmbench.papers.li2009.collisions import CUBES, FRICTION, RULES, SLIDING, SLIPS
from mpmbench.papers.li2009.impact import CAMPAIGN, HYDRODYNAMIC, KEPT, METHODS, SPEEDS
from mpmbench.report.evidence import Runs

MOMENTUM = 31_332.0  # of six cubes at the start [kg m/s]
MEETING = 0.1875  # of two squares by geometry [s]
DEARER = 1.1  # cost of a step: no extra costs, but for what measuring them is worth


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


@claim(
    "Contact costs nothing",
    "Sect. 5.2.1",
    quote="we propose a novel and effective contact algorithm, which introduces no extra computational "
    "costs more than the computations for a single body",
    threshold=f"a step of OTM for two squares that collide with shared nodes takes at most {DEARER:g} times the "
    "processor time that it takes for two that are too far apart to meet, by the median of three pairs of runs, "
    "each timed alone three times",
)
def no_cost(runs: Runs) -> Answer:
    """Processor time of a step for squares that meet over that for squares that do not, and with a penalty."""
    times = {
        name: np.array([_step(runs, **match, problem__slip=slip) for slip in SLIPS])
        for name, match in SLIDING.items()
    }
    apart, *meeting = times.values()
    shared, penalty = (float(np.median(one / apart)) for one in meeting)
    return shared <= DEARER, (
        f"a step with shared nodes takes {shared:.2f} times that of squares apart, one with a penalty {penalty:.2f}"
    )


def _step(runs: Runs, **match: Any) -> float:
    """Processor time of a step [s]."""
    total, steps = (
        runs.number("contact_slip", name, **match, timing_context="exclusive")
        for name in ("solver_cpu_time", "steps")
    )
    return total / steps


@claim(
    "Friction comes by itself",
    "Sect. 5.2.1",
    quote="we are able to capture not only the normal forces but also the friction on the contact interfaces",
    threshold="squares that meet at 2 m/s and slide with 1, 2 and 4 m/s exchange more than a hundredth of the "
    "normal impulse along their faces; and it is friction, which has a bound: from 2 to 4 m/s the ratio of "
    f"the impulses grows by less than a fifth, as with a penalty and the coefficient {FRICTION:g}",
)
def friction(runs: Runs) -> Answer:
    """Impulse along the faces over that across them by speed of sliding, with shared nodes and a penalty."""
    _, *meeting = SLIDING.values()
    ratio, beside = (
        [runs.number("contact_slip", "impulse_ratio", **one, problem__slip=slip) for slip in SLIPS]
        for one in meeting
    )
    inside = {
        "a force along the faces": min(ratio) > 0.01,
        "the bound of friction": ratio[-1] < 1.2 * ratio[-2],
    }
    ours, theirs = (", ".join(f"{one:.3f}" for one in values) for values in (ratio, beside))
    return inside, (
        f"the impulse along the faces over that across them at 1, 2 and 4 m/s is {ours}; with a "
        f"penalty and the coefficient {FRICTION:g} it is {theirs}"
    )


@claim(
    "The depth approaches the hydrodynamic limit",
    "Sect. 5.2.3, Fig. 5.22",
    quote="when we increase the impact velocity, it may be observed the penetration depth asymptotically "
    "approaches that predicted by the hydrodynamic theory",
    threshold="by OTM with masses that are kept, which makes no energy, "
    "the depth over the diameter, when the sphere's centre has 1 % of its energy left, "
    "grows with each velocity, by less and less from 2000 to 3000 "
    "m/s, and ends within 20 % of the root of the ratio of the densities, 1.71",
)
def hydrodynamic(runs: Runs) -> Answer:
    """Growth of the depth with velocity, and its distance from the limit of a flowing rod."""
    match = METHODS[KEPT]
    depth = [
        runs.number(CAMPAIGN[KEPT], "depth_over_diameter_of_centre", **match, problem__speed=speed)
        for speed in SPEEDS
    ]
    rise = [b - a for a, b in pairwise(depth)]
    inside = {
        "growth": all(one > 0.0 for one in rise),
        "levelling off": rise[-1] < rise[-2],
        "the limit": abs(depth[-1] / HYDRODYNAMIC - 1.0) < 0.2,
    }
    words = ", ".join(f"{one:.2f}" for one in depth)
    return inside, f"depths over the diameter from 500 to 3000 m/s: {words}"
