"""What the implicit loops share: the settings of Newton's iteration, and steps that are halved when it fails."""

from dataclasses import dataclass
from typing import Any, ClassVar

from mpmbench.core.errors import NotApplicable, NotConverged, require, require_option
from mpmbench.core.loops import TimeLoop
from mpmbench.core.materials import kirchhoff_stress
from mpmbench.core.state import State
from mpmbench.core.transfer import find_transfer
from mpmbench.core.transfer.flip import Flip


@dataclass(frozen=True)
class ImplicitLoop(TimeLoop):
    """Settings of an implicit loop; it defines `one_step`.

    Parameters
    ----------
    mass : {"lumped", "consistent"}
        In the dynamic tangent.
    transfer : {"nodal", "flip"}
        Moving nodes keep their velocities; those that stay leave them to the particles.
    stress_update : {"usl"}
        Stress and displacement are found together.
    traction : {"end_point", "last_particle"}
        Where a point load acts: on a tracked massless end point, or on the last particle.
    dirichlet : {"direct", "multipliers"}
        How boundary points are held: by their nodes, or by ``sum_I N_I(x_d) u_I`` for bases that
        do not interpolate.
    ghost_stiffness : float
        Stiffness of the cells in use, in Young's moduli, which holds nodes that few particles see.
    residual_tolerance : float
        Residual at which Newton's iteration ends, relative to the external force.
    step_halvings : int
        How often a step that does not converge may be halved, and its halves again.
    line_search : bool
        Shorten steps that make the residual grow; those that turn a particle inside out always are.
    """

    mass: str = "consistent"
    transfer: str = "nodal"
    stress_update: str = "usl"
    traction: str = "end_point"
    dirichlet: str = "direct"
    ghost_stiffness: float = 0.0
    residual_tolerance: float = 1e-8
    step_halvings: int = 6
    line_search: bool = True
    implicit: ClassVar[bool] = True
    stress: ClassVar[Any] = staticmethod(kirchhoff_stress)

    def __post_init__(self) -> None:
        super().__post_init__()
        require_option("mass", self.mass, ("lumped", "consistent"))
        find_transfer(self.transfer)
        require_option("stress_update", self.stress_update, ("usl", "usf", "musl"))
        require_option("traction", self.traction, ("end_point", "last_particle"))
        require_option("dirichlet", self.dirichlet, ("direct", "multipliers"))
        ghost, tolerance = self.ghost_stiffness, self.residual_tolerance
        require(0.0 <= ghost < 1.0, "ghost_stiffness", ghost, "a number from 0 to 1")
        require(
            1e-14 <= tolerance < 1.0, "residual_tolerance", tolerance, "a number from 1e-14 to 1"
        )
        halvings = self.step_halvings
        require(0 <= halvings <= 20, "step_halvings", halvings, "a whole number from 0 to 20")

    def check(self, case: Any) -> None:
        """Refuse combinations that make no sense with an implicit time loop."""
        loop, transfer = f"method.time={self.time}", find_transfer(self.transfer)
        if self.moving and not transfer.velocity_on_nodes:
            raise NotApplicable(
                f"{loop} with moving nodes keeps velocities on the nodes: "
                "it needs method.transfer=nodal"
            )
        if not self.on_body and type(transfer) is not Flip:
            raise NotApplicable(
                f"{loop} with nodes that stay updates particle velocities by the trapezoidal rule: "
                "it needs method.transfer=flip"
            )
        if self.stress_update != "usl":
            raise NotApplicable(
                f"{loop} finds stress and displacement together: it needs method.stress_update=usl"
            )
        if self.dirichlet != "direct" and (self.frozen or not self.moving):
            raise NotApplicable(
                f"method.dirichlet={self.dirichlet} holds points of the material: "
                "it needs method.nodes=moving and method.shape_functions=updated"
            )
        if self.ghost_stiffness > 0.0:
            if self.on_body:
                raise NotApplicable(
                    "method.ghost_stiffness > 0 needs a background grid that particles move through"
                )
            if not case.basis.background_grid:
                raise NotApplicable(
                    "method.ghost_stiffness > 0 needs a background grid, "
                    f"and basis={case.basis_name} has none"
                )

    def step(self, s: State, dt: float, level: int = 0) -> None:
        """Advance by `dt` [s], in two halves when Newton's iteration fails, these in halves again."""
        try:
            self.one_step(s, dt)
        except NotConverged:
            if level >= self.step_halvings:
                raise
            s.record("halved_at", s.time)
            self.step(s, 0.5 * dt, level + 1)
            self.step(s, 0.5 * dt, level + 1)

    def one_step(self, s: State, dt: float) -> None:
        """Advance by `dt` [s]; the state must stay as it was when this raises `NotConverged`."""
        raise NotImplementedError
