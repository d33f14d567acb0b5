"""Nodes are there for all bodies: the rule 5.1 of Li 2009, and the single field of the material point method.

Where nodes move, those of other bodies that come into the support of a particle count as its own;
on a fixed grid all particles have one velocity field. Both keep bodies from passing through each
other by the stress that a common velocity field causes, without any force of contact. Both act
before the surfaces touch, by up to a support, know no separation but that of supports, and hold
bodies together in tension and along their surfaces: what sticks is the price of simplicity.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from mpmbench.core.bodies import Part
from mpmbench.core.contact import ContactRule
from mpmbench.core.errors import NotApplicable
from mpmbench.core.registry import register


@register("contact", "shared")
@dataclass(frozen=True)
class Shared(ContactRule):
    """Everybody's nodes are in everybody's support: rule 5.1 of Li 2009, the single field of a grid."""

    own_nodes: ClassVar[bool] = False

    def check(self, case: Any, parts: Sequence[Part]) -> None:
        """Refuse functions that never see a node of another body."""
        if case.choices.frozen:
            raise NotApplicable(
                "contact=shared needs functions that see new nodes: "
                "method.shape_functions=frozen keeps those of the start"
            )
        if case.choices.moving and case.basis.promises.kronecker == "everywhere":
            raise NotApplicable(
                f"contact=shared needs supports that reach other bodies: basis={case.basis_name} "
                "lives on the cells of its own body; take contact=penalty"
            )
