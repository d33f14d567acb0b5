"""Nodes of another body are seen when they are near a node of one's own: the rule 5.2 of Li 2009.

A particle of the body A sees a foreign node x_a within its support if some node x_b of A has

    |x_a - x_b| <= R_node,

with a range R_node that may be smaller than the supports: bodies meet when their nodes are so near,
and not already when supports overlap. The thesis asks for an x_b within the search range of the
particle as well; here any node of the body counts, which makes a difference only where x_a is within
R_node of a node that its particle does not see. All else is as with `shared`.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from mpmbench.core.bases import Basis, BasisSettings
from mpmbench.core.bases.entropy.basis import EntropyBasis
from mpmbench.core.bases.parted import PartedBasis
from mpmbench.core.bodies import Part
from mpmbench.core.contact import ContactRule
from mpmbench.core.errors import NotApplicable
from mpmbench.core.geometry import Cloud, Geometry, search_tree
from mpmbench.core.registry import register
from mpmbench.core.setting import setting


@register("contact", "range")
@dataclass(frozen=True)
class NodeRange(ContactRule):
    """Foreign nodes within a range of one's own nodes are in the support: rule 5.2 of Li 2009, meshfree."""

    range: float = setting(
        1.0,
        "distance between nodes at which bodies meet, in nodal spacings",
        unit="-",
        above=0.0,
        most=10.0,
    )
    own_nodes: ClassVar[bool] = False

    def check(self, case: Any, parts: Sequence[Part]) -> None:
        """Refuse functions whose supports cannot be restricted to some nodes."""
        smooth = getattr(case.basis, "rim", "smooth") == "smooth"
        plain = getattr(case.basis, "locality", "fixed") == "fixed"
        if not case.choices.moving or case.choices.frozen:
            raise NotApplicable("contact=range needs nodes that move with the bodies")
        if case.basis_name not in ("lme", "maxent") or not smooth or not plain:
            raise NotApplicable(
                "contact=range chooses nodes for max-ent functions with plain distances: it needs "
                "basis=lme or maxent, and basis.rim=smooth, basis.locality=fixed"
            )

    def functions(
        self,
        basis: BasisSettings,
        place: Geometry,
        meshes: Sequence[Cloud],
        body: np.ndarray,
        moving: bool,
    ) -> Basis:
        reach = self.range * place.nodal_spacing
        owner = np.repeat(np.arange(len(meshes)), [len(mesh.nodes) for mesh in meshes])
        points = np.bincount(body, minlength=len(meshes)).tolist()
        built = [basis.build(place, n, moving) for n in points]
        for b, one in enumerate(built):
            assert isinstance(one, EntropyBasis)
            one.admit(Near(owner == b, reach))
        return RangedBasis(built, body)


@dataclass(frozen=True)
class Near:
    """Marks a body's `own` nodes, shape (N,) of bool, and others within the distance `reach` [m] of one."""

    own: np.ndarray
    reach: float

    def __call__(self, nodes: np.ndarray) -> np.ndarray:
        distance, _ = search_tree(nodes[self.own]).query(nodes, distance_upper_bound=self.reach)
        return np.asarray(self.own | (distance <= self.reach))


class RangedBasis(PartedBasis):
    """Bases on all nodes, of which each admits those that its body may see."""

    def __init__(self, bases: list[Basis], body: np.ndarray) -> None:
        super().__init__(bases, body)
        self.nodes = bases[0].nodes.copy()
        self.first[:] = 0

    def move(self, displacement: np.ndarray) -> None:
        for basis in self.bases:
            basis.move(displacement)
        self.nodes[:] = self.bases[0].nodes
