"""Chapter 5 in motion: a moving picture of each kind of impact, from runs that keep many instants."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import xarray as xr

from mpmbench.papers.kit import Campaigns, Chapter, variables
from mpmbench.report.evidence import MissingRuns
from mpmbench.report.picture import View, film, gif

SECONDS = 4.0  # that each lasts
WIDTH = 480  # [pixels], so that 31 pictures stay well below 2 MB
FROM_THE_AXIS = View(up=0, azimuth=225.0)  # of a quarter between planes of symmetry
LABELS = {
    "von_mises": {"units": "Pa", "long_name": "von Mises stress"},
    "plastic_strain": {"units": "1", "long_name": "equivalent plastic strain"},
}


@dataclass(frozen=True)
class Impact:
    """A run that is shown, by what colours.

    Attributes
    ----------
    title, caption : str
    match : dict
        Its attributes and settings.
    colours : str
        Field of the particles.
    near : float
        Particles that start farther from the origin are left out [m].
    """

    title: str
    caption: str
    match: dict[str, Any]
    colours: str = "von_mises"
    near: float = np.inf
    view: View = field(default_factory=View)


SQUARES, CUBES = {"problem": "two_squares"}, {"problem": "six_cubes"}
SHARED, PENALTY = {"contact__name": "shared"}, {"contact__name": "penalty"}
FILMS = {
    "squares_shared": Impact(
        "Two squares with an offset, shared nodes",
        "The thesis' rule: nodes of both are in everybody's support.",
        SQUARES | SHARED,
    ),
    "squares_penalty": Impact(
        "Two squares with an offset, penalty",
        "Springs between points and facets of the surfaces.",
        SQUARES | PENALTY,
    ),
    "cubes_shared": Impact("Six cubes, shared nodes", "The thesis' rule.", CUBES | SHARED),
    "cubes_penalty": Impact("Six cubes, penalty", "The same with springs.", CUBES | PENALTY),
    "sphere": Impact(
        "A steel sphere on an aluminium plate at 1000 m/s",
        "A quarter, seen from the axis; the plate goes on to 10 mm. Penalty.",
        {"problem": "sphere_impact"},
        "plastic_strain",
        4.5e-3,
        FROM_THE_AXIS,
    ),
    "rod": Impact(
        "Taylor's rod at 227 m/s",
        "A quarter, seen from the axis.",
        {"problem": "taylor_anvil"},
        "plastic_strain",
        view=FROM_THE_AXIS,
    ),
}


def films_chapter(campaigns: Campaigns) -> Chapter:
    """One film after the other; a sentence names those that were not run."""
    page = Chapter("films", "Chapter 5 in motion: OTM")
    lacking = []
    for name, impact in FILMS.items():
        wanted = ("snapshot_time", "position", "volume", impact.colours)
        try:
            _, found = variables(campaigns, "films", *wanted, **impact.match)
        except MissingRuns:
            lacking.append(impact.title)
            continue
        pictures = film(particles_of(found, impact), impact.colours, impact.view)
        size = (WIDTH, round(WIDTH * pictures[0].height / pictures[0].width))
        small = [one.resize(size) for one in pictures]
        page.animate(name, impact.title, impact.caption, gif(small, SECONDS))
    if not page.animations:
        raise MissingRuns("films: no run has finished")
    if lacking:
        page.notes.append(f"No run to show of: {', '.join(lacking)}.")
    return page


def particles_of(found: dict[str, np.ndarray], impact: Impact) -> xr.Dataset:
    """The particles of a run that start near the origin, as a film takes them."""
    position = found["position"]
    near = np.linalg.norm(position[0], axis=1) < impact.near
    each, colours = ("snapshot", "particle"), impact.colours
    data = {
        "position": ((*each, "dim"), position[:, near]),
        "volume": (each, found["volume"][:, near]),
        colours: (each, found[colours][:, near], LABELS[colours]),
    }
    coords = {"snapshot_time": ("snapshot", found["snapshot_time"])}
    return xr.Dataset(data, coords, {"problem": impact.match["problem"], "method": "otm"})
