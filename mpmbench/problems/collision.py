"""What problems of colliding bodies share: nodes and particles of all of them, and how a collision is judged."""

from typing import Any, ClassVar

import numpy as np

from mpmbench.core.bodies import Part, boxes_meet, union
from mpmbench.core.choices import Choices
from mpmbench.core.errors import NotApplicable
from mpmbench.core.geometry import Box, Cloud, Geometry, search_tree
from mpmbench.core.geometry.inside import inside_surface
from mpmbench.core.geometry.triangulate import check_points, seed_triangles
from mpmbench.core.materials import Material
from mpmbench.core.simulation import Solution
from mpmbench.core.state import State
from mpmbench.problems import Problem

NOTICED = 1e-3  # of the largest momentum of a body: bodies have met
LAST = 0.2  # of the run, over which what is locked is averaged


class Collision(Problem):
    """Base of plane problems of several bodies: a derived class gives `bodies` and `domain`."""

    dimension: ClassVar[int] = 2
    bends: ClassVar[bool] = True
    touches_fixed_nodes: ClassVar[bool] = True
    samples: ClassVar[int] = 400
    known_early: ClassVar[tuple[str, ...]] = ("captured_most", "strain_energy_max", "first_contact")

    def check(self, material: Material, choices: Choices, basis: str, resolution: int) -> None:
        if not choices.dynamic:
            raise NotApplicable("a collision is dynamic: it needs method.time=explicit or newmark")

    def check_particles(self, particles_per_cell: int) -> None:
        check_points(particles_per_cell)

    # geometry and initial conditions, from the bodies

    def domain(self, resolution: int) -> Box:
        """The grid that the bodies move through."""
        raise NotImplementedError

    def nodes(self, resolution: int, choices: Choices) -> Geometry:
        if choices.on_body:
            return union(self.bodies(resolution, 1))
        return self.domain(resolution)

    def seed(self, resolution: int, particles_per_cell: int) -> tuple[np.ndarray, np.ndarray]:
        parts = self.bodies(resolution, particles_per_cell)
        return np.vstack([part.X for part in parts]), np.concatenate([part.V0 for part in parts])

    def velocity(self, X: np.ndarray, material: Material) -> np.ndarray:
        """That of the body with the nearest node."""
        parts = self.bodies(4, 1)
        each = [search_tree(part.mesh.nodes).query(X)[0] for part in parts]
        return np.array([part.velocity for part in parts])[np.argmin(each, axis=0)]

    # quantities of interest

    def observe(self, state: State) -> dict[str, Any]:
        """Particles, and nodes where they move, that lie inside another body."""
        return {"captured_now": captured(state)}

    def quantities(self, solution: Solution, material: Material) -> dict[str, tuple[Any, ...]]:
        series = {name: np.array(values) for name, values in solution.history.items()}
        out = inside_others(series["captured_now"]) | {
            "locked_energy_fraction": (
                locked_energy(series) / float(series["kinetic_energy"][0]),
                "1",
                "mean strain energy minus mean vibration energy over the last 20 %,"
                " over the kinetic energy at the start",
            ),
            "kinetic_energy_kept": (
                float(series["kinetic_energy"][-1] / series["kinetic_energy"][0]),
                "1",
                "kinetic energy at the end over that at the start",
            ),
            "strain_energy_max": (
                float(series["strain_energy"].max()),
                "J",
                "largest strain energy",
            ),
        }
        mass, momentum = solution.body_masses, series["body_momentum"]
        for b in range(min(2, len(mass))):
            speed = float(momentum[-1, b, 0] / mass[b])
            out[f"velocity_{b + 1}"] = (speed, "m/s", f"mean velocity of body {b + 1} along x_1")
        change = np.linalg.norm(momentum - momentum[0], axis=2).max(axis=1)
        met = np.flatnonzero(change > NOTICED * np.linalg.norm(momentum[0], axis=1).max())
        text = "instant at which a thousandth of the largest momentum has changed its body"
        out["first_contact"] = (float(series["time"][met[0]]) if len(met) else np.nan, "s", text)
        left = np.linalg.norm(momentum - momentum[-1], axis=2).max(axis=1)
        busy = np.flatnonzero(left > NOTICED * np.linalg.norm(momentum[0], axis=1).max())
        text = (
            "instant after which no more than a thousandth of the largest momentum changes its body"
        )
        out["last_contact"] = (
            float(series["time"][busy[-1] + 1]) if len(busy) else np.nan,
            "s",
            text,
        )
        if len(mass) == 2:
            pressed, *along = np.abs(momentum[-1, 1] - momentum[0, 1]).tolist()
            rubbed = float(np.linalg.norm(along)) / pressed if pressed > 0.0 else np.nan
            text = "impulse between the bodies across x_1 over that along it"
            out["impulse_ratio"] = (rubbed, "1", text)
            text = "speed of separation that bodies lose again, over that of approach"
            out["pulled_back"] = (pulled_back(momentum / np.array(mass)[:, None]), "1", text)
        return out


def part_of(
    name: str,
    nodes: np.ndarray,
    triangles: np.ndarray,
    spacing: float,
    particles_per_cell: int,
    velocity: tuple[float, ...],
) -> Part:
    """A body with particles in its triangles."""
    X, V0 = seed_triangles(nodes, triangles, particles_per_cell)
    return Part(name, Cloud(nodes, triangles, spacing), X, V0, velocity)


def captured(s: State) -> int:
    """Number of particles, and of nodes where they move, that lie inside the surface of another body."""
    p, bodies, surface = s.particles, s.bodies, s.bodies.surface
    on_nodes = s.choices.moving and not s.choices.frozen
    places = (s.basis.nodes if surface.on_nodes else p.x)[surface.row]
    found = 0
    for b in range(bodies.count):
        corners = places[surface.facet[surface.body[surface.facet[:, 0]] == b]]
        for other in range(bodies.count):
            if other == b:
                continue
            points = p.x[bodies.particles(other)]
            if on_nodes:
                points = np.vstack([points, s.basis.nodes[bodies.node == other]])
            if boxes_meet(points, corners.reshape(-1, points.shape[1])):
                found += int(np.count_nonzero(inside_surface(points, corners)))
    return found


def inside_others(series: np.ndarray) -> dict[str, tuple[Any, ...]]:
    """What a problem tells of the numbers that `captured` found, shape (T,)."""
    text = "particles and moving nodes inside another body"
    return {
        "captured_now": (series, "1", text),
        "captured": (int(series[-1]), "1", f"{text} at the end"),
        "captured_most": (int(series.max()), "1", f"most {text} at any time"),
    }


def pulled_back(velocity: np.ndarray) -> float:
    """Largest speed of separation of two bodies minus the last one, over the speed of approach.

    Velocities have the shape (time, 2, dim) [m/s]. Bodies that have parted exchange no momentum, so
    that it is 0.
    """
    between = velocity[:, 1] - velocity[:, 0]
    approach = float(np.linalg.norm(between[0]))
    apart = between @ (-between[0] / approach)
    return float(apart.max() - apart[-1]) / approach


def locked_energy(series: dict[str, np.ndarray]) -> float:
    """Strain energy that will not come back [J]: its mean over the end of the run without that of vibration.

    Small vibrations about a state of self-stress have as much strain energy on average as kinetic
    energy without rigid motion.
    """
    time = series["time"]
    late = time >= (1.0 - LAST) * time[-1]
    vibration = series["body_vibration_energy"][late].sum(axis=1).mean()
    return float(series["strain_energy"][late].mean() - vibration)
