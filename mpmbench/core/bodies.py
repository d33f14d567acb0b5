"""Several bodies in one simulation: what a problem hands over of each, and who is whose.

Particles of a body follow each other, and so do the points on the surfaces of all bodies, which are
tracers behind them: body b has the particles ``first[b]`` to ``first[b + 1]``. Where nodes move, or
where each body has nodes of its own, they follow each other in the same way.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from mpmbench.core.energies import dissipated_energy, kinetic_energy, strain_energy
from mpmbench.core.geometry import Cloud
from mpmbench.core.geometry.surface import Surface, inside_mesh, joined, surface_of
from mpmbench.core.materials import Material
from mpmbench.core.particles import Particles

if TYPE_CHECKING:
    from mpmbench.core.state import State

TOUCHING = 1e-9  # of the spacing: bodies that overlap by less just touch


@dataclass(frozen=True)
class Part:
    """One of several bodies, as a problem hands it over.

    Attributes
    ----------
    name : str
    mesh : Cloud
        Its triangulation: the nodes where they move, and the surface.
    X, V0 : ndarray
        Particles: positions [m], shape (P, dim), and volumes [m^dim], shape (P,).
    velocity : tuple of float
        With which the body starts [m/s].
    material : Material or None
        Its own; None for that of the run.
    """

    name: str
    mesh: Cloud
    X: np.ndarray
    V0: np.ndarray
    velocity: tuple[float, ...]
    material: Material | None = None

    @cached_property
    def surface(self) -> Surface:
        """Points and facets of the boundary of the mesh."""
        return surface_of(self.mesh)


@dataclass
class Bodies:
    """Who is whose among particles and nodes, and what the bodies are made of.

    Attributes
    ----------
    names : tuple of str
    materials : tuple of Material
        One for each body.
    first : ndarray of int
        Body b has the particles ``first[b]`` to ``first[b + 1]``, shape (B + 1,).
    particle : ndarray of int
        Body of each particle and tracer, shape (P,).
    node : ndarray of int
        Body of each node, shape (N,); -1 where nodes are there for all bodies.
    surface : Surface
        Of all bodies; its points are nodes that move, or tracers, which are carried along.
    """

    names: tuple[str, ...]
    materials: tuple[Material, ...]
    first: np.ndarray
    particle: np.ndarray
    node: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    surface: Surface = field(default_factory=Surface.none)

    @classmethod
    def single(cls, material: Material, particles: int, tracers: int) -> "Bodies":
        """One body, to which everything belongs."""
        owner = np.zeros(particles, dtype=np.int64)
        return cls(("body",), (material,), np.array([0, particles - tracers]), owner)

    @property
    def count(self) -> int:
        """How many there are."""
        return len(self.names)

    def particles(self, body: int) -> slice:
        """Particles with mass of a body."""
        return slice(int(self.first[body]), int(self.first[body + 1]))

    @cached_property
    def laws(self) -> list[tuple[Material, int, int]]:
        """Materials, and the ranges of particles with mass that are made of them.

        Neighbours of the same material are one range.
        """
        ranges: list[tuple[Material, int, int]] = []
        for material, start, stop in zip(
            self.materials, self.first[:-1].tolist(), self.first[1:].tolist(), strict=True
        ):
            if ranges and ranges[-1][0] == material:
                ranges[-1] = (material, ranges[-1][1], stop)
            else:
                ranges.append((material, start, stop))
        return ranges


def gather(parts: Sequence[Part], material: Material, on_nodes: bool) -> Bodies:
    """Who is whose among the particles of these bodies and the points of their surfaces; none are no bodies.

    These points are nodes (`on_nodes`), or tracers behind the particles.
    """
    if not parts:
        return Bodies((), (), np.zeros(1, dtype=np.int64), np.zeros(0, dtype=np.int64))
    solid, each = [len(part.X) for part in parts], np.arange(len(parts))
    first, owner = np.cumsum([0, *solid]), np.repeat(each, solid)
    surfaces = [part.surface for part in parts]
    if on_nodes:
        rows = np.cumsum([0, *(len(part.mesh.nodes) for part in parts)])[:-1]
    else:
        points = [len(one.row) for one in surfaces]
        rows = first[-1] + np.cumsum([0, *points])[:-1]
        owner = np.concatenate([owner, np.repeat(each, points)])
        surfaces = [replace(one, row=np.arange(len(one.row))) for one in surfaces]
    surface = joined(surfaces, rows.tolist(), on_nodes)
    names, materials = zip(*((part.name, part.material or material) for part in parts), strict=True)
    return Bodies(names, materials, first, owner, surface=surface)


def particles_of(parts: Sequence[Part], material: Material, on_nodes: bool) -> Particles:
    """Particles of all bodies at the start, and behind them the points of their surfaces unless these are nodes."""
    made = [part.material or material for part in parts]
    X, V0 = np.vstack([part.X for part in parts]), np.concatenate([part.V0 for part in parts])
    p = Particles.at_rest(
        X,
        V0,
        1.0,
        None if on_nodes else surface_points(parts),
        max(one.history for one in made),
        any(one.rate_dependent for one in made),
    )
    bodies = gather(parts, material, on_nodes)
    for b, (part, one) in enumerate(zip(parts, made, strict=True)):
        p.v[bodies.particle == b] = part.velocity
        p.m[bodies.particles(b)] *= one.density
    return p


def owners(parts: Sequence[Part], nodes: int, on_body: bool, own_nodes: bool) -> np.ndarray:
    """Body of each node, shape (N,): -1 where fixed nodes are there for all."""
    if on_body:
        return np.repeat(np.arange(len(parts)), [len(part.mesh.nodes) for part in parts])
    if own_nodes:
        return np.repeat(np.arange(len(parts)), nodes // len(parts))
    return np.full(nodes, -1)


def union(parts: Sequence[Part]) -> Cloud:
    """The meshes of all bodies as one set of nodes."""
    offset = np.cumsum([0, *(len(part.mesh.nodes) for part in parts)])
    simplices = [part.mesh.simplices for part in parts]
    joined = None
    if all(one is not None for one in simplices):
        joined = np.vstack([one + k for one, k in zip(simplices, offset, strict=False)])
    nodes, graded = np.vstack([part.mesh.nodes for part in parts]), None
    if any(part.mesh.graded is not None for part in parts):
        graded = np.vstack([local_spacing(part.mesh) for part in parts])
    return Cloud(nodes, joined, max(part.mesh.nodal_spacing for part in parts), graded=graded)


def local_spacing(mesh: Cloud) -> np.ndarray:
    """Distances between the nodes of a mesh along each axis around each of them [m], shape (N, dim)."""
    if mesh.graded is not None:
        return mesh.graded
    return np.full(mesh.nodes.shape, mesh.nodal_spacing)


def surface_points(parts: Sequence[Part]) -> np.ndarray:
    """Places of the points on all surfaces [m], shape (S, dim), body by body."""
    return np.vstack([part.mesh.nodes[part.surface.row] for part in parts])


def overlap(parts: Sequence[Part]) -> tuple[str, str, float] | None:
    """The two bodies that lie in each other deepest at the start, and how deep [m]; None when they do not."""
    deepest: tuple[str, str, float] | None = None
    for one in parts:
        for other in parts:
            if one is other or not boxes_meet(one.mesh.nodes, other.mesh.nodes):
                continue
            points = np.vstack([one.mesh.nodes, one.X])
            points = points[inside_mesh(points, other.mesh)]
            if not len(points):
                continue
            depth = float(other.surface.distance(points, other.mesh.nodes).max())
            least = TOUCHING * other.mesh.nodal_spacing
            if depth > least and (deepest is None or depth > deepest[2]):
                deepest = (one.name, other.name, depth)
    return deepest


def boxes_meet(x: np.ndarray, y: np.ndarray, reach: float = 0.0) -> bool:
    """Whether the boxes around two sets of points are no further apart than `reach` [m]."""
    gap = np.maximum(x.min(axis=0) - y.max(axis=0), y.min(axis=0) - x.max(axis=0))
    return bool((gap <= reach).all())


def inertia(m: np.ndarray, x: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Momentum [kg m/s], angular momentum about the origin [kg m^2/s] and vibration of particles.

    The vibration is the kinetic energy [J] that is left without translation and rigid rotation.

    Parameters
    ----------
    m, x, v : ndarray
        Masses [kg], shape (P,), places [m] and velocities [m/s], shape (P, dim).
    """
    momentum, mass = m @ v, m.sum()
    centre, mean = m @ x / mass, momentum / mass
    arm, relative = np.zeros((len(x), 3)), np.zeros((len(x), 3))
    arm[:, : x.shape[1]], relative[:, : x.shape[1]] = x - centre, v - mean
    spin = m @ np.cross(arm, relative)
    tensor = np.einsum("p,pa,pa->", m, arm, arm) * np.eye(3) - np.einsum("p,pa,pb->ab", m, arm, arm)
    rate = np.linalg.lstsq(tensor, spin, rcond=None)[0] if x.shape[1] > 1 else np.zeros(3)
    relative -= np.cross(rate, arm)
    whole = np.zeros((2, 3))
    whole[0, : x.shape[1]], whole[1, : x.shape[1]] = centre, momentum
    total = spin + np.cross(whole[0], whole[1])
    return momentum, total, 0.5 * float(m @ np.sum(relative**2, axis=1))


def audit(s: "State", v: np.ndarray) -> dict[str, Any]:
    """Momenta and energies of each body, when there are several, at velocities `v` [m/s] of what has the energies."""
    p, bodies, carriers, movers = s.particles, s.bodies, s.carriers, s.movers
    if bodies.count < 2:
        return {}
    rows: dict[str, list[Any]] = {}
    for b in range(bodies.count):
        own, material = bodies.particles(b), bodies.materials[b]
        carried, moved = s.of_body(carriers, b), s.of_body(movers, b)
        momentum, spin, _ = inertia(carriers.m[carried], carriers.x[carried], carriers.v[carried])
        vibration = inertia(movers.m[moved], movers.x[moved], v[moved])[2]
        for name, value in {
            "body_momentum": momentum,
            "body_angular_momentum": spin,
            "body_kinetic_energy": kinetic_energy(movers.m[moved], v[moved]),
            "body_vibration_energy": vibration,
            "body_strain_energy": strain_energy(
                material.law, s.axes, p.F[own], p.state[own], p.V0[own]
            ),
            "body_dissipated_energy": dissipated_energy(material, p, own),
        }.items():
            rows.setdefault(name, []).append(value)
    return {name: np.array(values) for name, values in rows.items()}
