"""Every registered material: stress against the derivative of its energy, objectivity, and small-strain limit."""

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mpmbench.core import registry
from mpmbench.core.compiled import kernel
from mpmbench.core.errors import BadSetting
from mpmbench.core.materials import cauchy_stress, energy_density

MATERIALS = registry.names("material")
ELASTIC = [name for name in MATERIALS if registry.get("material", name).conserves_energy]


@kernel
def stress_of(law, axes, F, state, sigma):  # type: ignore[no-untyped-def]
    cauchy_stress(law, axes, F, np.zeros_like(F), 1.0, state, sigma)


@kernel
def energy_of(law, axes, F, state):  # type: ignore[no-untyped-def]
    return energy_density(law, axes, F, state)


def stress(material: Any, F: np.ndarray) -> np.ndarray:
    sigma = np.zeros_like(F)
    stress_of(material.law, (0.0,) * len(F), F, np.zeros(material.history), sigma)
    return sigma


def energy(material: Any, F: np.ndarray) -> float:
    return energy_of(material.law, (0.0,) * len(F), F, np.zeros(material.history))


def deformations(dim: int) -> list[np.ndarray]:
    rng = np.random.default_rng(dim)
    return [np.eye(dim) + 0.15 * rng.standard_normal((dim, dim)) for _ in range(5)]


@pytest.mark.parametrize("dim", (1, 2, 3))
@pytest.mark.parametrize("name", ELASTIC)
def test_stress_is_the_derivative_of_the_energy(name: str, dim: int) -> None:
    """``sigma = (dW/dF) F^T / J`` by central differences."""
    material = registry.get("material", name)()
    for F in deformations(dim):
        P = np.zeros((dim, dim))
        for i in range(dim):
            for j in range(dim):
                dF = np.zeros((dim, dim))
                dF[i, j] = 1e-6
                P[i, j] = (energy(material, F + dF) - energy(material, F - dF)) / 2e-6
        expected = P @ F.T / np.linalg.det(F)
        assert np.allclose(stress(material, F), expected, rtol=1e-6, atol=1e-6 * np.abs(expected).max())


@pytest.mark.parametrize("dim", (2, 3))
@pytest.mark.parametrize("name", ELASTIC)
def test_objectivity_as_declared(name: str, dim: int) -> None:
    """``sigma(Q F) = Q sigma(F) Q^T`` and a symmetric stress, where the material claims it; not where it does not."""
    material = registry.get("material", name)()
    Q = Rotation.from_rotvec([0.0, 0.0, 0.7]).as_matrix()[:dim, :dim]
    objective, symmetric = True, True
    for F in deformations(dim):
        sigma = stress(material, F)
        scale = np.abs(sigma).max()
        objective &= bool(np.abs(stress(material, Q @ F) - Q @ sigma @ Q.T).max() < 1e-10 * scale)
        symmetric &= bool(np.abs(sigma - sigma.T).max() < 1e-10 * scale)
    assert (objective and symmetric) == material.symmetric


@pytest.mark.parametrize("dim", (1, 2, 3))
@pytest.mark.parametrize("name", ELASTIC)
def test_small_strains_are_linear_elastic(name: str, dim: int) -> None:
    material = registry.get("material", name)()
    lame, shear = material.lame_parameters()
    strain = 1e-7 * np.arange(1.0, 1.0 + dim**2).reshape(dim, dim)
    strain = 0.5 * (strain + strain.T)
    expected = lame * np.trace(strain) * np.eye(dim) + 2.0 * shear * strain
    computed = stress(material, np.eye(dim) + strain)
    assert np.allclose(computed, expected, rtol=1e-5, atol=1e-5 * np.abs(expected).max())


@pytest.mark.parametrize("name", ELASTIC)
def test_lower_dimensions_are_plane_strain(name: str) -> None:
    """The stress in 1D and 2D is that of 3D with F = 1 in the missing directions."""
    material = registry.get("material", name)()
    F = np.eye(3)
    F[:2, :2] = [[1.1, 0.2], [-0.1, 0.95]]
    assert np.allclose(stress(material, F)[:2, :2], stress(material, F[:2, :2]), rtol=1e-12)
    F = np.diag([1.2, 1.0, 1.0])
    assert np.allclose(stress(material, F)[:1, :1], stress(material, F[:1, :1]), rtol=1e-12)


@pytest.mark.parametrize(
    ("key", "value"), [("young_modulus", 0.0), ("young_modulus", -1.0), ("poisson_ratio", 0.5), ("density", 0.0)]
)
def test_constants_out_of_range_are_refused(key: str, value: float) -> None:
    with pytest.raises(BadSetting, match=key):
        registry.get("material", "neo_hookean")(**{key: value})
