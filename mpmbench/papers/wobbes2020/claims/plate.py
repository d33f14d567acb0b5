"""Claims on the plate (Sect. 8.3)."""

from typing import Any

import numpy as np

from mpmbench.papers.kit import Campaigns
from mpmbench.papers.wobbes2020.claims.judging import LARGE, MUCH, Answer, chosen, claim
from mpmbench.papers.wobbes2020.support import METHODS, PROFILE, RELATIVE_STRESS, fields, method
from mpmbench.report.evidence import Evidence, Runs
from mpmbench.report.tables import number_text

ROW = 0.07  # height of the particles shown in Fig. 9 [m]
CONSTANT = 0.05  # piecewise constant: scatter within a cell over that of all particles


def _error(runs: Runs, name: str) -> float:
    """Relative RMS error of the stress in Fig. 9; infinite where the run did not finish."""
    more = {"basis__d_max": runs.choice("d_max", 3.0)} if name == "MPM-maxent" else {}
    match = chosen(runs, name, **more)
    done = runs.status("fig9", **match) == "ok"
    return runs.number("fig9", RELATIVE_STRESS, **match) if done else np.inf


def _words(errors: dict[str, float]) -> str:
    return ", ".join(
        f"{name} {number_text(error) if np.isfinite(error) else 'broke down'}"
        for name, error in errors.items()
    )


@claim(
    "The stress of piecewise-linear functions is piecewise constant",
    "Sect. 8.3, Fig. 9",
    quote="Employing piecewise-linear basis functions within both MPM and the OTM method leads only "
    "to a piecewise-constant approximation of the stress field",
    threshold=f"the standard deviation of the stress within a cell is at most {CONSTANT:g} of that "
    "over all particles of the row",
)
def piecewise_constant(runs: Runs) -> Answer:
    """Scatter of the stress within the cells of the row of Fig. 9."""
    found = {}
    for name in ("MPM-P1", "OTM-P1"):
        file, one = fields(Campaigns(runs.campaigns), "fig9", *PROFILE, **method(name))
        x = one["position_initial"]
        row = np.abs(x[:, 1] - x[np.argmin(np.abs(x[:, 1] - ROW)), 1]) < 1e-9
        place = one["position" if name == "MPM-P1" else "position_initial"][row, 0]
        stress, cell = one["stress"][row, 0, 0], np.floor(32 * place).astype(int)
        means = np.bincount(cell, stress) / np.maximum(np.bincount(cell), 1)
        found[name] = float(np.std(stress - means[cell]) / np.std(stress))
        runs.evidence.append(Evidence(f"scatter within cells, {name}", found[name], (file,)))
    words = " and ".join(f"{value:.2g} ({name})" for name, value in found.items())
    because = f"within a cell the stress scatters by {words} of its scatter over the row"
    return {name: value <= CONSTANT for name, value in found.items()}, because


@claim(
    "Max-ent functions give considerably more accurate stresses than linear ones",
    "Sect. 8.3, Fig. 9",
    quote="The simulations performed with the maxent basis functions show considerably more accurate "
    "stress approximations for both methods",
    threshold=LARGE,
)
def maxent_stress(runs: Runs) -> Answer:
    """Errors of the stress in Fig. 9, linear functions against max-ent."""
    names = ("MPM-P1", "MPM-maxent", "OTM-P1", "OTM-maxent")
    errors = {name: _error(runs, name) for name in names}
    parts = {
        scheme: errors[f"{scheme}-maxent"] * MUCH <= errors[f"{scheme}-P1"]
        for scheme in ("MPM", "OTM")
    }
    return parts, f"relative RMS errors of the stress: {_words(errors)}"


@claim(
    "B-splines give even smoother stresses than max-ent functions",
    "Sect. 8.3, Fig. 9",
    quote="The unified approach and BSMPM lead to an even smoother stress profiles which are in "
    "close agreement with the analytical solution",
    threshold="a smaller RMS error of the stress",
)
def ranking(runs: Runs) -> Answer:
    """Errors of the stress in Fig. 9, B-splines against max-ent."""
    names = [name for name in METHODS if not name.endswith("P1")]
    errors = {name: _error(runs, name) for name in names}
    better = {
        "MPM": errors["BSMPM"] < errors["MPM-maxent"],
        "OTM": errors["unified"] < errors["OTM-maxent"],
    }
    return better, f"relative RMS errors of the stress: {_words(errors)}"


@claim(
    "MPM with max-ent functions needs d_max = 3 on the plate",
    "Sect. 8.3",
    quote="To obtain these results with the MPM algorithm, the user-defined factor d_max is set to "
    "3.0, while for the OTM method, d_max = 2.0 is taken",
    threshold="with d_max = 2 the run fails, or its error of the stress is larger",
)
def support_size(runs: Runs) -> Answer:
    """How MPM with max-ent functions and consistent mass ends for d_max of 2 and 3."""
    match = METHODS["MPM-maxent"] | {"mass": "consistent"}
    words, errors = [], []
    for size in (2.0, 3.0):
        here: dict[str, Any] = {**match, "basis__d_max": size}
        status = runs.status("fig9", **here)
        done = status == "ok"
        errors.append(runs.number("fig9", RELATIVE_STRESS, **here) if done else np.inf)
        error = f"{number_text(errors[-1])} of the stress" if done else status.replace("_", " ")
        words.append(f"d_max = {size:g}: {error}")
    return errors[1] < errors[0], f"MPM-maxent with consistent mass, {', '.join(words)}"
