"""Claims that the papers on the family are cited for, and what the runs say."""

import math
from itertools import pairwise
from typing import Any

from mpmbench.analysis.estimate import slopes_text
from mpmbench.papers.family.support import (
    CELLS,
    CROSSING,
    ERROR,
    LOCKING,
    METHODS,
    SEEDINGS,
    TRANSFERS,
)
from mpmbench.report.claims import Claims, Holds
from mpmbench.report.evidence import MissingRuns, Runs

Answer = tuple[Holds, str]
claim = Claims()


def _finished(runs: Runs, campaign: str, **match: Any) -> bool:
    return runs.status(campaign, **match) == "ok"


def _errors(runs: Runs, name: str, seeding: str) -> dict[int, float]:
    """Errors of a method on the vortex by resolution, infinite where it broke down."""
    found = {}
    for n in CELLS:
        match = {**METHODS[name], "problem__seeding": seeding, "resolution": n}
        done = _finished(runs, "vortex", **match)
        found[n] = runs.number("vortex", ERROR, **match) if done else math.inf
    return found


@claim(
    "GIMP removes the noise of particles that cross cells",
    "Bardenhagen and Kober 2004",
    threshold="with 256 cells, where particles cross, GIMP's stress error is a fifth of that of hats "
    "or less, and it falls with every refinement",
)
def gimp_crossing(runs: Runs) -> Answer:
    """Stress errors on the bar whose particles cross."""
    errors = {
        name: [
            runs.number("crossing", "error_stress_rms", **CROSSING[name], resolution=n)
            for n in (64, 128, 256)
        ]
        for name in ("hats", "gimp")
    }
    crossings = runs.number("crossing", "n_cell_crossings", **CROSSING["hats"], resolution=256)
    ratio = errors["gimp"][-1] / errors["hats"][-1]
    falls = errors["gimp"][0] > errors["gimp"][1] > errors["gimp"][2]
    because = (
        f"with 256 cells and {crossings:g} crossings the stress error of GIMP is {ratio:.2g} of that "
        f"of hats; from 64 to 256 cells it goes {errors['gimp'][0]:.2g}, {errors['gimp'][1]:.2g}, "
        f"{errors['gimp'][2]:.2g} Pa, with hats {errors['hats'][0]:.2g}, {errors['hats'][1]:.2g}, "
        f"{errors['hats'][2]:.2g} Pa"
    )
    if crossings == 0.0:
        raise MissingRuns("crossing: no particle crosses a cell")
    return {"noise is smaller": ratio <= 0.2, "stress converges": falls}, because


@claim(
    "CPDI shows no numerical fracture in large stretch, where GIMP does",
    "Sadeghirad, Brannon and Burghardt 2011, vertical bar",
    threshold="at 1000 m/s2, until 0.12 s, on 8 and 16 cells: CPDI holds (gap below 2) within 2 % of "
    "1.6666 m, both GIMP part",
)
def cpdi_fracture(runs: Runs) -> Answer:
    """The heavy bar at 1000 m/s2."""
    answer, words = {}, []
    for n in (8, 16):
        heavy = {"problem__gravity": 1000, "resolution": n}
        match = {**METHODS["CPDI"], **heavy}
        if _finished(runs, "heavy_bar", **match):
            error = runs.number("heavy_bar", "error_elongation", **match)
            gap = runs.number("heavy_bar", "largest_gap", **match)
            answer[f"CPDI holds on {n} cells"] = gap < 2.0 and error < 0.02
            found = f"has a gap of {gap:.2f} and an elongation that is off by {100.0 * error:.1f} %"
        else:
            answer[f"CPDI holds on {n} cells"], found = False, "parts"
        parted = {
            name: not _finished(runs, "heavy_bar", **METHODS[name], **heavy)
            for name in ("uGIMP", "cpGIMP")
        }
        answer |= {f"{name} parts on {n} cells": does for name, does in parted.items()}
        others = ", ".join(f"{name} {'parts' if x else 'holds'}" for name, x in parted.items())
        words.append(f"on {n} cells CPDI {found}; {others}")
    return answer, "; ".join(words)


@claim(
    "APIC conserves angular momentum, PIC does not",
    "Jiang, Schroeder and Teran 2015",
    threshold="APIC without a cut-off of small masses keeps it to 1e-10 in half a turn of a free disk, "
    "PIC loses more than 1 %",
    holds=lambda exact, apic, pic: abs(exact) < 1e-10 and pic > 0.01,
    sentence="in half a turn APIC loses {exact:.1e} of it, with the usual cut-off of small masses "
    "{apic:.1e}, PIC {pic:.2g}",
)
def apic_momentum(runs: Runs) -> dict[str, float]:
    """Lost shares."""
    names = {"exact": "apic, no cut-off", "apic": "apic", "pic": "pic"}
    return {
        key: 1.0 - runs.number("transfers", "angular_momentum_kept", **TRANSFERS[name])
        for key, name in names.items()
    }


def _rates(runs: Runs, *names: str) -> dict[str, float]:
    """Decay of the kinetic energy of the spinning disk, ``-ln(E/E_0)``; infinite after a breakdown."""
    found = {}
    for name in names:
        match = TRANSFERS[name]
        done = _finished(runs, "transfers", **match)
        kept = runs.number("transfers", "kinetic_energy_kept", **match) if done else 0.0
        found[name] = -math.log(kept) if kept > 0.0 else math.inf
    return found


def _less(runs: Runs, *names: str) -> Answer:
    """Whether the first transfer decays at half the rate of PIC or less, and each next one slower."""
    rates = _rates(runs, "pic", *names)
    answer = {f"{names[0]} against pic": rates[names[0]] <= 0.5 * rates["pic"]}
    for before, after in pairwise(names):
        answer[f"{after} against {before}"] = rates[after] < rates[before]
    words = [
        f"{name}: {rate:.2g}" if math.isfinite(rate) else f"{name} breaks down"
        for name, rate in rates.items()
    ]
    return answer, f"-ln(E/E_0) of the kinetic energy after half a turn: {', '.join(words)}"


@claim(
    "XPIC dissipates far less than PIC, and less with more terms",
    "Hammerquist and Nairn 2017",
    threshold="the kinetic energy decays at half the rate of PIC or less with two terms, and slower with five",
)
def xpic_dissipation(runs: Runs) -> Answer:
    """Kinetic energy of the spinning disk."""
    return _less(runs, "xpic(2)", "xpic(5)")


@claim(
    "FMPM dissipates far less than PIC, and less with more terms",
    "Nairn and Hammerquist 2021",
    threshold="the kinetic energy decays at half the rate of PIC or less with two terms, slower with three, "
    "and slower still with five",
)
def fmpm_dissipation(runs: Runs) -> Answer:
    """Kinetic energy of the spinning disk."""
    return _less(runs, "fmpm(2)", "fmpm(3)", "fmpm(5)")


@claim(
    "FMPM dissipates less than XPIC with as many terms",
    "Nairn and Hammerquist 2021",
    threshold="the kinetic energy decays more slowly with two terms",
    holds=lambda fmpm, xpic: fmpm < xpic,
    sentence="-ln(E/E_0) after half a turn is {fmpm:.2g} with fmpm(2) and {xpic:.2g} with xpic(2)",
)
def fmpm_against_xpic(runs: Runs) -> dict[str, float]:
    """Rates with two terms."""
    rates = _rates(runs, "fmpm(2)", "xpic(2)")
    return {"fmpm": rates["fmpm(2)"], "xpic": rates["xpic(2)"]}


@claim(
    "TLMPM is cheaper than MPM with the same functions",
    "de Vaucorbeil, Nguyen and Hutchinson 2020",
    threshold="processor time per particle and step on the vortex, 32 cells, quadratic splines: "
    "less than 0.9 of updated MPM's",
    holds=lambda share: share < 0.9,
    sentence="a step of TLMPM takes {share:.2f} of one of updated MPM",
)
def tlmpm_cost(runs: Runs) -> dict[str, float]:
    """Both with quadratic splines, on the same particles."""
    times = []
    for name in ("TLMPM, splines", "MPM, splines"):
        match = {**METHODS[name], "problem__seeding": "polar", "resolution": 32}
        solving = runs.number("vortex", "solver_cpu_time", **match)
        times.append(solving / runs.number("vortex", "steps", **match))
    return {"share": times[0] / times[1]}


@claim(
    "TLMPM is of second order on the vortex",
    "de Vaucorbeil, Nguyen and Hutchinson 2020",
    threshold="fitted order from 8 to 32 cells between 1.7 and 2.3",
)
def tlmpm_order(runs: Runs) -> Answer:
    """Orders by functions and seeding."""
    answer, words = {}, []
    for name in ("TLMPM, hats", "TLMPM, splines"):
        for seeding in SEEDINGS:
            found = runs.order("vortex", ERROR, **METHODS[name], problem__seeding=seeding)
            answer[f"{name.split(', ')[1]}, {seeding} seeds"] = 1.7 <= found.slope <= 2.3
            words.append(f"{name}, {seeding} seeds: {slopes_text(found)}")
    return answer, "; ".join(words)


@claim(
    "TLMPM is the most accurate of the family on the vortex",
    "de Vaucorbeil, Nguyen and Hutchinson 2020",
    threshold="with 32 cells the best TLMPM has the smallest error, or one within 10 % of it",
)
def tlmpm_best(runs: Runs) -> Answer:
    """Errors of all methods with 32 cells."""
    answer, words = {}, []
    for seeding in SEEDINGS:
        errors = {name: _errors(runs, name, seeding)[32] for name in METHODS}
        best = min(errors, key=lambda name: errors[name])
        total = min(error for name, error in errors.items() if name.startswith("TLMPM"))
        answer[f"{seeding} seeds"] = total <= 1.1 * errors[best]
        words.append(
            f"{seeding} seeds: {best} has {errors[best]:.2e} m, the best TLMPM {total:.2e} m"
        )
    return answer, "; ".join(words)


@claim(
    "MPM, GIMP and CPDI: on the vortex MPM and GIMP break down, CPDI survives",
    "Kamojjala et al. 2015",
    threshold="at A = 0.5 on 8, 16 and 32 cells: CPDI always finishes with an error that falls, the "
    "others do not",
)
def vortex_survival(runs: Runs) -> Answer:
    """Who finishes, and whose errors fall, by seeding."""
    answer, words = {}, []
    for seeding in SEEDINGS:
        for name in ("MPM, hats", "uGIMP", "cpGIMP", "CPDI"):
            errors = list(_errors(runs, name, seeding).values())
            survives = math.isfinite(errors[-1]) and errors[0] > errors[1] > errors[2]
            answer[f"{name} on {seeding} seeds"] = survives == (name == "CPDI")
            end = "converges" if survives else "does not converge"
            words.append(f"{name} {end} on {seeding} seeds ({', '.join(map(_short, errors))})")
    return answer, "; ".join(words)


def _short(error: float) -> str:
    return f"{error:.1e} m" if math.isfinite(error) else "broke down"


@claim(
    "F-bar removes volumetric locking",
    "Coombs et al. 2018; de Souza Neto et al. 1996",
    threshold="Cook's membrane on 16 cells: what locks, below 0.9 of the reference, is within 5 % of it with F-bar",
)
def f_bar_locking(runs: Runs) -> Answer:
    """Rise of the middle of the right edge over the converged one."""
    answer, words = {}, []
    for name, match in LOCKING.items():
        standard, f_bar = (
            runs.number(
                "locking",
                "middle_over_reference",
                **match,
                method__volumetric=volumetric,
                resolution=16,
            )
            for volumetric in ("standard", "f_bar")
        )
        if standard < 0.9:
            answer[name] = abs(f_bar - 1.0) < 0.05
        does = "" if standard < 0.9 else ", does not lock"
        words.append(f"{name}: {standard:.3f} without{does}, {f_bar:.3f} with F-bar")
    return answer or False, "; ".join(words)
