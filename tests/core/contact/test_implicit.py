"""Implicit steps of several bodies, each of its own material."""

from dataclasses import replace
from typing import Any

import numpy as np

from mpmbench import case
from mpmbench.core.implicit.newton import Equations
from mpmbench.core.implicit.step import prepare
from mpmbench.core.materials import Material
from mpmbench.problems.two_squares import TwoSquares
from tests.core.contact.checks import refusal
from tests.core.support import compose


def internal_forces(made: Any, moduli: tuple[float, float]) -> tuple[np.ndarray, np.ndarray]:
    """Forces of two squares of these moduli [Pa], shape (N, dim), and the body of each node, -1 for none."""

    class Mixed(TwoSquares):
        def materials(self, material: Material) -> tuple[Material, ...]:
            return tuple(replace(material, young_modulus=one) for one in moduli)  # type: ignore[type-var]

    s = case.build(replace(made, problem=Mixed()))
    w = prepare(s)
    equations = Equations(s, w, np.zeros_like(s.nodes.v), 1e-3, inertia=None)
    du = 1e-3 * np.random.default_rng(0).standard_normal(s.nodes.v.shape)
    assert equations.residual(du) is not None
    body = np.full(len(du), -1)
    for p, owner in enumerate(s.bodies.particle[s.particles.material]):
        body[w.phi.index[p, : w.phi.size[p]]] = owner
    return equations.internal, body


def test_each_body_resists_by_its_own_material() -> None:
    made = case.read(compose("two_squares", "implicit_mpm", "linear", resolution=2))
    mixed, body = internal_forces(made, (1e6, 5e6))
    assert {0, 1} <= set(body.tolist())  # they are too far apart to share nodes
    for b, modulus in enumerate((1e6, 5e6)):
        alike, _ = internal_forces(made, (modulus, modulus))
        assert np.abs(alike[body == b]).max() > 0.0
        assert np.array_equal(mixed[body == b], alike[body == b])
    assert np.abs(mixed - alike)[body == 0].max() > 0.1 * np.abs(mixed).max() / 5.0


def test_means_of_cells_are_for_one_material() -> None:
    changes = {"method__volumetric": "f_bar", "resolution": 2}
    assert "several materials" in refusal("sphere_impact", "implicit_mpm", "linear", **changes)
