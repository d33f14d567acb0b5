"""Contact of several bodies: one file per rule.

A plug-in is a dataclass of its settings, derived from `ContactRule` and registered with
``@register("contact", name)``. It says whether particles see nodes of their own body only, and its
`build` gives what acts in the steps: forces on the nodes, or impulses that correct their velocities.

Every rule here keeps the momentum of bodies that nothing else holds to round-off, which thousands of
steps add up (1e-12 of what its parts have in the tests, 4e-11 in the longest runs of `range`):
forces and impulses come in pairs, and nodes that keep velocities give back what their masses change
(`mpmbench.core.transfer.nodal`).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from mpmbench.core.bases import Basis, BasisSettings
from mpmbench.core.bases.parted import own_functions
from mpmbench.core.choices import Choices
from mpmbench.core.errors import NotApplicable
from mpmbench.core.geometry import Cloud, Geometry
from mpmbench.core.setting import Settings

if TYPE_CHECKING:
    from mpmbench.core.bodies import Part
    from mpmbench.core.state import State

__all__ = ["Contact", "ContactRule"]


class Contact:
    """What a rule does in the steps of a simulation; this one does nothing."""

    def push(self, s: "State") -> None:
        """Add forces [N] to ``s.nodes.f``, shape (N, dim), where the particles are now."""

    def hold(self, s: "State", dt: float) -> float:
        """Correct the velocities ``s.nodes.v`` of the step, and with them the accelerations.

        Returns
        -------
        float
            Work of these impulses on the nodes [J], whose velocities were ``nodes.v_last``.
        """
        return 0.0

    def power(self, v: np.ndarray) -> float:
        """Power of the forces of `push` at nodal velocities, shape (N, dim) [W]."""
        return 0.0

    def stored(self, s: "State") -> float:
        """What forces have taken so far, where the particles are now [J]: it is stored, or lost to friction."""
        return 0.0


@dataclass(frozen=True)
class ContactRule(Settings):
    """Base of the rules.

    Attributes
    ----------
    own_nodes : bool
        Particles see nodes of their own body only: where nodes move those of the body, else a copy
        of all nodes for each body.
    at_surfaces : bool
        The rule acts at points of surfaces, which are carried along as tracers; else surfaces are
        looked at only, and those of moving nodes are nodes.
    """

    own_nodes: ClassVar[bool] = True
    at_surfaces: ClassVar[bool] = False

    def check(self, case: Any, parts: "Sequence[Part]") -> None:
        """Raise `NotApplicable` for a method, basis or bodies that the rule cannot do."""

    def surface_of_nodes(self, choices: Choices) -> bool:
        """Whether the points of surfaces are nodes of this method, and not tracers."""
        return choices.moving and not choices.frozen and not self.at_surfaces

    def functions(
        self,
        basis: BasisSettings,
        place: Geometry,
        meshes: Sequence[Cloud],
        body: np.ndarray,
        moving: bool,
    ) -> Basis:
        """The shape functions that particles see.

        Parameters
        ----------
        basis : BasisSettings
        place : Geometry
            All nodes.
        meshes : sequence of Cloud
            Those of each body, where nodes are those of bodies.
        body : ndarray of int
            Body of each particle and tracer, shape (P,).
        moving : bool
            Nodes will move.
        """
        if self.own_nodes:
            return own_functions(basis, meshes or [place], body, int(body.max()) + 1, moving)
        return basis.build(place, len(body), moving)

    def build(self, s: "State") -> Contact:
        """What acts in the steps of this simulation."""
        return Contact()


def check_bodies(case: Any, parts: "Sequence[Part]") -> None:
    """Refuse what no rule can do with these bodies.

    Raises
    ------
    NotApplicable
        With the reason.
    """
    if len(parts) < 2:
        if type(case.contact).__name__ != "Shared":
            raise NotApplicable("contact is a rule for several bodies, and this problem has one")
        return
    if case.choices.implicit and case.contact.own_nodes:
        raise NotApplicable(
            f"method.time={case.choices.time} solves for all nodes at once and knows no contact "
            "but that of shared nodes"
        )
    materials = {part.material or case.material for part in parts}
    volumetric = getattr(case.choices, "volumetric", "standard")
    if case.choices.implicit and volumetric == "f_bar" and len(materials) > 1:
        raise NotApplicable(
            f"method.volumetric=f_bar with method.time={case.choices.time} takes the means of cells, which "
            "bodies of several materials share"
        )
    case.contact.check(case, parts)
