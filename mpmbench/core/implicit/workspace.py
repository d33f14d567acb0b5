"""What implicit methods keep allocated between the steps of a run."""

from dataclasses import dataclass, field

import numpy as np

from mpmbench.core.bases.handle import Stencils
from mpmbench.core.implicit.constraints import HeldPoints
from mpmbench.core.implicit.ghost import GhostCells, GhostGrid, GhostSimplices
from mpmbench.core.matrix.blocks import BandMemory
from mpmbench.core.matrix.pattern import Pattern
from mpmbench.core.transfer.sharing import Cells


@dataclass
class Workspace:
    """What stays allocated between the steps of a run.

    Attributes
    ----------
    phi : Stencils
        Shape functions at the start of the step.
    F, state, tau : ndarray
        Deformation gradients, history and Kirchhoff stresses of the current iterate.
    cells : Cells or None
        The particles of each cell, for F-bar.
    held : HeldPoints or None
        Dirichlet conditions at points; without them, nodes are held directly.
    memory : BandMemory
        Memory of the factorised tangent.
    """

    phi: Stencils
    F: np.ndarray
    state: np.ndarray
    tau: np.ndarray
    pattern: Pattern | None = None
    ghost_grid: GhostGrid | GhostSimplices | None = None
    ghost: GhostCells | None = None
    cells: Cells | None = None
    held: HeldPoints | None = None
    memory: BandMemory = field(default_factory=BandMemory)
    pattern_of: tuple[np.ndarray, np.ndarray] = field(
        default_factory=lambda: (np.zeros(0), np.zeros(0))
    )
