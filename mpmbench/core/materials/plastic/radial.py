"""The return of von Mises: deviators shrink, volumes stay, and one number is found, the plastic strain.

A law's flow stress is ``theta (g(e) + g(e_n) (r - 1))`` after an increment ``D = e - e_n`` of the
plastic strain in the time dt: `hardening` gives g, `rate_factor` gives r at the rate ``D / dt`` and
`softening` gives theta at the temperature before the step. D makes the incremental energy

    ``U(ln J) + (q - 3 mu D)^2 / (6 mu) + theta (G(e) - G(e_n) + g(e_n) dt psi(D / dt))``

smallest, with the stress q of the trial, ``G = int g de`` and ``psi = int (r - 1) d rate`` (Ortiz
and Stainier 1999); hardening is in G alone, and the potential psi has the overstress only.
"""

import math
from typing import Any

import numpy as np

from mpmbench.core.compiled import answers_by_default, compiled, fallback, vector
from mpmbench.core.compiled.algebra import determinant
from mpmbench.core.materials import cauchy_stress, energy_density
from mpmbench.core.materials.plastic import (
    PLASTIC_STRAIN,
    PLASTIC_WORK,
    elastic_strains,
    explicit_step,
    hardening,
    return_strains,
)
from mpmbench.core.materials.principal import THREE
from mpmbench.core.materials.symmetric import (
    SIX,
    SMALL,
    deform,
    norm_squared,
    strain_of,
    stretch_of,
)

MOST_ITERATIONS = 200
SETTLED = 1e-10  # relative step of Newton's method after which its error is below rounding


@answers_by_default
def rate_factor(law: Any, rate: float) -> tuple[float, float]:
    """Factor r of the flow stress at a rate of plastic strain [1/s], 1 at rest, and its derivative [s]."""
    return 1.0, 0.0


@answers_by_default
def softening(law: Any, state: np.ndarray) -> float:
    """Factor theta of the flow stress at the temperature of this history, from 0 to 1."""
    return 1.0


@answers_by_default
def volumetric(law: Any, log_J: float, state: np.ndarray) -> tuple[float, float, float]:
    """Energy U [J/m^3], mean Kirchhoff stress ``dU / d ln J`` and its derivative [Pa]."""
    bulk = law.lame + 2.0 / 3.0 * law.shear
    return 0.5 * bulk * log_J * log_J, bulk * log_J, bulk


@answers_by_default
def warm(law: Any, log_J: float, work: float, state: np.ndarray) -> None:
    """Note what plastic work [J/m^3] leaves as heat, in columns of the law's own."""


@compiled
def increment_of_plastic_strain(law, trial, dt, state):
    """Increment D for the effective stress `trial` [Pa], slope of the flow stress [Pa], and plastic work [J/m^3].

    Newton's method on ``trial - 3 mu D - flow stress``, which falls with D, in a bracket: half of it
    is taken where a step leads out of it, as where the slope is infinite.
    """
    stiffness, theta, start = 3.0 * law.shear, softening(law, state), state[PLASTIC_STRAIN]
    first, slope, stored = hardening(law, start)
    excess = trial - theta * first
    if not (excess > 0.0 and dt > 0.0):
        return 0.0, 0.0, 0.0
    low, high = 0.0, excess / stiffness
    g, x, overstress = first, 0.0, 0.0
    slope = theta * (slope + first * rate_factor(law, 0.0)[1] / dt)
    integral, step = stored, 0.0
    for _ in range(MOST_ITERATIONS):
        step = excess / (stiffness + slope)
        if x > 0.0 and abs(step) <= SETTLED * x:
            break
        if not low < x + step <= high:
            step = 0.5 * (low + high) - x
        x += step
        g, slope, integral = hardening(law, start + x)
        factor, per_rate = rate_factor(law, x / dt)
        overstress = first * (factor - 1.0)
        slope = theta * (slope + first * per_rate / dt)
        excess = trial - stiffness * x - theta * (g + overstress)
        if excess > 0.0:
            low = x
        else:
            high = x
    work = theta * (integral + g * step - stored + overstress * (x + step))
    return x + step, slope, work


@fallback(return_strains, given=hardening)
def _return_strains(law, strain, dt, state, elastic, tau, moduli):
    log_J = strain[0] + strain[1] + strain[2]
    _, mean, bulk = volumetric(law, log_J, state)
    normal = vector(THREE)
    square = 0.0
    for a in range(3):
        normal[a] = 2.0 * law.shear * (strain[a] - log_J / 3.0)
        square += normal[a] * normal[a]
    trial = math.sqrt(1.5 * square)
    D, slope, work = increment_of_plastic_strain(law, trial, dt, state)
    kept = 1.0  # part of the deviator that is left
    if D > 0.0:
        kept = 1.0 - 3.0 * law.shear * D / trial
        for a in range(3):
            elastic[a] = strain[a] - 1.5 * D * normal[a] / trial
        state[PLASTIC_STRAIN] += D
        state[PLASTIC_WORK] += work
        warm(law, log_J, work, state)
    along = 0.0 if D == 0.0 else kept - slope / (3.0 * law.shear + slope)
    for a in range(3):
        tau[a] = mean + kept * normal[a]
        for b in range(3):
            moduli[a, b] = bulk + 2.0 * law.shear * kept * ((1.0 if a == b else 0.0) - 1.0 / 3.0)
            if along != 0.0:
                moduli[a, b] -= 2.0 * law.shear * along * normal[a] * normal[b] / square
    return D > 0.0


@fallback(cauchy_stress, given=hardening)
def _cauchy(law, axes, F, L, dt, state, sigma):
    """The explicit step: deviators shrink whatever their axes, which are not looked for while b_e is close to I."""
    X, e = vector(SIX), vector(SIX)
    deform(axes, L, dt, state, X)
    if not norm_squared(X) <= SMALL * SMALL:
        explicit_step(law, axes, F, L, dt, state, sigma)
        return
    strain_of(X, e)
    log_J = e[0] + e[1] + e[2]
    for k in range(3):
        e[k] -= log_J / 3.0
    _, mean, _ = volumetric(law, log_J, state)
    trial = 2.0 * law.shear * math.sqrt(1.5 * norm_squared(e))
    D, _, work = increment_of_plastic_strain(law, trial, dt, state)
    if D > 0.0:
        kept = 1.0 - 3.0 * law.shear * D / trial  # part of the deviator that is left
        for k in range(6):
            e[k] = kept * e[k] + (log_J / 3.0 if k < 3 else 0.0)
        stretch_of(e, X)
        for k in range(3):
            e[k] -= log_J / 3.0
        state[PLASTIC_STRAIN] += D
        state[PLASTIC_WORK] += work
        warm(law, log_J, work, state)
    for k in range(6):
        state[k] = X[k]
    inverse_J, double = 1.0 / determinant(axes, F), 2.0 * law.shear
    for i in range(len(axes)):
        sigma[i, i] = inverse_J * (mean + double * e[i])
        for j in range(i):
            sigma[i, j] = inverse_J * double * e[2 + i + j]  # xy, xz and yz
            sigma[j, i] = sigma[i, j]


@fallback(energy_density, given=hardening)
def _energy(law, axes, F, state):
    """``U(ln J) + mu dev(e) : dev(e)`` of the elastic strains e."""
    strain = vector(THREE)
    elastic_strains(state, strain)
    log_J = strain[0] + strain[1] + strain[2]
    total = volumetric(law, log_J, state)[0]
    for a in range(3):
        total += law.shear * (strain[a] - log_J / 3.0) ** 2
    return total
