"""Local maximum-entropy functions with a Gaussian (Arroyo and Ortiz 2006; Li 2009, section 2.3)."""

import math
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from mpmbench.core.bases.clouds.cloud import CloudBasis
from mpmbench.core.bases.entropy.basis import EntropyBasis, EntropySettings
from mpmbench.core.bases.entropy.consistent import ConsistentGradients
from mpmbench.core.bases.entropy.points import fill_points
from mpmbench.core.bases.entropy.priors import CUT_GAUSSIAN, Formulation
from mpmbench.core.bases.radial import GAUSSIAN
from mpmbench.core.choices import Choices
from mpmbench.core.errors import BadSetting, NotApplicable, require
from mpmbench.core.geometry import Cloud, Geometry
from mpmbench.core.registry import register
from mpmbench.core.setting import setting

SMALLEST_RADIUS = 2.5  # in nodal spacings: fewer nodes may fail to surround a point


@register("basis", "lme")
@dataclass(frozen=True)
class LocalMaxEnt(EntropySettings):
    """Local maximum-entropy functions on any set of nodes, Arroyo and Ortiz 2006.

    The priors are exp(-beta |x - x_i|^2) with beta = gamma / h^2. A point whose nodes do not suffice or
    do not surround it takes more. A ``smooth`` rim lowers the Gaussian by its tangent in r^2, so that
    nodes enter and leave a support without a jump; a ``cut`` one is that of Iaconeta 2017, section 5.3.
    Newton's method without its line search is that of Li (2009), which fails for large gamma. Gradients
    that are ``consistent`` pass the patch test on irregular clouds.
    """

    gamma: float = setting(
        1.8,
        "locality beta h^2: 0.8 wide functions, 4 and more close to linear",
        unit="-",
        above=0.0,
        most=100.0,
    )
    spacing: float = setting(
        0.0, "nodal spacing h of gamma; 0: that of the nodes at the start", unit="m", least=0.0
    )
    radius: float = setting(
        0.0,
        "search radius R; 0: the larger of h sqrt(ln(1/cutoff)/gamma) and 2.5 h",
        unit="m",
        least=0.0,
    )
    relative_radius: float = setting(
        0.0,
        "the same over the nodal spacing, greater than 1; 0: radius decides",
        unit="-",
        least=0.0,
        most=20.0,
    )
    rim: str = setting(
        "smooth",
        "the Gaussian is lowered to vanish at R, or cut off there",
        options=("smooth", "cut"),
    )
    cutoff: float = setting(
        1e-6, "value of the Gaussian at the automatic radius", unit="-", least=1e-15, most=1e-6
    )
    line_search: bool = setting(True, "safeguard Newton's method")
    locality: str = setting(
        "fixed",
        "plain distances, as of nodes that stay; h follows J^(1/dim); or distances before deformation",
        options=("fixed", "volume", "convected"),
    )
    stretch_limit: float = setting(
        20.0,
        "largest stretch of the convected metric, and one over the smallest",
        unit="-",
        least=1.0,
    )
    gradient: str = setting(
        "exact",
        "derivatives, or corrected so that the particles integrate them exactly",
        options=("exact", "consistent"),
    )

    def check_together(self) -> None:
        relative = self.relative_radius
        require(
            relative == 0.0 or relative > 1.0,
            "relative_radius",
            relative,
            "a number greater than 1, at most 20, or 0",
        )
        if self.rim == "cut":
            require(self.locality == "fixed", "locality", self.locality, "fixed, as rim is cut,")
            require(self.gradient == "exact", "gradient", self.gradient, "exact, as rim is cut,")

    def check(self, choices: Choices, touches_fixed_nodes: bool) -> None:
        """Corrected gradients are for particles that fill the space between nodes."""
        if self.gradient == "consistent" and not (choices.moving and not choices.frozen):
            raise NotApplicable(
                "basis.gradient=consistent needs nodes that move with the material and updated "
                "shape functions"
            )

    def suited_to(self, choices: Choices) -> "LocalMaxEnt":
        """Nodes that stay while particles pass have plain distances: they follow no deformation."""
        follows = choices.on_body or not choices.moves_particles
        return self if follows else replace(self, locality="fixed")

    def build(self, geometry: Geometry, particles: int, moving: bool) -> EntropyBasis | CloudBasis:
        h = self.spacing or geometry.nodal_spacing
        automatic = h * max(math.sqrt(-math.log(self.cutoff) / self.gamma), SMALLEST_RADIUS)
        radius = self.relative_radius * h or self.radius or automatic
        if radius <= h:
            raise BadSetting("radius", self.radius, f"more than the nodal spacing of {h:.6g} m")
        nodes = geometry.points
        scale = np.ones(nodes.shape)
        if isinstance(geometry, Cloud) and geometry.graded is not None:
            scale = geometry.graded / geometry.nodal_spacing
        form = Formulation(
            axes=(0.0,) * geometry.dimension,
            prior=CUT_GAUSSIAN if self.rim == "cut" else GAUSSIAN,
            rim_exponent=self.gamma * (radius / h) ** 2,
            spacing=h / radius,
            tolerance=self.tolerance,
            line_search=self.line_search,
        )
        if self.rim == "cut":
            fill = partial(fill_points, form, radius)
            return CloudBasis(nodes, particles, radius, nodes.shape[1] + 1, fill, moving)
        supports = radius * scale.max(axis=1)
        return EntropyBasis(
            nodes,
            particles,
            lambda moved: supports,
            form,
            local=self.search == "local",
            locality=self.locality,
            stretch_limit=self.stretch_limit,
            scale=scale,
            consistent=ConsistentGradients(geometry) if self.gradient == "consistent" else None,
        )
