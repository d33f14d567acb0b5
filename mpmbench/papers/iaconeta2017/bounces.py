"""What the error of the rolling disk mixes: the height at which it rolls, bounces, time in the air."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.signal import find_peaks

from mpmbench.papers.iaconeta2017.disk import ROWS
from mpmbench.papers.iaconeta2017.support import history, look
from mpmbench.papers.kit import Campaigns, Chapter, cell
from mpmbench.papers.parts import of_file, thinned
from mpmbench.report.figures import panels
from mpmbench.report.tables import Cell

RADIUS, SPACING = 0.5, 0.05  # of the disk, and h [m]
SLOPE, GRAVITY = math.radians(60.0), 9.81  # [m/s^2]
LEAST_BOUNCE = 1e-3  # [m]; what is lower is a ripple of the elastic disk
# How far above the plane a particle still sees its nodes [h], one cell or the search radius; the
# disks of Table 1 start that far above it.
REACHES = {
    "MPM": 1.0,
    "GMM-MLS, R_eff = R / 2": 1.5 * math.sqrt(2.0),
    "GMM-LME, gamma = 1.8": math.sqrt(2.0),
}
HISTORIES = (
    *("time", "centre_rise", "centre_displacement", "centre_displacement_exact"),
    *("lowest_particle", "kinetic_energy", "strain_energy", "external_work"),
)


@dataclass(frozen=True)
class Motion:
    """How a disk came down the plane.

    Attributes
    ----------
    heights : list of float
        Rise of the centre after each landing [m].
    aloft : float
        Share of the time after the first landing in which no particle sees the plane.
    height : float
        Mean distance of the centre from the plane while one does, after the first landing [m].
    ahead, by_flights, by_height : float
        Displacement at the end less that of a rigid disk that rolls [m]: measured; of one that flies
        as long and lands without slipping; of one that rolls at this height.
    balance : ndarray
        Kinetic and strain energy less the work of gravity, over its work until the end.
    leap : float
        Potential energy of the highest bounce, over the same.
    """

    heights: list[float]
    aloft: float
    height: float
    ahead: float
    by_flights: float
    by_height: float
    balance: np.ndarray
    leap: float

    @property
    def rest(self) -> float:
        """What neither flights nor height explain of the displacement at the end [m]."""
        return self.ahead - self.by_flights - self.by_height


def bounces_chapter(campaigns: Campaigns) -> Chapter:
    """Heights of the bounces, time in the air and energy of three runs of Table 1."""
    page = Chapter("bounces", "Beyond the paper: the disk rolls, bounces and flies")
    page.statement = (
        "Eqs. 64 to 66 are those of a rigid disk that rolls and never leaves the plane; the error of "
        "Table 1 is the distance to it."
    )
    figure, axes = panels(1, 2, 2.8)
    rows: list[list[Any]] = []
    motions: dict[str, Motion] = {}
    for name, reach in REACHES.items():
        match = {**ROWS[name], "time_step": 2e-3}
        file, found = history(campaigns, "table1", *HISTORIES, **match)
        one = motions[name] = motion(found, reach * SPACING)
        line = look(name.split(",")[0]) | {"marker": None, "label": name}
        over = found["lowest_particle"] / (reach * SPACING)
        axes[0, 0].plot(*thinned(found["time"], over), **line)
        axes[0, 1].plot(*thinned(found["time"], 100.0 * one.balance), **line)
        listed = Cell(", ".join(f"{height:.3g}" for height in one.heights), (file,))
        rms = cell(campaigns, "table1", "error_centre_rms", **match)
        shares = (one.aloft, one.ahead, one.by_flights, one.by_height, one.rest)
        energies = (-one.balance[-1], one.leap)
        rows.append([name, listed, rms, *of_file(file, *shares, *energies)])
    axes[0, 0].axhline(1.0, color="#888888", lw=0.8)
    axes[0, 0].set_ylabel("height of the lowest particle over the reach")
    axes[0, 1].set_ylabel("energy balance [% of the work of gravity]")
    for axis in axes[0]:
        axis.set_xlabel("time [s]")
    axes[0, 0].legend(fontsize=6)
    caption = (
        "2 ms. Left: above 1 no particle sees a node of the plane, and the disk flies. Right: kinetic "
        "and strain energy less the work of gravity until then, over that until the end."
    )
    page.draw("energy", "Contact and energy", caption, figure)
    columns = ["method", "heights of its bounces [m]", "RMS error [m]", "in the air after landing"]
    columns += ["ahead at the end [m]", "by flights [m]", "by its height [m]", "the rest [m]"]
    columns += ["energy lost, of the work", "highest bounce, of the work"]
    title = "Bounces, time in the air and energy, 2 ms"
    page.tabulate("energy", title, columns, rows, numeric=range(2, 10))
    page.notes += [
        "The error mixes three things. In the air the centre gains g sin(theta) instead of 2/3 g "
        "sin(theta), and a rigid disk that lands without slipping keeps the way. Contact by shared "
        "functions acts at a distance, and a disk that rolls with its centre higher above the plane "
        "rolls as if it were larger, and faster. The rest is what landings and deformation do.",
        " ".join(in_words(name, one) for name, one in motions.items()),
    ]
    if cancels(motions["MPM"], [one for name, one in motions.items() if name != "MPM"]):
        page.notes.append(
            "MPM comes nearest to the rigid disk because its landings hold it back by about as much as its "
            "flights carry it ahead, not because it rolls better: the ranking of Table 1 says little "
            "about rolling."
        )
    return page


def motion(found: dict[str, np.ndarray], reach: float) -> Motion:
    """How a disk came down the plane, from its `HISTORIES`.

    Parameters
    ----------
    found : dict
        Arrays of one length.
    reach : float
        Up to which height a particle sees nodes of the plane, and the gap at the start [m].
    """
    rise, work, time = found["centre_rise"], found["external_work"], found["time"]
    flies = found["lowest_particle"] > reach
    landed = np.arange(len(flies)) >= np.argmin(flies)
    heights = bounces(rise)
    height = RADIUS + reach + float(rise[landed & ~flies].mean())
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flies, [False]])))
    spans = (edges[1::2] - edges[::2]) * (time[-1] - time[0]) / (len(time) - 1)
    exact, along = found["centre_displacement_exact"][-1], found["centre_displacement"][-1]
    weight = work[-1] / (math.sin(SLOPE) * along - math.cos(SLOPE) * rise[-1])  # [N]
    return Motion(
        heights=heights,
        aloft=float(flies[landed].mean()),
        height=height,
        ahead=float(along - exact),
        by_flights=float(np.sum(GRAVITY * math.sin(SLOPE) / 6.0 * spans**2)),
        by_height=float(exact * (1.5 / (1.0 + 0.5 * (RADIUS / height) ** 2) - 1.0)),
        balance=(found["kinetic_energy"] + found["strain_energy"] - work) / work[-1],
        leap=float(weight * math.cos(SLOPE) * max(heights, default=0.0) / work[-1]),
    )


def bounces(rise: np.ndarray) -> list[float]:
    """How far the centre rises after each landing [m], from its distance to the plane over time."""
    tops, _ = find_peaks(rise, prominence=LEAST_BOUNCE)
    landings, _ = find_peaks(-rise, prominence=LEAST_BOUNCE)
    return [
        float(rise[top] - rise[landings[landings < top][-1]])
        for top in tops
        if (landings < top).any()
    ]


def cancels(one: Motion, others: list[Motion]) -> bool:
    """Whether one is nearest to the rigid disk though it is least explained by flights and height."""
    return all(
        abs(one.ahead) < abs(other.ahead) and abs(one.rest) > abs(other.rest) for other in others
    )


def in_words(name: str, one: Motion) -> str:
    """The motion of a disk in two sentences."""
    listed = ", ".join(f"{height:.3g}" for height in one.heights) or "none"
    grow = len(one.heights) > 1 and bool(np.all(np.diff(one.heights) > 0.0))
    kept = "loses" if one.balance[-1] < 0.0 else "gains"
    return (
        f"{name}: bounces of {listed} m{', each higher than the last' if grow else ''}; in the air "
        f"for {100.0 * one.aloft:.0f} % of the time after landing; {one.ahead:.3f} m ahead at the end, "
        f"where flights alone give {one.by_flights:.3f} m and its height {one.by_height:.3f} m. It "
        f"{kept} {100.0 * abs(one.balance[-1]):.2g} % of the work of gravity, and its highest bounce "
        f"holds {100.0 * one.leap:.2g} %."
    )
