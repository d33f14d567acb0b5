"""Time loops: one file per loop. `Choices` holds the interchangeable parts of a method (house plan, section 1).

A plug-in registers a step function with ``@register("method", name)``; the key ``method.time``
selects it. It may carry an attribute ``check(choices)`` that raises `NotApplicable` for a
combination that makes no sense.
"""

from dataclasses import dataclass

from mpmbench.core.errors import require, require_option


@dataclass(frozen=True)
class Choices:
    """What distinguishes one method from another.

    Parameters
    ----------
    name : str
        Name of the preset.
    time : str
        Time loop: ``explicit`` (symplectic Euler, leapfrog), ``static`` (load steps) or
        ``newmark``.
    nodes : {"fixed", "moving"}
        Whether the nodes keep their places (MPM) or move with the material (OTM, unified, GMM,
        FEM). Those of implicit MPM move during a step and are reset after it.
    shape_functions : {"updated", "frozen"}
        Evaluated at the current positions in every step, or once: particles then keep their
        functions and gradients are pushed forward by F (Lagrangian kernels).
    mass : {"lumped", "consistent"}
    transfer : {"flip", "pic", "blend", "position_difference", "nodal"}
        How velocity comes back to the particles; `nodal` leaves it on the nodes.
    flip : float
        Weight of FLIP in ``blend``, 0 to 1.
    stress_update : {"usl", "usf", "musl"}
        Update stress last, first, or last with re-mapped velocities.
    mass_cutoff : float
        Degrees of freedom with less than this many particle masses are left out.
    traction : {"end_point", "last_particle"}
        Where a point load acts: on a tracked massless end point, or on the last particle.
    dirichlet : {"direct", "multipliers"}
        How implicit methods hold boundary points: by their nodes, or by ``sum_I N_I(x_d) u_I`` for
        bases that do not interpolate.
    ghost_stiffness : float
        Stiffness of the cells in use, in Young's moduli, which holds nodes that few particles see.
    residual_tolerance : float
        Residual at which Newton's iteration ends, relative to the external force.
    step_halvings : int
        How often a step that does not converge may be halved, and its halves again.
    line_search : bool
        Shorten steps that make the residual grow; those that turn a particle inside out always are.
    derivatives : {"plain", "symmetric"}
        How SPH takes derivatives: of Eq. 2.5 of Li 2009, or with differences of velocities and sums
        of stresses.
    newmark_velocity, newmark_displacement : float
        Newmark's lambda and zeta (often gamma and beta); 1/2 and 1/4 is the trapezoidal rule.
    """

    name: str = "mpm"
    time: str = "explicit"
    nodes: str = "fixed"
    shape_functions: str = "updated"
    mass: str = "lumped"
    transfer: str = "flip"
    flip: float = 1.0
    stress_update: str = "usl"
    mass_cutoff: float = 1e-6
    traction: str = "end_point"
    dirichlet: str = "direct"
    ghost_stiffness: float = 0.0
    residual_tolerance: float = 1e-8
    step_halvings: int = 6
    line_search: bool = True
    derivatives: str = "plain"
    newmark_velocity: float = 0.5
    newmark_displacement: float = 0.25

    def __post_init__(self) -> None:
        require_option("nodes", self.nodes, ("fixed", "moving"))
        require_option("shape_functions", self.shape_functions, ("updated", "frozen"))
        require_option("mass", self.mass, ("lumped", "consistent"))
        require_option(
            "transfer", self.transfer, ("flip", "pic", "blend", "position_difference", "nodal")
        )
        require(0.0 <= self.flip <= 1.0, "flip", self.flip, "a number from 0 to 1")
        require_option("stress_update", self.stress_update, ("usl", "usf", "musl"))
        require(
            0.0 <= self.mass_cutoff < 1.0,
            "mass_cutoff",
            self.mass_cutoff,
            "a number from 0 to less than 1",
        )
        require_option("traction", self.traction, ("end_point", "last_particle"))
        require_option("dirichlet", self.dirichlet, ("direct", "multipliers"))
        require(
            0.0 <= self.ghost_stiffness < 1.0,
            "ghost_stiffness",
            self.ghost_stiffness,
            "a number from 0 to 1",
        )
        tolerance, zeta = self.residual_tolerance, self.newmark_displacement
        require(
            1e-14 <= tolerance < 1.0, "residual_tolerance", tolerance, "a number from 1e-14 to 1"
        )
        require(
            0 <= self.step_halvings <= 20,
            "step_halvings",
            self.step_halvings,
            "a whole number from 0 to 20",
        )
        require_option("derivatives", self.derivatives, ("plain", "symmetric"))
        velocity = self.newmark_velocity
        require(0.5 <= velocity <= 1.0, "newmark_velocity", velocity, "a number from 0.5 to 1")
        require(
            0.5 * velocity <= zeta <= 1.0,
            "newmark_displacement",
            zeta,
            "at least newmark_velocity / 2 (stability)",
        )

    @property
    def flip_weight(self) -> float:
        """Weight of FLIP in the velocity update; the rest is PIC.

        Position differences (Eq. 49) are PIC: ``(x^{s+1} - x^s)/dt = sum_i phi_i v_i^{s+1}`` (Eq.
        68), without the cancellation of subtracting positions. With `nodal` the particle velocity
        is only read off.
        """
        return {"flip": 1.0, "blend": self.flip}.get(self.transfer, 0.0)

    @property
    def conserves(self) -> frozenset[str]:
        """What the method conserves without constraints and loads, if the material lets it; audits compare.

        Momentum always, by the partition of unity. Angular momentum exactly when the matrix that is
        solved is that of ``sum_p m_p phi_i x_p = sum_j M_ij x_j``, which a lumped one is not.
        Energy is bounded unless a lumped projection filters the velocity of the particles (PIC) in
        every step.
        """
        kept = {"mass", "momentum"}
        if self.mass == "consistent":
            kept.add("angular_momentum")
        if self.mass == "consistent" or self.transfer in ("flip", "nodal"):
            kept.add("energy")
        return frozenset(kept)

    @property
    def moving(self) -> bool:
        """Nodes move with the material."""
        return self.nodes == "moving"

    @property
    def frozen(self) -> bool:
        """Particles keep their shape functions."""
        return self.shape_functions == "frozen"
