"""What the paper leaves open of the moving least squares, weight and polynomials, and what it does."""

from contextlib import suppress
from itertools import product
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from mpmbench.papers.iaconeta2017.support import COLOURS, METHODS
from mpmbench.papers.kit import Campaigns, Chapter, cell, variables
from mpmbench.papers.parts import numbers, of_file, quantities, with_digits
from mpmbench.report import style
from mpmbench.report.evidence import MissingRuns
from mpmbench.report.figures import single
from mpmbench.report.tables import Cell

Match = dict[str, Any]
ROOT = 2.0**0.5
FOOT, SOIL_SPACING = 4.0, 0.1  # of the soil column: where its foot is at the start, and h [m]
WEIGHTS: dict[str, Match] = {
    "cubic spline": {"basis__weight": "cubic_spline"},
    "quartic spline": {"basis__weight": "quartic_spline"},
    "Gaussian": {"basis__weight": "gaussian"},
}
POLYNOMIALS: dict[str, Match] = {
    "1, x, y": {"basis__degree": 1, "basis__mixed_terms": False},
    "1, x, y, xy": {"basis__degree": 1, "basis__mixed_terms": True},
    "degree 2": {"basis__degree": 2},
}
MARKERS = ("o", "s", "^")  # of the polynomials
# at the published search radius of the disk R = 1.5 sqrt(2) h
DISK_WEIGHTS: dict[str, Match] = {
    name: {**match, "basis__effective_radius": 2.0 / 3.0} for name, match in WEIGHTS.items()
} | {"cubic spline, R_eff = R / 2": {**WEIGHTS["cubic spline"], "basis__effective_radius": 0.5}}
ABOVE: Match = {"basis": "mls", "problem__gap": 1.5 * ROOT}
UNSTATED = (
    "The paper states neither the weight nor the polynomials of the moving least squares; Eq. 50 "
    "prints 1, x, y, xy and further terms."
)
GAPS = {"sqrt(2) h": ROOT, "1.5 sqrt(2) h": 1.5 * ROOT}
CLOUDS: dict[str, Match] = {
    "GMM-LME, gamma = 1.8": {"basis": "lme"},
    "GMM-MLS, R_eff = R / 2": {
        "basis": "mls",
        "basis__effective_radius": 0.5,
        **POLYNOMIALS["1, x, y"],
    },
}


def mls_soil_chapter(campaigns: Campaigns) -> Chapter:
    """Run-out of the soil column over weight and polynomials."""
    page = Chapter("mls_soil", "What the paper leaves open of GMM-MLS: the soil column")
    page.statement = UNSTATED
    wanted = ("stiffened_steps", "halved_steps")
    cells = {}
    for weight, terms in product(WEIGHTS, POLYNOMIALS):
        campaign = "mls_soil"
        match: Match = {"basis": "mls", **WEIGHTS[weight], **POLYNOMIALS[terms]}
        if (weight, terms) == ("cubic spline", "1, x, y"):
            campaign = "soil"
            match = {"basis": "mls", "resolution": 40}
        steps = quantities(campaigns, campaign, wanted, **match)
        cells[weight, terms] = [*advance(campaigns, campaign, match), *steps]
    first = {choice: found[0] for choice, found in cells.items()}
    others = {
        name: cell(campaigns, "soil", "final_run_out", **METHODS[name], resolution=40)
        for name in ("MPM", "GMM-LME")
    }
    figure, axes = single(height=2.8, width=1.5 * style.COLUMN)
    draw_choices(axes, list(WEIGHTS), first, others)
    axes.set_ylabel("run-out at 2 s [m]")
    caption = "h = 0.1 m, R = sqrt(2) h, R_eff = R / 2, clouds of six nodes or more."
    page.draw("run-out", "Run-out over weight and polynomials", caption, figure)
    columns = ["weight", "polynomials", "run-out at 2 s [m]", "particles ahead of the body"]
    columns += ["stiffened steps", "halved steps"]
    rows = [[*choice, *found] for choice, found in cells.items() if found[0].value != ""]
    title = "GMM-MLS, h = 0.1 m, with each weight and polynomials"
    page.tabulate("choices", title, columns, rows, numeric=(2, 3, 4, 5))
    page.notes.append(weighed("The run-out of GMM-MLS", first, others))
    page.notes.append(
        "Particles more than a search radius ahead of the next one have left the body, are counted "
        "beside it, and are no part of its run-out here. The Gaussian is lowered so that it vanishes "
        "at the search radius; one that is cut off there is a further choice."
    )
    return page


def advance(campaigns: Campaigns, campaign: str, match: Match) -> list[Cell]:
    """Run-out of the body at the end [m], and particles ahead of it; or how the run ended."""
    with suppress(MissingRuns):
        file, found = variables(campaigns, campaign, "position", **match)
        if "position" in found:
            return of_file(file, *front(found["position"][-1][:, 0], ROOT * SOIL_SPACING))
    ended = cell(campaigns, campaign, "final_run_out", **match)
    return [ended, Cell() if isinstance(ended.value, float) else ended]


def front(x: np.ndarray, reach: float) -> tuple[float, int]:
    """Run-out of particles at `x` [m], and how many are ahead by more than `reach` [m] of the next."""
    ordered = np.sort(x)
    wide = np.flatnonzero(np.diff(ordered) > reach)
    last = int(wide[0]) if len(wide) else len(ordered) - 1
    return float(ordered[last] - FOOT), len(ordered) - 1 - last


def mls_disk_chapter(campaigns: Campaigns) -> Chapter:
    """RMS error of the disk over weight and polynomials, and from equal gaps."""
    page = Chapter("mls_disk", "What the paper leaves open of GMM-MLS: the rolling disk")
    page.statement = UNSTATED
    wanted = ("error_centre_rms", "error_end_relative", "bounce_height")
    cells = {}
    for weight, terms in product(DISK_WEIGHTS, POLYNOMIALS):
        match = ABOVE | DISK_WEIGHTS[weight] | POLYNOMIALS[terms]
        cells[weight, terms] = quantities(campaigns, "mls_disk", wanted, **match)
    first = {choice: found[0] for choice, found in cells.items()}
    others = {
        "MPM": cell(campaigns, "mls_disk", wanted[0], method="implicit_mpm"),
        "GMM-LME": cell(campaigns, "mls_disk", wanted[0], basis="lme", problem__gap=ROOT),
    }
    figure, axes = single(height=3.0, width=1.8 * style.COLUMN)
    draw_choices(axes, list(DISK_WEIGHTS), first, others)
    axes.set_ylabel("RMS error of the centre [m]")
    caption = "Radius 0.5 m, h = 0.05 m, 2 ms, R = 1.5 sqrt(2) h, and R_eff = 2/3 R as published or R / 2."
    page.draw("errors", "RMS error over weight and polynomials", caption, figure)
    columns = ["weight", "polynomials", "RMS error [m]", "error at the end", "bounce [m]"]
    rows = [[*choice, *found] for choice, found in cells.items() if found[0].value != ""]
    title = "GMM-MLS, 2 ms, with each weight and polynomials"
    page.tabulate("choices", title, columns, rows, numeric=(2, 3, 4))
    page.notes.append(weighed("The RMS error of GMM-MLS", first, others))
    _gaps(page, campaigns)
    return page


def _gaps(page: Chapter, campaigns: Campaigns) -> None:
    """Both kinds of clouds from the same gap above the plane."""
    wanted = ("error_centre_rms", "error_end_relative", "bounce_height")
    rows, said = [], []
    for words, gap in GAPS.items():
        found = {
            name: quantities(campaigns, "mls_disk", wanted, **match, problem__gap=gap)
            for name, match in CLOUDS.items()
        }
        rows += [[words, name, *cells] for name, cells in found.items()]
        lme, mls = (with_digits(4, cells[0]).text or "missing" for cells in found.values())
        said.append(f"from {words} GMM-LME has {lme} m and GMM-MLS {mls} m")
    columns = ["gap", "method", "RMS error [m]", "error at the end", "bounce [m]"]
    title = "From the same gap above the plane, 2 ms"
    page.tabulate("gaps", title, columns, rows, numeric=(2, 3, 4))
    page.notes.append(
        "In Table 1 each method starts one search radius above the plane: GMM-LME from sqrt(2) h, "
        f"GMM-MLS from 1.5 sqrt(2) h. RMS errors from the same gap: {', '.join(said)}."
    )


def draw_choices(
    axes: Axes,
    weights: list[str],
    found: dict[tuple[str, str], Cell],
    others: dict[str, Cell],
) -> None:
    """One mark for each weight and polynomials, a level line for each of the other methods."""
    for shift, marker, terms in zip((-0.15, 0.0, 0.15), MARKERS, POLYNOMIALS, strict=True):
        values = numbers(found[weight, terms] for weight in weights)
        places = np.arange(len(weights)) + shift
        axes.plot(places, values, marker, color=COLOURS["GMM-MLS"], label=f"GMM-MLS, {terms}")
    for (name, one), line in zip(others.items(), ("--", ":"), strict=True):
        if isinstance(one.value, float):
            axes.axhline(one.value, color=COLOURS[name], ls=line, lw=1.2, label=name)
    axes.set_xticks(range(len(weights)), [weight.replace(", ", "\n") for weight in weights])
    axes.set_xlim(-0.5, len(weights) - 0.5)
    axes.set_ylim(bottom=0.0)
    axes.legend(fontsize=6)


def weighed(what: str, found: dict[tuple[str, str], Cell], others: dict[str, Cell]) -> str:
    """What the choices do, beside what the other methods do, in a sentence.

    Raises
    ------
    MissingRuns
        When nothing can be compared.
    """
    choices, methods = (numbers(cells) for cells in (found.values(), others.values()))
    choices, methods = choices[np.isfinite(choices)], methods[np.isfinite(methods)]
    if len(choices) < 2 or len(methods) < 2:
        raise MissingRuns(f"{what} is known for too few choices or methods")
    ended = [
        " with ".join(key) for key, one in found.items() if isinstance(one.value, str) and one.value
    ]
    early = f" ({' and '.join(ended)} did not finish)" if ended else ""
    by_choice, by_method = (values.max() / values.min() for values in (choices, methods))
    which = "more" if by_choice > by_method else "less"
    return (
        f"{what} is {choices.min():.3g} to {choices.max():.3g} m over what the paper leaves "
        f"open{early}, a factor of {by_choice:.2g}; between {' and '.join(others)} it is a factor of "
        f"{by_method:.2g} ({methods.min():.3g} to {methods.max():.3g} m): the undisclosed choice "
        f"weighs {which} than the method."
    )
