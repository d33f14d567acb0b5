"""Local maximum-entropy functions with a Gaussian (Arroyo and Ortiz 2006; Li 2009, section 2.3)."""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from mpmbench.core.bases import BasisSettings, Promises
from mpmbench.core.bases.clouds.cloud import CloudBasis
from mpmbench.core.bases.entropy.basis import PROMISES, EntropyBasis
from mpmbench.core.bases.entropy.consistent import ConsistentGradients
from mpmbench.core.bases.entropy.priors import GAUSSIAN
from mpmbench.core.bases.entropy.truncated import truncated_basis
from mpmbench.core.choices import Choices
from mpmbench.core.errors import BadSetting, NotApplicable, require, require_option
from mpmbench.core.geometry import Geometry
from mpmbench.core.registry import register

SMALLEST_RADIUS = 2.5  # in nodal spacings: fewer nodes may fail to surround a point


@register("basis", "lme")
@dataclass(frozen=True)
class LocalMaxEnt(BasisSettings):
    """Settings of the local max-ent basis: priors exp(-beta |x - x_i|^2) with beta = gamma / h^2.

    Parameters
    ----------
    gamma : float
        Locality, positive.
    spacing : float or None
        Nodal spacing h [m]; None or 0 reads it from the nodes as they are at the start
        (`Cloud.nodal_spacing`).
    radius : float or None
        Search radius R [m]; None or 0 takes the larger of h sqrt(ln(1 / cutoff) / gamma) and 2.5 h.
    relative_radius : float
        The same in nodal spacings, R / h; 0 takes `radius`.
    rim : {"smooth", "cut"}
        At the rim the Gaussian is lowered by its tangent in r^2, so that nodes enter and leave a
        support without a jump; or it is cut off, and points whose nodes do not suffice take more
        (Iaconeta 2017, section 5.3).
    cutoff : float
        Value of the Gaussian at the automatic radius, at most 1e-6.
    tolerance : float
        Largest residual of linear completeness, in nodal spacings.
    search : {"local", "all"}
        Look for neighbours in cells, or at all nodes for every point (same functions).
    line_search : bool
        Safeguard Newton's method; without it, it is the plain one of Li (2009), which fails for
        large gamma.
    locality : {"fixed", "volume", "convected"}
        Neighbours and weights by plain distance; or by distances before the change of volume of a
        particle (h follows compression), or before its whole deformation (`metric`). A point that
        nodes do not surround takes more.
    stretch_limit : float
        Principal stretches of the convected metric stay between 1/stretch_limit and stretch_limit.
    gradient : {"exact", "consistent"}
        The derivatives of the functions, or those corrected so that the particles integrate them
        exactly, which passes the patch test on irregular clouds (`consistent`).
    """

    gamma: float = 1.8
    spacing: float | None = None
    radius: float | None = None
    relative_radius: float = 0.0
    rim: str = "smooth"
    cutoff: float = 1e-6
    tolerance: float = 1e-12
    search: str = "local"
    line_search: bool = True
    locality: str = "fixed"
    stretch_limit: float = 20.0
    gradient: str = "exact"
    promises: ClassVar[Promises] = PROMISES

    def __post_init__(self) -> None:
        require(0.0 < self.gamma <= 100.0, "gamma", self.gamma, "a positive number, at most 100")
        for key in ("spacing", "radius"):
            value = getattr(self, key) or 0.0
            require(
                0.0 <= value < math.inf,
                key,
                value,
                "a positive length in metres, or 0 for an automatic one",
            )
        relative = self.relative_radius
        require(
            relative == 0.0 or 1.0 < relative <= 20.0,
            "relative_radius",
            relative,
            "a number from 1 to 20, or 0",
        )
        require_option("rim", self.rim, ("smooth", "cut"))
        require(1e-15 <= self.cutoff <= 1e-6, "cutoff", self.cutoff, "a number from 1e-15 to 1e-6")
        require(
            1e-13 <= self.tolerance <= 1e-4,
            "tolerance",
            self.tolerance,
            "a number from 1e-13 to 1e-4",
        )
        require_option("search", self.search, ("local", "all"))
        require(
            isinstance(self.line_search, bool), "line_search", self.line_search, "true or false"
        )
        require_option("locality", self.locality, ("fixed", "volume", "convected"))
        require(
            self.stretch_limit >= 1.0, "stretch_limit", self.stretch_limit, "a number of at least 1"
        )
        require_option("gradient", self.gradient, ("exact", "consistent"))
        if self.rim == "cut":
            require(self.locality == "fixed", "locality", self.locality, "fixed, as rim is cut,")
            require(self.gradient == "exact", "gradient", self.gradient, "exact, as rim is cut,")

    def check(self, choices: Choices, touches_fixed_nodes: bool) -> None:
        """Refuse corrected gradients where the particles do not fill the space between the nodes."""
        if self.gradient == "consistent" and not (choices.moving and not choices.frozen):
            raise NotApplicable(
                "basis.gradient=consistent needs nodes that move with the material and updated shape functions"
            )

    def build(self, geometry: Geometry, particles: int, moving: bool) -> EntropyBasis | CloudBasis:
        """The basis on the nodes of `geometry`, with room for `particles` particles."""
        h = self.spacing or geometry.nodal_spacing
        automatic = h * max(math.sqrt(-math.log(self.cutoff) / self.gamma), SMALLEST_RADIUS)
        radius = self.relative_radius * h or self.radius or automatic
        if radius <= h:
            raise BadSetting("radius", self.radius, f"more than the nodal spacing of {h:.6g} m")
        nodes = geometry.points
        if self.rim == "cut":
            return truncated_basis(nodes, particles, radius, self.gamma / h**2, self.tolerance)
        return EntropyBasis(
            nodes,
            particles,
            lambda moved: np.full(len(moved), radius),
            prior=GAUSSIAN,
            rim_exponent=self.gamma * (radius / h) ** 2,
            spacing=h / radius,
            tolerance=self.tolerance,
            local=self.search == "local",
            line_search=self.line_search,
            locality=self.locality,
            stretch_limit=self.stretch_limit,
            consistent=ConsistentGradients(geometry) if self.gradient == "consistent" else None,
        )
