"""Fields that results derive from stress and history: in every dimension those of three dimensions."""

from typing import Any

import numpy as np
import pytest

from mpmbench.contracts.materials import Path
from mpmbench.core import registry
from mpmbench.core.materials.fields import derived_fields


def fields_after(material: Any, *steps: np.ndarray, dt: float = 1e-3) -> dict[str, float]:
    """Fields of a particle that was deformed, and the way there."""
    path = Path(material, len(steps[0]))
    for F in steps:
        before = path.F
        path.step(F, dt)
    L = (steps[-1] @ np.linalg.inv(before) - np.eye(len(F))) / dt
    kept = {"F": path.F[None], "sigma": path.sigma[None], "state": path.state[None], "L": L[None]}
    return {
        name: float(values[0]) for name, (values, _, _) in derived_fields(material, kept).items()
    }


@pytest.mark.parametrize("dim", (pytest.param(1, marks=pytest.mark.slow), 2))
@pytest.mark.parametrize("name", registry.names("material"))
def test_what_is_out_of_the_plane_counts(name: str, dim: int) -> None:
    """Two steps in 1D or 2D and the same ones in 3D have the same fields, of every material."""
    material = registry.get("material", name)()
    if "poisson_ratio" in vars(material):
        material = type(material)(poisson_ratio=0.3)
    rng = np.random.default_rng(dim)
    steps, whole = [], []
    for size in (0.02, 0.1):
        steps.append(0.8 * np.eye(dim) + size * rng.standard_normal((dim, dim)))
        F = np.eye(3)
        F[:dim, :dim] = steps[-1]
        whole.append(F)
    low, high = fields_after(material, *steps), fields_after(material, *whole)
    assert low["von_mises"] + abs(low["pressure"]) > 0.0
    for key, value in high.items():
        least = 1e-12 * (abs(high["pressure"]) if key == "von_mises" else 1.0)
        assert low[key] == pytest.approx(value, rel=1e-9, abs=least), key


def test_values_in_uniaxial_strain() -> None:
    """Hencky: ``tau = 2 mu e`` apart from the mean ``K e``; von Mises' stress is the yield stress in flow."""
    hencky = registry.get("material", "hencky_elastic")(young_modulus=1e6, poisson_ratio=0.3)
    lame, mu = hencky.lame_parameters()
    e = np.log(0.9)
    found = fields_after(hencky, np.array([[0.9]]))
    assert found["von_mises"] == pytest.approx(-2.0 * mu * e / 0.9)
    assert found["pressure"] == pytest.approx(-(lame + 2.0 / 3.0 * mu) * e / 0.9)
    metal = registry.get("material", "thermo_viscoplastic")()
    found = fields_after(metal, np.array([[0.9]]))
    g = 1.5e9 * (1.0 + found["plastic_strain"] / 0.001) ** (1.0 / 22.0)
    assert found["von_mises"] == pytest.approx(g / 0.9)
    work = (
        1.5e9
        * 0.001
        * 22.0
        / 23.0
        * ((1.0 + found["plastic_strain"] / 0.001) ** (23.0 / 22.0) - 1.0)
    )
    assert found["temperature"] == pytest.approx(300.0 + 0.9 * work / (7850.0 * 477.0))
