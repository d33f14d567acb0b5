"""APIC (Jiang et al. 2015) in plain numpy: particles carry the affine part of the velocity field around them."""

from typing import Any, ClassVar

import numpy as np

from mpmbench import NotApplicable, ParticleData, State, Transfer, TransferPromises, register


@register("transfer", "plain_apic")
class PlainApic(Transfer):
    """Affine particle-in-cell transfer, for a lumped mass."""

    particle_data: ClassVar[dict[str, ParticleData]] = {
        "affine": ParticleData(("dim", "dim"), "m2 s-1", "affine part of the velocity field, B")
    }
    promises: ClassVar[TransferPromises] = TransferPromises(affine=True, energy=True, order=3.0)

    def check(self, choices: Any) -> None:
        """Refuse a consistent mass, for which particle velocities alone are exact already."""
        if choices.mass != "lumped":
            raise NotApplicable(f"method.transfer={choices.transfer} needs method.mass=lumped")

    def start(self, s: State) -> None:
        """Take the affine part of the initial field."""
        self.to_particles(s, 0.0)

    def to_nodes(self, s: State, q: np.ndarray) -> None:
        """Add ``sum_p m_p phi_i C_p (x_i - x_p)``, ``C = B D^-1``, ``D = sum_i phi_i (x_i - x) (x_i - x)``."""
        p, (nodes, phi, away) = s.particles, self.around(s)
        D = np.einsum("pk,pkd,pke->pde", phi, away, away)
        field = np.einsum("pde,pke->pkd", p.data["affine"] @ np.linalg.pinv(D), away)
        np.add.at(q, nodes, (p.m[:, None] * phi)[:, :, None] * field)

    def to_particles(self, s: State, dt: float) -> None:
        """Take ``B_p = sum_i phi_i v_i (x_i - x_p)``."""
        nodes, phi, away = self.around(s)
        B = np.einsum("pk,pkd,pke->pde", phi, s.nodes.v[nodes], away)
        s.particles.data["affine"][:] = B

    def around(self, s: State) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Node numbers and functions of each particle, shape (P, K), and ``x_i - x_p`` [m]."""
        near = s.basis.evaluate(s.particles.x)
        used = np.arange(near.index.shape[1]) < near.size[:, None]
        nodes = np.where(used, near.index, 0)
        away = s.basis.nodes[nodes] - s.particles.x[:, None]
        return nodes, np.where(used, near.phi, 0.0), away
