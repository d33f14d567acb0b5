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

from mpmbench.core.compiled import (
    answers_by_default,
    compiled,
    fallback,
    inlined,
    matrix,
    vector,
)
from mpmbench.core.compiled.algebra import determinant, multiply
from mpmbench.core.compiled.rows import BATCH, LANES, groups
from mpmbench.core.materials import cauchy_stress, energy_density, strain_all
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
LOG_J, SIZE, TRIAL, KEPT, MEAN = range(5)  # numbers of each particle of a batch


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
    explicit_step(law, axes, F, L, dt, state, sigma)


@inlined
def strain_one(axes, fields, first, dt, F, V, b, L_b, F_b):
    """``F <- (I + dt L) F`` of the b-th particle of a batch, and ``V = det(F) V_0`` of what is V_0 before."""
    dim = len(axes)
    increment, old = matrix(axes, axes), matrix(axes, axes)
    for d in range(dim):
        for e in range(dim):
            L_b[d, e], old[d, e] = fields[first + d * dim + e, b], F[d * dim + e, b]
            increment[d, e] = dt * L_b[d, e] + (1.0 if d == e else 0.0)
    multiply(axes, increment, old, F_b)
    V[0, b] *= determinant(axes, F_b)
    for d in range(dim):
        for e in range(dim):
            F[d * dim + e, b] = F_b[d, e]


@fallback(strain_all, given=hardening)
def _strain_all(law, axes, fields, first, dt, F, V, state, sigma, n):
    """The explicit step: deviators shrink whatever their axes, which are not looked for while b_e is close to I.

    Tensors are rows of numbers of all particles, which vectors take at once; what is plastic is
    returned one particle after the other.
    """
    dim, double = len(axes), 2.0 * law.shear
    old, X, e = matrix(SIX, BATCH), matrix(SIX, BATCH), matrix(SIX, BATCH)
    scalars = matrix((0.0,) * 5, BATCH)
    L_b, F_b, sigma_b = matrix(axes, axes), matrix(axes, axes), matrix(axes, axes)
    for b in range(len(LANES) * groups(n)):
        for k in range(6):
            old[k, b] = state[b, k] if b < n else 0.0
    for b in range(len(LANES) * groups(n)):
        strain_one(axes, fields, first, dt, F, V, b, L_b, F_b)
        deform(axes, L_b, dt, old[:, b], X[:, b])
    for b in range(len(LANES) * groups(n)):
        strain_of(X[:, b], e[:, b])
    for b in range(len(LANES) * groups(n)):
        scalars[LOG_J, b] = e[0, b] + e[1, b] + e[2, b]
        for k in range(3):
            e[k, b] -= scalars[LOG_J, b] / 3.0
        scalars[SIZE, b] = norm_squared(X[:, b])
        scalars[TRIAL, b] = double * math.sqrt(1.5 * norm_squared(e[:, b]))
        scalars[KEPT, b] = 1.0
    plastic = False
    for b in range(n):
        history = state[b]
        if not scalars[SIZE, b] <= SMALL * SMALL:
            continue
        log_J, trial = scalars[LOG_J, b], scalars[TRIAL, b]
        scalars[MEAN, b] = volumetric(law, log_J, history)[1]
        D, _, work = increment_of_plastic_strain(law, trial, dt, history)
        if D > 0.0:
            plastic = True
            scalars[KEPT, b] = 1.0 - 3.0 * law.shear * D / trial  # of the deviator
            history[PLASTIC_STRAIN] += D
            history[PLASTIC_WORK] += work
            warm(law, log_J, work, history)
    if plastic:
        for b in range(len(LANES) * groups(n)):
            for k in range(6):
                mean = scalars[LOG_J, b] / 3.0 if k < 3 else 0.0
                e[k, b] = scalars[KEPT, b] * e[k, b] + mean
            stretch_of(e[:, b], old[:, b])
            for k in range(6):
                e[k, b] -= scalars[LOG_J, b] / 3.0 if k < 3 else 0.0
                X[k, b] = old[k, b] if scalars[KEPT, b] < 1.0 else X[k, b]
    for b in range(len(LANES) * groups(n)):
        for i in range(dim):
            for j in range(dim):
                F_b[i, j] = F[i * dim + j, b]
        inverse_J = 1.0 / determinant(axes, F_b)
        for i in range(dim):
            sigma[i * dim + i, b] = inverse_J * (scalars[MEAN, b] + double * e[i, b])
            for j in range(i):  # xy, xz and yz
                sigma[i * dim + j, b] = inverse_J * double * e[2 + i + j, b]
                sigma[j * dim + i, b] = sigma[i * dim + j, b]
    for b in range(n):
        if scalars[SIZE, b] <= SMALL * SMALL:
            for k in range(6):
                state[b, k] = X[k, b]
            continue
        for i in range(dim):
            for j in range(dim):
                F_b[i, j], L_b[i, j] = F[i * dim + j, b], fields[first + i * dim + j, b]
        explicit_step(law, axes, F_b, L_b, dt, state[b], sigma_b)
        for i in range(dim):
            for j in range(dim):
                sigma[i * dim + j, b] = sigma_b[i, j]
    return True


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
