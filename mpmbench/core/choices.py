"""What the rest of the program asks about a method; the method itself is a `TimeLoop`, which derives from this."""

from dataclasses import dataclass
from typing import ClassVar

from mpmbench.core.setting import Settings, setting


@dataclass(frozen=True)
class Choices(Settings):
    """What problems, bases and mass matrices may ask about a method.

    The preset gives `name`, its own, and `time`, that of the time loop. Fixed nodes of implicit
    methods move during a step and are reset after it.

    Attributes
    ----------
    dynamic : bool
        The loop has inertia.
    implicit : bool
        The loop solves equations with a tangent.
    moves_particles : bool
        Something happens to the particles at all.
    particles_are_nodes : bool
        The method is one of particles only, each of which is a node.
    meets_walls : bool
        The loop knows rigid walls that let go.
    """

    name: str = "mpm"
    time: str = "explicit"
    nodes: str = setting(
        "fixed", "they keep their places, or move with the material", options=("fixed", "moving")
    )
    shape_functions: str = setting(
        "updated",
        "evaluated where the particles are, or once and their gradients pushed forward by F",
        options=("updated", "frozen"),
    )
    dynamic: ClassVar[bool] = True
    implicit: ClassVar[bool] = False
    moves_particles: ClassVar[bool] = True
    particles_are_nodes: ClassVar[bool] = False
    meets_walls: ClassVar[bool] = False

    # What holds for a loop without a setting of this name; the others have a field instead.
    mass = "lumped"  # mass matrix, or kept, or consistent
    mass_cutoff = 1e-6  # nodes with less than this many particle masses follow their neighbours
    transfer = "flip"  # of velocities between particles and nodes, by its name
    gradient = "functions"  # derivatives of the functions, affine or conforming
    traction = "end_point"  # where a point load acts, or last_particle
    drag = 0.0  # force against the velocity over mass and velocity [1/s]
    dirichlet = "direct"  # boundary points are held by their nodes

    @property
    def moving(self) -> bool:
        """Nodes move with the material."""
        return self.nodes == "moving"

    @property
    def frozen(self) -> bool:
        """Particles keep their shape functions."""
        return self.shape_functions == "frozen"

    @property
    def on_body(self) -> bool:
        """Nodes are those of the body, not of a domain that it moves through."""
        return self.moving or self.frozen
