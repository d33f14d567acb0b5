"""What the implicit loops share: settings, and steps that are halved when Newton's iteration fails."""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from mpmbench.core.errors import NotApplicable, NotConverged
from mpmbench.core.geometry import Box
from mpmbench.core.loops import TimeLoop
from mpmbench.core.materials import kirchhoff_stress
from mpmbench.core.setting import setting
from mpmbench.core.state import State
from mpmbench.core.transfer import find_transfer
from mpmbench.core.transfer.flip import Flip


@dataclass(frozen=True)
class ImplicitLoop(TimeLoop):
    """Base of implicit loops: it does a step in parts when Newton's iteration fails.

    A derived class defines `one_step`.
    """

    mass: str = setting(
        "consistent", "mass matrix in the dynamic tangent", options=("lumped", "consistent")
    )
    transfer: str = setting(
        "nodal", "nodal: moving nodes keep velocities; flip: fixed nodes leave them to particles"
    )
    stress_update: str = setting(
        "usl",
        "only usl: stress and displacement are found together",
        options=("usl", "usf", "musl", "usavg"),
    )
    traction: str = setting(
        "end_point",
        "where a point load acts: at a massless point that follows the boundary, or a particle",
        options=("end_point", "last_particle"),
    )
    dirichlet: str = setting(
        "direct",
        "boundary points are held by their nodes, or sum_I N_I(x_d) u_I is held there",
        options=("direct", "multipliers"),
    )
    ghost_stiffness: float = setting(
        0.0,
        "of the cells in use in Young's moduli; 1e-6 holds nodes that few particles see",
        unit="-",
        least=0.0,
        below=1.0,
        by_preset=True,
    )
    volumetric: str = setting(
        "standard",
        "change of volume at each particle, or one for all particles of a cell (f_bar: no locking)",
        options=("standard", "f_bar"),
    )
    gradient: str = setting(
        "functions",
        "derivatives of the functions, or means over Voronoi cells of the particles as in SCNI",
        options=("functions", "conforming"),
    )
    residual_tolerance: float = setting(
        1e-8,
        "of Newton's iteration, relative to the external force",
        unit="-",
        least=1e-14,
        below=1.0,
    )
    step_halvings: int = setting(
        6,
        "how often a step that does not converge is halved, and its halves again",
        unit="-",
        least=0,
        most=20,
    )
    line_search: bool = setting(
        True,
        "shorten steps that make the residual grow; if a particle turns inside out, always",
    )
    implicit: ClassVar[bool] = True
    meets_walls: ClassVar[bool] = True
    stress: ClassVar[Any] = staticmethod(kirchhoff_stress)

    def check_together(self) -> None:
        """The transfer exists."""
        super().check_together()
        find_transfer(self.transfer)

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
        if self.dirichlet != "direct" and not self.moving:
            raise NotApplicable(
                f"method.dirichlet={self.dirichlet} holds points of the material: "
                "it needs method.nodes=moving"
            )
        if self.gradient == "conforming":
            from mpmbench.core.bases.conforming import refuse_other_cells  # and sparse matrices

            refuse_other_cells(case)
        for wall in case.problem.loads(case.material).walls:
            if np.count_nonzero(wall.normal) != 1:
                raise NotApplicable(f"{loop} needs walls across an axis: turn the axes")
            if self.dirichlet != "direct":
                raise NotApplicable(
                    f"method.dirichlet={self.dirichlet} holds points of the material, and walls hold nodes"
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

        if self.volumetric == "f_bar":
            self._check_cells(case)

    def _check_cells(self, case: Any) -> None:
        """Refuse F-bar where particles of a cell do not share their functions, or have equal gradients."""
        geometry = case.problem.nodes(case.resolution, self)
        if not case.basis.background_grid:
            raise NotApplicable(
                "method.volumetric=f_bar needs functions that all particles of a cell share: "
                "basis=linear or bspline"
            )
        if self.frozen:
            raise NotApplicable(
                "method.volumetric=f_bar needs method.shape_functions=updated: frozen functions "
                "are pushed forward by F itself"
            )
        if not isinstance(geometry, Box) and (geometry.cells is None or not self.moving):
            raise NotApplicable(
                "method.volumetric=f_bar changes nothing in triangles, whose gradients are constant"
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
