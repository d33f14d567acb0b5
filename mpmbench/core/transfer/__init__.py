"""Transfers: one file each. How velocity goes from particles to nodes and back, and what it needs per particle.

A plug-in is a class that derives from `Transfer`, registered with ``@register("transfer", name)``;
the key ``method.transfer`` of explicit methods selects it. The sums over particles (`sums`) and the
carrying back (`carry`) are the same compiled code for all of them; a transfer adds to both.
"""

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from mpmbench.core import registry
from mpmbench.core.errors import BadSetting
from mpmbench.core.particles import ParticleData
from mpmbench.core.transfer.parts import NOTHING

if TYPE_CHECKING:
    from mpmbench.core.state import State

__all__ = [
    "Transfer",
    "TransferPromises",
    "find_transfer",
]


@dataclass(frozen=True)
class TransferPromises:
    """What a transfer claims about itself with a lumped mass; the contract tests it in both directions.

    Attributes
    ----------
    affine : bool
        A velocity field that is affine on the nodes comes back to them unchanged from the
        particles, wherever these are.
    energy : bool
        No step filters the velocities of particles: most of the energy of small scales is left
        after many steps.
    order : float or None
        Order of the displacements of a vibrating plate, on a fixed grid with quadratic B-splines
        of 4 to 16 cells; None where it depends on the settings.
    angular_momentum : bool
        That of the particles, with the `spin` of what they carry besides, is constant for smooth
        functions away from edges.
    """

    affine: bool = False
    energy: bool = False
    order: float | None = None
    angular_momentum: bool = False


class Transfer:
    """Base of all transfers: velocities of particles are summed to the nodes and nothing else is.

    Attributes
    ----------
    particle_data : dict of ParticleData
        Arrays that the transfer keeps per particle, by name; they are in ``particles.data``.
    promises : TransferPromises
    velocity_on_nodes : bool
        Nodes keep their velocities, and those of particles are only read off.
    """

    particle_data: ClassVar[dict[str, ParticleData]] = {}
    promises: ClassVar[TransferPromises] = TransferPromises()
    velocity_on_nodes: ClassVar[bool] = False

    def check(self, choices: Any) -> None:
        """Raise `NotApplicable` for settings of a method that make no sense with this transfer."""

    def flip_weight(self, choices: Any) -> float:
        """Share of the old velocity, changed by the acceleration, in the new one; the rest is interpolated."""
        return 0.0

    def start(self, s: "State") -> None:
        """Write the transfer's own data before the first step, when ``nodes.v`` is the initial velocity."""

    def keep_momentum(self, s: "State") -> None:
        """Change ``nodes.v_old``, which nodes have kept, when ``nodes.q`` is the momentum of the particles."""

    def to_nodes(self, s: "State", q: np.ndarray) -> None:
        """Add to the momentum `q` [kg m/s], shape (N, dim), which is ``sum_p m_p phi_i v_p`` so far."""

    def to_nodes_again(self, s: "State", q: np.ndarray) -> None:
        """The same where USF and MUSL project velocities once more, and what particles carry besides."""
        self.to_nodes(s, q)

    def part(self, s: "State") -> Any:
        """What particles carry besides their velocity (`parts`): the step takes it along."""
        return NOTHING

    def refine(self, s: "State") -> None:
        """Change ``nodes.v``, all constraints included, before the particles take anything from it."""

    def to_particles(self, s: "State", dt: float) -> None:
        """Take more from ``nodes.v`` and ``nodes.a``, at the old places of the particles.

        Velocities by `flip_weight` are there and may be changed, and so is the stress of the step.
        """

    def shift(self, s: "State", dt: float) -> None:
        """Move particles further, when they have followed the nodes for `dt` [s]."""

    def spin(self, s: "State") -> np.ndarray:
        """Angular momentum [kg m^2/s], shape (3,), of what particles carry besides their velocity."""
        return np.zeros(3)

    @property
    def takes_more(self) -> bool:
        """Whether there is a `to_particles`, for which positions must wait."""
        return type(self).to_particles is not Transfer.to_particles


@cache
def find_transfer(name: str) -> Transfer:
    """The transfer of this name.

    Raises
    ------
    BadSetting
        When there is none.
    """
    try:
        transfer: Transfer = registry.get("transfer", name)()
    except KeyError:
        known = "one of " + ", ".join(registry.names("transfer"))
        raise BadSetting("transfer", name, known) from None
    return transfer
