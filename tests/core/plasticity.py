"""Von Mises laws at one point: a step, the flow stress written out once more, and integrated rate equations."""

from itertools import pairwise
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from mpmbench.core.compiled import compiled
from mpmbench.core.materials import kirchhoff_step
from mpmbench.core.materials.plastic import PLASTIC_STRAIN
from mpmbench.core.materials.plastic.j2 import J2
from mpmbench.core.materials.plastic.johnson_cook import JohnsonCook

INFINITE = float("inf")


@compiled
def evaluate(law, axes, increment, F, dt, old, state, tau, moduli):  # type: ignore[no-untyped-def]
    kirchhoff_step(law, axes, increment, F, dt, old, state, tau, moduli)


def step(
    material: Any, increment: np.ndarray, old: np.ndarray, dt: float = INFINITE
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Kirchhoff stress, moduli and history after an increment."""
    dim = len(increment)
    state, tau, moduli = np.zeros_like(old), np.zeros((dim, dim)), np.zeros((dim,) * 4)
    evaluate(material.law, (0.0,) * dim, increment, increment, dt, old, state, tau, moduli)
    return tau, moduli, state


def flow(material: Any, strain: float) -> tuple[float, float]:
    """Slow, cold flow stress [Pa] and its integral [J/m^3], written out once more."""
    if isinstance(material, J2):
        sigma, e0 = material.yield_stress, material.reference_strain
        if material.hardening == "linear":
            H = material.hardening_modulus
            return sigma + H * strain, sigma * strain + H * strain**2 / 2.0
        if material.hardening == "voce":
            gain = material.saturation_stress - sigma
            stored = (sigma + gain) * strain + gain * e0 * np.expm1(-strain / e0)
            return sigma - gain * np.expm1(-strain / e0), stored
    if isinstance(material, JohnsonCook):
        A, B, n = material.yield_stress, material.hardening_modulus, material.hardening_exponent
        return A + B * strain**n, A * strain + B * strain ** (n + 1.0) / (n + 1.0)
    n, sigma, e0 = material.hardening_exponent, material.yield_stress, material.reference_strain
    grown = (1.0 + strain / e0) ** (1.0 / n)
    return sigma * grown, sigma * e0 * n / (n + 1.0) * (grown * (1.0 + strain / e0) - 1.0)


def von_mises(tau: np.ndarray) -> float:
    deviator = tau - np.trace(tau) / 3.0 * np.eye(3)
    return float(np.sqrt(1.5 * np.sum(deviator**2)))


def b_of(state: np.ndarray) -> np.ndarray:
    """Elastic left Cauchy-Green tensor."""
    xx, yy, zz, xy, xz, yz = state[:6]
    return np.eye(3) + np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def strain_of(b: np.ndarray) -> np.ndarray:
    """Logarithmic strain of a left Cauchy-Green tensor."""
    values, vectors = np.linalg.eigh(b)
    return np.asarray(0.5 * (vectors * np.log(values)) @ vectors.T)


def deformed(material: Any, rng: np.random.Generator, size: float = 0.2) -> np.ndarray:
    """History after large flow in an arbitrary direction."""
    _, _, state = step(material, distorted(rng, size), np.zeros(material.history))
    return state


def distorted(rng: np.random.Generator, size: float, dim: int = 3) -> np.ndarray:
    """A deformation of about this size whose volume is right side up."""
    while True:
        increment = np.eye(dim) + size * rng.standard_normal((dim, dim))
        if np.linalg.det(increment) > 0.5:
            return np.asarray(increment)


def extrapolated(values: list[np.ndarray]) -> np.ndarray:
    """Romberg's limit of results with 1, 2, 4, ... times as many steps of a method of first order."""
    row = values
    for order in range(1, len(values)):
        row = [(2.0**order * b - a) / (2.0**order - 1.0) for a, b in pairwise(row)]
    return row[-1]


def sheared(material: Any, start: np.ndarray, shear: float, n: int, time: float) -> np.ndarray:
    """Kirchhoff stresses in MPa, plastic strain and work in MJ/m^3 after n steps of simple shear."""
    state, dt = start, time / n
    increment = np.eye(3)
    increment[0, 1] = shear / n
    for _ in range(n):
        tau, _, state = step(material, increment, state, dt)
    return np.array([*1e-6 * tau[np.triu_indices(3)], state[6], 1e-6 * state[7]])


def integrated(
    material: Any, start: np.ndarray, shear: float, time: float, rate: Any
) -> np.ndarray:
    """The same from rate equations: ``b' = l b + b l^T - 3 e' dev(tau) b / q``, where `rate` gives e'."""
    lame, mu = material.lame_parameters()
    l = np.zeros((3, 3))
    l[0, 1] = shear / time

    def stress(b: np.ndarray) -> np.ndarray:
        values, vectors = np.linalg.eigh(b)
        logs = 0.5 * np.log(values)
        return np.asarray((vectors * (lame * logs.sum() + 2.0 * mu * logs)) @ vectors.T)

    def rates(_: float, y: np.ndarray) -> np.ndarray:
        b = y[:9].reshape(3, 3)
        tau = stress(b)
        q = von_mises(tau)
        deviator = tau - np.trace(tau) / 3.0 * np.eye(3)
        speed = rate(q, y[9], 1e6 * y[10], 3.0 * np.sum(deviator * l) / (2.0 * q))
        growth = l @ b + b @ l.T - 3.0 * speed / q * deviator @ b
        return np.array([*growth.ravel(), speed, 1e-6 * q * speed])

    y0 = np.array([*b_of(start).ravel(), start[6], 1e-6 * start[7]])
    end = solve_ivp(
        rates, (0.0, time), y0, method="DOP853", max_step=time / 500.0, rtol=1e-13, atol=1e-14
    ).y[:, -1]
    return np.array([*1e-6 * stress(end[:9].reshape(3, 3))[np.triu_indices(3)], *end[9:]])


def at_yield(material: Any, plastic_strain: float, softening: float = 1.0) -> np.ndarray:
    """History of a particle in simple shear that is about to flow."""
    _, mu = material.lame_parameters()

    def history(gamma: float) -> np.ndarray:
        state = np.zeros(material.history)
        state[0], state[3], state[PLASTIC_STRAIN] = gamma**2, gamma, plastic_strain
        return state

    def excess(gamma: float) -> float:
        """The principal strains of a simple shear are +- arsinh(gamma / 2)."""
        stress = 2.0 * mu * np.sqrt(3.0) * np.arcsinh(0.5 * gamma)
        return float(stress - softening * flow(material, plastic_strain)[0])

    return history(brentq(excess, 0.0, 3.0, xtol=1e-15, rtol=1e-14))
