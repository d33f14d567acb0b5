"""A basis: hat functions on a line of nodes, evaluated with numpy and stored per particle."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from mpmbench import (
    BasisSettings,
    BrokeDown,
    Geometry,
    Promises,
    Stencils,
    StoredBasis,
    register,
)


class Hats(StoredBasis):
    """Hat functions on the nodes x_0 < x_1 < ..., shape (N, 1)."""

    def __init__(self, nodes: np.ndarray, particles: int) -> None:
        self.nodes = nodes.copy()
        self.handle = Stencils.empty(particles, 2, 1)

    def _fill(self, x: np.ndarray, stored: Stencils) -> Stencils:
        outside = self.first_outside(x)
        if outside >= 0:
            raise BrokeDown(f"point {outside} is outside the nodes")
        line = self.nodes[:, 0]
        left = np.clip(np.searchsorted(line, x[:, 0], side="right") - 1, 0, len(line) - 2)
        h = line[left + 1] - line[left]
        t = (x[:, 0] - line[left]) / h
        stored.size[:] = 2
        stored.index[:] = np.stack([left, left + 1], axis=1)
        stored.phi[:] = np.stack([1.0 - t, t], axis=1)
        stored.grad_phi[:, :, 0] = np.stack([-1.0 / h, 1.0 / h], axis=1)
        return stored

    def first_outside(self, x: np.ndarray) -> int:
        inside = (x[:, 0] >= self.nodes[0, 0]) & (x[:, 0] <= self.nodes[-1, 0])
        return -1 if inside.all() else int(np.argmin(inside))

    def move(self, displacement: np.ndarray) -> None:
        self.nodes += displacement


@register("basis", "stored_hat")
@dataclass(frozen=True)
class StoredHat(BasisSettings):
    """Hat functions in 1D, stored per particle."""

    promises: ClassVar[Promises] = Promises(
        (1,), kronecker="everywhere", continuous_gradient=False, grid=True
    )

    def build(self, geometry: Geometry, particles: int, moving: bool) -> Hats:
        return Hats(geometry.points, particles)
