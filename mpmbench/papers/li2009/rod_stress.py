"""Section 5.1: what the largest von Mises stress of Table 5.1 depends on, by OTM on Taylor's rod."""

from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from mpmbench.papers.kit import Campaigns, Chapter, variables
from mpmbench.papers.li2009.taylor import bulk, scaled
from mpmbench.papers.parts import of_file, quantities, with_digits
from mpmbench.report.tables import Cell

CAMPAIGN = "rod_stress"
PLAIN: dict[str, Any] = {
    "basis__gamma": 1.8,
    "basis__gradient": "exact",
    "mass": "lumped",
    "method__transfer": "nodal",
    "method__drag": 0.0,
    "end_time": 80e-6,
}
CASES: dict[str, dict[str, Any]] = {
    "as in Table 5.1": {},
    "gamma = 0.8": {"basis__gamma": 0.8},
    "gamma = 1.2": {"basis__gamma": 1.2},
    "gamma = 4": {"basis__gamma": 4.0},
    "gradients that integrate exactly": {"basis__gradient": "consistent"},
    "masses kept": {"mass": "kept"},
    "velocities of particles (flip)": {"method__transfer": "flip"},
    "damping of 2000 /s": {"method__drag": 2000.0},
    "twice the time": {"end_time": 160e-6},
}
REFERENCE = (419.0, 477.0)  # of the largest von Mises stress in Table 5.1 [MPa]
NEAREST = 12  # particles, about as many as there are between the nodes of a cell
SHAPE = ("length", "radius_nodes", "plastic_strain_max", "von_mises_max")
SCALES = (1e3, 1e3, 1.0, 1e-6)


def stress_chapter(campaigns: Campaigns) -> Chapter:
    """One change in each row; the largest stress at points, in most of the volume, and of means over neighbours."""
    page = Chapter(
        "rod_stress", "Beyond the thesis: what the largest von Mises stress of the rod depends on"
    )
    campaigns[CAMPAIGN]  # raises when nothing was run
    rows: list[list[Any]] = [
        [name, *row_of(campaigns, PLAIN | change)] for name, change in CASES.items()
    ]
    largest = [row[4].value for row in rows if isinstance(row[4].value, float)]
    means = [row[6].value for row in rows if isinstance(row[6].value, float)]
    columns = ["change", "length [mm]", "radius, nodes [mm]", "plastic strain"]
    columns += ["largest von Mises [MPa]", "99 % of the volume below [MPa]"]
    columns += [f"largest of means over {NEAREST} [MPa]", "lowest pressure [MPa]"]
    columns += ["highest pressure [MPa]"]
    note = (
        "OTM, 3 cells along the radius, at the end; one change in each row. Means are those of the stresses of the "
        f"{NEAREST} particles nearest to each, by volume, of which then the von Mises stress is taken. "
        "A rod at rest has no pressures of gigapascals: they alternate from particle to particle, and so do "
        "the stresses that they leave."
    )
    page.tabulate(
        "stress",
        "Largest stresses by what is changed",
        columns,
        rows,
        numeric=range(1, 9),
        note=note,
    )
    if largest and means:
        page.notes.append(judged(largest, means))
    return page


def row_of(campaigns: Campaigns, match: dict[str, Any]) -> list[Cell]:
    """Shape, and stresses at points, in the volume and of means, of one run."""
    found = quantities(campaigns, CAMPAIGN, SHAPE, **match)
    shape = [scaled(one, factor) for one, factor in zip(found, SCALES, strict=True)]
    if not isinstance(found[-1].value, float):
        return [*shape, *[found[-1]] * 4]
    wanted = ("position", "volume", "stress", "von_mises", "pressure")
    file, fields = variables(campaigns, CAMPAIGN, *wanted, **match)
    x, V, sigma, stress, pressure = (fields[name][-1] for name in wanted)
    solid = np.isfinite(stress)
    x, V, sigma, stress, pressure = (one[solid] for one in (x, V, sigma, stress, pressure))
    values = (
        bulk(stress, V),
        float(von_mises(means_of(x, V, sigma)).max()),
        float(pressure.min()),
        float(pressure.max()),
    )
    return [*shape, *(with_digits(3, one) for one in of_file(file, *(1e-6 * v for v in values)))]


def means_of(x: np.ndarray, V: np.ndarray, sigma: np.ndarray) -> np.ndarray:
    """Means by volume of the stresses of the particles nearest to each, shape (P, 3, 3)."""
    _, near = cKDTree(x).query(x, k=min(NEAREST, len(x)))
    weight = V[near] / V[near].sum(axis=1, keepdims=True)
    return np.asarray(np.einsum("pk,pkab->pab", weight, sigma[near]))


def von_mises(sigma: np.ndarray) -> np.ndarray:
    """Von Mises stress of stresses of shape (P, 3, 3)."""
    mean = np.trace(sigma, axis1=1, axis2=2) / 3.0
    s = sigma - mean[:, None, None] * np.eye(3)
    return np.asarray(np.sqrt(1.5 * np.sum(s**2, axis=(1, 2))))


def judged(largest: list[float], means: list[float]) -> str:
    """Whether any change brings the largest stress into the range of the references, and what means do."""
    low, high = REFERENCE
    inside = sum(low <= one <= high for one in largest)
    below = sum(one < low for one in means)
    return (
        f"The largest stress at a particle lies within the references' {low:g} to {high:g} MPa in {inside} of "
        f"{len(largest)} runs, between {min(largest):.0f} and {max(largest):.0f} MPa; that of means over "
        f"{NEAREST} particles lies between {min(means):.0f} and {max(means):.0f} MPa, and below the references in "
        f"{below}. So the number is one of the place where it is read off, and the thesis does not say which that is."
    )
