"""Claims on the bar with fixed ends (Sect. 8.1) and on what it shows of the mass."""

import numpy as np

from mpmbench.analysis.estimate import OrderEstimate, slopes_text
from mpmbench.papers.kit import Campaigns
from mpmbench.papers.wobbes2020.beyond import floor_growth
from mpmbench.papers.wobbes2020.claims.judging import (
    LARGE,
    LITTLE,
    MUCH,
    ORDER,
    ORDER_WITHIN,
    Answer,
    chosen,
    claim,
)
from mpmbench.papers.wobbes2020.support import ERROR, METHODS, method
from mpmbench.report.evidence import Runs
from mpmbench.report.tables import number_text

CELLS = (8, 16, 32, 64)


def _slope(runs: Runs, name: str, coarse: int, fine: int) -> float:
    """Local order of a method in Fig. 6 between two grids."""
    errors = [runs.number("fig6", ERROR, **method(name, resolution=n)) for n in (coarse, fine)]
    return float(np.log(errors[0] / errors[1]) / np.log(fine / coarse))


def _is(slope: float, order: float) -> bool:
    return abs(slope - order) <= ORDER_WITHIN


@claim(
    "MPM-P1 loses second order to grid crossing, OTM-P1 keeps it",
    "Sect. 8.1, Fig. 6",
    quote="In fact, MPM suffers from grid-crossing errors that result in a loss of the "
    "convergence. The OTM-P1 method preserves the second-order convergence until the final "
    "refinement",
    threshold=f"{ORDER}; lost: a slope below 1",
)
def grid_crossing(runs: Runs) -> Answer:
    """Orders before and after particles cross cells; whether the loss needs crossing."""
    before, after = _slope(runs, "MPM-P1", 15, 63), _slope(runs, "MPM-P1", 127, 511)
    otm = _slope(runs, "OTM-P1", 15, 255)
    crossings = [
        runs.number("fig6", "n_cell_crossings", **method("MPM-P1", resolution=n)) for n in (63, 511)
    ]
    because = (
        f"MPM-P1 has slope {before:.2f} from 16 to 64 nodes ({crossings[0]:g} crossings at 64) and "
        f"{after:.2f} from 128 to 512 ({crossings[1]:g} at 512); OTM-P1 has {otm:.2f} from 16 to 256"
    )
    if not (
        _is(before, 2.0) and after < 1.0 and _is(otm, 2.0) and crossings[0] == 0 < crossings[1]
    ):
        return False, because
    exponent, of_mpm, of_otm = floor_growth(Campaigns(runs.campaigns))
    finest = {"method": "mpm", "resolution": 256}
    inside = [
        runs.number("amplitude_floor", "n_cell_crossings", **finest, problem__velocity_amplitude=v)
        for v in (0.01, 0.02)
    ]
    if max(inside) == 0 and of_mpm < 1.0 < of_otm:
        because += (
            ". But crossing is not the only cause: without any, MPM-P1 has a floor (slope "
            f"{of_mpm:.2f}, growing with the amplitude to the power {exponent:.1f}), OTM-P1 has "
            "none"
        )
        return "the loss is there; crossing is not its only cause", because
    return True, because


@claim(
    "OTM-P1 is of first order in the last refinement",
    "Sect. 8.1, Fig. 6",
    quote="until the final refinement, where only first-order convergence is achieved",
    threshold=ORDER,
    holds=lambda slope: _is(slope, 1.0),
    sentence="the slope of OTM-P1 from 256 to 512 nodes is {slope:.2f}",
)
def last_refinement(runs: Runs) -> dict[str, float]:
    """Slope of OTM-P1 between the two finest grids."""
    return {"slope": _slope(runs, "OTM-P1", 255, 511)}


@claim(
    "Max-ent functions lead to significantly lower errors than piecewise-linear ones",
    "Sect. 8.1, Fig. 6",
    quote="maxent basis functions lead to significantly lower errors than the piecewise-linear "
    "basis functions for both MPM and OTM schemes",
    threshold=f"{LARGE} on every grid of 8 to 64 cells",
)
def maxent_accurate(runs: Runs) -> Answer:
    """Errors with piecewise-linear functions over those with max-ent."""
    gains = {}
    for scheme in ("MPM", "OTM"):
        of_scheme = []
        for n in CELLS:
            linear, maxent = (
                runs.number("orders", ERROR, **chosen(runs, f"{scheme}-{basis}", resolution=n))
                for basis in ("P1", "maxent")
            )
            of_scheme.append(linear / maxent)
        gains[scheme] = of_scheme
    words = [
        f"{number_text(min(some))} to {number_text(max(some))} times smaller with {scheme}"
        for scheme, some in gains.items()
    ]
    enough = {scheme: min(some) >= MUCH for scheme, some in gains.items()}
    return enough, f"on 8 to 64 cells max-ent errors are {' and '.join(words)}"


@claim(
    "With max-ent functions the order is between 1 and 2",
    "Sect. 8.1, Fig. 6",
    quote="With maxent basis functions, the convergence of MPM and the OTM method varies between "
    "linear and quadratic",
    threshold="every local slope between 1 and 2",
)
def maxent_order(runs: Runs) -> Answer:
    """Slopes of max-ent."""
    orders = {
        name: runs.order("orders", ERROR, **chosen(runs, name))
        for name in ("MPM-maxent", "OTM-maxent")
    }
    words = ", ".join(f"{name} {slopes_text(order)}" for name, order in orders.items())
    between = {
        name: bool(np.all((order.local >= 1.0) & (order.local <= 2.0)))
        for name, order in orders.items()
    }
    return between, f"least-squares slope (local slopes): {words}"


@claim(
    "BSMPM and the unified method have order 3 until a limiting value",
    "Sect. 8.1, Fig. 6",
    quote="These methods have third-order convergence until the limiting value is reached",
    threshold=f"{ORDER}; a limit: on 512 nodes at most 1.5 times the error of the time step",
)
def spline_order(runs: Runs) -> Answer:
    """Order of BSMPM and unified, and the limiting value of Fig. 6."""
    names = ("BSMPM", "unified")
    orders: dict[str, OrderEstimate] = {
        name: runs.order("orders", ERROR, **chosen(runs, name)) for name in names
    }
    limits = [runs.number("fig6", ERROR, **method(name, resolution=511)) for name in names]
    floor = runs.number("fig6", "predicted_temporal_floor", **method("unified", resolution=511))
    words = ", ".join(f"{name} {slopes_text(order)}" for name, order in orders.items())
    because = (
        f"{words}; with consistent mass the errors on 512 nodes are {limits[0]:.3g} and "
        f"{limits[1]:.3g} m, and the time step alone makes {floor:.3g} m"
    )
    parts = {f"order of {name}": _is(order.slope, 3.0) for name, order in orders.items()}
    return parts | {"the limit": max(limits) <= 1.5 * floor}, because


@claim(
    "Lumping has little influence at low order, but changes the order of BSMPM",
    "Sect. 7",
    quote="While mass lumping has little influence on the solution quality of lower order methods, "
    "its O(h²) approximation of the consistent mass matrix can significantly influence the spatial "
    "convergence of higher-order methods such as BSMPM",
    threshold=f"little: errors differ by less than a factor of {LITTLE:g}; {ORDER}",
)
def lumping(runs: Runs) -> Answer:
    """Errors of MPM-P1 and orders of BSMPM with both masses."""
    errors = {
        mass: np.array(
            [
                runs.number("orders", ERROR, **METHODS["MPM-P1"], mass=mass, resolution=n)
                for n in CELLS
            ]
        )
        for mass in ("lumped", "consistent")
    }
    over = errors["lumped"] / errors["consistent"]
    orders = {
        mass: runs.order("orders", ERROR, **METHODS["BSMPM"], mass=mass)
        for mass in ("lumped", "consistent")
    }
    because = (
        f"lumped errors of MPM-P1 are {over.min():.2f} to {over.max():.2f} times the consistent "
        f"ones; BSMPM has slope {slopes_text(orders['lumped'])} lumped, "
        f"{slopes_text(orders['consistent'])} consistent"
    )
    apart = orders["consistent"].slope - orders["lumped"].slope > 2.0 * ORDER_WITHIN
    return {"low order": over.max() < LITTLE, "order of BSMPM": apart}, because
