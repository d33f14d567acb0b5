"""The contract of a material: stress and energy belong together, rotations change nothing, small strains are linear."""

from collections.abc import Iterator
from dataclasses import dataclass, fields
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from mpmbench.contracts import Contract, Finding, largest
from mpmbench.core import registry
from mpmbench.core.compiled import compiled
from mpmbench.core.materials import cauchy_stress, energy_density

CHECKS = Contract()


@dataclass(frozen=True)
class MaterialCase:
    """A material with typical settings, in one to three dimensions."""

    name: str
    dimension: int

    @property
    def material(self) -> Any:
        return typical(self.name)

    def deformations(self) -> list[np.ndarray]:
        """Deformation gradients, shape (dim, dim) each: moderate ones, small and compressive if the law has a limit."""
        rng = np.random.default_rng(self.dimension)
        mean, spread = (1.0, 0.15) if self.material.conserves_energy else (0.999, 1e-4)
        return [
            mean * np.eye(self.dimension) + spread * rng.standard_normal((self.dimension,) * 2)
            for _ in range(5)
        ]


def typical(name: str) -> Any:
    """A material with its defaults, but a Poisson's ratio that lets all terms count."""
    plugin = registry.get("material", name)
    keys = {field.name for field in fields(plugin)}
    return plugin(poisson_ratio=0.3) if "poisson_ratio" in keys else plugin()


def cases(name: str) -> list[MaterialCase]:
    """All cases of a material."""
    return [MaterialCase(name, dimension) for dimension in (1, 2, 3)]


@compiled
def stress_of(law, axes, F, L, dt, state, sigma):
    """Cauchy stress, for callers that are not compiled."""
    cauchy_stress(law, axes, F, L, dt, state, sigma)


@compiled
def energy_of(law, axes, F, state):
    """Stored energy."""
    return energy_density(law, axes, F, state)


def stress(material: Any, F: np.ndarray) -> np.ndarray:
    """Cauchy stress [Pa] of a new particle, shape (dim, dim)."""
    sigma = np.zeros_like(F)
    L, state = np.zeros_like(F), np.zeros(material.history)
    stress_of(material.law, (0.0,) * len(F), F, L, 1.0, state, sigma)
    return sigma


def energy(material: Any, F: np.ndarray, state: np.ndarray | None = None) -> float:
    """Stored energy [J/m^3], of a new particle unless its history is given."""
    history = np.zeros(material.history) if state is None else state
    return float(energy_of(material.law, (0.0,) * len(F), F, history))


@dataclass
class Path:
    """A particle that is deformed step by step, as an explicit loop does it."""

    material: Any
    dimension: int

    def __post_init__(self) -> None:
        self.F = np.eye(self.dimension)
        self.sigma = np.zeros_like(self.F)
        self.state = np.zeros(self.material.history)

    def step(self, F: np.ndarray, dt: float, spin: np.ndarray | float = 0.0) -> None:
        """Deform to F [1] in the time dt [s], and add a spin [1/s] to the rate at the end of it."""
        L = (F @ np.linalg.inv(self.F) - np.eye(self.dimension)) / dt + spin
        self.F = F
        axes = (0.0,) * self.dimension
        stress_of(self.material.law, axes, F.copy(), L, dt, self.state, self.sigma)

    @property
    def nominal(self) -> np.ndarray:
        """First Piola-Kirchhoff stress [Pa], shape (dim, dim), whose work is that of ``dF``."""
        return np.linalg.det(self.F) * self.sigma @ np.linalg.inv(self.F).T

    @property
    def energy(self) -> float:
        """Stored energy [J/m^3]."""
        return energy(self.material, self.F, self.state)


def work_along(path: Path, steps: list[np.ndarray], dt: float) -> float:
    """Work of the stress [J/m^3] while a particle is deformed, by the trapezoidal rule."""
    work = 0.0
    for F in steps:
        before, P = path.F, path.nominal
        path.step(F, dt)
        work += 0.5 * float(np.sum((P + path.nominal) * (F - before)))
    return work


def elastic(case: MaterialCase) -> bool:
    """The stress is a function of F that belongs to an energy."""
    return bool(case.material.conserves_energy)


@CHECKS.asks(elastic)
def stress_is_the_derivative_of_the_energy(case: MaterialCase) -> Iterator[Finding]:
    """``sigma = (dW/dF) F^T / J`` by central differences; of materials that store the work."""
    material, dim = case.material, case.dimension
    errors = []
    for F in case.deformations():
        P = np.zeros((dim, dim))
        for i, j in np.ndindex(dim, dim):
            dF = np.zeros((dim, dim))
            dF[i, j] = 1e-6
            P[i, j] = (energy(material, F + dF) - energy(material, F - dF)) / 2e-6
        expected = P @ F.T / np.linalg.det(F)
        errors.append((stress(material, F) - expected) / largest(expected))
    yield Finding.below(
        np.array(errors), 2e-6, "relative difference from the derivative of the energy"
    )


@CHECKS.asks(lambda case: case.dimension > 1)
def objectivity(case: MaterialCase) -> Iterator[Finding]:
    """A large rotation on top of a motion turns the stress and nothing else, exactly when the material says so.

    The motion is two steps, so that the history counts; rates are seen through the last of them,
    on which a spin is imposed where the stress is a function of the rate.
    """
    material, dim = case.material, case.dimension
    Q = Rotation.from_rotvec([0.0, 0.0, 2.0] if dim == 2 else [1.2, -0.7, 1.4]).as_matrix()
    Q = Q[:dim, :dim]
    spin = 3.0 * (Q - Q.T) if material.rate_dependent else 0.0
    rotated, skew, stored = [], [], []
    for first, second in pairwise(case.deformations()):
        path, turned = Path(material, dim), Path(material, dim)
        path.step(first, 1.0)
        path.step(second, 0.1)
        turned.step(Q @ first, 1.0)
        turned.step(Q @ second, 0.1, spin)
        scale = largest(path.sigma)
        rotated.append(largest(turned.sigma - Q @ path.sigma @ Q.T) / scale)
        skew.append(largest(path.sigma - path.sigma.T) / scale)
        stored.append(abs(turned.energy / path.energy - 1.0))
    errors = [float(np.max(some)) for some in (rotated, skew, stored)]
    measured = "relative errors {:.2g}, {:.2g} and of the energy {:.2g}".format(*errors)
    claim = "an objective, symmetric stress"
    yield Finding.as_declared(max(errors) < 1e-9, material.symmetric, claim, measured)


@CHECKS.asks()
def small_slow_work_is_stored(case: MaterialCase) -> Iterator[Finding]:
    """In small and slow deformations every law is elastic: the work of the stress is the stored energy."""
    dim, path = case.dimension, Path(case.material, case.dimension)
    gradient = 1e-5 * np.random.default_rng(dim).standard_normal((dim, dim))
    steps = [np.eye(dim) + share * gradient for share in np.linspace(0.1, 1.0, 10)]
    work = work_along(path, steps, 1e6)
    yield Finding.below(path.energy / work - 1.0, 1e-3, "relative difference of work and energy")


@CHECKS.asks(lambda case: not elastic(case))
def large_fast_work_is_lost(case: MaterialCase) -> Iterator[Finding]:
    """A law that does not conserve energy never gives more than it was given, and less on a closed path."""
    dim, path = case.dimension, Path(case.material, case.dimension)
    shear = 0.05 * np.ones((dim, dim)) - 0.1 * np.eye(dim)
    swing = np.sin(np.linspace(0.0, 2.0 * np.pi, 401))[1:]
    lost, stored = 0.0, 0.0
    for share in swing:
        before = path.energy
        lost += work_along(path, [np.eye(dim) + share * shear], 1e-3) - (path.energy - before)
        stored = max(stored, path.energy)
        yield Finding(lost > -1e-3 * stored, f"{-lost:.2g} J/m3 come from nowhere")
    yield Finding(lost > 1e-2 * stored, f"only {lost:.2g} of {stored:.2g} J/m3 are lost")


@CHECKS.asks(lambda case: case.material.dissipated is not None)
def what_is_lost_is_in_the_history(case: MaterialCase) -> Iterator[Finding]:
    """Work that is not stored stands in the history as dissipated, which never falls, also far beyond yield."""
    dim, path = case.dimension, Path(case.material, case.dimension)
    gradient = 0.2 * np.random.default_rng(dim).standard_normal((dim, dim)) - 0.1 * np.eye(dim)
    turns, work, before = np.sin(np.linspace(0.0, 2.0 * np.pi, 2001))[1:], 0.0, 0.0
    for share in turns:
        work += work_along(path, [np.eye(dim) + share * gradient], 1e-6)
        lost = float(path.state[case.material.dissipated])
        yield Finding(lost >= before, f"{before - lost:.2g} J/m3 of what was lost are back")
        before = lost
    yield Finding(before > 0.0, "nothing is lost")
    yield Finding.below((work - path.energy) / before - 1.0, 1e-2, "relative difference from work")


@CHECKS.asks(lambda case: case.dimension > 1 and case.material.history > 0)
def flow_is_objective(case: MaterialCase) -> Iterator[Finding]:
    """Large steps far beyond the elastic range, rotated: stress, energy and what was lost are the same."""
    material, dim = case.material, case.dimension
    rng = np.random.default_rng(dim)
    Q = Rotation.from_rotvec([0.0, 0.0, 2.0] if dim == 2 else [1.2, -0.7, 1.4]).as_matrix()
    Q = Q[:dim, :dim]
    path, turned = Path(material, dim), Path(material, dim)
    F, stored = 0.97 * np.eye(dim), 0.0
    for _ in range(5):
        path.step(F, 1.0)
        turned.step(Q @ F, 1.0)
        F = F + 0.1 * rng.standard_normal((dim, dim))
        scale = largest(path.sigma) or 1.0  # it may be apart
        error = largest(turned.sigma - Q @ path.sigma @ Q.T) / scale
        stored = max(stored, path.energy)  # grains that are apart have next to none
        energies = abs(turned.energy - path.energy) / stored
        yield Finding(max(error, energies) < 1e-9, f"relative errors {error:.2g}, {energies:.2g}")
        if material.dissipated is not None:
            lost, again = (float(one.state[material.dissipated]) for one in (path, turned))
            yield Finding(abs(again - lost) <= 1e-9 * lost, f"{lost:.12g} and {again:.12g} J/m3")


@CHECKS.asks(elastic)
def small_strains_are_linear_elastic(case: MaterialCase) -> Iterator[Finding]:
    """``sigma = lambda tr(eps) I + 2 mu eps`` for small strains, with `lame_parameters`, which bound the time step."""
    material, dim = case.material, case.dimension
    lame, shear = material.lame_parameters()
    strain = 1e-7 * np.arange(1.0, 1.0 + dim**2).reshape(dim, dim)
    strain = 0.5 * (strain + strain.T)
    expected = lame * np.trace(strain) * np.eye(dim) + 2.0 * shear * strain
    error = (stress(material, np.eye(dim) + strain) - expected) / largest(expected)
    yield Finding.below(error, 2e-5, "relative difference from linear elasticity")


@CHECKS.asks(elastic)
def lower_dimensions_are_plane_strain(case: MaterialCase) -> Iterator[Finding]:
    """The stress in 1D and 2D is that of 3D with F = 1 in the missing directions."""
    material, dim = case.material, case.dimension
    F = np.eye(3)
    F[:dim, :dim] = case.deformations()[0] if dim < 3 else np.eye(3)
    expected, computed = stress(material, F)[:dim, :dim], stress(material, F[:dim, :dim].copy())
    error = (computed - expected) / max(largest(expected), 1e-300)
    yield Finding.below(error, 1e-12, "relative difference from 3D")
