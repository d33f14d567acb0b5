"""The contract of a material: stress and energy belong together, rotations change nothing, small strains are linear."""

from collections.abc import Iterator
from dataclasses import dataclass, fields
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
def stress_of(law, axes, F, state, sigma):
    """Cauchy stress without a rate."""
    cauchy_stress(law, axes, F, np.zeros_like(F), 1.0, state, sigma)


@compiled
def energy_of(law, axes, F, state):
    """Stored energy."""
    return energy_density(law, axes, F, state)


def stress(material: Any, F: np.ndarray) -> np.ndarray:
    """Cauchy stress [Pa] of a new particle, shape (dim, dim)."""
    sigma = np.zeros_like(F)
    stress_of(material.law, (0.0,) * len(F), F, np.zeros(material.history), sigma)
    return sigma


def energy(material: Any, F: np.ndarray) -> float:
    """Stored energy [J/m^3] of a new particle."""
    return float(energy_of(material.law, (0.0,) * len(F), F, np.zeros(material.history)))


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


@CHECKS.asks(lambda case: case.material.history == 0 and case.dimension > 1)
def objectivity(case: MaterialCase) -> Iterator[Finding]:
    """``sigma(Q F) = Q sigma(F) Q^T`` and a symmetric stress exactly when the material says so."""
    material = case.material
    Q = Rotation.from_rotvec([0.0, 0.0, 0.7]).as_matrix()[: case.dimension, : case.dimension]
    rotated, skew = [], []
    for F in case.deformations():
        sigma = stress(material, F)
        scale = largest(sigma)
        rotated.append(largest(stress(material, Q @ F) - Q @ sigma @ Q.T) / scale)
        skew.append(largest(sigma - sigma.T) / scale)
    holds = bool(np.max(rotated) < 1e-10 and np.max(skew) < 1e-10)
    measured = f"relative errors {np.max(rotated):.2g} and {np.max(skew):.2g}"
    claim = "an objective, symmetric stress"
    yield Finding.as_declared(holds, material.symmetric, claim, measured)


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
