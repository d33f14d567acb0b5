"""Section 3.2.4: the incremental variational update at single points, beside the equations that it approximates."""

from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from mpmbench.papers.kit import Campaigns, Chapter, variables
from mpmbench.papers.parts import of_file, thinned
from mpmbench.report import style
from mpmbench.report.evidence import MissingRuns
from mpmbench.report.figures import panels

METAL = {"material": "thermo_viscoplastic"}
STRETCH = METAL | {"problem__path": "stretch"}
POINTS: dict[str, dict[str, Any]] = {
    "stretched at 1 /s": STRETCH | {"problem__rate": 1.0},
    "stretched at 1e3 /s": STRETCH | {"problem__rate": 1e3},
    "stretched at 1e6 /s": STRETCH | {"problem__rate": 1e6, "material__initial_temperature": 300.0},
    "stretched at 1e6 /s, from 800 K": STRETCH
    | {"problem__rate": 1e6, "material__initial_temperature": 800.0},
    "sheared at 1e3 /s": METAL | {"problem__path": "shear"},
    "back and forth at 1e3 /s": METAL | {"problem__path": "cyclic"},
    "von Mises, stretched": {"material": "j2"},
}
SERIES = ("time", "strain", "axial_stress", "plastic_strain_history", "temperature_history")
PRECISION = 1e-9  # of the integrator
MELTS, MOST_OVER = 1.0 - 1e-9, 10.0  # bounds of what it tries


def exact_stress(
    settings: dict[str, float], time: np.ndarray, strain: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Stress [Pa] and plastic strain over a history of the strain, by integrating Eqs. 5.3 to 5.9.

    With ``q' = 3 mu (strain' - e' sign q)`` and, beyond the yield stress, ``|q| = theta(T) g(e) (1 +
    e' / rate_0)^(1/m)``, or without rate and heat the linear hardening of j2 (where the strain has one sign).
    """
    shear = 0.5 * settings["young_modulus"] / (1.0 + settings["poisson_ratio"])
    first = settings["yield_stress"]
    if "rate_exponent" not in settings:
        hardening = settings["hardening_modulus"]
        beyond = np.maximum(3.0 * shear * strain - first, 0.0) / (3.0 * shear + hardening)
        return 3.0 * shear * (strain - beyond), beyond
    heating = settings["taylor_quinney"] / (settings["density"] * settings["specific_heat"])
    span = settings["melting_temperature"] - settings["reference_temperature"]

    def rates(t: float, state: np.ndarray, speed: float) -> np.ndarray:
        q, e, work = state[0], max(state[1], 0.0), state[2]  # the integrator tries others too
        rise = settings["initial_temperature"] + heating * work - settings["reference_temperature"]
        theta = 1.0 - np.clip(rise / span, 0.0, MELTS) ** settings["softening_exponent"]
        g = first * (1.0 + e / settings["reference_strain"]) ** (
            1.0 / settings["hardening_exponent"]
        )
        over = min(max(abs(q) / (theta * g), 1.0), MOST_OVER)
        flow = settings["reference_rate"] * (over ** settings["rate_exponent"] - 1.0)
        return np.array([3.0 * shear * (speed - np.sign(q) * flow), flow, abs(q) * flow])

    speed = np.diff(strain) / np.diff(time)
    turns = np.flatnonzero(np.abs(np.diff(speed)) > 1e-6 * np.abs(speed).max()) + 1
    state, stress, plastic = np.zeros(3), [0.0], [0.0]
    for start, stop in zip([0, *turns], [*turns, len(time) - 1], strict=True):
        found = solve_ivp(
            rates, (time[start], time[stop]), state, "Radau", time[start + 1 : stop + 1],
            args=(speed[start],), rtol=PRECISION, atol=PRECISION * np.array([first, 1.0, first]),
        )  # fmt: skip
        stress.extend(found.y[0])
        plastic.extend(found.y[1])
        state = found.y[:, -1]
    return np.array(stress), np.array(plastic)


def settings_of(campaigns: Campaigns, file: str) -> dict[str, float]:
    """Numbers of the material of a run; those that are null are left out."""
    row = campaigns["inelastic"].settings.loc[file]
    named = {
        str(key).removeprefix("material."): value
        for key, value in row.items()
        if str(key).startswith("material.")
    }
    return {
        key: float(value)
        for key, value in named.items()
        if isinstance(value, (int, float)) and not isinstance(value, bool) and np.isfinite(value)
    }


def inelastic_chapter(campaigns: Campaigns) -> Chapter:
    """Stress and temperature along paths of strain, and the exact stress in black."""
    page = Chapter(
        "inelastic",
        "Sect. 3.2.4: inelastic solids, the incremental update at a point",
        "The stress follows from the minimum of an incremental energy, so that a step of an inelastic solid "
        "is one of an elastic solid with another energy.",
    )
    figure, axes = panels(1, 2, 2.8)
    rows: list[list[Any]] = []
    for rank, (name, match) in enumerate(POINTS.items()):
        try:
            file, found = variables(campaigns, "inelastic", *SERIES, **match)
        except MissingRuns:
            if rank == 0:
                raise
            continue
        exact, plastic = exact_stress(settings_of(campaigns, file), found["time"], found["strain"])
        width = 4.0 - 0.5 * rank  # where paths coincide, the later one lies on the wider one
        look: dict[str, Any] = {"color": f"C{rank}", "lw": width, "alpha": 0.7}
        axes[0, 0].plot(*thinned(found["strain"], 1e-6 * found["axial_stress"]), label=name, **look)
        axes[0, 0].plot(*thinned(found["strain"], 1e-6 * exact), **style.EXACT | {"linewidth": 0.5})
        axes[0, 1].plot(
            *thinned(found["plastic_strain_history"], found["temperature_history"]), **look
        )
        scale = float(np.abs(exact).max())
        ends = (
            found["axial_stress"][-1],
            found["plastic_strain_history"][-1],
            found["temperature_history"][-1],
        )
        apart = np.abs(found["axial_stress"] - exact).max() / scale
        strains = np.abs(found["plastic_strain_history"] - plastic).max()
        rows.append([name, *of_file(file, *ends, apart, strains)])
    axes[0, 0].set(xlabel="strain", ylabel="stress [MPa]")
    axes[0, 1].set(xlabel="equivalent plastic strain", ylabel="temperature [K]")
    axes[0, 0].legend(fontsize=5)
    caption = (
        "Colours: 2,000 steps of the update; black: the differential equations, integrated to nine digits. "
        "Where paths coincide, the thinner line lies on the wider one."
    )
    page.draw("paths", "Stress and temperature along paths", caption, figure)
    columns = ["point", "stress at the end [Pa]", "plastic strain", "temperature [K]"]
    columns += ["largest difference of stress over the largest stress", "of plastic strain"]
    note = (
        "Power laws of hardening and rate (m = 10, 1000 /s), softening, adiabatic heat, Eqs. 5.3 to 5.9. "
        "The dual potential holds the overstress only: hardening counts once. Von Mises has no heat."
    )
    page.tabulate(
        "ends", "The update beside the exact stress", columns, rows, numeric=range(1, 6), note=note
    )
    page.notes.append(
        "A step takes the temperature of its start, and flow stress by the rate times that of its start: "
        "the differences are of first order in the step. Where the strain turns round, they fall once a step is "
        "shorter than the strain in which the overstress goes, here about 6e-4."
    )
    return page
