"""The paper's claims, each with a rule that judges it from stored runs."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np

from mpmbench.analysis.estimate import slopes_text
from mpmbench.papers.iaconeta2017.disk import ROWS, STEPS, printed_overheads
from mpmbench.papers.iaconeta2017.support import COLUMNS, MESHES, METHODS
from mpmbench.report.claims import Claims, Holds, SetUp
from mpmbench.report.evidence import MissingRuns, Runs
from mpmbench.report.timing import clock_in

Answer = tuple[Holds, str]
ROOT = 2.0**0.5
SIZES = (16, 32, 64, 128)
MIDDLE = 1  # of the three time steps of Table 1: 2 ms
MLS = "the weight and the polynomials of the moving least squares"
SET_UPS = (
    SetUp("as stated"),
    SetUp("quartic spline", {"weight": "quartic_spline"}, MLS),
    SetUp("Gaussian", {"weight": "gaussian"}, MLS),
    SetUp("1, x, y, xy", {"mixed_terms": True}, MLS),
    SetUp("degree 2", {"degree": 2}, MLS),
)
IN_WORDS = (
    "All claims are judged in one set-up: the load in one step, the search radii of the paper, moving "
    "least squares of degree 1 with a cubic spline as weight, a disk that starts one cell (MPM) or one "
    "search radius (GMM) above the plane. The paper states neither the weight nor the polynomials of "
    "the moving least squares: a claim that turns on these is not decidable."
)
# the cubic spline of degree 1 that is zero at the search radius
RIM_VANISHES: dict[str, Any] = {
    "basis__effective_radius": 0.5,
    "basis__degree": 1,
    "basis__mixed_terms": False,
}
BASE = 4.0  # in front of the soil column's foot [m]
claim = Claims()


@claim(
    "All the methods have a quadratic rate of convergence",
    "Fig. 7",
    quote="It is demonstrated that all the methods have a quadratic rate of convergence.",
    threshold="every order between h = 0.5 m and 0.0625 m lies between 1.8 and 2.2",
)
def quadratic(runs: Runs) -> Answer:
    """Orders of the deflection between h = 0.5 m and 0.0625 m."""
    orders = {
        name: runs.order("fig7", "error_tip", SIZES, **_method(runs, name)) for name in METHODS
    }
    parts = [f"{name}: p = {slopes_text(order)}" for name, order in orders.items()]
    return all(1.8 < order.slope < 2.2 for order in orders.values()), ", ".join(parts)


@claim(
    "-0.67433 m is equally reached by all the methods",
    "Sect. 5.1",
    quote="is equally reached by all the methods.",
    threshold="every deflection at h = 0.01 m is within 1e-5 m of -0.67433 m",
)
def same_limit(runs: Runs) -> Answer:
    """Deflections at h = 0.01 m."""
    found = {
        name: runs.number("fig7", "tip_deflection", resolution=800, **_method(runs, name))
        for name in METHODS
    }
    because = ", ".join(f"{name} {value:.6f} m" for name, value in found.items()) + " at h = 0.01 m"
    return all(abs(value + 0.67433) < 1e-5 for value in found.values()), because


@claim(
    "UL-FEM, MPM and GMM-MLS error curves coincide",
    "Fig. 7",
    quote="In particular, the UL-FEM, MPM and GMM-MLS error curves coincide.",
    threshold="MPM within 1e-4 of UL-FEM, GMM-MLS within 20 %; 50 load steps change MPM by less than 1e-3",
)
def curves(runs: Runs) -> Answer:
    """Errors of MPM and GMM-MLS over those of UL-FEM, and MPM with load steps."""
    fem, mpm, mls = (
        np.array([runs.number("fig7", "error_tip", resolution=n, **match) for n in SIZES])
        for match in (_method(runs, name) for name in ("UL-FEM", "MPM", "GMM-MLS"))
    )
    apart = np.abs(mpm / fem - 1.0).max()
    mls /= fem
    bare: dict[str, Any] = {"method__ghost_stiffness": 0.0}
    once, often = (
        runs.number("load_steps", "tip_deflection", **METHODS["MPM"], problem__load_steps=n, **bare)
        for n in (1, 50)
    )
    because = (
        f"MPM and UL-FEM agree to {apart:.1e} when the load is applied at once; with 50 load steps "
        f"the deflection of MPM changes by {100.0 * (often / once - 1.0):.2f} %. The error of "
        f"GMM-MLS is {mls.min():.2f} to {mls.max():.2f} times that of UL-FEM"
    )
    if apart > 1e-4 or not 0.8 < mls.min() <= mls.max() < 1.2:
        return False, because
    return abs(often / once - 1.0) < 1e-3 or "when the load is applied in one step", because


@claim(
    "GMM-LME is less accurate than GMM-MLS in statics",
    "Fig. 7",
    quote="the quadratic rate is maintained, but the curve is shifted a bit upwards, which makes this "
    "technique less accurate than GMM-MLS",
    threshold="a larger error of the deflection at h = 0.125 m with R = sqrt(2) h, and with R = 3 h",
    holds=lambda narrow, wide, **_: {
        "the search radius of the paper": narrow > 1.0,
        "R = 3 h": wide > 1.0,
    },
    sentence=(
        "at h = 0.125 m the error of GMM-LME is {narrow:.2f} times that of GMM-MLS with R = "
        "sqrt(2) h and {wide:.2f} times with R = 3 h; its own falls from {own_narrow:.2e} to "
        "{own_wide:.2e}: the cut made most of it"
    ),
)
def lme(runs: Runs) -> dict[str, float]:
    """Errors of GMM-LME over those of GMM-MLS with both radii, and its own."""

    def error(radius: float, **match: Any) -> float:
        return runs.number(
            "radius", "error_tip", **match, basis__relative_radius=radius, resolution=64
        )

    match: dict[str, Any] = {"basis": "lme", "basis__gamma": 1.8}
    mls = {"basis": "mls", **(_mls_choice(runs) or {})}
    quotients = [error(radius, **match) / error(radius, **mls) for radius in (ROOT, 3.0)]
    own = [error(radius, **match) for radius in (ROOT, 3.0)]
    return dict(zip(("narrow", "wide", "own_narrow", "own_wide"), quotients + own, strict=True))


@claim(
    "By using either MPM or GMM, the contact is implicitly caught",
    "Sect. 5.2",
    quote="by using either MPM or GMM, the contact is implicitly caught",
    threshold="the disk ends within 20 % of the exact way",
)
def contact(runs: Runs) -> Answer:
    """A disk that touches the plane, and one that starts above it."""
    stuck, held = [], True
    for name in COLUMNS:
        here = {"problem__gap": 0.0, **_method(runs, name)}
        words = runs.status("glued", **here)
        if words == "ok":
            short = runs.number("glued", "error_end_relative", **here)
            held &= short < -0.5
            words = f"{100.0 * -short:.0f} % short"
        stuck.append(f"{words} ({name})")
    free = [
        runs.number("table1", "error_end_relative", time_step=2e-3, **match)
        for name, match in ROWS.items()
        if name != "GMM-MLS"
    ]
    rising = runs.number("glued", "error_end_relative", problem__diagonal="rising")
    because = (
        f"a disk that touches the plane at the start: {', '.join(stuck)}; one that starts above it "
        f"ends {100.0 * min(free):.1f} to {100.0 * max(free):.1f} % off, but "
        f"{100.0 * -rising:.0f} % short when the background squares of MPM are cut along rising "
        "diagonals"
    )
    if max(map(abs, free)) > 0.2:
        return False, because
    return "when the disk starts above the plane" if held else True, because


def _table1(
    runs: Runs, quantity: str, mls: Mapping[str, Any] = MappingProxyType({})
) -> dict[str, np.ndarray]:
    """A quantity of Table 1 by rows, for 4, 2 and 1 ms; nan for runs that did not finish.

    Runs of moving least squares match `mls` besides what their rows say.
    """

    def number(**here: Any) -> float:
        done = runs.status("table1", **here) == "ok"
        return runs.number("table1", quantity, **here) if done else np.nan

    rows = {
        name: {**match, **(mls if match.get("basis") == "mls" else {})}
        for name, match in ROWS.items()
    }
    return {
        name: np.array([number(**match, time_step=dt) for dt in STEPS])
        for name, match in rows.items()
    }


@claim(
    "In the dynamic case GMM is more accurate than MPM",
    "Sect. 5.2, Table 1",
    quote="for a given computational cost, GMM is generally more accurate than MPM",
    threshold="a smaller RMS error of the centre in every case of Table 1",
)
def gmm(runs: Runs) -> Answer:
    """Root mean square errors of Table 1; with another MLS those of its middle time step."""
    errors = _table1(runs, "error_centre_rms")
    other = _other_mls(runs)
    if other is not None:
        mpm = errors["MPM"][MIDDLE]
        return other < mpm, f"GMM-MLS {other:.3g} m, MPM {mpm:.3g} m, 2 ms"
    others = [row < errors["MPM"] for name, row in errors.items() if name != "MPM"]
    better, total = int(np.sum(others)), int(np.size(others))
    rows = []
    for name, row in errors.items():
        words = ["failed" if np.isnan(value) else f"{value:.3g}" for value in row]
        rows.append(f"{name} {', '.join(words)}")
    because = f"GMM has the smaller RMS error in {better} of {total} cases [m, for 4, 2 and 1 ms]"
    because = f"{because}: {'; '.join(rows)}. The error mixes rolling with bounces and flights"
    return better == total, because


def _other_mls(runs: Runs) -> float | None:
    """RMS error [m] of the disk with the moving least squares of this set-up; None as stated."""
    match = _mls_choice(runs)
    if match is None:
        return None
    above: dict[str, Any] = {"problem__gap": 1.5 * ROOT, "basis__effective_radius": 2.0 / 3.0}
    return runs.number("mls_disk", "error_centre_rms", **match, **above)


def _method(runs: Runs, name: str) -> dict[str, Any]:
    """What a run of one of the paper's methods must match in this set-up."""
    other = _mls_choice(runs) if name == "GMM-MLS" else None
    return {**METHODS[name], **(other or {})}


def _mls_choice(runs: Runs) -> dict[str, Any] | None:
    """What a run of GMM-MLS with the weight and polynomials of this set-up must match."""
    stated = {"weight": "cubic_spline", "degree": 1, "mixed_terms": False}
    chosen = {key: runs.choice(key, value) for key, value in stated.items()}
    if chosen == stated:
        return None
    return {"basis": "mls"} | {f"basis__{key}": value for key, value in chosen.items()}


@claim(
    "There, GMM-LME has smaller errors than GMM-MLS",
    "Sect. 5.2, Table 1",
    quote="GMM-LME presents smaller errors in comparison to GMM-MLS",
    threshold="a smaller RMS error of the centre in every case, and from each of both gaps above the plane",
)
def lme_dynamic(runs: Runs) -> Answer:
    """RMS errors of GMM-LME against GMM-MLS, from the gaps of Table 1 and from the same gaps."""
    errors = _table1(runs, "error_centre_rms")
    other = _mls_choice(runs)
    published = {"basis__effective_radius": 2.0 / 3.0}
    match = RIM_VANISHES if other is None else other | published
    near, far = (_from_gap(runs, gap, match) for gap in (ROOT, 1.5 * ROOT))
    rows = [row for name, row in errors.items() if "LME" in name]
    if other is None:
        mls = errors["GMM-MLS, R_eff = R / 2"]
        failed = int(np.isnan(errors["GMM-MLS"]).sum())
        with_what = f"GMM-MLS with R_eff = R / 2 (with R_eff = sqrt(2) h {failed} of {len(STEPS)} runs fail)"
    else:
        rows, mls = [row[MIDDLE : MIDDLE + 1] for row in rows], np.array([far[1]])
        with_what = "GMM-MLS at 2 ms"
    quotients = np.concatenate([row / mls for row in rows])
    better = int(np.sum(quotients < 1.0))
    because = (
        f"GMM-LME has the smaller RMS error in {better} of {len(quotients)} cases, "
        f"{np.nanmin(quotients):.2f} to {np.nanmax(quotients):.2f} times that of {with_what}, where "
        "GMM-LME starts 1.41 h above the plane and GMM-MLS 2.12 h; 2 ms, both from 1.41 h: GMM-LME "
        f"{_metres(near[0])}, GMM-MLS {_metres(near[1])}; both from 2.12 h: GMM-LME "
        f"{_metres(far[0])}, GMM-MLS {_metres(far[1])}"
    )
    parts = {
        "the gaps of Table 1": better == len(quotients),
        "the same gap of 1.41 h": near[0] < near[1],
        "the same gap of 2.12 h": far[0] < far[1],
    }
    return parts, because


def _from_gap(runs: Runs, gap: float, match: dict[str, Any]) -> tuple[float, float]:
    """RMS errors [m] of GMM-LME and GMM-MLS from the same gap [h] above the plane, 2 ms.

    Infinite for a run that did not finish.
    """

    def error(**here: Any) -> float:
        done = runs.status("mls_disk", **here, problem__gap=gap) == "ok"
        return (
            runs.number("mls_disk", "error_centre_rms", **here, problem__gap=gap)
            if done
            else np.inf
        )

    return error(basis="lme"), error(**{"basis": "mls", **match})


def _metres(error: float) -> str:
    return f"{error:.4g} m" if np.isfinite(error) else "failed"


@claim(
    "GMM takes 10 % (MLS) and 8.5 % to 16 % (LME) more time than MPM",
    "Sect. 5.2, Table 1",
    quote="showing an increment of computational time of 10% in the case of GMM-MLS and from 8.5% up to "
    "16% in the case of GMM-LME",
    threshold="5 % to 20 % more time in every case",
    holds=lambda low, high, **_: low > 5.0 and high < 20.0,
    sentence=(
        "GMM takes {low:.0f} % to {high:.0f} % more time than MPM here, where only active "
        "nodes enter the system; Table 1 itself gives {least:+.1f} % to {most:+.1f} %"
    ),
)
def cost(runs: Runs) -> dict[str, float]:
    """Least and largest solver time of GMM over that of MPM, less one [%]: here, and as printed."""
    times = _table1(runs, clock_in(runs.campaigns, "table1").quantity, _mls_choice(runs) or {})
    over = np.array([row / times["MPM"] - 1.0 for name, row in times.items() if name != "MPM"])
    least, most = printed_overheads()
    return {
        "low": 100.0 * float(np.nanmin(over)),
        "high": 100.0 * float(np.nanmax(over)),
        "least": 100.0 * least,
        "most": 100.0 * most,
    }


@claim(
    "The final configurations of MPM, GMM-LME and GMM-MLS are almost coincident",
    "Fig. 10",
    quote="the final configurations at time 2.0 s of MPM, GMM-LME and GMM-MLS are almost "
    "coincident using Mesh 1 and Mesh 2",
    threshold="all three finish, and their run-outs differ by less than 10 % on every mesh",
)
def columns(runs: Runs) -> Answer:
    """Run-outs at 2 s, mesh by mesh: how far apart, and of which methods."""
    other = _mls_choice(runs)
    if other is not None:
        found = {
            name: runs.number("soil", "final_run_out", **METHODS[name], resolution=40)
            for name in COLUMNS
            if name != "GMM-MLS"
        }
        found["GMM-MLS"] = runs.number("mls_soil", "final_run_out", **other)
        spread = max(found.values()) / min(found.values()) - 1.0
        run_outs = ", ".join(
            f"{name} {value:.3f} m" if value < BASE else f"{name} flings a particle off the base"
            for name, value in found.items()
        )
        apart = f"; they differ by {100.0 * spread:.0f} %" if max(found.values()) < BASE else ""
        return spread < 0.1, f"h = 0.1 m: {run_outs}{apart}"
    parts, holds = [], True
    for n, campaign in MESHES:
        match = {name: {**METHODS[name], "resolution": n} for name in COLUMNS}
        try:
            ended = {name: runs.status(campaign, **here) for name, here in match.items()}
        except MissingRuns:
            if campaign == "soil":
                raise
            continue  # `reproduce` does not run the finest mesh
        found = {
            name: runs.number(campaign, "final_run_out", **match[name])
            for name in COLUMNS
            if ended[name] == "ok"
        }
        spread = max(found.values()) / min(found.values()) - 1.0 if found else np.inf
        holds &= len(found) == len(COLUMNS) and spread < 0.1
        advance = {name: f"{value:.3f} m" for name, value in found.items()}
        words = [f"{name} {advance.get(name, ended[name].replace('_', ' '))}" for name in COLUMNS]
        mesh = f"h = {4.0 / n:g} m: {', '.join(words)}"
        parts.append(f"{mesh}; those that finish differ by {100.0 * spread:.0f} %")
    return holds, "advance at 2 s, " + "; ".join(parts)


@claim(
    "MPM is more robust than GMM under extremely large deformation",
    "Sect. 5.3",
    quote="a lack of robustness of the GMM algorithm is observed",
    threshold="MPM finishes with no more helped steps than either GMM, or where a GMM fails",
)
def robust(runs: Runs) -> Answer:
    """Steps that needed a stiffer tangent or halves, and how runs ended; another MLS: h = 0.1 m."""
    other = _mls_choice(runs)
    helped = dict.fromkeys(COLUMNS, 0.0)
    parts, failed = [], set()
    for name in COLUMNS:
        campaign = "soil" if other is None or name != "GMM-MLS" else "mls_soil"
        for n in (40, 80) if other is None else (40,):
            match = {**_method(runs, name), "resolution": n}
            found = runs.status(campaign, **match).replace("_", " ")
            if found == "ok":
                kinds = ("stiffened_steps", "halved_steps")
                steps = sum(runs.number(campaign, kind, **match) for kind in kinds)
                helped[name] += steps
                found = f"{steps:.0f}"
            else:
                failed.add(name)
            parts.append(f"{name} h = {4.0 / n:g} m: {found}")
    bare = runs.status("soil_check", method__ghost_stiffness=0.0)
    because = (
        f"steps that Newton's own iteration did not solve: {', '.join(parts)}; "
        f"MPM without ghost stiffness, to 0.5 s: {bare.replace('_', ' ')}"
    )
    fewest = helped["MPM"] <= min(helped["GMM-MLS"], helped["GMM-LME"])
    return "MPM" not in failed and (bool(failed) or fewest), because
